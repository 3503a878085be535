#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# colcon_check.sh FOLDER: builds and tests the last commit with colcon, on the ROS wheels, in a clean workspace. FOLDER
# must be outside the checkout and is replaced. Takes 25 minutes on two cores.
# Environment: PYTHON selects 3.11 or 3.12; COLCON_TEST=no builds only.
set -euo pipefail

here=$(cd "$(dirname "$0")/.." && pwd)
[ $# = 1 ] || { sed -n '3,5s/^# //p' "$0" >&2; exit 2; }
case $(realpath -m "$1") in
  "$here" | "$here"/*) echo "colcon_check: $1 lies inside the checkout; name a folder outside of it" >&2; exit 2 ;;
esac
if [ -e "$1" ] && [ ! -f "$1/.colcon-check" ]; then
  echo "colcon_check: $1 exists, and was not made by this script; name another folder" >&2
  exit 2
fi
rm -rf "$1"
mkdir -p "$1/src"
workspace=$(cd "$1" && pwd)
touch "$workspace/.colcon-check"

# Nothing of another ROS or of the checkout's own environment.
unset PYTHONPATH PYTHONHOME AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH ROS_DISTRO
git clone --quiet "$here" "$workspace/src/hpccd"
# colcon does not look for packages inside another package.
cp -r "$workspace/src/hpccd/examples/cpp" "$workspace/src/falling_sheet"
# In a workspace the package is named hpccd; the targets that ROS exports with it also need C.
sed -i "s/find_package(hpccd_core [0-9.]* REQUIRED).*/find_package(hpccd REQUIRED)/; s/LANGUAGES CXX/LANGUAGES C CXX/" \
  "$workspace/src/falling_sheet/CMakeLists.txt"
venv=$workspace/venv
bash "$workspace/src/hpccd/scripts/create_venv.sh" "$venv" test
touch "$venv/COLCON_IGNORE"
"$venv/bin/python" -m pip install --quiet colcon-common-extensions
# shellcheck source=/dev/null
. "$venv/build.env"

cd "$workspace"
export PATH=$venv/bin:$PATH AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
colcon build --event-handlers console_cohesion+ --cmake-args \
  "-DCMAKE_PROJECT_INCLUDE=$workspace/src/hpccd/cmake/pypi_ros.cmake" \
  "-DPython3_EXECUTABLE=$venv/bin/python" "-DPython_EXECUTABLE=$venv/bin/python" \
  "-DGTest_DIR=$workspace/src/hpccd/cmake/gtest" "-DHPCCD_GTEST_SOURCE=$venv/src/gtest_vendor" \
  ${CMAKE_ARGS:-} >build.log 2>&1 || { tail -50 build.log; exit 1; }
echo "colcon_check: built, with $(grep -c 'warning:' build.log || true) warnings of the compiler ($workspace/build.log)"

set +u
# shellcheck source=/dev/null
. install/setup.bash
set -u
sheet=$(install/falling_sheet/lib/falling_sheet/falling_sheet)
sed -n 1,4p <<<"$sheet"
[ "${COLCON_TEST:-yes}" != no ] || exit 0
colcon test --packages-select hpccd --return-code-on-test-failure || failed=$?
colcon test-result --all
exit "${failed:-0}"
