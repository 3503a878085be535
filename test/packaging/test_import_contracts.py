# SPDX-License-Identifier: Apache-2.0
"""Imports go one way (.importlinter), and `make lint` notices one that does not."""

import os
import shutil
import subprocess
import sys

import pytest
from sources import ROOT

pytest.importorskip("importlinter", reason="import-linter comes with the extra lint")

ORDER = "Each package imports only packages listed before it in docs/architecture.md"
ABOVE = "The core does not import the packages around it"
LABORATORY = "The packages never import the oracles, fuzzers and benchmarks of test/"


def lint(folder):
    return subprocess.run(
        [sys.executable, "-c", "from importlinter.cli import lint_imports_command as main; main()", "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder)},
        text=True,
        capture_output=True,
        timeout=100,
    )


@pytest.fixture
def copy(tmp_path):
    shutil.copy(ROOT / ".importlinter", tmp_path)
    for package in ("hpccd_core", "hpccd_ros"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "results"))
    return tmp_path


def test_contracts_are_kept():
    done = lint(ROOT)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    "module, statement, broken",
    [
        ("hpccd_ros/frames/drops.py", "from hpccd_ros.middleware import qos", ORDER),
        ("hpccd_ros/node/node.py", "from hpccd_ros.replay import compare", ORDER),
        ("hpccd_ros/detect/layout.py", "import rclpy", "The core, frames and their detection do not import ROS"),
        ("hpccd_core/scene.py", "from hpccd_ros.base import quoting", ABOVE),
        ("hpccd_core/scene.py", "import oracle", LABORATORY),
        ("hpccd_ros/detect/layout.py", "from fuzz import questions", LABORATORY),
        ("hpccd_ros/scenes/scene.py", "import bench", LABORATORY),
    ],
)
def test_an_import_that_runs_up_is_seen(copy, module, statement, broken):
    path = copy / module
    path.write_text(f"{path.read_text()}\n{statement}\n")
    done = lint(copy)
    assert done.returncode == 1 and f"{broken} BROKEN" in done.stdout, done.stdout + done.stderr


def test_a_package_without_a_floor_is_seen(copy):
    (copy / "hpccd_ros" / "attic").mkdir()
    (copy / "hpccd_ros" / "attic" / "__init__.py").touch()
    done = lint(copy)
    assert done.returncode == 1 and "attic" in done.stdout, done.stdout + done.stderr
