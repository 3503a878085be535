# SPDX-License-Identifier: Apache-2.0
"""A command that fails or is interrupted leaves the files of an earlier run as they are, and nothing beside them."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time

import pytest
from live import PATIENCE
from sources import ROOT, SOURCES

from hpccd_ros import cli

BAG = str(ROOT / "bags" / "cloth-drop-small.mcap")
# Commands that replace a file -> the file, and an option that each rejects.
REPLACED = {
    "view": (("view", BAG, "-o", "run.png"), "run.png", ("--step", "300")),
    "pdf": (("view", BAG, "-o", "run.pdf"), "run.pdf", ("--step", "300")),
    "sequence": (("view", BAG, "--every", "80", "-o", "run"), "run/000001.png", ("--params", "no.yaml")),
    "page": (("view", BAG, "--html", "run.html"), "run.html", ("--step", "300")),
    "scene": (("scene", "cloth-drop", "--png", "run.png", "--at", "0"), "run.png", ("--at", "900")),
    "bench": (
        ("bench", "cpu", "folding-strip", "--repeat", "1", "--out", "run", "--label", "x"),
        "run/cpu-x.json",
        ("--threads", "-1"),
    ),
    "trade": (
        ("bench", "accuracy", "folding-strip", "--repeat", "1", "--out", ".", "--label", "x", "--picture", "run.png"),
        "run.png",
        ("--tiers", "exakt"),
    ),
}
# Commands that write a new file -> the file.
NEW = {
    "cut": (("cut", BAG, "--to", "1", "-o", "run.mcap"), "run.mcap"),
    "recover": (("doctor", BAG, "--recover", "run.mcap"), "run.mcap"),
    "csv": (("replay", BAG, "--csv", "run.csv"), "run.csv"),
    "json": (("replay", BAG, "--json", "run.json"), "run.json"),
    "mcap": (("scene", "folding-strip", "--mcap", "run.mcap"), "run.mcap"),
    "npz": (("scene", "folding-strip", "--npz", "run.npz"), "run.npz"),
    "params": (("scene", "arm-and-cloth", "--params", "run.yaml"), "run.yaml"),
}
# Each takes longer than a test waits, or is interrupted while the file is written.
SLOW = {
    "view": REPLACED["view"],
    "page": REPLACED["page"],
    "scene": REPLACED["scene"],
    "bench": (("bench", "cpu", "folding-strip", "--repeat", "100000", "--out", "run"), "run/cpu-x.json"),
    "csv": (("replay", BAG, "--csv", "run.csv", "--rate", "0.1"), "run.csv"),
    "mcap": (("scene", "n-body-like-hr", "--mcap", "run.mcap"), "run.mcap"),
}
LARGEST = 200  # bytes of a file where the disk is full


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "run").mkdir()
    return tmp_path


def _content(folder):
    return {str(path.relative_to(folder)): path.is_file() and path.read_bytes() for path in folder.rglob("*")}


def _earlier(folder, name):
    (folder / name).write_bytes(b"from the run before")
    return _content(folder)


def _started(folder, arguments, **options):
    command = [sys.executable, "-m", "hpccd_ros.cli", *arguments]
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, cwd=folder, env=environment, **pipes, **options)


def _on_a_full_disk():
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, LARGEST))


@pytest.mark.parametrize("case", REPLACED)
def test_a_bad_argument_leaves_the_earlier_file(hpccd, folder, case):
    arguments, name, wrong = REPLACED[case]
    before = _earlier(folder, name)
    done = hpccd(*arguments, *wrong)
    assert done.returncode == 2 and done.stderr.startswith("hpccd "), done.stderr
    assert _content(folder) == before


@pytest.mark.parametrize(
    "case", [pytest.param(case, marks=pytest.mark.long) if case == "pdf" else case for case in REPLACED]
)
def test_a_full_disk_leaves_the_earlier_file(folder, case):
    arguments, name, _ = REPLACED[case]
    before = _earlier(folder, name)
    process = _started(folder, arguments, preexec_fn=_on_a_full_disk)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2 and "File too large" in said and "Traceback" not in said, said
    assert _content(folder) == before


@pytest.mark.parametrize("case", NEW)
def test_a_full_disk_leaves_no_part_of_a_new_file(folder, case):
    arguments, _ = NEW[case]
    before = _content(folder)
    process = _started(folder, arguments, preexec_fn=_on_a_full_disk)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2 and "File too large" in said and "Traceback" not in said, said
    assert _content(folder) == before


@pytest.mark.parametrize("case", NEW)
def test_an_earlier_file_is_rejected(hpccd, folder, case):
    arguments, name = NEW[case]
    before = _earlier(folder, name)
    done = hpccd(*arguments)
    assert done.returncode == 2 and name in done.stderr and "exist" in done.stderr
    assert _content(folder) == before


def _defaults():
    """A shell's background job ignores SIGINT."""
    for number, handler in cli._Interrupts.DEFAULTS.items():
        signal.signal(number, handler)


