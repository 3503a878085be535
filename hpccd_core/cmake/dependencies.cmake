# SPDX-License-Identifier: Apache-2.0
# Threads, and Boost.Multiprecision: headers only, from the cmeel-boost wheel or the system's libboost-dev. Neither is
# needed by those who use the library.
find_package(Threads REQUIRED)

if(HPCCD_PYTHON)
  find_package(Python3 REQUIRED COMPONENTS Interpreter Development.Module)
else()
  find_package(Python3 QUIET COMPONENTS Interpreter)
endif()

# hpccd_python_folders(variable subfolder): that subfolder of each folder on Python's own path, which also names the
# folders of pip's isolated build environment; none without Python.
function(hpccd_python_folders variable subfolder)
  set(found "")
  if(Python3_EXECUTABLE)
    execute_process(COMMAND ${Python3_EXECUTABLE} -c
      "import sys; print(';'.join(p + '/${subfolder}' for p in sys.path if p))"
      OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE)
  endif()
  set(${variable} "${found}" PARENT_SCOPE)
endfunction()

hpccd_python_folders(boost_hints cmeel.prefix/include)
find_path(BOOST_INCLUDE boost/multiprecision/cpp_int.hpp HINTS ${boost_hints} NO_CMAKE_FIND_ROOT_PATH)
if(NOT BOOST_INCLUDE)
  unset(_Python3_EXECUTABLE CACHE)  # so that the next look finds the Python of an environment activated meanwhile
  message(FATAL_ERROR "Boost headers not found: install libboost-dev, or pip install cmeel-boost into the Python "
    "environment that is active here")
endif()
