#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# create_venv.sh FOLDER EXTRA...: creates a virtual environment for building, running and testing.
# Environment: PYTHON selects the Python; by default that of FOLDER if it exists, else the first suitable one.
set -euo pipefail

venv=$1
shift
here=$(cd "$(dirname "$0")/.." && pwd)

fail() {
  printf 'hpccd: %s\n' "$@" >&2
  exit 1
}

version_of() { "$1" -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null || true; }

suitable() { case "$(version_of "$1")" in 3.11 | 3.12) true ;; *) false ;; esac; }

# The ROS 2 Jazzy wheels exist for these two Python versions.
find_python() {
  local name
  for name in python3 python3.12 python3.11; do
    if suitable "$name"; then
      command -v "$name"
      return
    fi
  done
  fail "no Python 3.11 or 3.12 found." \
    "Remedy on Debian 12 or Ubuntu 24.04: sudo apt install python3 python3-venv" \
    "or name one: make venv PYTHON=/path/to/python3.12"
}

include_folder() { "$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))'; }

has_headers() { [ -f "$(include_folder)/Python.h" ]; }

fetch_headers() {
  local folder=$1 version package
  version=$(version_of "$venv/bin/python")
  package=libpython$version-dev
  local include=$folder/usr/include
  if [ ! -f "$include/python$version/Python.h" ]; then
    echo "hpccd: Python.h is not installed; unpacking the package $package in $folder"
    mkdir -p "$folder"
    (cd "$folder" && apt-get download --quiet=2 "$package" && dpkg-deb --extract "$package"_*.deb .) || fail \
      "Python.h is missing ($(include_folder)), and $package could not be downloaded." \
      "Remedy on Debian and Ubuntu: sudo apt install python$version-dev"
  fi
  include=$(cd "$include" && pwd)
  cat >"$venv/build.env" <<EOF
export CPATH="$include\${CPATH:+:\$CPATH}"
export CMAKE_ARGS="-DPython3_INCLUDE_DIR=$include/python$version -DPython_INCLUDE_DIR=$include/python$version \${CMAKE_ARGS:-}"
EOF
}

python=${PYTHON:-}
if [ -n "$python" ] && ! suitable "$python"; then
  found=$(version_of "$python")
  fail "PYTHON=$python is ${found:+Python }${found:-no Python}; 3.11 or 3.12 is needed (the ROS 2 Jazzy wheels exist for these)."
fi
command -v g++ >/dev/null || fail "g++ not found. Remedy: sudo apt install g++"

if suitable "$venv/bin/python" && "$venv/bin/python" -m pip --version >/dev/null 2>&1 &&
  { [ -z "$python" ] || [ "$(version_of "$python")" = "$(version_of "$venv/bin/python")" ]; }; then
  echo "hpccd: bringing $venv up to date"
else
  [ -n "$python" ] || python=$(find_python)
  "$python" -c 'from ensurepip import bootstrap; import venv' 2>/dev/null || fail \
    "$python cannot create virtual environments (module ensurepip is missing)." \
    "Remedy on Debian and Ubuntu: sudo apt install python$(version_of "$python")-venv"
  echo "hpccd: creating $venv with Python $(version_of "$python"); the package index is needed, 1 GB of disk, and one to three minutes"
  "$python" -m venv --clear "$venv"
fi

# Debian and Ubuntu have Python.h in a separate package; without root it can be unpacked here.
# build.env is read by the Makefile before anything is compiled.
: >"$venv/build.env"
if ! has_headers; then
  fetch_headers "$venv/python-headers"
fi

PIP_CONSTRAINT=$here/requirements/constraints-$(version_of "$venv/bin/python").txt
export PIP_CONSTRAINT
"$venv/bin/python" "$here/scripts/requirements.py" "$@" >"$venv/requirements.txt"
"$venv/bin/python" -m pip install --quiet --requirement "$venv/requirements.txt" || fail \
  "installing the requirements failed (see above)." \
  "They come from the Python package index: is there a network, or a mirror (PIP_INDEX_URL)?"
