# SPDX-License-Identifier: Apache-2.0
"""The benchmark and the soak of the node, short: what they check must hold, and they must see what is wrong."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import hpccd_ros

ROOT = Path(hpccd_ros.__file__).resolve().parents[1]


def bench(folder, *arguments):
    """(exit status, the result as written, what was printed)."""
    done = subprocess.run(
        [sys.executable, "-m", "hpccd_ros.cli", "bench", *arguments, "--out", str(folder), "--label", "test"],
        cwd=ROOT, capture_output=True, text=True, timeout=550,
    )  # fmt: skip
    said = done.stdout + done.stderr
    files = list(folder.glob("*-test.json"))
    assert files, said
    return done.returncode, json.loads(files[0].read_text()), said


def test_latency_beside_the_echo(tmp_path):
    # No limit on times here: other tests may keep the machine busy.
    options = ("cloth-drop", "--size", "0.2", "--repeat", "20", "--seconds", "0", "--limit", "1e9")
    status, result, said = bench(tmp_path, "ros", *options)
    assert status == 0, said
    (row,) = result["rows"]
    assert row["rounds"] == 20 and row["contacts"] > 100
    whole = sum(row["parts_mean_ms"].values()) + row["core_mean_ms"]
    assert whole == pytest.approx(row["whole_mean_ms"]), "the parts make up the whole"
    assert (tmp_path / "ros.png").exists()


def test_latency_above_the_limit_fails(tmp_path):
    options = ("two-triangles", "--repeat", "5", "--seconds", "0", "--limit", "1e-9")
    status, result, said = bench(tmp_path, "ros", *options)
    assert status == 1 and "times as long as the echo" in result["failures"][0], said


def test_soak_of_twenty_seconds(tmp_path):
    # In so short a time the heap still grows to its size: the limit on memory is for half an hour.
    options = ("--minutes", "0.33", "--rate", "20", "--restart-every", "4", "--memory-limit", "25")
    status, result, said = bench(tmp_path, "soak", *options, "--check-every", "3")
    assert status == 0, said
    last = result["rows"][-1]
    # How much of all this fits into the time depends on the machine.
    assert last["checked"] >= 1 and last["replies"] == last["requests"] >= 1
    assert last["publisher_ended"] + last["publisher_killed"] >= 2 and last["topologies"] > 10
    assert 20 < last["node_memory_mb"]["least"] <= last["node_memory_mb"]["most"] < 1000
