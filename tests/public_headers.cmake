# Compiles every public header of ROOT by itself with COMPILER, in C++17, 20 and 23, and the C API in C11, with all
# warnings that make sense of a header as errors. In C++14 the C API compiles too; the first error of others says what
# they need.
cmake_minimum_required(VERSION 3.25)
if(COMPILER MATCHES "clang")
  # Not those about C++98, about padding, and about what only this project's own option asks for.
  set(cxx_warnings -Weverything -Wno-c++98-compat -Wno-c++98-compat-pedantic -Wno-padded)
  set(c_warnings -Weverything -Wno-padded)
else()
  set(cxx_warnings -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wold-style-cast)
  set(c_warnings -Wall -Wextra -Wpedantic -Wshadow -Wconversion)
endif()
set(includes -I${ROOT}/layout/include)

function(compile header language)
  set(source ${WORK}/header.txt)
  file(WRITE ${source} "#include <cab/${header}>\n")
  execute_process(COMMAND ${COMPILER} -x ${language} ${ARGN} -Werror ${includes} -fsyntax-only ${source}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "<cab/${header}> as ${language} with ${ARGN}:\n${output}")
  endif()
endfunction()

file(GLOB headers ${ROOT}/layout/include/cab/*.h)
list(FILTER headers EXCLUDE REGEX "/mpi[.]h$") # needs MPI's own header
list(LENGTH headers count)
if(count LESS 10)
  message(FATAL_ERROR "only ${count} public headers were found")
endif()
foreach(path IN LISTS headers)
  cmake_path(GET path FILENAME header)
  foreach(standard 17 20 2b)
    compile(${header} c++ -std=c++${standard} ${cxx_warnings})
  endforeach()
endforeach()
compile(cab_c.h c -std=c11 ${c_warnings})
compile(cab_c.h c++ -std=c++14)
foreach(header cab.h world.h record.h)
  file(WRITE ${WORK}/header.txt "#include <cab/${header}>\n")
  execute_process(COMMAND ${COMPILER} -x c++ -std=c++14 ${includes} -fsyntax-only ${WORK}/header.txt
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  string(REGEX MATCH "error:[^\n]*" first "${output}")
  if(result EQUAL 0 OR NOT first MATCHES "cab needs C[+][+]17")
    message(FATAL_ERROR "<cab/${header}> in C++14 does not begin with what it needs: ${first}")
  endif()
endforeach()
message("${count} headers")