@pytest.mark.parametrize(
    "case, number", [*((case, signal.SIGINT) for case in SLOW), ("csv", signal.SIGTERM), ("mcap", signal.SIGHUP)]
)
def test_an_interrupt_leaves_the_earlier_file(folder, case, number):
    arguments, name, *_ = SLOW[case]
    before = _content(folder) if case in NEW else _earlier(folder, name)
    process = _started(folder, arguments, preexec_fn=_defaults)
    deadline = time.monotonic() + PATIENCE
    # A benchmark measures before it writes.
    while process.poll() is None and not (list(folder.glob(".*.part")) or (case == "bench" and _measures(process))):
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.send_signal(number)
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, said
    assert _content(folder) == before


def test_an_interrupt_while_python_makes_a_class_has_its_exit_status(tmp_path):
    (tmp_path / "made.py").write_text(
        "import sys; from hpccd_ros import cli; interrupts = cli._Interrupts()\n"
        "try: exec('import os, signal; os.kill(os.getpid(), signal.SIGINT)')\n"
        "except KeyboardInterrupt: sys.exit(130)\n"
    )
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    words = [sys.executable, "-m", "made"]
    done = subprocess.run(words, cwd=tmp_path, env=environment, preexec_fn=_defaults, timeout=PATIENCE)
    assert done.returncode == 130


def _measures(process) -> bool:
    """Whether the process has used more CPU time than its imports take."""
    fields = open(f"/proc/{process.pid}/stat").read().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) > 4 * os.sysconf("SC_CLK_TCK")


@pytest.mark.parametrize("option", ["--csv", "--json", "--html"])
def test_a_device_is_written_to_and_its_errors_are_the_users(hpccd, folder, option):
    command = ("view" if option == "--html" else "replay", BAG, option)
    assert len(hpccd(*command, "/dev/stdout").stdout) > 400
    full = hpccd(*command, "/dev/full")
    assert full.returncode == 2 and full.stderr.endswith(f"{option} /dev/full: No space left on device\n")
    assert [*_content(folder)] == ["run"] and not os.path.exists("/dev/null.png")


def test_a_picture_without_a_suffix_is_a_png(hpccd, folder):
    shutil.rmtree(folder / "run")
    assert hpccd("view", BAG, "-o", "run").returncode == 0
    assert [*_content(folder)] == ["run"] and (folder / "run").read_bytes().startswith(b"\x89PNG")


def test_rerun_recordings_are_replaced_whole(hpccd, folder):
    pytest.importorskip("rerun")
    before = _earlier(folder, "run.rrd")
    missing = hpccd("view", BAG, "-o", "run.rrd", "--step", "300")
    assert missing.returncode == 2 and "no step 300" in missing.stderr
    assert _content(folder) == before
    assert hpccd("view", BAG, "-o", "run.rrd", "--step", "30").returncode == 0
    assert sorted(_content(folder)) == ["run", "run.rrd"] and (folder / "run.rrd").stat().st_size > 10_000


def test_many_recordings(hpccd, folder):
    pytest.importorskip("distributed")
    for name in ("a.mcap", "b.mcap"):
        shutil.copy(BAG, folder / name)
    before = _earlier(folder, "run.json")
    done = hpccd("replay", "a.mcap", "b.mcap", "--csv", "run.csv", "--json", "run.json")
    assert done.returncode == 2 and "--json run.json: File exists" in done.stderr
    assert _content(folder) == before
