# SPDX-License-Identifier: Apache-2.0
"""`python -m bench limit`."""

import numpy as np
import pytest

from bench.core import limit, limit_work
from bench.core.limit_rates import Rates
from bench.core.limit_work import STAGES, TABLE, Work
from bench.report import performance_limit
from bench.report.results import Kept, by
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")
STATS = {
    "node_pairs": 100,
    "leaf_pairs": 10,
    "vf_candidates": 64,
    "ee_candidates": 32,
    "vf_rejected_slabs": 32,
    "ee_rejected_slabs": 16,
    "vf_rejected_coplanarity": 16,
    "ee_rejected_coplanarity": 8,
    "vf_rejected_projection": 8,
    "ee_rejected_projection": 4,
    "vf_contacts": 4,
    "ee_contacts": 2,
}


def test_a_step_without_work_is_drawn(bench):
    status, _, folder = bench("limit", "two-triangles", "--steps", "1", "--repeat", "1", "--threads-list", "1")
    assert status == 0


def test_a_row_for_each_stage_the_farthest_first(bench):
    status, result, folder = bench("limit", *STRIP, "--threads-list", "2,1")
    assert status == 0 and result["failures"] == []
    rows = [row for row in result["rows"] if row["part"] == "stage"]
    assert [mine[0]["threads"] for mine in by(rows, "threads")] == [1, 2]
    for mine in by(rows, "threads"):
        *stages, rest, step = mine
        # What is too short to be timed is told with another one.
        assert {name for row in stages for name in row["stage"].split(", ")} == set(STAGES) and rest["stage"] == "rest"
        distances = [row["distance_ms"] for row in stages]
        assert distances == sorted(distances, reverse=True)
        assert sum(row["ms"] for row in [*stages, rest]) == pytest.approx(step["ms"], abs=1e-4)
        assert sum(row["least_ms"] for row in stages) == pytest.approx(step["least_ms"], abs=1e-4)
    rates = {(row["rate"], row["threads"]) for row in result["rows"] if row["part"] == "rate"}
    assert rates >= {(rate, n) for rate in ("comparisons", "doubles", "read", "copy") for n in (1, 2)}
    page = performance_limit.stages(Kept.read(folder / "limit-test.json", "limit"))
    assert len(page) == 2 + len(by(rows, "threads")[0]) and page[0].count("| least |") == 2
    rated = performance_limit.rates(Kept.read(folder / "limit-test.json", "limit"))
    assert any(line.startswith("| comparisons | ") for line in rated)


def test_a_part_that_is_not_timed_is_told_with_the_whole(bench, monkeypatch):
    asked = limit._stages
    monkeypatch.setattr(limit, "_stages", lambda *given: asked(*given) | {"k-DOPs": 0.0})
    status, result, _ = bench("limit", *STRIP, "--threads-list", "1")
    rows = {row["stage"]: row for row in result["rows"] if row["part"] == "stage"}
    assert status == 0 and "k-DOPs" not in rows
    assert {"candidates", "tested"} <= rows["tests, k-DOPs"]["items"].keys()


def test_work_is_counted_by_the_program_and_the_scene():
    faces = np.array([[0, 1, 2], [2, 1, 3]], np.uint32)
    meshes = Mesh("moves", faces, 4), Mesh("stays", faces, 4, static=True)
    x = np.zeros((8, 3), np.float32)
    found = limit_work.counts(Step(meshes, 0, x, x), STATS)
    assert (found["vertices"], found["leaves"], found["nodes"]) == (4, 1, 1)
    assert found["position_bytes"] == 2 * 4 * 12
    assert found["leaf_visits"] == 2 * 10 - 1
    assert (found["candidates"], found["tested"]) == (96, 48)
    assert (found["vf_outside"], found["vf_rooted"], found["ee_rooted"], found["ee_contacts"]) == (8, 8, 4, 2)
    assert {item.count for item in TABLE} <= found.keys() and all(item.how for item in TABLE)
    nodes = limit_work.of_stage("nodes", found)
    assert (nodes.read, nodes.touched, nodes.comparisons) == (64, 100 * 128 + 10 * 304, 100 * 12 + 10 * 44)


def test_the_longest_of_what_goes_side_by_side_is_the_least_time():
    class Known(Rates):
        def of(self, name, size=0):
            return {"comparisons": 1e3, "doubles": 1e3, "floats": 2e3, "read": 1e4, "copy": 5e3}[name]

    rates = Known(1)
    both = rates.least(Work(comparisons=10, flops=20), single=False)
    assert (both.ms, both.by) == (pytest.approx(30), "computing")
    assert rates.least(Work(flops=20), single=True).ms == pytest.approx(10)
    moved = rates.least(Work(comparisons=1, read=300, written=100), single=False)
    assert (moved.ms, moved.by) == (pytest.approx(1e3 * (100 / 5e3 + 200 / 1e4)), "moving")
    assert rates.least(Work(touched=1000, flops=1), single=False).by == "touching"


def test_wrong_threads_are_explained(bench, capsys):
    assert bench("limit", *STRIP, "--threads-list", "0")[0] == 2
    assert "--threads-list 0: each number must be above 0" in capsys.readouterr().err
