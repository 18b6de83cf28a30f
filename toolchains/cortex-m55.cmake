# SPDX-License-Identifier: MIT
# Double-precision FPU, and vectors that GCC 12 does not use.
set(CMAKE_SYSTEM_PROCESSOR cortex-m55)
set(cpu_flags "-mcpu=cortex-m55")
set(machine mps3-an547)
include(${CMAKE_CURRENT_LIST_DIR}/arm_none_eabi.cmake)
