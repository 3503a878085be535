# SPDX-License-Identifier: Apache-2.0
"""The C++ package, installed into an empty folder, serves a program of somebody else."""

import fcntl
import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from build_tools import run
from sources import ROOT

import hpccd_core as hc

VERSION = hc.__version__
# The tree in which `make venv` and `make test-core` compile.
BUILD = Path(os.environ.get("HPCCD_BUILD_TREE", ROOT / "build" / "cmake"))


@pytest.fixture(scope="session")
def prefix(tmp_path_factory):
    if not (BUILD / "build.ninja").is_file():
        pytest.skip(f"there is no build tree in {BUILD}: make venv")
    folder = tmp_path_factory.mktemp("prefix")
    with (BUILD / "packaging.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # workers of pytest-xdist come here at once, and Ninja has no lock of its own
        run("cmake", "--build", BUILD, "--target", "hpccd_core_shared", "hpccd_core_static")
        for component in ("runtime", "development"):
            run("cmake", "--install", BUILD / "hpccd_core", "--prefix", folder, "--component", component)
    return folder


def configure(source: Path, build: Path, prefix: Path, *options: str) -> None:
    run("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={prefix}", "-DCMAKE_BUILD_TYPE=Release", *options)


@pytest.fixture(scope="session")
def results(prefix, tmp_path_factory):
    """The output of the example, with the shared and with the static library."""
    printed = {}
    for kind, option in (("shared", "ON"), ("static", "OFF")):
        build = tmp_path_factory.mktemp(kind)
        configure(ROOT / "examples" / "cpp", build, prefix, f"-DBUILD_SHARED_LIBS={option}")
        run("cmake", "--build", build)
        linked = run("readelf", "-d", build / "falling_sheet")
        assert ("libhpccd_core.so" in linked) == (kind == "shared")
        printed[kind] = run(build / "falling_sheet")
    return printed


def test_the_example_runs_with_either_library(results):
    assert results["shared"] == results["static"]
    assert results["shared"].startswith(f"hpccd {VERSION}\n")


def test_the_example_prints_the_contacts(results):
    """Those of the same scene in Python."""
    n = 8
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    cloth = np.stack([2.0 * i / n - 1, 2.0 * j / n - 1, np.full(i.shape, 0.95)], axis=-1).reshape(-1, 3)
    a = (i * (n + 1) + j)[:n, :n].ravel()
    faces = np.stack([a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2], axis=-1).reshape(-1, 3)
    pyramid = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0], [0.03, 0.02, 0.5]])
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    scene.add_mesh("pyramid", np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]), static=True)
    detector = hc.Detector(scene)
    expected = []
    for _ in range(5):
        fallen = cloth - [0, 0, 0.2]
        contacts = detector.detect(np.vstack([cloth, pyramid]), np.vstack([fallen, pyramid]))
        expected += [(*map(int, row), f"{t:.4f}") for row, t in zip(contacts.vf, contacts.vf_toc, strict=True)]
        expected += [(*map(int, row), f"{t:.4f}") for row, t in zip(contacts.ee, contacts.ee_toc, strict=True)]
        cloth = fallen
    found = []
    for line in results["shared"].splitlines():
        if match := re.match(r"  vertex (\d+), face (\d+) at t = ([\d.]+)", line):
            found.append((int(match[1]), int(match[2]), match[3]))
        elif match := re.match(r"  edge (\d+)-(\d+), edge (\d+)-(\d+) at t = ([\d.]+)", line):
            found.append((*map(int, match.groups()[:4]), match[5]))
    assert len(expected) > 20
    assert found == expected


