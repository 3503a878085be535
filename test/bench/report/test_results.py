# SPDX-License-Identifier: Apache-2.0
"""Result files: what is written can be read, in full, and the kept ones hold the figures of the page."""

import json

import numpy as np
import pytest
from sources import ROOT

from bench.report.results import Kept
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import Report

KEPT = sorted((ROOT / "test" / "bench" / "results").glob("*.json"))


def test_what_is_written_is_read(tmp_path):
    report = Report("cpu", "hpccd bench cpu", {"repeat": 3})
    stages = {"traverse": 1 / 3, "other": 0}
    report.add(scene="s", median_ms=np.float32(0.5), contacts=np.int64(2**40), stages_ms=stages)
    report.add(scene='quoted "t"', median_ms=float("nan"), contacts=None, small=1.5e-17)
    assert report.end(tmp_path, "test") == 0
    result = Kept.read(tmp_path / "cpu-test.json", "cpu")
    assert result.command == "hpccd bench cpu" and result.machine == report.machine
    assert result.rows == [
        {"scene": "s", "median_ms": 0.5, "contacts": 2**40, "stages_ms": {"traverse": 0.333333, "other": 0}},
        {"scene": 'quoted "t"', "median_ms": "nan", "contacts": None, "small": 1.5e-17},
    ]


def test_each_row_has_a_line(tmp_path):
    report = Report("cpu", "hpccd bench cpu", {})
    for k in range(20):
        report.add(number=k, stages_ms={"a": k, "b": k})
    report.end(tmp_path, "test")
    written = (tmp_path / "cpu-test.json").read_text()
    assert [json.loads(line.strip().rstrip(","))["number"] for line in written.splitlines() if "number" in line] == [
        *range(20)
    ]


def test_another_benchmarks_result_is_refused(tmp_path):
    Report("cpu", "hpccd bench cpu", {}).end(tmp_path, "test")
    with pytest.raises(UserError, match="results of `hpccd bench cpu`, not of gpu"):
        Kept.read(tmp_path / "cpu-test.json", "gpu")


@pytest.mark.parametrize("path", KEPT, ids=lambda path: path.stem)
def test_kept_results_are_sound(path):
    whole = json.loads(path.read_text(encoding="utf-8"))
    assert whole["command"].startswith(tuple(f"{by} {whole['benchmark']}" for by in ("hpccd bench", "python -m bench")))
    assert whole["failures"] == [] and whole["rows"]
    assert "+changes" not in whole["machine"]["commit"], "measured on sources that are in no commit"
