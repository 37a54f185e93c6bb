# What `cmake --install` puts in place: the library, cab::rig, cab::record and cab::mpi, their public headers, the
# package that find_package(cab CONFIG) finds, the files of pkg-config, and the cab command. All of it may be moved
# afterwards. Each file belongs to one of the components cab_runtime, cab_development and cab_tools.
include(CMakePackageConfigHelpers)

set(CAB_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/cab)
set(CAB_KINDS static)
if(BUILD_SHARED_LIBS)
  set(CAB_KINDS shared)
endif()
install(TARGETS cab EXPORT cab-${CAB_KINDS}-targets
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT cab_runtime
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cab_runtime NAMELINK_COMPONENT cab_development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cab_development)
if(TARGET cab_static)
  list(APPEND CAB_KINDS static)
  install(TARGETS cab_static EXPORT cab-static-targets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cab_development)
endif()
set(CAB_HEADERS ${PROJECT_SOURCE_DIR}/layout/include/cab)
install(DIRECTORY ${CAB_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT cab_development
  FILES_MATCHING PATTERN *.h
  PATTERN rig.h EXCLUDE PATTERN skin.h EXCLUDE PATTERN record.h EXCLUDE PATTERN replay.h EXCLUDE PATTERN mpi.h EXCLUDE
  PATTERN files.h EXCLUDE) # files.h is for the command and the Python package alone
# The libraries beside libcab, which are static, and their headers.
set(CAB_PARTS "")
set(rig_headers rig.h skin.h)
set(record_headers record.h replay.h)
set(mpi_headers mpi.h)
foreach(name rig record mpi)
  if(TARGET cab_${name})
    list(APPEND CAB_PARTS ${name})
    install(TARGETS cab_${name} EXPORT cab-${name}-targets
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT cab_development)
    install(EXPORT cab-${name}-targets NAMESPACE cab:: DESTINATION ${CAB_PACKAGE_DIR} COMPONENT cab_development)
    list(TRANSFORM ${name}_headers PREPEND ${CAB_HEADERS}/)
    install(FILES ${${name}_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cab COMPONENT cab_development)
  endif()
endforeach()

# The package for CMake.
foreach(kind IN LISTS CAB_KINDS)
  install(EXPORT cab-${kind}-targets NAMESPACE cab:: DESTINATION ${CAB_PACKAGE_DIR} COMPONENT cab_development)
endforeach()
configure_package_config_file(cmake/cab-config.cmake.in ${PROJECT_BINARY_DIR}/cab-config.cmake
  INSTALL_DESTINATION ${CAB_PACKAGE_DIR} NO_CHECK_REQUIRED_COMPONENTS_MACRO NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cab-config-version.cmake COMPATIBILITY SameMajorVersion)
set(package_files ${PROJECT_BINARY_DIR}/cab-config.cmake ${PROJECT_BINARY_DIR}/cab-config-version.cmake)
if("static" IN_LIST CAB_KINDS)
  set(CAB_STATIC_PACKAGES "")
  if(CAB_WITH_TBB)
    list(APPEND CAB_STATIC_PACKAGES Threads TBB)
  endif()
  if(CAB_WITH_FCL)
    list(APPEND CAB_STATIC_PACKAGES fcl)
  endif()
  if(CAB_WITH_QHULL)
    list(APPEND CAB_STATIC_PACKAGES Qhull)
  endif()
  set(CAB_STATIC_RUNTIME ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
  list(FILTER CAB_STATIC_RUNTIME INCLUDE REGEX "^(stdc[+][+]|c[+][+]|m)$")
  configure_file(cmake/cab-static-packages.cmake.in ${PROJECT_BINARY_DIR}/cab-static-packages.cmake @ONLY)
  list(APPEND package_files ${PROJECT_BINARY_DIR}/cab-static-packages.cmake)
endif()
install(FILES ${package_files} DESTINATION ${CAB_PACKAGE_DIR} COMPONENT cab_development)

# The files for pkg-config. What a static libcab is linked with is private where there is a shared one too, and public
# where there is none, so that no program has to say --static. It is linked by the C compiler in C programs, so it names
# the C++ runtime. FCL is named as a library: its own file for pkg-config asks for -std=c++11.
set(CAB_PC_LIBS "")
set(CAB_PC_REQUIRES "")
set(CAB_PC_LIBS_PRIVATE "")
set(CAB_PC_REQUIRES_PRIVATE "")
if("static" IN_LIST CAB_KINDS)
  set(libs "")
  set(requires "")
  if(CAB_WITH_TBB)
    list(APPEND requires tbb)
  endif()
  if(CAB_WITH_QHULL)
    list(APPEND requires qhull_r)
  endif()
  if(CAB_WITH_FCL)
    string(APPEND libs " -lfcl")
  endif()
  foreach(library IN LISTS CAB_STATIC_RUNTIME)
    string(APPEND libs " -l${library}")
  endforeach()
  list(JOIN requires " " requires)
  if("shared" IN_LIST CAB_KINDS)
    set(CAB_PC_LIBS_PRIVATE "${libs}")
    set(CAB_PC_REQUIRES_PRIVATE "${requires}")
  else()
    set(CAB_PC_LIBS "${libs}")
    set(CAB_PC_REQUIRES "${requires}")
  endif()
endif()
set(CAB_PC_CFLAGS "")
if(WIN32 AND BUILD_SHARED_LIBS)
  set(CAB_PC_CFLAGS " -DCAB_SHARED") # cab/api.h
endif()
# Folders are relative to that of the file, if they are within the prefix.
foreach(folder LIBDIR INCLUDEDIR)
  set(CAB_PC_${folder} ${CMAKE_INSTALL_${folder}})
  if(NOT IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
    set(CAB_PC_${folder} \${prefix}/${CMAKE_INSTALL_${folder}})
  endif()
endforeach()
file(RELATIVE_PATH CAB_PC_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" CAB_PC_PREFIX "${CAB_PC_PREFIX}")
configure_file(cmake/cab.pc.in ${PROJECT_BINARY_DIR}/cab.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/cab.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT cab_development)
set(CAB_RECORD_LIBS "")
if(CAB_WITH_ZSTD)
  set(CAB_RECORD_LIBS " -lzstd")
endif()
foreach(name IN LISTS CAB_PARTS)
  configure_file(cmake/cab-${name}.pc.in ${PROJECT_BINARY_DIR}/cab-${name}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/cab-${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
    COMPONENT cab_development)
endforeach()

if(CAB_BUILD_COMMAND)
  install(TARGETS cab_command RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT cab_tools)
  # The page of `cab view`, if ./dev view has built it.
  install(FILES ${PROJECT_SOURCE_DIR}/build/view/cab_view.html DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/cab
    COMPONENT cab_tools OPTIONAL)
  # The package behind `cab scan`.
  install(DIRECTORY perf/tools/scan/cab_scan DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/cab/scan COMPONENT cab_tools
    FILES_MATCHING PATTERN *.py PATTERN py.typed PATTERN __pycache__ EXCLUDE)
  if(BUILD_SHARED_LIBS)
    file(RELATIVE_PATH to_library ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
    set_target_properties(cab_command PROPERTIES INSTALL_RPATH $ORIGIN/${to_library})
  endif()
endif()
# Licences of cab and of what is compiled into what is installed. The Debian packages have them in the form that Debian
# asks for.
if(NOT CAB_DEBIAN)
  set(parts library development)
  set(components cab_runtime cab_development)
  if(CAB_BUILD_COMMAND)
    list(APPEND parts tools)
    list(APPEND components cab_tools)
  endif()
  if(CAB_BUILD_PYTHON)
    list(APPEND parts python)
    list(APPEND components python)
  endif()
  cab_third_party_words(words ${parts})
  cab_third_party(${PROJECT_BINARY_DIR}/LICENSE.third-party ${words})
  foreach(component IN LISTS components)
    install(FILES LICENSE ${PROJECT_BINARY_DIR}/LICENSE.third-party DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/cab
      COMPONENT ${component})
  endforeach()
endif()
