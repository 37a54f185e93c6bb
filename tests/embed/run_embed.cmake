cmake_minimum_required(VERSION 3.25)
# Installs cab, moves what was installed, and configures, builds and runs tests/embed and its folders c, hello_c,
# golden, rig, components and pkg_config against it.
# VARIANT built: the build at BUILD. VARIANT other: a build of the libraries alone, cab shared, with a static one beside
# it, where that at BUILD is static.
# VERSION: cab's, three numbers.
# CAB_WITH_FCL, CAB_WITH_QHULL, CAB_WITH_TBB: the options of the build at BUILD.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(REPLACE ";" " " command "${ARGV}")
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(common -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=${BUILD_TYPE})
if(VARIANT STREQUAL other)
  if(SHARED)
    set(SHARED OFF)
  else()
    set(SHARED ON)
  endif()
  set(BUILD ${WORK}/library)
  run(${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} ${common} -D BUILD_SHARED_LIBS=${SHARED} -D CAB_SANITIZE=${SANITIZE}
    -D CAB_BUILD_TESTS=OFF -D CAB_BUILD_COMMAND=OFF -D CAB_BUILD_BOTH=ON
    -D CAB_WITH_FCL=${CAB_WITH_FCL} -D CAB_WITH_QHULL=${CAB_WITH_QHULL} -D CAB_WITH_TBB=${CAB_WITH_TBB})
  run(${CMAKE_COMMAND} --build ${BUILD})
endif()

# From an empty folder, so that nothing of an earlier run stands in for a file that is not installed any more.
# It is installed into one folder and used in another.
foreach(folder installed prefix project rig c golden components make static hello_c)
  file(REMOVE_RECURSE ${WORK}/${folder})
