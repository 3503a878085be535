# SPDX-License-Identifier: Apache-2.0
"""Drive CMakeLists.txt for pip, against the ROS 2 wheels; colcon uses CMakeLists.txt alone.

What the CMake install leaves under lib/python*/site-packages becomes part of the wheel's Python packages; its
other lib/ and share/ files go to the environment's prefix, where the ROS wheels keep theirs.
"""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Command, Distribution, find_packages, setup
from setuptools.command.build_ext import build_ext
from setuptools.command.build_py import build_py

from distutils.command.install_data import install_data  # isort: skip  (setuptools supplies distutils)

HERE = Path(__file__).resolve().parent
PYTHON_PACKAGES_OF_CMAKE = ("hpccd", "hpccd_core")
# Own libraries are found next to each other, and from site-packages/hpccd.
RPATH = "$ORIGIN;$ORIGIN/../../.."


def ros_prefix() -> Path:
    """Return the prefix of the ROS wheels: that of the virtual environment or of pip's isolated build."""
    for entry in sys.path:
        for folder in Path(entry or ".").resolve().parents:
            if (folder / "share" / "ament_cmake_core" / "cmake").is_dir():
                return folder
    raise SystemExit(
        "hpccd: the ROS 2 build wheels (ros-jazzy-ament-cmake, ...) are not installed in this environment. "
        "Remedy: `make venv`, or `pip install .` without --no-build-isolation."
    )


def tool(name: str) -> str | None:
    """Return the path of a build tool: the first on PATH, else the one beside this Python."""
    return shutil.which(name) or shutil.which(name, path=str(Path(sys.executable).parent))


class FreshPythonFiles(build_py):
    """Copy the Python sources into an empty folder: a module deleted there must not be installed."""

    def run(self):
        shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()


class CMakeBuild(build_ext):
    """Configure, build and stage the CMake project."""

    def run(self):
        work = Path(self.build_temp).resolve()
        # The Makefile names a tree of its own, in which it builds the C++ tests too.
        build = Path(os.environ.get("HPCCD_BUILD_TREE") or work / "cmake").resolve()
        stage, prefix = work / "stage", ros_prefix()
        self._forget_other_environment(build, prefix)
        shutil.rmtree(stage, ignore_errors=True)

        cmake = tool("cmake")
        if cmake is None:
            raise SystemExit("hpccd: cmake not found. Remedy: pip install cmake ninja")
        ninja = tool("ninja")
        generator = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={ninja}"] if ninja else []
        configure = [
            cmake,
            "-S",
            str(HERE),
            "-B",
            str(build),
            *generator,
            "-DCMAKE_BUILD_TYPE=Release",
            "-DBUILD_TESTING=OFF",
            "-DHPCCD_PIP=ON",
            # CMake remembers what CMAKE_ARGS said at another time.
            "-DHPCCD_CUDA=AUTO",
            "-DHPCCD_BUILD_TESTS=OFF",
            f"-DCMAKE_PROJECT_INCLUDE={HERE / 'cmake' / 'pypi_ros.cmake'}",
            f"-DHPCCD_ROS_PREFIX={prefix}",
            f"-DCMAKE_INSTALL_PREFIX={stage}",
            f"-DCMAKE_INSTALL_RPATH={RPATH}",
            # rosidl asks for Python3, pybind11 for Python.
            f"-DPython3_EXECUTABLE={sys.executable}",
            f"-DPython_EXECUTABLE={sys.executable}",
            *shlex.split(os.environ.get("CMAKE_ARGS", "")),
        ]
        subprocess.check_call(configure)
        subprocess.check_call([cmake, "--build", str(build), "--parallel", self._jobs()])
        subprocess.check_call([cmake, "--install", str(build)], stdout=subprocess.DEVNULL)

        (site_packages,) = stage.glob("lib/python3*/site-packages")
        for package in PYTHON_PACKAGES_OF_CMAKE:
            if (site_packages / package).is_dir():
                shutil.copytree(
                    site_packages / package,
                    Path(self.build_lib) / package,
                    dirs_exist_ok=True,
                    ignore=shutil.ignore_patterns("__pycache__", "*.c"),
                )
        shutil.rmtree(site_packages.parent)
        self.distribution.hpccd_stage = stage

    @staticmethod
    def _jobs() -> str:
        return os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(len(os.sched_getaffinity(0)))

    @staticmethod
    def _forget_other_environment(build: Path, prefix: Path) -> None:
        """CMake caches absolute paths of the ROS wheels: start afresh when these lie elsewhere now."""
        mark, environment = build / "hpccd_environment.txt", f"{prefix}\nPython {sys.version}\n"
        if not (mark.is_file() and mark.read_text() == environment):
            shutil.rmtree(build, ignore_errors=True)
            build.mkdir(parents=True)
            mark.write_text(environment)


class StagedData(install_data):
    """Put the staged lib/ and share/ into the environment's prefix."""

    def run(self):
        stage = self.distribution.hpccd_stage
        files: dict[str, list[str]] = {}
        for top in ("lib", "share"):
            for file in sorted((stage / top).rglob("*")):
                if file.is_file():
                    files.setdefault(str(file.parent.relative_to(stage)), []).append(str(file))
        self.data_files = sorted(files.items())
        super().run()


class NoEditable(Command):
    """Reject `pip install -e`: it would report success and leave the generated messages out."""

    user_options = [("dist-dir=", "d", ""), ("dist-info-dir=", "I", "")]

    def initialize_options(self):
        self.dist_dir = self.dist_info_dir = None

    def finalize_options(self):
        pass

    def run(self):
        raise SystemExit("hpccd: editable installs are not supported. Remedy: `make venv` rebuilds.")


class BinaryDistribution(Distribution):
    hpccd_stage: Path | None = None

    def has_ext_modules(self):
        return True


setup(
    distclass=BinaryDistribution,
    packages=find_packages(include=["hpccd_ros", "hpccd_ros.*"]),
    package_data={"": ["*.pyi", "py.typed", "*.yaml", "*.json", "assets/*"]},
    cmdclass={
        "build_py": FreshPythonFiles,
        "build_ext": CMakeBuild,
        "install_data": StagedData,
        "editable_wheel": NoEditable,
    },
    data_files=[("share/hpccd", ["package.xml"])],  # replaced by StagedData; non-empty so that it runs
    zip_safe=False,
)
