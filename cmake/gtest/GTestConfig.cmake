# SPDX-License-Identifier: Apache-2.0
# find_package(GTest) with -DGTest_DIR=<this folder>: builds GoogleTest from HPCCD_GTEST_SOURCE, the source folder
# that the wheel ros-gtest-vendor installs as <prefix>/src/gtest_vendor.
if(NOT EXISTS "${HPCCD_GTEST_SOURCE}/src/gtest-all.cc")
  message(FATAL_ERROR "HPCCD_GTEST_SOURCE='${HPCCD_GTEST_SOURCE}' holds no GoogleTest sources. "
    "Remedy: pip install ros-gtest-vendor==1.14.9000")
endif()
if(NOT TARGET GTest::gtest)
  find_package(Threads REQUIRED)
  add_library(gtest STATIC EXCLUDE_FROM_ALL "${HPCCD_GTEST_SOURCE}/src/gtest-all.cc")
  target_include_directories(gtest SYSTEM PUBLIC "${HPCCD_GTEST_SOURCE}/include" PRIVATE "${HPCCD_GTEST_SOURCE}")
  target_compile_options(gtest PRIVATE -O1)
  target_link_libraries(gtest PUBLIC Threads::Threads)
  add_library(gtest_main STATIC EXCLUDE_FROM_ALL "${HPCCD_GTEST_SOURCE}/src/gtest_main.cc")
  target_link_libraries(gtest_main PUBLIC gtest)
  add_library(GTest::gtest ALIAS gtest)
  add_library(GTest::gtest_main ALIAS gtest_main)
endif()
set(GTest_FOUND TRUE)
