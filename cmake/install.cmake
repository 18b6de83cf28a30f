# SPDX-License-Identifier: MIT
# find_package(lecalib CONFIG) gives lecalib::lecalib and, where they were built, lecalib::host and lecalib::usb.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/lecalib)

set(installed_targets lecalib)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/lecalib DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h" PATTERN host EXCLUDE PATTERN usb EXCLUDE)
if(TARGET lecalib_host)
  list(APPEND installed_targets lecalib_host)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/lecalib/host DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lecalib
    FILES_MATCHING PATTERN "*.hpp")
endif()
if(TARGET lecalib_usb)
  list(APPEND installed_targets lecalib_usb)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/lecalib/usb DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/lecalib
    FILES_MATCHING PATTERN "*.hpp")
  install(FILES ${PROJECT_SOURCE_DIR}/lecalib/usb/70-lecalib.rules DESTINATION lib/udev/rules.d)
endif()
if(TARGET lecalib_command)
  install(TARGETS lecalib_command)
endif()
install(TARGETS ${installed_targets} EXPORT lecalib-targets)
install(EXPORT lecalib-targets NAMESPACE lecalib:: DESTINATION ${package_dir})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/lecalib-config.cmake.in
  ${PROJECT_BINARY_DIR}/lecalib-config.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/lecalib-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/lecalib-config.cmake ${PROJECT_BINARY_DIR}/lecalib-config-version.cmake
  DESTINATION ${package_dir})
