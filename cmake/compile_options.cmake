# SPDX-License-Identifier: MIT
# lecalib_compile_options(TARGET): warnings and instrumentation for a target of ours, never for a consumer's.
function(lecalib_compile_options target)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wold-style-cast -Wvla -Wundef -Wnull-dereference
    $<$<BOOL:${LECALIB_WARNINGS_AS_ERRORS}>:-Werror>)
  if(LECALIB_SANITIZE)
    target_compile_options(${target} PRIVATE
      -fsanitize=${LECALIB_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC $<BUILD_INTERFACE:-fsanitize=${LECALIB_SANITIZE}>)
  endif()
  if(LECALIB_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage)
    target_link_options(${target} PUBLIC $<BUILD_INTERFACE:--coverage>)
  endif()
  if(LECALIB_BUILD_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)  # counters that guide libFuzzer
  endif()
endfunction()
