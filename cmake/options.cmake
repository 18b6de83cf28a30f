# SPDX-License-Identifier: MIT
# As a subdirectory of another project only the library itself is built.
option(LECALIB_BUILD_HOST "Build lecalib::host: files, reports, simulator (heap allowed)" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_EXAMPLES "Build the examples and, with LECALIB_BUILD_HOST, the lecalib command" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_FUZZ "Build the libFuzzer targets (needs clang and LECALIB_BUILD_HOST)" OFF)
option(LECALIB_WITH_LZ4 "Read AEDAT 4 files compressed by LZ4, where the library is there" ON)
option(LECALIB_WITH_ZSTD "Read AEDAT 4 files compressed by Zstandard, where the library is there" ON)
option(LECALIB_WITH_ZLIB "Read recordings packed by gzip, where zlib is there" ON)
option(LECALIB_USB "Build lecalib::usb, live cameras, where host is built and libusb-1.0 is there" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_INSTALL "Make the install target install lecalib" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_WARNINGS_AS_ERRORS "Treat warnings in lecalib's own targets as errors" OFF)
option(LECALIB_COVERAGE "Instrument lecalib's own targets for gcov" OFF)
set(LECALIB_SANITIZE "" CACHE STRING "Sanitizers for lecalib's own targets, e.g. address,undefined")

if(LECALIB_BUILD_FUZZ AND NOT (LECALIB_BUILD_HOST AND CMAKE_CXX_COMPILER_ID MATCHES Clang))
  message(FATAL_ERROR "LECALIB_BUILD_FUZZ needs clang (-DCMAKE_CXX_COMPILER=clang++) and LECALIB_BUILD_HOST")
endif()
