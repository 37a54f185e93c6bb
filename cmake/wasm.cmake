# Cross-compiles to WebAssembly with Emscripten. Programs run in node.
execute_process(COMMAND em-config EMSCRIPTEN_ROOT OUTPUT_VARIABLE emscripten_root OUTPUT_STRIP_TRAILING_WHITESPACE
  RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "em-config is not found: install Emscripten (Debian: emscripten)")
endif()
include(${emscripten_root}/cmake/Modules/Platform/Emscripten.cmake)

# The JavaScript that Emscripten 3.1.6 makes takes a node that has fetch() for a browser.
set(CMAKE_CROSSCOMPILING_EMULATOR node --no-experimental-fetch)
# Debian's acorn, which em++ calls when it links, is where Debian's node looks, and no other.
set_property(GLOBAL PROPERTY RULE_LAUNCH_LINK "${CMAKE_COMMAND} -E env NODE_PATH=/usr/share/nodejs")
# A failed allocation is a status of the library, so code that throws must find its handler.
set(CMAKE_CXX_FLAGS_INIT -fwasm-exceptions)
set(CMAKE_EXE_LINKER_FLAGS_INIT "-fwasm-exceptions -sALLOW_MEMORY_GROWTH")
