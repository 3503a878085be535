# SPDX-License-Identifier: Apache-2.0
"""Fixtures of several folders. Imports are late: the tests of the core need neither ROS nor its packages."""

import itertools
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

# A DDS domain of its own for the test run, shared with the processes that it starts. 0..101 are safe on Linux whatever
# the ephemeral port range is.
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
# Workers of pytest-xdist inherit that of the run: each counts on from it.
if worker := int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")):
    os.environ["ROS_DOMAIN_ID"] = str((int(os.environ["ROS_DOMAIN_ID"]) + worker) % 102)

# Shells without job control start background commands with SIGINT ignored, also for the processes that tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_numbers = itertools.count()


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run the tests marked long, which take minutes")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long"):
        for item in items:
            if item.get_closest_marker("long"):
                item.add_marker(pytest.mark.skip(reason="takes minutes; make test-long runs it"))


def pytest_sessionfinish(session):
    """Remove the shared memory of processes that tests have killed, 17 MB each: it would fill /dev/shm in a day."""
    if hasattr(session.config, "workerinput"):  # of pytest-xdist; its controller does it
        return
    used = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        try:
            used |= set(re.findall(r"/dev/shm/fastrtps_[0-9a-f]{16}\b", maps.read_text()))
        except OSError:
            pass  # it has ended, or is another user's, whose memory stays
    for segment in Path("/dev/shm").glob("fastrtps_" + 16 * "[0-9a-f]"):
        if str(segment) not in used and segment.stat().st_uid == os.getuid():
            for file in (segment, segment.with_name(f"{segment.name}_el")):
                file.unlink(missing_ok=True)


@pytest.fixture(scope="session")
def data_folder():
    """Folder of scenes and queries with ground truth."""
    folder = os.environ.get("HPCCD_DATA")
    if not folder:
        pytest.skip("HPCCD_DATA is not set: no folder of scenes with ground truth to compare with")
    if not Path(folder).is_dir():
        pytest.fail(f"HPCCD_DATA is {folder!r}, which is not a folder")
    return Path(folder)


@pytest.fixture
def start_node(tmp_path):
    """Starts nodes as processes; ``start_node(parameters, remaps=(...), wait=True)`` -> NodeProcess."""
    from node_process import NodeProcess

    nodes = []

    def start(parameters, **options):
        nodes.append(NodeProcess(tmp_path, parameters, **options))
        return nodes[-1]

    yield start
    for node in nodes:
        node.close()


@pytest.fixture
def small_bag():
    """The recording that the repository holds: 90 frames, 89 results, accuracy exact."""
    from sources import ROOT

    return ROOT / "bags" / "cloth-drop-small.mcap"


@pytest.fixture
def hpccd(tmp_path):
    """Run `hpccd ARGUMENTS` as a process in an empty folder; returns the CompletedProcess, output as text."""
    from sources import SOURCES

    def run(*arguments, **options):
        return subprocess.run(
            [sys.executable, "-m", "hpccd_ros.cli", *map(str, arguments)],
            cwd=tmp_path,
            text=True,
            capture_output=True,
            timeout=500,
            env={**os.environ, "PYTHONPATH": SOURCES},
            **options,
        )

    return run


@pytest.fixture
def children(tmp_path, monkeypatch):
    """Starts processes that are ended with the test."""
    from sources import SOURCES

    from hpccd_ros.demo.children import Children

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
    import base_bags

    folder = tmp_path_factory.mktemp("sound")
    base_bags.write_all(folder)
    return folder
