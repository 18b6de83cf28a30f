# SPDX-License-Identifier: MIT
# cmake -D NM=... -D OBJDUMP=... -D LIBRARY=liblecalib.a -P check_objects.cmake
# What the compiled library asks of the world and of the start-up code: no heap, no printing, no exceptions, no libm
# beyond exactly rounded functions, nothing to initialise before main.

# Everything that may stay undefined in the library. Compilers call the first four on their own.
set(allowed memcpy memmove memset memcmp strlen strcmp sqrt sqrtf floor floorf ceil ceilf fmod ldexp
  _GLOBAL_OFFSET_TABLE_ __stack_chk_fail)

execute_process(COMMAND ${NM} --extern-only --portability ${LIBRARY} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\n" ";" symbols "${symbols}")
set(defined ${allowed})
set(wanted)
foreach(line ${symbols})
  if(line MATCHES "^([^ ]+) U")
    list(APPEND wanted ${CMAKE_MATCH_1})
  elseif(line MATCHES "^([^ ]+) [A-Za-z]")
    list(APPEND defined ${CMAKE_MATCH_1})
  endif()
endforeach()
list(REMOVE_DUPLICATES wanted)
list(REMOVE_ITEM wanted ${defined})
if(wanted)
  list(JOIN wanted "\n  " names)
  message(SEND_ERROR "the library calls what a microcontroller does not have:\n  ${names}")
endif()

execute_process(COMMAND ${OBJDUMP} --section-headers ${LIBRARY} OUTPUT_VARIABLE sections COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\n" ";" sections "${sections}")
set(member "")
foreach(line ${sections})
  if(line MATCHES "^([^ ]+\\.o): ")
    set(member ${CMAKE_MATCH_1})
  elseif(line MATCHES "^ *[0-9]+ (\\.(data|init_array|ctors|tdata|tbss)[^ ]*) +([0-9a-f]+) ")
    set(section ${CMAKE_MATCH_1})
    set(size ${CMAKE_MATCH_3})
    # .data.rel.ro is read-only but for the loader of a position-independent program.
    if(NOT section MATCHES "^\\.data\\.rel\\.ro" AND NOT size MATCHES "^0+$")
      message(SEND_ERROR "${member}: ${section} has 0x${size} bytes: initialised static data or code before main")
    endif()
  endif()
endforeach()
