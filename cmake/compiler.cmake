# Compiler flags, and what compilers get wrong.
#   cab_flags          what every target of the project is compiled with
#   CAB_KERNEL_FLAGS   what files of kernels/isa have on top, whatever their instruction set
#   CAB_SCALAR_FLAGS   what keeps the scalar kernels scalar
#   CAB_AVX2_FLAGS     what lets a compiler use AVX2
#   CAB_AVX512_FLAGS   and AVX-512
#   CAB_AVOID_DSE      ON where g++ deletes live stores
#   cab_harden         what targets that read strangers' files are compiled and linked with on top

add_library(cab_flags INTERFACE)
target_include_directories(cab_flags INTERFACE ${PROJECT_SOURCE_DIR})

# Hardens a target as Debian's packages are: a stack or a buffer that is written over ends the program, and the tables
# of a program's addresses are read-only once it runs. The engine and its kernels read no files, and keep their code.
function(cab_harden target)
  if(NOT PROJECT_IS_TOP_LEVEL OR NOT CMAKE_SYSTEM_NAME STREQUAL Linux)
    return()
  endif()
  target_compile_options(${target} PRIVATE -fstack-protector-strong)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  if(NOT CAB_SANITIZE AND "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}}" MATCHES "-O[123s]")
    # It needs optimisation. Some compilers define it themselves, hence -U.
    target_compile_options(${target} PRIVATE -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
  endif()
  target_link_options(${target} PRIVATE LINKER:-z,relro LINKER:-z,now)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL EXECUTABLE)
    target_link_options(${target} PRIVATE -pie)
  endif()
endfunction()

# Windows' compilers. Written from their documentation and never tried (docs/platforms.md).
if(MSVC)
  # /fp:precise fuses no product and sum since Visual Studio 2022, and clang-cl is told not to.
  target_compile_options(cab_flags INTERFACE /W4 /utf-8 /fp:precise
    $<$<BOOL:${CAB_WARNINGS_AS_ERRORS}>:/WX>)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    target_compile_options(cab_flags INTERFACE /clang:-ffp-contract=off)
    set(CAB_SCALAR_FLAGS /clang:-fno-vectorize /clang:-fno-slp-vectorize)
    set(CAB_AVX2_FLAGS -mavx2 -mfma)
    set(CAB_AVX512_FLAGS -mavx512f -mavx512cd -mavx512dq -mavx512bw -mavx512vl)
  else()
    target_compile_options(cab_flags INTERFACE /permissive- /Zc:__cplusplus /Zc:inline)
    set(CAB_SCALAR_FLAGS "") # it has no option against vectors: the bits are the same, the times are not
    set(CAB_AVX2_FLAGS /arch:AVX2)
    set(CAB_AVX512_FLAGS /arch:AVX512)
  endif()
  # Debug has /RTC1, which no optimisation may stand beside.
  set(CAB_KERNEL_FLAGS /bigobj $<$<CONFIG:RelWithDebInfo,MinSizeRel>:/O2>)
  return()
endif()

# -ffp-contract=off everywhere: the bits of poses, boxes and hits must not depend on whether a compiler found a fused
# multiply-add.
target_compile_options(cab_flags INTERFACE -Wall -Wextra -Wshadow -Wconversion -ffp-contract=off
  $<$<BOOL:${CAB_WARNINGS_AS_ERRORS}>:-Werror>)
if(CAB_SANITIZE)
  target_compile_options(cab_flags INTERFACE
    -fsanitize=${CAB_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  target_link_options(cab_flags INTERFACE -fsanitize=${CAB_SANITIZE})
endif()
if(CAB_FUZZ)
  # Libraries count edges and check casts too; test programs, which no fuzzer links, do not.
  set(is_library $<NOT:$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>>)
  target_compile_options(cab_flags INTERFACE $<${is_library}:-fsanitize=fuzzer-no-link,float-cast-overflow>)
endif()

# Kernels rely on inlining, so every preset compiles them with -O2 at least.
set(CAB_KERNEL_FLAGS $<$<NOT:$<CONFIG:Release>>:-O2> -fno-math-errno -fno-exceptions)
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  set(CAB_SCALAR_FLAGS -fno-vectorize -fno-slp-vectorize)
  # The vectoriser of straight-line code of clang 14 gets points of contacts wrong (kernels/convex/least_depth.h), as
  # tests/kernels/convex/contact_pairs_test.cpp shows in WebAssembly. Kernels are vectors already.
  list(APPEND CAB_KERNEL_FLAGS -fno-slp-vectorize)
else()
  # As one SHELL: text, since CMake drops an option that the flags have before, and -ftree-slp-vectorize would then win.
  set(CAB_SCALAR_FLAGS "SHELL:-fno-tree-vectorize -fno-tree-slp-vectorize")
endif()

set(CAB_AVX2_FLAGS -mavx2 -mfma)
set(CAB_AVX512_FLAGS -mavx512f -mavx512cd -mavx512dq -mavx512bw -mavx512vl)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # The AVX-512 headers of GCC 12 themselves cause these two warnings.
  list(APPEND CAB_AVX512_FLAGS -Wno-uninitialized -Wno-maybe-uninitialized)
endif()
if(MINGW AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  # The stack of Windows is aligned to 16 bytes, and g++ moves wider registers to it as if it were aligned to theirs
  # (GCC bug 54412). The assembler writes the unaligned forms of these moves, which cost the same where data is aligned.
  list(APPEND CAB_AVX2_FLAGS -Wa,-muse-unaligned-vector-move)
  list(APPEND CAB_AVX512_FLAGS -Wa,-muse-unaligned-vector-move)
endif()

if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # g++ 12.2 deletes live stores at -O3 (dead-store elimination). tests/kernels/overlap_test.cpp shows it; the test
  # passes at -O2, with -fno-tree-dse, under the sanitizers and with clang. So where Release, as by default, or
  # RelWithDebInfo asks for -O3, g++ before 13 compiles at -O2. Kernels need -O3 to unroll their short loops, and have
  # it without the faulty pass. Any other level is taken as it is.
  set(CAB_AVOID_DSE ON)
  foreach(config Release RelWithDebInfo)
    string(TOUPPER ${config} upper)
    if(CMAKE_CXX_FLAGS_${upper} MATCHES "-O3")
      add_compile_options($<$<CONFIG:${config}>:-O2>)
      list(APPEND CAB_KERNEL_FLAGS $<$<CONFIG:${config}>:-O3>)
    endif()
  endforeach()
  list(APPEND CAB_KERNEL_FLAGS -fno-tree-dse -Wno-maybe-uninitialized)
  # Its vectoriser of straight-line code takes a pair of double(float(x)) for x, so a box is enlarged about a centre
  # other than the one it stores (tests/layout/fit_box_test.cpp). Kernels have no such round trip, and keep the pass.
  add_compile_options(-fno-tree-slp-vectorize)
  list(PREPEND CAB_KERNEL_FLAGS -ftree-slp-vectorize)
endif()
