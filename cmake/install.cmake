# What `cmake --install` puts in place: the library and cab::rig, their public headers, the package that
# find_package(cab CONFIG) finds, and the cab command.
include(CMakePackageConfigHelpers)

set(CAB_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/cab)
install(TARGETS cab EXPORT cab-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY layout/include/cab engine/include/cab DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN *.h)
if(TARGET cab_rig)
  install(TARGETS cab_rig EXPORT cab-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY scenes/rig/include/cab DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN *.h)
endif()
install(EXPORT cab-targets NAMESPACE cab:: DESTINATION ${CAB_PACKAGE_DIR})
configure_package_config_file(cmake/cab-config.cmake.in ${PROJECT_BINARY_DIR}/cab-config.cmake
  INSTALL_DESTINATION ${CAB_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cab-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cab-config.cmake ${PROJECT_BINARY_DIR}/cab-config-version.cmake
  DESTINATION ${CAB_PACKAGE_DIR})
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

if(CAB_BUILD_COMMAND)
  install(TARGETS cab_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  if(BUILD_SHARED_LIBS)
    set_target_properties(cab_command PROPERTIES INSTALL_RPATH $ORIGIN/../${CMAKE_INSTALL_LIBDIR})
  endif()
endif()
