# SPDX-License-Identifier: Apache-2.0
enable_testing()
find_package(GTest REQUIRED)
# -O1: the code of tests takes longer to compile than to run. The library that they test keeps its own options.
file(GLOB_RECURSE test_sources CONFIGURE_DEPENDS tests/*.cpp)
list(FILTER test_sources EXCLUDE REGEX "/golden_hashes_test\\.cpp$")
add_library(hpccd_core_golden_hashes OBJECT EXCLUDE_FROM_ALL tests/golden_hashes_test.cpp)
target_link_libraries(hpccd_core_golden_hashes PUBLIC hpccd_core_static GTest::gtest_main)
target_compile_options(hpccd_core_golden_hashes PRIVATE -ffp-contract=off -O1)
target_include_directories(hpccd_core_golden_hashes PRIVATE tests src)

add_executable(hpccd_core_tests ${test_sources} $<TARGET_OBJECTS:hpccd_core_golden_hashes>)
target_link_libraries(hpccd_core_tests PRIVATE hpccd_core_static GTest::gtest_main)
target_compile_options(hpccd_core_tests PRIVATE -ffp-contract=off -O1)
target_include_directories(hpccd_core_tests PRIVATE tests src)
target_include_directories(hpccd_core_tests SYSTEM PRIVATE ${BOOST_INCLUDE})
target_precompile_headers(hpccd_core_tests PRIVATE <gtest/gtest.h> <algorithm> <cmath> <cstdint> <functional> <limits>
  <map> <memory> <optional> <random> <string> <thread> <vector>)
include(GoogleTest)
gtest_discover_tests(hpccd_core_tests)

# The golden hashes alone, for where compiling all tests takes too long.
add_executable(hpccd_core_golden_tests EXCLUDE_FROM_ALL $<TARGET_OBJECTS:hpccd_core_golden_hashes>)
target_link_libraries(hpccd_core_golden_tests PRIVATE hpccd_core_static GTest::gtest_main)

if(HPCCD_PIP)
  set_target_properties(hpccd_core_tests PROPERTIES EXCLUDE_FROM_ALL ON)
endif()
