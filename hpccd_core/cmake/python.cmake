# SPDX-License-Identifier: Apache-2.0
# The Python package hpccd_core, alike in the ROS package and in the wheel of its own: the extension module and
# the sources beside it. They go to HPCCD_PYTHON_DIR/hpccd_core.
execute_process(COMMAND ${Python3_EXECUTABLE} -m pybind11 --cmakedir
  OUTPUT_VARIABLE pybind11_dir OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(pybind11_dir)
  list(APPEND CMAKE_PREFIX_PATH "${pybind11_dir}")
endif()
set(PYBIND11_FINDPYTHON ON)
find_package(pybind11 CONFIG REQUIRED)
pybind11_add_module(_core src/bindings.cpp src/bindings_device.cpp src/bindings_rigid.cpp
  src/bindings_detail.cpp)
set_target_properties(_core PROPERTIES UNITY_BUILD ON)
target_include_directories(_core PRIVATE src)
target_compile_options(_core PRIVATE -ffp-contract=off -Wall -Wextra $<$<CONFIG:Release>:-O2>)
target_link_libraries(_core PRIVATE hpccd_core_static)

# Where a toolchain links the C++ library into the module, its symbols stay inside: shared with a module that is loaded
# later and has its own (cupy, torch), they crash it.
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
  target_link_options(_core PRIVATE LINKER:--exclude-libs,ALL)
endif()

if(DEFINED HPCCD_PYTHON_DIR)
  install(TARGETS _core DESTINATION "${HPCCD_PYTHON_DIR}/hpccd_core" COMPONENT python)
  install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/" DESTINATION "${HPCCD_PYTHON_DIR}/hpccd_core" COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed" PATTERN "assets/*"
    PATTERN "__pycache__" EXCLUDE PATTERN "include" EXCLUDE PATTERN "src" EXCLUDE PATTERN "tests" EXCLUDE
    PATTERN "cmake" EXCLUDE)
endif()