def test_only_the_public_names_are_shown(prefix):
    shown = run("nm", "-D", "-C", "--defined-only", prefix / "lib" / "libhpccd_core.so").splitlines()
    names = [line.split(maxsplit=2)[2].split("@@")[0] for line in shown]
    namespace = "v" + "_".join(VERSION.split(".")[:2])
    public = re.compile(rf"((vtable|typeinfo|typeinfo name) for )?hpccd::{namespace}::(\w+)")
    headers = "\n".join(file.read_text() for file in sorted((prefix / "include" / "hpccd").glob("*.h")))
    for name in names:
        if name.startswith("HPCCD_CORE_"):
            continue
        match = public.match(name)
        assert match, f"{name} is shown"
        assert re.search(rf"HPCCD_API [^;{{]*\b{match[3]}\b", headers), f"{name} is shown, but not marked in a header"
    assert len(names) > 40


def test_one_soname_for_one_binary_interface(prefix):
    library = prefix / "lib" / "libhpccd_core.so"
    dynamic = run("readelf", "-d", library)
    assert f"[libhpccd_core.so.{'.'.join(VERSION.split('.')[:2])}]" in dynamic
    needed = set(re.findall(r"NEEDED.*\[(\w+)", dynamic))
    assert needed <= {"libstdc", "libm", "libgcc_s", "libc", "ld"}
    assert library.resolve().name == f"libhpccd_core.so.{VERSION}"


def project(folder: Path, text: str) -> Path:
    folder.mkdir()
    (folder / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.22)\nproject(user LANGUAGES CXX)\n{text}")
    return folder


def rejected(tmp_path: Path, text: str, where: Path, says: str) -> None:
    """A project that cannot be configured with what was installed, or built, at `where`."""
    with pytest.raises(AssertionError, match=says):
        configure(project(tmp_path / "rejected", text), tmp_path / "build_of_rejected", where)


def test_versions_that_fit(prefix, tmp_path):
    major, minor = map(int, VERSION.split(".")[:2])
    fits = project(tmp_path / "fits", f"find_package(hpccd_core {major}.{minor} REQUIRED)")
    configure(fits, tmp_path / "a", prefix)
    later = f"find_package(hpccd_core {major}.{minor + 1} REQUIRED)"
    rejected(tmp_path, later, prefix, says="requested\\s+version")


def test_a_component_that_is_not_there(prefix, tmp_path):
    wrong = "find_package(hpccd_core REQUIRED COMPONENTS gpu)"
    rejected(tmp_path, wrong, prefix, says="components static and shared, not\\s+'gpu'")


def test_an_optional_component_that_is_not_there(prefix, tmp_path):
    user = project(
        tmp_path / "user",
        "find_package(hpccd_core REQUIRED OPTIONAL_COMPONENTS gpu)\n"
        "if(hpccd_core_gpu_FOUND)\nmessage(FATAL_ERROR gpu)\nendif()",
    )
    configure(user, tmp_path / "build", prefix)


@pytest.mark.usefixtures("prefix")  # the library is built
def test_what_is_only_built_is_no_package(tmp_path):
    user = "find_package(hpccd_core REQUIRED)"
    rejected(tmp_path, user, BUILD, says="Could not find a package configuration file")


def test_a_program_that_links_both(prefix, tmp_path):
    """In a folder of its own each asks for another one, which nobody would notice."""
    user = project(
        tmp_path / "user",
        "add_subdirectory(a)\nadd_subdirectory(b)\nadd_executable(user user.cpp)\ntarget_link_libraries(user a b)",
    )
    (user / "user.cpp").write_text("int main() {}\n")
    for name, component in (("a", "shared"), ("b", "static")):
        (user / name).mkdir()
        (user / name / "CMakeLists.txt").write_text(
            f"find_package(hpccd_core REQUIRED COMPONENTS {component})\nadd_library({name} INTERFACE)\n"
            f"target_link_libraries({name} INTERFACE hpccd::core_{component})\n"
        )
    with pytest.raises(AssertionError, match="HPCCD_CORE_LIBRARY"):
        configure(user, tmp_path / "build", prefix)


