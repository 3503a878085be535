# SPDX-License-Identifier: Apache-2.0
"""`python -m bench step`."""

import dataclasses
import sys

import numpy as np
import pytest

import hpccd_core as hc
from bench.core import step_queries
from bench.core.step_queries import StepRunner, contradictions, elsewhere, trials
from bench.report import performance_step
from bench.report.results import Kept
from hpccd_ros.bench.sources import of_scene

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")
OPTIONS = {"accuracy": "exact", "backend": "cpu", "threads": 1}


def a_step():
    source = of_scene("folding-strip", 0.1)
    return source.step(source.n_steps - 1)


def test_a_row_for_each_question_and_a_line_for_each_scene(bench):
    status, result, folder = bench("step", *STRIP, "--threads", "2")
    assert status == 0 and result["failures"] == []
    assert [row["query"] for row in result["rows"]] == ["all", "first", "step", "trial"]
    every, first, step, _ = result["rows"]
    assert every["contacts"] >= first["contacts"] > 0 and every["over_all"] == 1
    assert 0 <= step["earliest"] <= every["earliest"] == first["earliest"] <= 1
    for row in result["rows"]:
        assert 0 < row["least_ms"] <= row["step_ms"] and row["stages_ms"]["total"] > 0
        assert row["over_all"] == pytest.approx(row["step_ms"] / every["step_ms"], rel=1e-4)
    assert result["rows"][3]["listing_ms"] > 0
    cells = performance_step.steps(Kept.read(folder / "step-test.json", "step"))[2].split(" | ")
    assert cells[1] == f"{round(every['contacts']):,}" and f"({step['over_all']:.2f})" in cells[5]


def test_no_start_comes_twice_in_a_row_but_that_of_trial_steps():
    step = a_step()
    for query in step_queries.QUERIES:
        runner, starts, ends = StepRunner(query, OPTIONS), [], []
        for _ in range(8):
            wanted = runner._as_wanted(step)
            starts.append(wanted.vertices_t0.tobytes())
            ends.append(wanted.vertices_t1.tobytes())
        follows = [a == b for a, b in zip(starts, starts[1:], strict=False)]
        assert all(follows) if query == "trial" else not any(follows)
        assert all(a != b for a, b in zip(ends, ends[1:], strict=False))


def test_what_is_shifted_keeps_its_contacts_and_trial_steps_their_start():
    step = a_step()
    moved = elsewhere(step)
    for of in (step, moved):
        assert of.vertices_t0.dtype == step.vertices_t0.dtype
    there, here = (
        hc.Detector(of.scene(), backend="cpu").detect(of.vertices_t0, of.vertices_t1) for of in (moved, step)
    )
    assert len(there) == pytest.approx(len(here), rel=0.05) and not np.array_equal(moved.vertices_t0, step.vertices_t0)
    tried = trials(step)
    assert all(trial.vertices_t0 is step.vertices_t0 for trial in tried) and len(tried) == 4
    np.testing.assert_allclose(tried[2].vertices_t1, 0.5 * (step.vertices_t0 + step.vertices_t1), atol=1e-6)


def test_answers_that_do_not_agree_are_seen():
    step = a_step()
    runners = [StepRunner(query, OPTIONS) for query in step_queries.QUERIES]
    for runner in runners:
        for _ in range(4):
            runner.run(step)
    assert contradictions(runners, "exact") == []
    every, first, free, trial = runners
    place = next(iter(every.earliest))
    free.earliest[place] = every.earliest[place] + 1e-15
    first.earliest[place] = every.earliest[place] - 1e-15
    trial.hashes[place].add(1)
    assert [text.split(":")[0] for text in contradictions(runners, "exact")] == ["trial", "first", "step"]
    free.earliest[place] = every.earliest[place] - 1e-10
    assert [text.split(":")[0] for text in contradictions(runners, "balanced")] == ["trial", "first", "step"]
    assert [text.split(":")[0] for text in contradictions(runners, "exact")] == ["trial", "first"]


def test_a_step_without_motion_or_size():
    step = a_step()
    still = dataclasses.replace(step, vertices_t0=0 * step.vertices_t0, vertices_t1=0 * step.vertices_t1)
    assert np.array_equal(elsewhere(still).vertices_t0, still.vertices_t0)


def test_a_peer_is_asked_the_same(bench):
    pytest.importorskip("ipctk", reason="ipctk is not installed: an optional extra (pip install 'hpccd[bench]')")
    status, result, _ = bench("step", *STRIP, "--peer", "ipctk")
    assert status == 0
    for row in result["rows"][1:]:
        assert row["times_faster_than_ipctk"] == pytest.approx(row["ipctk_ms"] / row["step_ms"], rel=1e-3)


def test_a_peer_that_is_not_there_is_named(bench, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipctk", None)  # as Python notes a module that cannot be imported
    status, result, _ = bench("step", *STRIP, "--peer", "ipctk")
    assert status == 2 and result is None
    assert "pip install" in capsys.readouterr().err


@pytest.mark.parametrize("more", [("--backend", "cpu"), ("--backend", "gpu", "--peer", "ipctk")])
def test_arrays_on_a_device_need_one_that_reads_them(bench, capsys, more):
    status, result, _ = bench("step", *STRIP, "--arrays", "device", *more)
    assert status == 2 and result is None
    assert "--arrays device: needs --backend gpu" in capsys.readouterr().err
