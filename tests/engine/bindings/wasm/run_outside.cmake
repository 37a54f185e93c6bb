# Programs outside cab's tree that import the package, in WORK: the one of docs/wasm.md, and one in TypeScript, which
# tsc checks with --strict. PACKAGE: the folder of the package. ROOT: that of the project.
file(REMOVE_RECURSE ${WORK})
file(COPY ${ROOT}/tests/embed/wasm/ ${ROOT}/tests/engine/bindings/wasm/types.ts DESTINATION ${WORK})
file(COPY ${PACKAGE}/ DESTINATION ${WORK}/node_modules/cab-collision)

# run(EXPECTED COMMAND...): the command succeeds, and prints what is expected, if that is not empty.
function(run expected)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE errors)
  if(NOT result EQUAL 0 OR (expected AND NOT output STREQUAL "${expected}\n"))
    message(FATAL_ERROR "${ARGN}: ${result}\n${output}${errors}\nexpected: ${expected}")
  endif()
  message("${ARGN}: ${output}")
endfunction()

run("link 1 of arm 0 touches link 0 of arm 1" node main.js)
foreach(resolution node node16)
  set(module es2022)
  if(resolution STREQUAL node16)
    set(module node16)
  endif()
  run("" tsc --strict --target es2022 --lib es2022,dom --module ${module} --moduleResolution ${resolution} types.ts)
endforeach()
run("true true true 4 bad_margin true" node types.js)
