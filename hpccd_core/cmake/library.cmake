# SPDX-License-Identifier: Apache-2.0
# The library: compiled once, put together as an archive and as a shared library.
# The sources of a folder are compiled together in the cold part, where headers cost more than the code itself. The hot
# part would lose speed: published methods 9 to 16 percent, normals of proximity 6 (the compiler inlines less in a source
# that grows).
set(hot ${hpccd_sources})
list(FILTER hot INCLUDE REGEX "^src/((backends|bvh|paper|traverse)/|contacts/places)")
set(cold ${hpccd_sources})
list(REMOVE_ITEM cold ${hot})
add_library(hpccd_core_hot OBJECT ${hot})
set_target_properties(hpccd_core_hot PROPERTIES UNITY_BUILD OFF)  # whatever CMAKE_UNITY_BUILD of a parent project says
add_library(hpccd_core_cold OBJECT ${cold})
hpccd_compile_all_kernels(hpccd_core_hot)
# Precompiled, the standard headers save up to half of the time of a source; its object stays the same, byte by byte.
target_precompile_headers(hpccd_core_hot PRIVATE <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <cstring>
  <functional> <limits> <map> <memory> <mutex> <optional> <span> <stdexcept> <string> <thread> <utility> <vector>)
foreach(part hpccd_core_hot hpccd_core_cold)
  target_include_directories(${part} PRIVATE include src)
  target_include_directories(${part} SYSTEM PRIVATE ${BOOST_INCLUDE})
  target_link_libraries(${part} PRIVATE Threads::Threads)
  # Contraction of a*b+c would give different bits on machines with and without it. No code reads errno after sqrt.
  target_compile_options(${part} PRIVATE -ffp-contract=off -Wall -Wextra -fno-math-errno)
  set_target_properties(${part} PROPERTIES
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON POSITION_INDEPENDENT_CODE ON)
endforeach()
target_link_libraries(hpccd_core_cold PRIVATE hpccd_core_hot)  # for its definitions alone
set_target_properties(hpccd_core_cold PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
foreach(source IN LISTS cold)
  get_filename_component(folder "${source}" DIRECTORY)
  set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${folder}")
endforeach()

hpccd_find_cuda()
if(hpccd_cuda_objects)
  set_source_files_properties(${hpccd_cuda_objects} PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
  # One target makes them, so that two that link them do not make them at the same time.
  add_custom_target(hpccd_cuda DEPENDS ${hpccd_cuda_objects})
else()
  target_sources(hpccd_core_cold PRIVATE src/gpu/unavailable.cpp src/hybrid/unavailable.cpp)
endif()

# hpccd_add_library(target kind)
function(hpccd_add_library target kind)
  add_library(${target} ${kind} $<TARGET_OBJECTS:hpccd_core_hot> $<TARGET_OBJECTS:hpccd_core_cold>
    ${hpccd_cuda_objects})
  if(hpccd_cuda_objects)
    add_dependencies(${target} hpccd_cuda)
  endif()
  set_target_properties(${target} PROPERTIES OUTPUT_NAME hpccd_core LINKER_LANGUAGE CXX)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
endfunction()

hpccd_add_library(hpccd_core_static STATIC)
set_target_properties(hpccd_core_static PROPERTIES EXPORT_NAME core_static)
# Consumers of an installed archive find the CUDA run-time library again: it lies elsewhere on their machine.
target_link_libraries(hpccd_core_static PUBLIC Threads::Threads)
foreach(library IN LISTS hpccd_cuda_libraries)
  target_link_libraries(hpccd_core_static PUBLIC "$<BUILD_INTERFACE:${library}>")
endforeach()

if(NOT HPCCD_INSTALL_CPP)
  add_library(hpccd::core ALIAS hpccd_core_static)  # for a project that has this one as a subfolder
  return()
endif()
hpccd_add_library(hpccd_core_shared SHARED)
if(HPCCD_PIP)
  set_target_properties(hpccd_core_shared PROPERTIES EXCLUDE_FROM_ALL ON)
endif()
add_library(hpccd::core ALIAS hpccd_core_shared)
# Before 1.0 a minor version may change the binary interface.
set(soversion ${PROJECT_VERSION_MAJOR})
if(PROJECT_VERSION_MAJOR EQUAL 0)
  set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
endif()
set_target_properties(hpccd_core_shared PROPERTIES
  EXPORT_NAME core_shared VERSION ${PROJECT_VERSION} SOVERSION ${soversion})
target_link_libraries(hpccd_core_shared PRIVATE Threads::Threads ${hpccd_cuda_libraries})
# Compiled hidden, the standard library's templates and CUDA's run time would still be shown.
set(script "${CMAKE_CURRENT_BINARY_DIR}/exported_names.map")
configure_file(cmake/exported_names.map.in "${script}" @ONLY)
target_link_options(hpccd_core_shared PRIVATE "LINKER:--version-script=${script}")
if(NOT HPCCD_SANITIZE)  # whose run time is the program's
  target_link_options(hpccd_core_shared PRIVATE LINKER:--no-undefined)
endif()
set_target_properties(hpccd_core_shared PROPERTIES LINK_DEPENDS "${script}")
