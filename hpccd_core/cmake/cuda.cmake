# SPDX-License-Identifier: Apache-2.0
# Finds nvcc and compiles the CUDA sources with it into objects. Not CMake's own CUDA language: that fails at configure
# time where nvcc comes from wheels, and a build without CUDA must always work.
set(HPCCD_CUDA "AUTO" CACHE STRING "CUDA backends: AUTO (where there is a GPU and nvcc works), ON (required), OFF")
set_property(CACHE HPCCD_CUDA PROPERTY STRINGS AUTO ON OFF)
# Machine code for Hopper; any other GPU since Turing compiles the portable code when it first runs.
set(HPCCD_CUDA_ARCHITECTURES "90;75-virtual" CACHE STRING "e.g. 87 (Jetson Orin), 90, or 75-virtual for portable code")

# hpccd_has_gpu(variable): whether this machine has an NVIDIA GPU; nvidia-smi knows it where no device file shows it (WSL).
function(hpccd_has_gpu variable)
  set(${variable} ON PARENT_SCOPE)
  foreach(file nvidiactl nvidia0 nvhost-gpu nvgpu)  # the last two: Jetson
    if(EXISTS "/dev/${file}")
      return()
    endif()
  endforeach()
  set(listed "")
  find_program(HPCCD_NVIDIA_SMI nvidia-smi PATHS /usr/lib/wsl/lib)
  if(HPCCD_NVIDIA_SMI)
    execute_process(COMMAND "${HPCCD_NVIDIA_SMI}" -L OUTPUT_VARIABLE listed ERROR_QUIET)
  endif()
  if(NOT listed MATCHES "GPU ")
    set(${variable} OFF PARENT_SCOPE)
  endif()
endfunction()

# hpccd_report_cuda(line): while CMake runs, and in a file that the Makefile prints.
function(hpccd_report_cuda line)
  message(STATUS "${line}")
  file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/cuda.txt" "${line}\n")
endfunction()

