cmake_minimum_required(VERSION 3.25)
# Makes an environment of Python in WORK, installs the package of the build at BUILD into it by pip, as docs/python.md
# says, and uses it: without PYTHONPATH, without a network, with the command if COMMAND_BUILT.
function(run)
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE output
    ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(REPLACE ";" " " command "${ARGV}")
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

unset(ENV{PYTHONPATH})
set(ENV{CAB_PYTHON_BUILD} ${BUILD})
set(ENV{PIP_NO_INDEX} 1)
set(ENV{PIP_DISABLE_PIP_VERSION_CHECK} 1)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

# An environment that sees none of Debian's modules, as that of another python3 in PATH.
run(${PYTHON} -m venv ${WORK}/closed)
execute_process(COMMAND ${WORK}/closed/bin/pip install --no-build-isolation ${ROOT} RESULT_VARIABLE result
  OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "lacks the Python module wheel[.]" OR output MATCHES "Traceback")
  message(FATAL_ERROR "pip in an environment without the module wheel, exit code ${result}:\n${output}")
endif()

run(${PYTHON} -m venv --system-site-packages ${WORK}/v)

# A wheel, in the environment that sees no modules of Debian but NumPy and what lies beside it.
run(${WORK}/v/bin/pip wheel --no-build-isolation --no-deps -w ${WORK}/wheels ${ROOT})
file(GLOB wheel ${WORK}/wheels/cab-*.whl)
run(${WORK}/closed/bin/pip install --no-deps ${wheel})
run(${PYTHON} -c "print(__import__('numpy').__path__[0])")
string(STRIP "${output}" numpy)
cmake_path(GET numpy PARENT_PATH numpy)
run(${CMAKE_COMMAND} -E env PYTHONPATH=${numpy} ${WORK}/closed/bin/python
  ${ROOT}/tests/engine/bindings/python/crowd.py)
message("the wheel: ${output}")

run(${WORK}/v/bin/pip install --no-build-isolation ${ROOT})
message("${output}")

file(WRITE ${WORK}/where.py "import cab\nprint(cab.__file__, cab.__version__)\n")
run(${WORK}/v/bin/python where.py)
if(NOT output MATCHES "^${WORK}/v/lib/[^ ]*/cab/__init__[.]py [0-9]+[.][0-9]+[.][0-9]+")
  message(FATAL_ERROR "the package that was imported is ${output}")
endif()
file(GLOB licences ${WORK}/v/lib/*/site-packages/cab/LICENSE.third-party)
file(READ "${licences}" text)
foreach(name xsimd Eigen pybind11)
  if(NOT text MATCHES "\n==== ${name} ")
    message(FATAL_ERROR "${licences} has no licence of ${name}")
  endif()
endforeach()
run(${WORK}/v/bin/python ${ROOT}/tests/engine/bindings/python/crowd.py)
message("${output}")
if(COMMAND_BUILT)
  run(${CMAKE_COMMAND} -E env PATH=/usr/bin:/bin ${WORK}/v/bin/python -m cab --version)
  message("python -m cab --version: ${output}")
endif()
