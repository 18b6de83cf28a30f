# SPDX-License-Identifier: MIT
# Single-precision FPU: double is done in software, about 30 times slower.
set(CMAKE_SYSTEM_PROCESSOR cortex-m4f)
set(cpu_flags "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16")
set(machine mps2-an386)
include(${CMAKE_CURRENT_LIST_DIR}/arm_none_eabi.cmake)
