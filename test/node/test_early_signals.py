# SPDX-License-Identifier: Apache-2.0
"""SIGINT and SIGTERM at any moment of the first seconds: the node ends as told, by each of the ways to start it."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from node_process import PATIENCE

import hpccd_ros

ROOT = Path(hpccd_ros.__file__).resolve().parents[1]
HERE = Path(__file__).resolve().parents[2]
WAYS = {
    "module": [sys.executable, "-m", "hpccd_ros.node"],
    "ros2-run": [sys.executable, str(HERE / "scripts" / "hpccd_node")],
}
CONSOLE = Path(sys.executable).with_name("hpccd_node")
if CONSOLE.exists():  # pip installs it; colcon does not
    WAYS["console"] = [str(CONSOLE)]


def looks_out(pid):
    """Whether the process has a handler for SIGTERM (for SIGINT, Python has one of its own)."""
    text = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"SigCgt:\s*(\w+)", text).group(1), 16) >> (signal.SIGTERM - 1) & 1


def has_loaded(library):
    return lambda pid: library in Path(f"/proc/{pid}/maps").read_text()


def told_to_end(command, number, moment, delay=0.0):
    """(exit status, output) of a node that is sent a signal this many seconds after ``moment(pid)`` has come true."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    node = subprocess.Popen(command, cwd=HERE, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    deadline = time.monotonic() + PATIENCE
    while node.poll() is None and not moment(node.pid):
        assert time.monotonic() < deadline
        time.sleep(0.002)
    time.sleep(delay)
    node.send_signal(number)
    output, _ = node.communicate(timeout=PATIENCE)
    return node.returncode, output.decode()


@pytest.mark.parametrize("way", WAYS)
def test_a_signal_while_the_node_is_loaded(way):
    moments = {
        "first line": looks_out,
        "numpy": has_loaded("_multiarray_umath"),
        "rclpy": has_loaded("_rclpy_pybind11"),
    }
    for name, moment in moments.items():
        for number in (signal.SIGINT, signal.SIGTERM):
            assert told_to_end(WAYS[way], number, moment) == (0, ""), (name, number)


def test_a_signal_while_the_node_starts():
    for step in range(6):
        number = (signal.SIGINT, signal.SIGTERM)[step % 2]
        status, output = told_to_end(WAYS["module"], number, has_loaded("_rclpy_pybind11"), 0.2 * step)
        assert status == 0 and "Traceback" not in output, (step, output)
        assert all("[hpccd]: active: meshes" in line for line in output.splitlines()), output
