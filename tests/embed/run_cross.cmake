# For a cross build: installs cab, builds tests/embed, tests/embed/c and tests/embed/golden against what was installed,
# and runs them under EMULATOR.
# VARIANT built: the build at BUILD. VARIANT shared: a shared cab with scalar and ISAS alone, which is built here.
cmake_minimum_required(VERSION 3.25)

# run(COMMAND...): what it prints is in `output`, with the ends of lines that C has.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE error)
  if(NOT result EQUAL 0)
    string(REPLACE ";" " " command "${ARGV}")
    message(FATAL_ERROR "${command}\n${output}${error}")
  endif()
  string(REPLACE "\r\n" "\n" output "${output}")
  set(output "${output}" PARENT_SCOPE)
endfunction()

# expect(PROGRAM TEXT ARGUMENT...): the program prints the text.
function(expect program text)
  run(${EMULATOR} ${WORK}/${program}${SUFFIX} ${ARGN})
  if(NOT output STREQUAL text)
    message(FATAL_ERROR "${program} ${ARGN} printed\n${output}instead of\n${text}")
  endif()
endfunction()

set(common -G ${GENERATOR} -D CMAKE_TOOLCHAIN_FILE=${TOOLCHAIN} -D CMAKE_BUILD_TYPE=${BUILD_TYPE})
if(VARIANT STREQUAL shared)
  set(BUILD ${WORK}/library)
  run(${CMAKE_COMMAND} -S ${SOURCE} -B ${BUILD} ${common} -D BUILD_SHARED_LIBS=ON -D CAB_ISAS=${ISAS}
    -D CAB_BUILD_TESTS=OFF -D CAB_BUILD_COMMAND=OFF -D CAB_BUILD_RIG=OFF
    -D CAB_WITH_FCL=OFF -D CAB_WITH_QHULL=OFF -D CAB_WITH_TBB=OFF)
  run(${CMAKE_COMMAND} --build ${BUILD} --target cab)
endif()

# From an empty folder, so that nothing of an earlier run stands in for a file that is not installed any more.
file(REMOVE_RECURSE ${WORK}/prefix ${WORK}/project ${WORK}/c ${WORK}/golden)
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
# A cross build looks for packages among the target's alone, so it is told where cab is.
file(GLOB_RECURSE config ${WORK}/prefix/cab-config.cmake)
cmake_path(GET config PARENT_PATH config)
list(APPEND common -D cab_DIR=${config})
foreach(folder IN ITEMS project c golden)
  string(REPLACE project . source ${folder})
  run(${CMAKE_COMMAND} -S ${SOURCE}/tests/embed/${source} -B ${WORK}/${folder} ${common})
  run(${CMAKE_COMMAND} --build ${WORK}/${folder})
endforeach()
if(VARIANT STREQUAL shared)
  list(PREPEND EMULATOR ${CMAKE_COMMAND} -E env WINEPATH=${WORK}/prefix/bin) # where wine looks for DLLs
endif()

expect(project/embed "link 1 of arm 0 touches link 0 of arm 1\n")
expect(c/embed_c "link 1 of arm 0 touches link 0 of arm 1\nray 1 meets link 0 of arm 1 after 4.40\n")
file(READ ${SOURCE}/tests/embed/c/layout.txt layout)
expect(c/embed_c "${layout}" --layout)

# The golden frames, on every instruction set of this build that the CPU has, and in C on the one that is chosen.
file(READ ${SOURCE}/tests/embed/golden/expected.txt hash)
set(ran "")
set(lacks "golden: isa is an instruction set that this CPU or this build lacks")
foreach(isa IN ITEMS auto scalar sse2 avx2 avx512 neon64)
  execute_process(COMMAND ${EMULATOR} ${WORK}/golden/golden_cpp${SUFFIX} ${isa} RESULT_VARIABLE result
    ERROR_VARIABLE error OUTPUT_VARIABLE output)
  string(REPLACE "\r\n" "\n" output "${output}")
  if(NOT result EQUAL 0 AND NOT isa MATCHES "auto|scalar" AND error MATCHES "${lacks}")
    continue()
  endif()
  if(NOT result EQUAL 0 OR NOT output STREQUAL hash)
    message(FATAL_ERROR "golden_cpp ${isa} printed\n${output}${error}instead of\n${hash}")
  endif()
  list(APPEND ran ${isa})
endforeach()
expect(golden/golden_c "${hash}")
# Every machine of the processor runs this one, so if it was built it must have run.
file(STRINGS ${BUILD}/CMakeCache.txt built_isas REGEX "^CAB_ISAS:")
string(REGEX REPLACE "^[^=]*=" "" built_isas "${built_isas}")
string(REPLACE "\\;" ";" built_isas "${built_isas}")
if((NOT built_isas OR ISAS IN_LIST built_isas) AND NOT ISAS IN_LIST ran)
  message(FATAL_ERROR "the golden frames did not run on ${ISAS}, but on ${ran}")
endif()
if(VARIANT STREQUAL shared AND NOT ran STREQUAL "auto;scalar;${ISAS}")
  message(FATAL_ERROR "built for scalar and ${ISAS}, and ran on ${ran}")
endif()
message("embed: ${VARIANT}: the golden frames ran on ${ran}")
