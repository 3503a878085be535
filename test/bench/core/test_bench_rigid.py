# SPDX-License-Identifier: Apache-2.0
"""`python -m bench rigid`."""

import pytest
from oracle import rigid_answers

from bench.report import performance_rigid
from bench.report.results import Kept


def cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_truth(bench):
    status, result, folder = bench("rigid", "--parts", "truth", "--queries", "200")
    assert status == 0 and result["failures"] == []
    assert [(row["motion"], row["kind"]) for row in result["rows"]] == [
        (motion, kind) for motion in ("screws", "joints") for kind in ("vf", "ee")
    ]
    for row in result["rows"]:
        assert row["queries"] == 100 and row["touching"] > 10 and row["reported"] > row["touching"]
        assert row["missed"] == row["late"] == row["beyond"] == row["open"] == 0
    lines = performance_rigid.truth(Kept.read(folder / "rigid-test.json", "rigid"))
    assert cells(lines[2])[:3] == ["screws", "vertex-face", "100"]


def test_what_is_missed_fails(bench, monkeypatch):
    monkeypatch.setattr(rigid_answers, "grown", lambda d, a, b: d)
    status, result, _ = bench("rigid", "--parts", "truth", "--queries", "400")
    assert status == 1
    assert any("missed" in text for text in result["failures"])


def test_bounds(bench):
    status, result, folder = bench("rigid", "--parts", "bounds")
    assert status == 0
    for row in result["rows"]:
        assert 0 < row["low"] <= row["median"] <= row["largest"] <= 1
        if row["motion"] == "screws":
            assert row["low"] == pytest.approx(1, abs=1e-6)
    lines = performance_rigid.bounds(Kept.read(folder / "rigid-test.json", "rigid"))
    assert [cells(line)[0] for line in lines[2:]] == ["screws", "joints", "joints that cancel"]


def test_cost(bench):
    options = ("--size", "0.02", "--repeat", "1", "--turns", "1,20", "--tolerances", "1e-3", "--threads", "1")
    status, result, folder = bench("rigid", "--parts", "cost", *options)
    assert status == 0
    ball, fast = (row for row in result["rows"] if row["scene"] == "spinning ball")
    assert ball["parts"] == 1 and fast["parts"] == 3
    for row in result["rows"]:
        assert row["enough"] and row["bound"] <= 2e-3 * 1.001
        assert row["contacts"] > 0 and row["linear_contacts"] > 0
        assert row["over_linear"] == pytest.approx(row["moved_ms"] / row["linear_ms"], rel=1e-4)
    lines = performance_rigid.cost(Kept.read(folder / "rigid-test.json", "rigid"))
    assert len(lines) == 2 + len(result["rows"])


def test_errors(bench, capsys):
    for arguments, text in ((("--parts", "all"), "--parts all"), (("--queries", "1"), "--queries 1")):
        status, _, _ = bench("rigid", *arguments)
        assert status != 0
        assert text in capsys.readouterr().err
