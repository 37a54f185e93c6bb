# Checks by READELF that each of FILES is hardened: position-independent, its table of addresses read-only from the
# start (full RELRO), and its code with checks of the stack and, if optimised and without SANITIZE, of buffers.
cmake_minimum_required(VERSION 3.25)
foreach(file IN LISTS FILES)
  execute_process(COMMAND ${READELF} -W --file-header --program-headers --dynamic --dyn-syms ${file}
    OUTPUT_VARIABLE text ERROR_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  set(wanted "DYN " "GNU_RELRO" "BIND_NOW|FLAGS_1.*NOW" "__stack_chk_fail")
  if(NOT SANITIZE AND NOT BUILD_TYPE STREQUAL Debug)
    list(APPEND wanted "__[a-z]+_chk")
  endif()
  foreach(expression IN LISTS wanted)
    if(NOT text MATCHES "${expression}")
      message(SEND_ERROR "${file} is not hardened: readelf shows no ${expression}")
    endif()
  endforeach()
endforeach()