# Sets hpccd_cuda_objects and hpccd_cuda_libraries, both empty where there is no CUDA.
function(hpccd_find_cuda)
  set(hpccd_cuda_objects "" PARENT_SCOPE)
  set(hpccd_cuda_libraries "" PARENT_SCOPE)
  string(TOUPPER "${HPCCD_CUDA}" wanted)
  if(wanted MATCHES "^(ON|YES|TRUE|Y|1)$")
    set(wanted ON)
  elseif(wanted MATCHES "^(OFF|NO|FALSE|N|0)$")
    set(wanted OFF)
  elseif(NOT wanted STREQUAL "AUTO")
    message(FATAL_ERROR "HPCCD_CUDA=${HPCCD_CUDA}: neither AUTO, ON nor OFF")
  endif()
  if(wanted STREQUAL "OFF")
    hpccd_report_cuda("CUDA: off, GPU backends are not compiled (HPCCD_CUDA=OFF)")
    return()
  endif()
  hpccd_has_gpu(has_gpu)
  if(wanted STREQUAL "AUTO" AND NOT has_gpu)
    hpccd_report_cuda("CUDA: no NVIDIA GPU found, GPU backends are not compiled; HPCCD_CUDA=ON compiles them")
    return()
  endif()

  # The nvidia-cuda-nvcc wheel puts the compiler beside the Python packages.
  hpccd_python_folders(wheels nvidia/cu13/bin)
  find_program(HPCCD_NVCC nvcc HINTS ENV CUDA_HOME PATH_SUFFIXES bin PATHS ${wheels} /usr/local/cuda/bin)
  set(problem "")
  if(NOT HPCCD_NVCC)
    set(problem "no nvcc on the PATH, in /usr/local/cuda/bin or from the nvidia-cuda-nvcc wheel")
  else()
    get_filename_component(nvcc_real "${HPCCD_NVCC}" REALPATH)
    get_filename_component(toolkit "${nvcc_real}/../.." ABSOLUTE)
    file(GLOB runtime "${toolkit}/lib64/libcudart_static.a" "${toolkit}/lib/libcudart_static.a"
      "${toolkit}/targets/*/lib/libcudart_static.a")
    if(NOT runtime)
      set(problem "nvcc is in ${toolkit}, but libcudart_static.a is not: install nvidia-cuda-runtime of the same version")
    else()
      list(GET runtime 0 runtime)
    endif()
  endif()

  set(flags -std=c++20 -O3 --fmad=false --expt-relaxed-constexpr -ccbin "${CMAKE_CXX_COMPILER}"
    -Xcompiler "-fPIC,-ffp-contract=off,-fvisibility=hidden")
  set(shown "")
  foreach(architecture IN LISTS HPCCD_CUDA_ARCHITECTURES)
    if(architecture MATCHES "^([0-9]+a?)-virtual$")
      list(APPEND flags -gencode "arch=compute_${CMAKE_MATCH_1},code=compute_${CMAKE_MATCH_1}")
      list(APPEND shown "PTX ${CMAKE_MATCH_1}")
    elseif(architecture MATCHES "^([0-9]+a?)$")
      list(APPEND flags -gencode "arch=compute_${architecture},code=sm_${architecture}")
      list(APPEND shown "sm_${architecture}")
    else()
      message(FATAL_ERROR "HPCCD_CUDA_ARCHITECTURES: '${architecture}' is not like 90 or 75-virtual")
    endif()
  endforeach()
  string(REPLACE ";" ", " shown "${shown}")

  if(NOT problem)
    # The whole way once: a compiler whose parts do not fit together fails here, not in the middle of the build.
    set(probe "${CMAKE_CURRENT_BINARY_DIR}/cuda_probe")
    file(WRITE "${probe}.cu" "#include <cub/device/device_radix_sort.cuh>\n__global__ void k() {}\nvoid f() { k<<<1, 1>>>(); }\n")
    execute_process(COMMAND "${HPCCD_NVCC}" ${flags} -c "${probe}.cu" -o "${probe}.o"
      RESULT_VARIABLE failed OUTPUT_VARIABLE said ERROR_VARIABLE said)
    if(failed)
      set(problem "${HPCCD_NVCC} does not compile a small program:\n${said}")
    endif()
  endif()
  if(problem)
    if(wanted STREQUAL "ON")
      message(FATAL_ERROR "CUDA: ${problem}")
    endif()
    hpccd_report_cuda("CUDA: GPU backends are not compiled (${problem})")
    return()
  endif()
  hpccd_report_cuda("CUDA: ${HPCCD_NVCC}, for ${shown}")

  foreach(source gpu/pipeline gpu/test_lists gpu/likely_stages gpu/separation_stages gpu/integer_stages gpu/snapshot_stages gpu/point_stages gpu/nearest_stages gpu/placed_search gpu/places_stages gpu/places_in_integers gpu/hints gpu/device gpu/results_to_device gpu/sort hybrid/cuda_device)
    string(REPLACE "/" "_" name "${source}")
    set(object "${CMAKE_CURRENT_BINARY_DIR}/${name}.o")
    add_custom_command(OUTPUT "${object}"
      COMMAND "${HPCCD_NVCC}" ${flags} "-DHPCCD_CUDA_ARCHITECTURES_TEXT=\"${shown}\""
        -I "${CMAKE_CURRENT_SOURCE_DIR}/src" -I "${CMAKE_CURRENT_SOURCE_DIR}/include"
        -MD -MF "${object}.d" -MT "${object}" -c "${CMAKE_CURRENT_SOURCE_DIR}/src/${source}.cu" -o "${object}"
      DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/src/${source}.cu" DEPFILE "${object}.d"
      COMMENT "Building CUDA object ${source}.cu" VERBATIM)
    list(APPEND objects "${object}")
  endforeach()
  set(hpccd_cuda_objects "${objects}" PARENT_SCOPE)
  set(hpccd_cuda_libraries "${runtime};${CMAKE_DL_LIBS};rt" PARENT_SCOPE)
  get_filename_component(folder "${runtime}" DIRECTORY)
  set(cuda_runtime_folder "${folder}" PARENT_SCOPE)
endfunction()
