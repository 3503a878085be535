# SPDX-License-Identifier: Apache-2.0
# For ROS 2 installed as Python wheels only; pass it as -DCMAKE_PROJECT_INCLUDE.
# HPCCD_ROS_PREFIX: the environment with the wheels, also for a later run of CMake by Ninja; by default from
# AMENT_PREFIX_PATH and CMAKE_PREFIX_PATH.
if(HPCCD_ROS_PREFIX)
  set(ENV{AMENT_PREFIX_PATH} "${HPCCD_ROS_PREFIX}")
  set(ENV{CMAKE_PREFIX_PATH} "${HPCCD_ROS_PREFIX}")
endif()

# The exported targets in those wheels list the include folder of the Python that built them, and CMake stops
# at an imported target whose include folder is missing. Such folders are dropped after the last line of the
# top CMakeLists.txt has run, when every imported target is known.
function(_hpccd_drop_missing_include_folders)
  get_property(targets DIRECTORY PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
    if(NOT folders)
      continue()
    endif()
    set(present "")
    foreach(folder IN LISTS folders)
      if(NOT IS_ABSOLUTE "${folder}" OR EXISTS "${folder}")
        list(APPEND present "${folder}")
      endif()
    endforeach()
    if(NOT present STREQUAL folders)
      set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${present}")
    endif()
  endforeach()
endfunction()

# With the environment inside the source folder (.venv), CMake refuses to export a target whose include folder lies
# in there. The exported target of a wheel is not used for compiling: keep such folders for this build only.
function(_hpccd_keep_own_environment_to_this_build)
  set(target ${PROJECT_NAME}__rosidl_generator_py)
  if(NOT TARGET ${target})
    return()  # another package of a workspace, without messages of its own
  endif()
  get_target_property(folders ${target} INTERFACE_INCLUDE_DIRECTORIES)
  list(TRANSFORM folders REPLACE "^(${CMAKE_SOURCE_DIR}/.*)$" "$<BUILD_INTERFACE:\\1>")
  set_target_properties(${target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "${folders}")
endfunction()

cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL _hpccd_drop_missing_include_folders)
cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL _hpccd_keep_own_environment_to_this_build)
