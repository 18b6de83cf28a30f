# SPDX-License-Identifier: MIT
# Single-precision FPU: double is done in software, about 30 times slower.
set(CMAKE_SYSTEM_PROCESSOR cortex-m33)
set(cpu_flags "-mcpu=cortex-m33 -mfpu=fpv5-sp-d16")
set(machine mps2-an505)
include(${CMAKE_CURRENT_LIST_DIR}/arm_none_eabi.cmake)
