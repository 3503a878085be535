# SPDX-License-Identifier: Apache-2.0
"""The demo as a newcomer runs it: it ends by itself, leaves what it says, and nothing that runs on."""

import itertools
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from live import PATIENCE
from matplotlib.image import imread
from sources import SOURCES

from hpccd_ros.demo.run import hpccd_from_here

RESULTS = ("demo.mcap", "demo.png", "node.yaml")
SMALL = ["demo", "--size", "0.1", "--frames", "40", "--rate", "40"]


@pytest.fixture
def demo_domain(monkeypatch):
    """The demo rejects a domain in which a node /hpccd runs: it gets to choose its own, as for a user."""
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def _running_from(folder):
    """Command lines of the processes that work in `folder`."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if process.joinpath("cwd").resolve() == folder.resolve():
                found.append(process.joinpath("cmdline").read_bytes().replace(b"\0", b" ").decode())
        except OSError:
            continue  # ended meanwhile, or not ours to look at
    return found


def test_demo(hpccd, tmp_path, demo_domain):
    """A run replaces what the run before left, and touches nothing else in the folder."""
    out = _left_before(tmp_path)
    (out / "thesis.txt").write_text("mine")
    done = hpccd(*SMALL)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (out / "thesis.txt").read_text() == "mine"
    logs = {"node.log", "publisher.log", "recorder.log"}
    assert {path.name for path in out.iterdir()} == {"demo.mcap", "demo.png", "node.yaml", "thesis.txt", *logs}
    wanted = ("39 of 39 steps, 0 frames dropped", "39 recorded results", "ms a frame", "all equal")
    for part in (*wanted, "worst frame: step", "try next"):
        assert part in done.stdout
    assert "hpccd-demo/demo.mcap" in done.stdout and "hpccd-demo/demo.png" in done.stdout
    assert hpccd("replay", "hpccd-demo/demo.mcap").returncode == 0
    worst = re.search(r"worst frame: step (\d+)", done.stdout).group(1)
    again = hpccd("view", "hpccd-demo/demo.mcap", "--step", worst, "-o", "other.png")
    assert again.returncode == 0 and f"other.png: step {worst}" in again.stdout
    demo, other = (imread(tmp_path / path)[150:890, :1520] for path in ("hpccd-demo/demo.png", "other.png"))
    assert np.array_equal(demo, other) and demo.std() > 0, "the worst frame; around the scene stand times"
    missing = hpccd("view", "hpccd-demo/demo.mcap", "--step", "300")
    assert missing.returncode == 2 and re.search(r"no step 300: it has \d+ to \d+", missing.stderr)
    assert not _running_from(tmp_path)


def _left_before(tmp_path):
    """The folder of the demo with the results of a run before."""
    out = tmp_path / "hpccd-demo"
    out.mkdir()
    for name in RESULTS:
        (out / name).write_text("from the run before")
    return out


def _assert_untouched(out):
    assert {path.name for path in out.iterdir() if path.suffix != ".log"} == set(RESULTS)
    assert all((out / name).read_text() == "from the run before" for name in RESULTS)


def _hold_up(pids, ended):
    """Stop one process after the other for longer than the queues of a stream last, with short breaths between."""
    for pid in itertools.cycle(pids):
        try:
            os.kill(pid, signal.SIGSTOP)
            ended.wait(0.8)
            os.kill(pid, signal.SIGCONT)
        except ProcessLookupError:
            pass  # the publisher ends before the others
        if ended.wait(0.2):
            return


def test_no_frame_is_lost_on_a_machine_that_is_too_slow(tmp_path, demo_domain):
    process = subprocess.Popen(
        [sys.executable, "-m", "hpccd_ros.cli", "demo", "--size", "0.1", "--frames", "30", "--rate", "20"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": SOURCES},
    )
    lines = []
    for line in process.stdout:
        lines.append(line)
        if line.startswith("processes"):
            break
    pids = [int(pid) for pid in re.findall(r"(?:node|recorder|publisher) (\d+)", lines[-1])]
    assert len(pids) == 3, lines
    ended = threading.Event()
    hold = threading.Thread(target=_hold_up, args=(pids, ended))
    hold.start()
    try:
        lines += process.stdout
    finally:
        ended.set()
        hold.join()
    said = "".join(lines)
    assert process.wait(PATIENCE) == 0, said
    assert "29 of 29 steps, 0 frames dropped" in said
    assert "verified   29 recorded results" in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_interrupted_demo_leaves_no_process(tmp_path, demo_domain, number):
    out = _left_before(tmp_path)
    process = subprocess.Popen(
        [sys.executable, "-m", "hpccd_ros.cli", "demo", "--size", "0.1", "--rate", "5"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": SOURCES},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background job ignores it
    )
    for line in process.stdout:
        if line.startswith("processes"):
            break
    assert len(_running_from(tmp_path)) >= 3
    process.send_signal(number)
    assert process.wait(PATIENCE) == (-9 if number == signal.SIGKILL else 130)
    deadline = time.monotonic() + PATIENCE
    while _running_from(tmp_path):
        assert time.monotonic() < deadline, _running_from(tmp_path)
        time.sleep(0.1)
    if number != signal.SIGKILL:
        _assert_untouched(out)
    assert all((out / name).read_text() == "from the run before" for name in RESULTS)


def test_a_child_that_fails_is_quoted_and_the_results_of_the_run_before_stay(tmp_path, demo_domain):
    out = _left_before(tmp_path)
    process = subprocess.Popen(
        [sys.executable, "-m", "hpccd_ros.cli", "demo", "--size", "0.1", "--rate", "5"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": SOURCES},
    )
    node = next(match for line in process.stdout if (match := re.match(r"processes +node (\d+),", line)))
    os.kill(int(node[1]), signal.SIGKILL)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert "the node ended with status -9" in said and "hpccd-demo/node.log" in said and "contacts on /contacts" in said
    _assert_untouched(out)
    assert not _running_from(tmp_path)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        (("--accuracy", "exakt"), "--accuracy exakt: not a tier; did you mean exact?"),
        (("--accuracy", "perfect"), "--accuracy perfect: not a tier; use one of fast, balanced, conservative, exact"),
        (("--threads", "5000"), "--threads 5000: must be from 0 to 1024"),
        (("--scene", "cloth-dorp"), "armadillo-like; did you mean cloth-drop?\n"),
        (("--frames", "1"), "a scene needs a whole number of at least 2\n"),
        (("--features", "faces"), "--features"),
    ],
)
def test_wrong_use_leaves_the_results_of_the_run_before(hpccd, tmp_path, wrong, says):
    out = _left_before(tmp_path)
    (out / "node.log").write_text("from the run before")
    done = hpccd("demo", *wrong)
    assert done.returncode == 2 and says in done.stderr
    assert (out / "node.log").read_text() == "from the run before"
    _assert_untouched(out)


def test_a_folder_in_the_place_of_a_result_is_named(hpccd, tmp_path):
    (tmp_path / "out" / "demo.mcap").mkdir(parents=True)
    done = hpccd("demo", "--out", "out")
    assert (done.returncode, done.stderr) == (2, "hpccd demo: --out out/demo.mcap: Is a directory\n")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["demo.mcap"]


@pytest.mark.parametrize("installed", ["on the path", "beside python", "as a module", "on the path of make"])
def test_commands_to_try_next_work_from_where_the_user_is(tmp_path, monkeypatch, installed):
    programs = tmp_path / "some venv" / "bin"
    programs.mkdir(parents=True)
    for name in ("python", "hpccd"):
        (programs / name).write_text("#!/bin/sh\necho it runs\n")
        (programs / name).chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "executable", str(programs / "python"))
    monkeypatch.delenv("MAKELEVEL", raising=False)
    path = users_path = os.environ["PATH"]
    if installed == "on the path":
        path = users_path = f"{programs}:{path}"
    elif installed == "on the path of make":
        monkeypatch.setenv("MAKELEVEL", "1")
        path = f"{programs}:{path}"
    elif installed == "as a module":
        (programs / "hpccd").unlink()
    monkeypatch.setenv("PATH", path)
    command = hpccd_from_here()
    done = subprocess.run(
        f"{command} --help", shell=True, cwd=tmp_path, env={"PATH": users_path}, capture_output=True, text=True
    )
    assert done.stdout == "it runs\n", command
    assert (command == "hpccd") == (installed == "on the path")
