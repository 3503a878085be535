# SPDX-License-Identifier: Apache-2.0
"""`hpccd_node --help` and `--version` result at once, without ROS."""

import re
import subprocess
import sys

import pytest
from sources import ROOT

from hpccd_ros.base.version import package_version
from hpccd_ros.node import start, usage

MODULE = ("-m", "hpccd_ros.node")


def run(*arguments):
    return subprocess.run([sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True, timeout=200)


@pytest.mark.parametrize("option", ["-h", "--help"])
def test_help(option):
    done = run(*MODULE, option)
    assert (done.returncode, done.stdout, done.stderr) == (0, usage.HELP, "")


def test_version():
    assert run(*MODULE, "--version").stdout == f"hpccd_node {package_version()}\n"


def test_help_loads_no_ros():
    code = (
        "import sys; sys.argv = ['hpccd_node', '--help']\n"
        "from hpccd_ros.node import start\n"
        "status = start.main()\n"
        "sys.exit(status or 'rclpy' in sys.modules)"
    )
    assert run("-c", code).returncode == 0


def test_an_option_of_ros_is_not_taken_for_ours(monkeypatch):
    monkeypatch.setattr(sys, "argv", ["hpccd_node", "--ros-args", "--help"])
    assert start.asked_for() is None


def test_files_that_it_names_are_there():
    for path in re.findall(r"(?:docs|config)/\w+\.\w+", usage.HELP):
        assert (ROOT / path).exists(), path
