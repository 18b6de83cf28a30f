# SPDX-License-Identifier: MIT
# cmake -D NM=... -D OBJDUMP=... -D LIBRARY=liblecalib.a -P check_objects.cmake
# What the compiled library asks of the world and of the start-up code: no heap, no printing, no exceptions, no libm
# beyond exactly rounded functions, nothing to initialise before main.

cmake_minimum_required(VERSION 3.25)

# What may stay undefined in the library: what compilers call on their own, and what every libm rounds exactly.
set(compiler "^(mem(cpy|move|set|cmp)|__stack_chk_fail|_GLOBAL_OFFSET_TABLE_|__(aeabi_|popcount|clz|ctz|bswap|u?(div|mod|mul)).*)$")
set(exact "^(sqrt|floor|ceil|fmod|ldexp)f?$")

execute_process(COMMAND ${NM} --print-file-name --extern-only --portability ${LIBRARY}
  OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "\\[[^\n]*" symbols "${symbols}")  # [member.o]: symbol type ...
set(defined)
foreach(line ${symbols})
  if(line MATCHES "^\\[[^ ]+\\]: ([^ ]+) [^U ]")
    list(APPEND defined ${CMAKE_MATCH_1})
  endif()
endforeach()
foreach(line ${symbols})
  if(line MATCHES "^\\[([^ ]+)\\]: ([^ ]+) U")
    set(member ${CMAKE_MATCH_1})
    set(symbol ${CMAKE_MATCH_2})
    if(NOT symbol MATCHES "${compiler}" AND NOT symbol MATCHES "${exact}" AND NOT symbol IN_LIST defined)
      message(SEND_ERROR "${member} calls ${symbol}, which a microcontroller does not have")
    endif()
  endif()
endforeach()

execute_process(COMMAND ${OBJDUMP} --section-headers ${LIBRARY} OUTPUT_VARIABLE sections COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE "\n" ";" sections "${sections}")
set(member "")
foreach(line ${sections})
  if(line MATCHES "^([^ ]+\\.o(bj)?): ")
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
