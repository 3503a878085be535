# SPDX-License-Identifier: Apache-2.0
# The Python package hpccd_core, alike in the ROS package and in the wheel of its own: two extension modules and the
# sources beside them. They go to HPCCD_PYTHON_DIR/hpccd_core.
execute_process(COMMAND ${Python3_EXECUTABLE} -m pybind11 --cmakedir
  OUTPUT_VARIABLE pybind11_dir OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(pybind11_dir)
  list(APPEND CMAKE_PREFIX_PATH "${pybind11_dir}")
endif()
set(PYBIND11_FINDPYTHON ON)
find_package(pybind11 CONFIG REQUIRED)
pybind11_add_module(_core src/bindings.cpp src/bindings_device.cpp src/bindings_rigid.cpp)
target_include_directories(_core PRIVATE src)
target_compile_options(_core PRIVATE -ffp-contract=off -Wall -Wextra)
target_link_libraries(_core PRIVATE hpccd_core_static)

# The oracles: slow and independent of the core's arithmetic, for tests and fuzzing.
file(GLOB reference_sources CONFIGURE_DEPENDS reference/*.cpp)
pybind11_add_module(_reference ${reference_sources})
target_include_directories(_reference SYSTEM PRIVATE ${BOOST_INCLUDE})
target_compile_options(_reference PRIVATE -ffp-contract=off)
target_link_libraries(_reference PRIVATE Threads::Threads)

# Where a toolchain links the C++ library into the module, its symbols stay inside: shared with a module that is loaded
# later and has its own (cupy, torch), they crash it.
if(CMAKE_SYSTEM_NAME STREQUAL "Linux")
  foreach(module _core _reference)
    target_link_options(${module} PRIVATE LINKER:--exclude-libs,ALL)
  endforeach()
endif()

if(DEFINED HPCCD_PYTHON_DIR)
  install(TARGETS _core _reference DESTINATION "${HPCCD_PYTHON_DIR}/hpccd_core" COMPONENT python)
  install(DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}/" DESTINATION "${HPCCD_PYTHON_DIR}/hpccd_core" COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed"
    PATTERN "__pycache__" EXCLUDE PATTERN "include" EXCLUDE PATTERN "src" EXCLUDE PATTERN "tests" EXCLUDE
    PATTERN "cmake" EXCLUDE PATTERN "bench" EXCLUDE)
endif()