def test_a_subfolder_of_another_project(tmp_path):
    """Configured only: it compiles the same files with the same flags."""
    user = project(
        tmp_path / "user",
        f'add_subdirectory("{ROOT / "hpccd_core"}" core)\n'
        "get_target_property(kind hpccd::core TYPE)\nget_target_property(name hpccd::core ALIASED_TARGET)\n"
        'message(STATUS "it is ${kind} ${name}")\ninstall(CODE "message(STATUS nothing)")\n',
    )
    options = ["-DHPCCD_CUDA=OFF", f"-DPython3_EXECUTABLE={sys.executable}", "-DCMAKE_BUILD_TYPE=Release"]
    assert "it is STATIC_LIBRARY hpccd_core_static" in run("cmake", "-S", user, "-B", tmp_path / "build", *options)


@pytest.mark.parametrize(
    "calls, says",
    [
        (
            "find_package(hpccd_core REQUIRED)\nfind_package(hpccd_core REQUIRED COMPONENTS static)",
            "core_shared already",
        ),
        ("find_package(hpccd_core REQUIRED COMPONENTS static shared)", "is one library"),
        (
            "find_package(hpccd_core QUIET COMPONENTS gpu)\nif(hpccd_core_FOUND OR TARGET hpccd::core)\n"
            'message(FATAL_ERROR "found")\nendif()\nfind_package(hpccd_core REQUIRED COMPONENTS static)\n'
            "get_target_property(kind hpccd::core INTERFACE_LINK_LIBRARIES)\n"
            'message(FATAL_ERROR "at last ${kind}")',
            "at last hpccd::core_static",
        ),
    ],
)
def test_one_program_gets_one_library(calls, says, prefix, tmp_path):
    source = project(tmp_path / "user", calls)
    with pytest.raises(AssertionError, match=r"\s+".join(says.split())):
        configure(source, tmp_path / "build", prefix)


def test_errors_are_caught_across_the_library(prefix, tmp_path):
    """By a program that hides its own names."""
    source = project(
        tmp_path / "user",
        "find_package(hpccd_core REQUIRED)\nadd_executable(user user.cpp)\n"
        "set_target_properties(user PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)\n"
        "target_link_libraries(user PRIVATE hpccd::core)\n",
    )
    (source / "user.cpp").write_text(
        "#include <hpccd/hpccd.h>\n"
        "int main() {\n"
        "  int caught = 0;\n"
        "  try { hpccd::Detector(nullptr, {}); } catch (const hpccd::InvalidArgument&) { ++caught; }\n"
        "  hpccd::Detector detector(std::make_shared<hpccd::Scene>(), {});\n"
        "  detector.cancel();\n"
        "  try { detector.detect({}, {}); } catch (const hpccd::Cancelled&) { ++caught; }\n"
        "  return caught == 2 ? 0 : 1;\n"
        "}\n"
    )
    configure(source, tmp_path / "build", prefix)
    run("cmake", "--build", tmp_path / "build")
    run(tmp_path / "build" / "user")


def test_the_program_of_the_page(prefix, tmp_path):
    """docs/cpp.md: its program, linked by its lines of CMake, prints the output that the page shows."""
    page = (ROOT / "docs" / "cpp.md").read_text()
    program, output = re.search(r"```cpp\n(.*?)```\n\n```text\n(.*?)```", page, re.DOTALL).groups()
    link = re.search(r"```cmake\n(.*?)```", page, re.DOTALL)[1]
    find, target = link.split("target_link_libraries")
    source = project(
        tmp_path / "simulator", f"{find}add_executable(simulator simulator.cpp)\ntarget_link_libraries{target}"
    )
    (source / "simulator.cpp").write_text(program)
    configure(source, tmp_path / "build", prefix, "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror")
    run("cmake", "--build", tmp_path / "build")
    assert run(tmp_path / "build" / "simulator") == output


@pytest.mark.parametrize("header", sorted(f.name for f in (ROOT / "hpccd_core" / "include" / "hpccd").glob("*.h")))
def test_each_header_stands_alone(header, prefix, tmp_path):
    source = tmp_path / "alone.cpp"
    source.write_text(f"#include <hpccd/{header}>\n#include <hpccd/{header}>\n")
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
    run("g++", "-std=c++20", *warnings, "-fsyntax-only", "-I", prefix / "include", source)
