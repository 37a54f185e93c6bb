# Debian packages, which `cpack` makes in the build folder (./dev packages): libcabN with the shared library, N being
# the number of the ABI; libcab-dev; cab-tools, if the command is built; python3-cab, if the Python package is built.
# Configure with CMAKE_INSTALL_PREFIX=/usr, BUILD_SHARED_LIBS and CAB_BUILD_BOTH. DEBFULLNAME and DEBEMAIL of the
# environment name the maintainer, if both are set.
if(NOT (BUILD_SHARED_LIBS AND CAB_BUILD_BOTH AND CAB_INSTALL) OR NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
  message(FATAL_ERROR "CAB_DEBIAN needs BUILD_SHARED_LIBS, CAB_BUILD_BOTH, CAB_INSTALL and CMAKE_INSTALL_PREFIX=/usr")
endif()
find_program(CAB_GZIP gzip REQUIRED)
string(REPLACE "-" "~" debian_version "${PROJECT_VERSION}${CAB_VERSION_SUFFIX}") # 1.0.0~rc comes before 1.0.0
set(library_package libcab${CAB_ABI_VERSION})
set(maintainer "The cab authors <cab@localhost.localdomain>")
if(DEFINED ENV{DEBEMAIL} AND DEFINED ENV{DEBFULLNAME})
  set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_PACKAGE_NAME cab)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${maintainer}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PACKAGE_VERSION "${debian_version}")
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${maintainer}")
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/engine)
set(CPACK_COMPONENTS_ALL "")
# Each package has a synopsis of its own. CPack prepends that of the project, unless it is what CPack has by default.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${CMAKE_PROJECT_NAME} built using CMake")

# The two documents that each package has. The copyright file has cab's licence, then those of what is compiled into the
# package.
file(READ ${PROJECT_SOURCE_DIR}/LICENSE license)
string(STRIP "${license}" license)
string(REGEX MATCH "Copyright [(]c[)] ([0-9]+), ([^\n]+)" copyright "${license}")
if(NOT copyright)
  message(FATAL_ERROR "LICENSE has no line: Copyright (c) YEAR, HOLDER")
endif()
set(copyright "${CMAKE_MATCH_1} ${CMAKE_MATCH_2}")
string(REGEX REPLACE "\n\n+" "\n.\n" license "${license}")
string(REGEX REPLACE "\n" "\n " license "${license}")
set(own_licence "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: cab\n\n\
Files: *\nCopyright: ${copyright}\nLicense: BSD-3-clause\n ${license}\n")
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC) # SOURCE_DATE_EPOCH, if that is set
file(WRITE ${PROJECT_BINARY_DIR}/debian/changelog
  "cab (${debian_version}) unstable; urgency=medium\n\n  * CHANGELOG.md of cab's sources says what changed.\n\n"
  " -- ${maintainer}  ${date}\n")
# cab_zip(FILE): FILE.gz, without a time in it
function(cab_zip file)
  execute_process(COMMAND ${CAB_GZIP} -9nc ${file} OUTPUT_FILE ${file}.gz COMMAND_ERROR_IS_FATAL ANY)
endfunction()
cab_zip(${PROJECT_BINARY_DIR}/debian/changelog)

# cab_package(COMPONENT PART NAME SECTION SHLIBDEPS DEPENDS SYNOPSIS TEXT); PART is that of third_party.cmake
macro(cab_package component part name section shlibdeps depends synopsis text)
  string(TOUPPER ${component} upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS ${shlibdeps})
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}")
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${synopsis}\n${text}")
  cab_third_party_words(words ${part})
  cab_third_party_debian(others ${words})
  file(WRITE ${PROJECT_BINARY_DIR}/debian/${name}/copyright "${own_licence}${others}")
  install(FILES ${PROJECT_BINARY_DIR}/debian/${name}/copyright ${PROJECT_BINARY_DIR}/debian/changelog.gz
    DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${name} COMPONENT ${component})
endmacro()

set(about "cab finds which links of many articulated characters touch, frame after
frame. Poses go in as batches, a sorted list of touching link pairs comes
out, with the same bits on every instruction set and any number of threads.")
set(exactly "(= ${debian_version})")
set(static_needs "")
if(CAB_BUILD_RECORD AND CAB_WITH_ZSTD)
  string(APPEND static_needs ", libzstd-dev")
endif()
if(CAB_WITH_TBB)
  string(APPEND static_needs ", libtbb-dev")
endif()
if(CAB_WITH_FCL)
  string(APPEND static_needs ", libfcl-dev, libccd-dev")
endif()
if(CAB_WITH_QHULL)
  string(APPEND static_needs ", libqhull-dev")
endif()
cab_package(cab_runtime library ${library_package} libs ON "" "collision detection of characters: library"
  "${about}\n\nThis package has the shared library.")
file(WRITE ${PROJECT_BINARY_DIR}/debian/triggers "activate-noawait ldconfig\n")
file(WRITE ${PROJECT_BINARY_DIR}/debian/shlibs
  "libcab ${CAB_ABI_VERSION} ${library_package} (>= ${debian_version})\n")
set(CPACK_DEBIAN_CAB_RUNTIME_PACKAGE_CONTROL_EXTRA
  ${PROJECT_BINARY_DIR}/debian/triggers ${PROJECT_BINARY_DIR}/debian/shlibs)
cab_package(cab_development development libcab-dev libdevel OFF "${library_package} ${exactly}${static_needs}"
  "collision detection of characters: development files"
  "${about}\n\nThis package has the headers for C++ and C, the static library, and\nfiles for CMake and pkg-config.")
if(CAB_BUILD_COMMAND)
  cab_package(cab_tools tools cab-tools math ON "${library_package} ${exactly}"
    "collision detection of characters: command"
    "${about}\n\nThis package has the command cab, which runs motion files, robots and crowds.")
  # For `cab scan`.
  set(CPACK_DEBIAN_CAB_TOOLS_PACKAGE_SUGGESTS "python3-cab, python3-dask, python3-distributed")
  configure_file(perf/cli/cab.1.in ${PROJECT_BINARY_DIR}/debian/cab.1 @ONLY)
  cab_zip(${PROJECT_BINARY_DIR}/debian/cab.1)
  install(FILES ${PROJECT_BINARY_DIR}/debian/cab.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT cab_tools)
endif()
if(CAB_BUILD_PYTHON)
  # The module is built for one version of Python.
  find_package(Python COMPONENTS Interpreter REQUIRED)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(python_needs "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), \
python3 (<< ${Python_VERSION_MAJOR}.${next_minor}), python3-numpy")
  cab_package(python python python3-cab python ON "${library_package} ${exactly}, ${python_needs}"
    "collision detection of characters: Python package"
    "${about}\n\nThis package has the Python package cab, which takes NumPy arrays.")
endif()
include(CPack)
