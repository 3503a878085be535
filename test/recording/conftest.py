# SPDX-License-Identifier: Apache-2.0
"""What the tests of recorder and replay share."""

import itertools
import os
import subprocess
import sys

import base_bags
import pytest
from sources import ROOT, SOURCES

from hpccd_ros.demo.children import Children

# Domains 0..101 are safe on Linux whatever the ephemeral port range is.
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

_numbers = itertools.count()


@pytest.fixture
def small_bag():
    """The recording that the repository holds: 90 frames, 89 answers, accuracy exact."""
    return ROOT / "bags" / "cloth-drop-small.mcap"


@pytest.fixture
def hpccd(tmp_path):
    """Run `hpccd ARGUMENTS` as a process in an empty folder; returns the CompletedProcess, output as text."""

    def run(*arguments, **options):
        return subprocess.run(
            [sys.executable, "-m", "hpccd_ros.cli", *map(str, arguments)], cwd=tmp_path, text=True,
            capture_output=True, timeout=500, env={**os.environ, "PYTHONPATH": SOURCES}, **options,
        )  # fmt: skip

    return run


@pytest.fixture
def children(tmp_path, monkeypatch):
    """Starts processes that are ended with the test."""
    monkeypatch.setenv("PYTHONPATH", SOURCES)
    folder = tmp_path / "logs"
    folder.mkdir()
    with Children(folder) as started:
        yield started


@pytest.fixture
def namespace():
    """A ROS namespace that no other test uses."""
    return f"/rec{os.getpid()}_{next(_numbers)}"


@pytest.fixture(scope="session")
def sound_bags(tmp_path_factory):
    """A folder with the sound recordings of base_bags.py: streams.mcap and everything.mcap."""
    folder = tmp_path_factory.mktemp("sound")
    base_bags.write_all(folder)
    return folder
