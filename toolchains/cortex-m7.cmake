# SPDX-License-Identifier: MIT
# Double-precision FPU.
set(CMAKE_SYSTEM_PROCESSOR cortex-m7)
set(cpu_flags "-mcpu=cortex-m7 -mfpu=fpv5-d16")
set(machine mps2-an500)
include(${CMAKE_CURRENT_LIST_DIR}/arm_none_eabi.cmake)
