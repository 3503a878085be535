# SPDX-License-Identifier: Apache-2.0
"""Many recordings at once: in local processes, and on a Dask cluster of separate processes."""

import csv
import json
import shutil
import sys
import types

import numpy as np
import pytest
from bag_tools import rewrite
from live import PATIENCE

from hpccd_ros.base.errors import UserError
from hpccd_ros.replay import many_recordings

pytest.importorskip("distributed", reason="Dask is not installed: make venv EXTRAS='test cluster'")


@pytest.fixture
def recordings(small_bag, tmp_path):
    """good, changed (step 61), cut off, without contacts."""
    folder = tmp_path / "bugs"
    folder.mkdir()
    shutil.copy(small_bag, folder / "a.mcap")

    def later(index, message, decoded):
        if message.topic == "/contacts" and index == 60:
            toc = decoded.toc.copy()
            toc[0] = np.nextafter(toc[0], 2)
            object.__setattr__(decoded, "toc", toc)
        return decoded

    rewrite(small_bag, folder / "b.mcap", later)
    (folder / "c.mcap").write_bytes(small_bag.read_bytes()[:200_000])
    rewrite(small_bag, folder / "d.mcap", lambda index, m, decoded: None if m.topic == "/contacts" else decoded)
    return sorted(folder.iterdir())


RESULTS = ["VERIFIED", "DIVERGED", "UNUSABLE", "COMPUTED"]


def _check(done, folder):
    assert done.returncode == 1, done.stdout + done.stderr
    assert "2 of 4 recordings without a difference, 177 results verified, 1 diverged" in done.stdout
    rows = json.loads((folder / "all.json").read_text())
    assert [row["result"] for row in rows] == RESULTS
    assert [row["file"][-6:] for row in rows] == ["a.mcap", "b.mcap", "c.mcap", "d.mcap"]
    assert "step 61: vertex" in rows[1]["why"] and "now at t =" in rows[1]["why"] and "cut off" in rows[2]["why"]
    assert rows[0]["contacts"] == 10_213
    return rows


def test_in_local_processes(hpccd, recordings, tmp_path):
    done = hpccd("replay", *recordings, "--json", "all.json", "--csv", "all.csv", "--jobs", "2")
    rows = _check(done, tmp_path)
    assert len({row["host"] for row in rows}) == 2, "two processes worked"
    table = list(csv.DictReader((tmp_path / "all.csv").open()))
    assert [row["result"] for row in table] == RESULTS and table[0]["verified"] == "89"
    again = hpccd("replay", *recordings, "--json", "all.json")
    assert again.returncode == 2 and "not overwritten" in again.stderr


def test_on_a_cluster(hpccd, children, recordings, tmp_path):
    file = tmp_path / "scheduler.json"
    children.start(
        "scheduler",
        "distributed.cli.dask_scheduler",
        "--host",
        "127.0.0.1",
        "--port",
        "0",
        "--no-dashboard",
        "--scheduler-file",
        str(file),
    )
    children.wait(file.exists, "no scheduler file", PATIENCE)
    address = json.loads(file.read_text())["address"]
    alone = hpccd("replay", *recordings, "--scheduler", address)
    assert alone.returncode == 2 and "has no workers" in alone.stderr
    worker = children.start("worker", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard")
    children.wait(lambda: worker.has_printed("Registered to"), "the worker did not register", PATIENCE)
    _check(hpccd("replay", *recordings, "--scheduler", address, "--json", "all.json"), tmp_path)


def test_no_scheduler_there(hpccd, small_bag):
    done = hpccd("replay", small_bag, "--scheduler", "nonsense://x")
    assert done.returncode == 2 and "--scheduler nonsense://x: no Dask scheduler" in done.stderr


def test_options_for_one_recording_only(hpccd, small_bag):
    done = hpccd("replay", small_bag, small_bag, "--publish")
    assert done.returncode == 2 and "--publish is for one recording" in done.stderr


def test_missing_dask_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)  # as if it were not installed
    with pytest.raises(UserError, match="needs the Python package distributed .* extra 'cluster'"):
        many_recordings.main(types.SimpleNamespace())
