# SPDX-License-Identifier: Apache-2.0
enable_testing()
find_package(GTest REQUIRED)
file(GLOB_RECURSE test_sources CONFIGURE_DEPENDS tests/*.cpp)
add_executable(hpccd_core_tests ${test_sources})
target_link_libraries(hpccd_core_tests PRIVATE hpccd_core_static GTest::gtest_main)
target_compile_options(hpccd_core_tests PRIVATE -ffp-contract=off)
target_include_directories(hpccd_core_tests PRIVATE tests src)
target_include_directories(hpccd_core_tests SYSTEM PRIVATE ${BOOST_INCLUDE})
include(GoogleTest)
gtest_discover_tests(hpccd_core_tests)

# The golden hashes alone, for where compiling all tests takes too long.
add_executable(hpccd_core_golden_tests EXCLUDE_FROM_ALL tests/golden_hashes_test.cpp)
target_link_libraries(hpccd_core_golden_tests PRIVATE hpccd_core_static GTest::gtest_main)
target_compile_options(hpccd_core_golden_tests PRIVATE -ffp-contract=off)
target_include_directories(hpccd_core_golden_tests PRIVATE tests src)
