# SPDX-License-Identifier: Apache-2.0
# Kernels once per instruction set; which one runs is chosen at run time (src/base/simd.cpp).
set(hpccd_kernels
  src/elementary/batch src/elementary/distance/distance_batch src/elementary/intersection_batch
  src/traverse/far_pairs src/traverse/leaf_pairs src/traverse/leaf_edge_faces)

# hpccd_compile_kernels(target instruction_set [option ...])
function(hpccd_compile_kernels target set)
  list(TRANSFORM hpccd_kernels APPEND "_${set}.cpp" OUTPUT_VARIABLE sources)
  target_sources(${target} PRIVATE ${sources})
  set_source_files_properties(${sources} PROPERTIES COMPILE_OPTIONS "${ARGN}")
  if(ARGN MATCHES "-m")  # precompiled headers are of the instruction set that all machines have
    set_source_files_properties(${sources} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

# Small tables are cleared for each pair of leaves; g++ clears them by "rep stos", whose start takes longer than the
# stores: a thirtieth of a step. Other compilers do not know the option.
include(CheckCXXCompilerFlag)
set(hpccd_clear_by_vectors -mmemset-strategy=vector_loop:1024:noalign,libcall:-1:noalign)
check_cxx_compiler_flag(${hpccd_clear_by_vectors} HPCCD_CLEARS_BY_VECTORS)
if(NOT HPCCD_CLEARS_BY_VECTORS)
  set(hpccd_clear_by_vectors)
endif()

# hpccd_compile_all_kernels(target): for every set that the processor's family may have.
function(hpccd_compile_all_kernels target)
  # -Wno-array-bounds: g++ 12 warns of subscript 1 of an array of two.
  hpccd_compile_kernels(${target} scalar -Wno-array-bounds)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|amd64")
    hpccd_compile_kernels(${target} avx2 -mavx2 -mbmi ${hpccd_clear_by_vectors} -Wno-psabi -Wno-array-bounds)
    # g++ 12 warns of _mm512_undefined_pd() in its own header (GCC bug 105593).
    hpccd_compile_kernels(${target} avx512 -mavx512f -mavx512dq -mavx512bw -mavx512vl -mbmi ${hpccd_clear_by_vectors}
      -mprefer-vector-width=512 -Wno-psabi -Wno-maybe-uninitialized -Wno-uninitialized -Wno-array-bounds)
    target_compile_definitions(${target} PUBLIC HPCCD_X86)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|AARCH64|arm64|ARM64")
    hpccd_compile_kernels(${target} neon -Wno-array-bounds)
    target_compile_definitions(${target} PUBLIC HPCCD_ARM64)
  endif()
endfunction()