endforeach()
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/installed)
file(RENAME ${WORK}/installed ${WORK}/prefix)
file(GLOB_RECURSE installed ${WORK}/prefix/*.cmake ${WORK}/prefix/*.pc)
foreach(file IN LISTS installed)
  file(STRINGS ${file} lines REGEX "${WORK}|${BUILD}|${SOURCE}/")
  if(lines)
    message(FATAL_ERROR "${file} names a folder of this machine:\n${lines}")
  endif()
endforeach()
file(GLOB_RECURSE shared_library ${WORK}/prefix/libcab.so)
file(GLOB_RECURSE static_library ${WORK}/prefix/libcab.a)
file(GLOB_RECURSE rig_library ${WORK}/prefix/libcab_rig.a)
if(SANITIZE)
  list(APPEND common -D CMAKE_CXX_FLAGS=-fsanitize=${SANITIZE} -D CMAKE_C_FLAGS=-fsanitize=${SANITIZE})
endif()
list(APPEND common -D CMAKE_PREFIX_PATH=${WORK}/prefix)
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed -B ${WORK}/project ${common})
run(${CMAKE_COMMAND} --build ${WORK}/project)
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/rig -B ${WORK}/rig ${common})
run(${CMAKE_COMMAND} --build ${WORK}/rig)

if(COMPILER MATCHES "clang")
  list(APPEND common -D CMAKE_C_COMPILER=clang)
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/c -B ${WORK}/c ${common})
run(${CMAKE_COMMAND} --build ${WORK}/c)

run(${WORK}/c/embed_c)
set(expected "link 1 of arm 0 touches link 0 of arm 1\nray 1 meets link 0 of arm 1 after 4.40\n")
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the C program printed\n${output}instead of\n${expected}")
endif()

# What programs in C are compiled for. A change of it needs another CAB_ABI_VERSION.
run(${WORK}/c/embed_c --layout)
file(READ ${SOURCE}/tests/embed/c/layout.txt expected)
if(NOT output STREQUAL expected)
  file(WRITE ${WORK}/layout.txt "${output}")
  message(FATAL_ERROR "the ABI has changed: if it was released, raise CAB_ABI_VERSION in engine/bindings/make_c_api; "
    "then copy ${WORK}/layout.txt to tests/embed/c/layout.txt")
endif()

# The golden frames, in both languages and on every instruction set that this CPU has.
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/golden -B ${WORK}/golden ${common})
run(${CMAKE_COMMAND} --build ${WORK}/golden)
file(READ ${SOURCE}/tests/embed/golden/expected.txt expected)
foreach(program golden_cpp golden_c)
  foreach(isa auto scalar sse2 avx2 avx512 neon64)
    execute_process(COMMAND ${WORK}/golden/${program} ${isa} RESULT_VARIABLE result OUTPUT_VARIABLE output
      ERROR_VARIABLE error)
    if(NOT isa MATCHES "auto|scalar" AND error STREQUAL
        "golden: isa is an instruction set that this CPU or this build lacks\n")
      message("${program}: this CPU has no ${isa}")
    elseif(NOT result EQUAL 0 OR NOT output STREQUAL expected)
      message(FATAL_ERROR "${program} ${isa} printed\n${output}${error}instead of\n${expected}")
    endif()
  endforeach()
endforeach()

run(${WORK}/rig/rig)
set(expected "3 links, 3 leaves\n2 links, 2 leaves\n")
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the rig's program printed\n${output}instead of\n${expected}")
endif()

run(${WORK}/project/embed)
set(expected "link 1 of arm 0 touches link 0 of arm 1\n")
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the example printed\n${output}instead of\n${expected}")
endif()

# Without the optional packages the program needs the C and C++ runtimes, libcab if it is shared, and nothing else.
if(NOT (CAB_WITH_FCL OR CAB_WITH_QHULL OR CAB_WITH_TBB OR SANITIZE))
  run(ldd ${WORK}/project/embed)
  string(REPLACE "\n" ";" lines "${output}")
  list(FILTER lines INCLUDE REGEX "[^ \t]")
  list(LENGTH lines needed_count)
  list(FILTER lines EXCLUDE REGEX "(linux-vdso|libstdc\\+\\+|libgcc_s|libm|libc|ld-linux[a-z0-9_-]*|libcab)\\.so")
  if(lines OR needed_count LESS 2)
    message(FATAL_ERROR "the program needs more than the C and C++ runtimes, or ldd failed:\n${output}")
  endif()
  message("ldd:\n${output}")
endif()

# The installed command runs from where it was put.
if(VARIANT STREQUAL built AND EXISTS ${WORK}/prefix/bin/cab)
  run(${WORK}/prefix/bin/cab --version)
endif()

# A project in C alone.
set(compile ${COMPILER})
set(compile_c cc)
if(COMPILER MATCHES "clang")
  set(compile_c clang)
endif()
set(flags_c "")
set(link_c "")
if(SANITIZE)
  set(flags_c -fsanitize=${SANITIZE})
  string(APPEND compile " ${flags_c}")
  if(COMPILER MATCHES "clang" AND SANITIZE MATCHES "undefined")
    string(APPEND flags_c " -fsanitize-link-c++-runtime")
    set(link_c -Wl,--no-as-needed,-lstdc++)  # which that runtime itself needs
  endif()
endif()
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/hello_c -B ${WORK}/hello_c ${common} -D "CMAKE_C_FLAGS=${flags_c}"
  -D "CMAKE_EXE_LINKER_FLAGS=${link_c}")
run(${CMAKE_COMMAND} --build ${WORK}/hello_c)
run(${WORK}/hello_c/hello)
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the program of tests/embed/hello_c printed\n${output}instead of\n${expected}")
endif()
string(APPEND compile_c " ${flags_c}")

# What is missing is refused in words, and what is there is found.
if(SHARED)
  set(kind shared)
  set(library SHARED_LIBRARY)
else()
  set(kind static)
  set(library STATIC_LIBRARY)
endif()
set(other "")
if(NOT shared_library)
  set(other shared)
elseif(NOT static_library)
  set(other static)
endif()
string(REGEX MATCH "^[0-9]+" major ${VERSION})
math(EXPR next "${major} + 1")
run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/components -B ${WORK}/components ${common} -D KIND=${kind}
  -D OTHER=${other} -D THIS=${VERSION} -D NEXT=${next}.0 -D LAST=0.1)
set(answers "wings: refused, cab has no component wings, only core, rig, shared and static\n"
  "all: found, wings FALSE\ntype: ${library}\nrig: STATIC_LIBRARY\n" "next version: refused, \n"
  "last version: refused, \n")
if(other)
  list(APPEND answers "other kind: refused, cab in ${WORK}/prefix has no ${other} library: -D CAB_BUILD_BOTH=ON")
else()
  list(APPEND answers "both kinds: refused, cab::cab cannot be shared and static in one project")
endif()
foreach(answer IN LISTS answers)
  string(FIND "${output}" "${answer}" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "find_package does not answer\n${answer}\nbut\n${output}")
  endif()
endforeach()

# Without CMake: by pkg-config, in C++ and in C.
find_program(PKG_CONFIG pkg-config REQUIRED)
find_program(MAKE make REQUIRED)
file(GLOB_RECURSE pc_file ${WORK}/prefix/cab.pc)
get_filename_component(pc_folder ${pc_file} DIRECTORY)
get_filename_component(library_folder ${pc_folder} DIRECTORY)
set(environment ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pc_folder} LD_LIBRARY_PATH=${library_folder})
file(COPY ${SOURCE}/tests/embed/pkg_config/Makefile ${SOURCE}/tests/embed/main.cpp DESTINATION ${WORK}/make)
run(${environment} ${MAKE} -C ${WORK}/make CXX=${compile})
run(${environment} sh -c "${compile_c} -std=c11 -Wall -Wextra -Wpedantic -Werror -o ${WORK}/make/hello_c \
  ${SOURCE}/tests/embed/hello_c/main.c $(pkg-config --cflags --libs cab)")
run(${environment} sh -c "${compile} -std=c++17 -o ${WORK}/make/rig ${SOURCE}/tests/embed/rig/main.cpp \
  $(pkg-config --cflags --libs cab-rig)")
set(expected "link 1 of arm 0 touches link 0 of arm 1\n")
foreach(program hello hello_c)
  run(${environment} ${WORK}/make/${program})
  if(NOT output STREQUAL expected)
    message(FATAL_ERROR "${program} of pkg-config printed\n${output}instead of\n${expected}")
  endif()
endforeach()
run(${environment} ${WORK}/make/rig)
run(${environment} ${PKG_CONFIG} --modversion cab)
if(NOT output STREQUAL "${VERSION}\n")
  message(FATAL_ERROR "cab.pc is of version ${output}")
endif()

# A static libcab beside a shared one, by both ways.
if(shared_library AND static_library)
  run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed -B ${WORK}/static ${common} -D BUILD_SHARED_LIBS=OFF)
  run(${CMAKE_COMMAND} --build ${WORK}/static)
  file(RENAME ${shared_library} ${shared_library}.hidden) # so that -lcab is the static one
  run(${environment} sh -c "${compile_c} -std=c11 -o ${WORK}/static/hello_c \
    ${SOURCE}/tests/embed/hello_c/main.c $(pkg-config --static --cflags --libs cab)")
  file(RENAME ${shared_library}.hidden ${shared_library})
  foreach(program embed hello_c)
    run(ldd ${WORK}/static/${program})
    if(output MATCHES "libcab")
      message(FATAL_ERROR "${program} is not linked with the static libcab:\n${output}")
    endif()
    run(${WORK}/static/${program})
    if(NOT output STREQUAL expected)
      message(FATAL_ERROR "${program} printed\n${output}instead of\n${expected}")
    endif()
  endforeach()
endif()

# What a linker sees of the libraries. A sanitizer adds names of its own.
if(SANITIZE)
  message("the names in libraries are not looked at: -fsanitize=${SANITIZE} adds some")
else()
  foreach(file IN LISTS shared_library static_library rig_library)
    run(${CMAKE_COMMAND} -D LIBRARIES=${file} -D NM=${NM} -D LIST=${SOURCE}/tests/embed/c/symbols.list
      -D FOUND=${WORK}/symbols.list -P ${SOURCE}/tests/embed/check_symbols.cmake)
    message("${output}")
  endforeach()
endif()

# At last without the component rig.
file(GLOB_RECURSE rig_package ${WORK}/prefix/cab-rig-targets*.cmake)
file(REMOVE ${rig_package})
execute_process(COMMAND ${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/rig -B ${WORK}/rig ${common} RESULT_VARIABLE result
  OUTPUT_VARIABLE output ERROR_VARIABLE output)
string(REGEX REPLACE "[ \n]+" " " words "${output}")
if(result EQUAL 0 OR NOT words MATCHES "has no component rig: it was built with -D CAB_BUILD_RIG=OFF")
  message(FATAL_ERROR "find_package does not say that the component rig is missing:\n${output}")
endif()
message("embed: ${VARIANT}, shared ${SHARED}: ${expected}")
