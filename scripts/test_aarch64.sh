#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# test_aarch64.sh VENV FILTER: compiles the C++ tests of the core for aarch64 and runs them in an emulator. FILTER: a
# GoogleTest filter; for golden hashes only, nothing else is compiled.
# test_aarch64.sh --check: checks whether this machine has compiler and emulator.
set -euo pipefail
cd "$(dirname "$0")/.."

missing=()
command -v aarch64-linux-gnu-g++ >/dev/null || missing+=(g++-aarch64-linux-gnu)
command -v qemu-aarch64 >/dev/null || command -v qemu-aarch64-static >/dev/null || missing+=(qemu-user)
if [ ${#missing[@]} -gt 0 ]; then
  echo "hpccd: tests for aarch64 need what is missing here: ${missing[*]}" >&2
  echo "Remedy on Debian or Ubuntu: sudo apt install ${missing[*]}" >&2
  exit 1
fi
[ "$1" != --check ] || exit 0

venv=$(cd "$1" && pwd) filter=$2
case $filter in
  GoldenHashes.*) tests=hpccd_core_golden_tests ;;
  *) tests=hpccd_core_tests ;;
esac

build=build/core-aarch64
mkdir -p build
# shellcheck source=/dev/null
. "$venv/build.env"
cmake -S hpccd_core -B $build -G Ninja --toolchain "$PWD/cmake/toolchains/aarch64-linux-gnu.cmake" \
  -DCMAKE_BUILD_TYPE=Release -DHPCCD_BUILD_TESTS=ON -DHPCCD_CUDA=OFF -DGTest_DIR="$PWD/cmake/gtest" \
  -DHPCCD_GTEST_SOURCE="$venv/src/gtest_vendor" -DPython3_EXECUTABLE="$venv/bin/python" \
  >$build.log 2>&1 || { cat $build.log; exit 1; }
cmake --build $build --target $tests
emulator=$(command -v qemu-aarch64 || command -v qemu-aarch64-static)
# The emulator runs for minutes, on one core each.
export GTEST_TOTAL_SHARDS=${JOBS:-$(nproc)}
shards=() failed=0
for ((GTEST_SHARD_INDEX = 0; GTEST_SHARD_INDEX < GTEST_TOTAL_SHARDS; ++GTEST_SHARD_INDEX)); do
  export GTEST_SHARD_INDEX
  "$emulator" -L /usr/aarch64-linux-gnu $build/$tests --gtest_filter="$filter" --gtest_brief=1 &
  shards+=($!)
done
for shard in "${shards[@]}"; do wait "$shard" || failed=1; done
exit $failed
