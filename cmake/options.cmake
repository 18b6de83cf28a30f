# SPDX-License-Identifier: MIT
# As a subdirectory of another project only the library itself is built.
option(LECALIB_BUILD_HOST "Build lecalib::host: files, reports, simulator (heap allowed)" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_EXAMPLES "Build the lecalib command and the examples (needs LECALIB_BUILD_HOST)" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(LECALIB_BUILD_FUZZ "Build the fuzz targets" OFF)
option(LECALIB_WARNINGS_AS_ERRORS "Treat warnings in lecalib's own targets as errors" OFF)
set(LECALIB_SANITIZE "" CACHE STRING "Sanitizers for lecalib's own targets, e.g. address,undefined")
option(LECALIB_COVERAGE "Instrument lecalib's own targets for gcov" OFF)
