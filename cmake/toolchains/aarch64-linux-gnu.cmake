# SPDX-License-Identifier: Apache-2.0
# Compiles for aarch64 with Debian's cross compiler (g++-aarch64-linux-gnu); programs run in an emulator (qemu-user).
# Python is that of this machine: it only provides the path to the Boost headers.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
find_program(hpccd_qemu NAMES qemu-aarch64 qemu-aarch64-static)
if(hpccd_qemu)
  set(CMAKE_CROSSCOMPILING_EMULATOR "${hpccd_qemu};-L;/usr/aarch64-linux-gnu")
endif()
