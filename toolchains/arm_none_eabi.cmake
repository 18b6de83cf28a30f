# SPDX-License-Identifier: MIT
# What the Cortex-M boards share: include it with `cpu_flags` and QEMU's `machine` set.
# A test is an image without arguments; it prints and gives its exit code through semihosting.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_CXX_FLAGS_INIT "${cpu_flags} -mthumb -mfloat-abi=hard -Wno-psabi -fno-exceptions -fno-rtti -fno-threadsafe-statics \
-fno-unwind-tables -fno-asynchronous-unwind-tables -ffunction-sections -fdata-sections")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostartfiles --specs=nano.specs -Wl,--gc-sections")
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-system-arm;-M;${machine};-display;none;-monitor;none;-serial;null;-chardev;stdio,id=out;-semihosting-config;enable=on,target=native,chardev=out;-kernel)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
