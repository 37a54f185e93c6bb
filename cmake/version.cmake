# The version of the project, which has one place: layout/include/cab/version.h. Sets CAB_VERSION, CAB_VERSION_SUFFIX,
# which is empty for a release, and CAB_ABI_VERSION, that of the C API, from layout/include/cab/cab_c.h.
set(CAB_VERSION_HEADER ${CMAKE_CURRENT_LIST_DIR}/../layout/include/cab/version.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CAB_VERSION_HEADER})
file(STRINGS ${CAB_VERSION_HEADER} CAB_VERSION REGEX "^#define CAB_VERSION_(MAJOR|MINOR|PATCH) [0-9]+$")
list(TRANSFORM CAB_VERSION REPLACE "^.* " "")
list(JOIN CAB_VERSION . CAB_VERSION)
if(NOT CAB_VERSION MATCHES "^[0-9]+[.][0-9]+[.][0-9]+$")
  message(FATAL_ERROR "${CAB_VERSION_HEADER} must define CAB_VERSION_MAJOR, _MINOR and _PATCH, numbers in this order")
endif()

file(STRINGS ${CAB_VERSION_HEADER} CAB_VERSION_SUFFIX REGEX "^#define CAB_VERSION_SUFFIX ")
if(NOT CAB_VERSION_SUFFIX MATCHES "\"(|-[a-z0-9.]+)\"$")
  message(FATAL_ERROR "${CAB_VERSION_HEADER} must define CAB_VERSION_SUFFIX, \"\" or such as \"-rc\"")
endif()
set(CAB_VERSION_SUFFIX "${CMAKE_MATCH_1}")

set(CAB_C_HEADER ${CMAKE_CURRENT_LIST_DIR}/../layout/include/cab/cab_c.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CAB_C_HEADER})
file(STRINGS ${CAB_C_HEADER} CAB_ABI_VERSION REGEX "^#define CAB_ABI_VERSION [0-9]+u$")
string(REGEX REPLACE "^.* ([0-9]+)u$" "\\1" CAB_ABI_VERSION "${CAB_ABI_VERSION}")
if(NOT CAB_ABI_VERSION MATCHES "^[0-9]+$")
  message(FATAL_ERROR "${CAB_C_HEADER} must define CAB_ABI_VERSION, a number")
endif()
