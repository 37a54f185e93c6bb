cmake_minimum_required(VERSION 3.25)
# Fails unless MODULE exports PyInit__cab and nothing else.
execute_process(COMMAND ${NM} -D --defined-only ${MODULE} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
if(NOT symbols MATCHES "^[0-9a-f]+ T PyInit__cab\n$")
  message(FATAL_ERROR "${MODULE} exports\n${symbols}instead of PyInit__cab alone")
endif()
message("${MODULE} exports PyInit__cab alone")
