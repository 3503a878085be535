# SPDX-License-Identifier: Apache-2.0
"""Compile each source once, the GPU backends where there is a GPU, and again what includes a changed header."""

import json
import os
import re
import shutil
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from build_tools import run
from sources import ROOT

CORE = ROOT / "hpccd_core"
BUILD = Path(os.environ.get("HPCCD_BUILD_TREE", ROOT / "build" / "cmake"))

# Takes the options of nvcc, and has the compiler of the host list the headers. The rest of a list is CUDA's own.
NVCC = """#!/bin/sh
while [ $# -gt 0 ]; do
  case $1 in
    -MF) list=$2 ;;
    -MT | -o) object=$2 ;;
    -c) source=$2 ;;
    -I) folders="$folders -I $2" ;;
  esac
  shift
done
[ -z "$list" ] || g++ -std=c++20 -x c++ -MM -MG -MT "$object" $folders "$source" |
  sed 's/ [^/ ][^ ]*\\.c*[uh]h*\\>//g' >"$list"
touch "$object"
"""


def test_no_source_is_compiled_twice():
    """The package, its C++ tests and its C++ library come from one tree."""
    if not (BUILD / "build.ninja").is_file():
        pytest.skip(f"there is no build tree in {BUILD}: make venv")
    objects = defaultdict(set)
    for step in json.loads(run("ninja", "-C", BUILD, "-t", "compdb")):
        if step["output"].endswith(".o") and step["file"].endswith((".c", ".cc", ".cpp", ".cxx")):
            file = Path(step["directory"], step["file"]).resolve()
            together = re.findall(r'#include "(.*)"', file.read_text()) if "Unity" in file.parts else [str(file)]
            for source in together:
                objects[source].add(step["output"])
    for file in ("src/detector.cpp", "src/bindings.cpp", "tests/detector_test.cpp"):
        assert str(CORE / file) in objects
    assert {source: several for source, several in objects.items() if len(several) > 1} == {}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """The sources of the core, to be changed, and a CUDA toolkit whose compiler compiles nothing."""
    folder = tmp_path_factory.mktemp("copy")
    for part in ("src", "include", "cmake"):
        shutil.copytree(CORE / part, folder / "core" / part)
    shutil.copy(CORE / "CMakeLists.txt", folder / "core")
    for empty in ("cuda/bin", "cuda/lib64"):
        (folder / empty).mkdir(parents=True)
    (folder / "cuda" / "lib64" / "libcudart_static.a").touch()
    (folder / "cuda" / "bin" / "nvcc").write_text(NVCC)
    (folder / "cuda" / "bin" / "nvcc").chmod(0o755)
    return folder


def configure(copy: Path, *options: str) -> str:
    nvcc = f"-DHPCCD_NVCC={copy / 'cuda' / 'bin' / 'nvcc'}"
    python = f"-DPython3_EXECUTABLE={sys.executable}"
    return run("cmake", "-G", "Ninja", "-S", copy / "core", "-B", copy / "build", nvcc, python, *options)


def includers(core: Path, header: Path) -> set[str]:
    """The CUDA sources that include this header, also through others."""

    def included(file: Path, seen: set[Path]) -> set[Path]:
        for name in re.findall(r'#\s*include ["<]([^">]+)[">]', file.read_text()):
            for folder in (file.parent, core / "src", core / "include"):
                found = (folder / name).resolve()
                if found.is_file() and found not in seen:
                    seen.add(found)
                    included(found, seen)
        return seen

    sources = {f"{file.parent.name}/{file.name}": file for file in (core / "src").glob("*/*.cu")}
    return {name for name, file in sources.items() if header.resolve() in included(file, set())}


def test_a_changed_header_compiles_all_gpu_sources_that_include_it(copy):
    configure(copy, "-DHPCCD_CUDA=ON")
    run("ninja", "-C", copy / "build", "hpccd_cuda")
    assert "no work to do" in run("ninja", "-C", copy / "build", "hpccd_cuda")
    header = copy / "core" / "src" / "elementary" / "exact" / "isolate.h"
    expected = includers(copy / "core", header)
    header.touch()
    listed = run("ninja", "-C", copy / "build", "-n", "hpccd_cuda")
    assert set(re.findall(r"CUDA object (\S+)", listed)) == expected
    assert "gpu/integer_stages.cu" in expected and "gpu/sort.cu" not in expected


def test_the_gpu_backends_are_compiled_where_there_is_a_gpu_or_on_demand(copy):
    assert re.search(r"CUDA: \S+/cuda/bin/nvcc, for sm_90", configure(copy, "-DHPCCD_CUDA=ON"))
    for off in ("OFF", "off", "0"):
        assert "GPU backends are not compiled (HPCCD_CUDA=OFF)" in configure(copy, f"-DHPCCD_CUDA={off}")
    printed = configure(copy, "-DHPCCD_CUDA=AUTO", "-DHPCCD_NVIDIA_SMI=/bin/false")
    if any(Path("/dev", file).exists() for file in ("nvidiactl", "nvidia0", "nvhost-gpu", "nvgpu")):
        assert "nvcc, for sm_90" in printed
    else:
        assert "no NVIDIA GPU found, GPU backends are not compiled; HPCCD_CUDA=ON compiles them" in printed
        (copy / "nvidia-smi").write_text("#!/bin/sh\necho 'GPU 0: a name'\n")
        (copy / "nvidia-smi").chmod(0o755)
        assert "nvcc, for sm_90" in configure(copy, "-DHPCCD_CUDA=AUTO", f"-DHPCCD_NVIDIA_SMI={copy / 'nvidia-smi'}")
