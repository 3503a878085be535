# SPDX-License-Identifier: Apache-2.0
"""`python -m bench distance`, and the part of `hpccd bench accuracy` about distance queries."""

import sys

import numpy as np
import oracle
import pytest
from sources import ROOT

from bench.core.distance_queries import ALLOWED, Allowance, Question, questions
from bench.report import performance_distance
from bench.report.results import Kept
from hpccd_ros.bench.sources import of_scene

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")


def test_a_row_for_each_question(bench):
    status, result, folder = bench("distance", *STRIP, "--separations", "0.02,0.002", "--threads", "2")
    assert status == 0 and result["failures"] == []
    assert [(row["query"], row["distance"]) for row in result["rows"]] == [
        ("plain", None),
        ("separation", 0.002),
        ("separation", 0.02),
        ("proximity", 0.002),
        ("proximity", 0.02),
        ("intersections", None),
        ("distances", None),
    ]
    plain, *separation, near, nearer, _, gaps = result["rows"]
    assert plain["over_plain"] == plain["least_over_plain"] == 1
    assert 0 < plain["pairs"] < separation[0]["pairs"] < separation[1]["pairs"], "more pairs come within more"
    assert near["pairs"] < nearer["pairs"] and gaps["pairs"] == 1
    for row in result["rows"]:
        assert 0 < row["least_ms"] <= row["step_ms"] and row["stages_ms"]["total"] > 0
        assert row["over_plain"] == pytest.approx(row["step_ms"] / plain["step_ms"], rel=1e-4)


def test_its_table_shows_its_numbers(bench):
    _, _, folder = bench("distance", *STRIP, "--separations", "0.02,0.002")
    result = Kept.read(folder / "distance-test.json", "distance")
    of = {(row["query"], row["distance"]): row for row in result.rows}
    first = performance_distance.by_distance(result)[2].split(" | ")
    assert first[1:3] == ["0.002", f"{round(of['plain', None]['pairs']):,}"]
    assert first[4] == f"{round(of['separation', 0.002]['pairs']):,}"
    assert f"({of['proximity', 0.002]['over_plain']:.2f})" in first[9]
    snapshot = performance_distance.of_a_snapshot(result)[2].split(" | ")
    assert snapshot[2] == f"{round(of['intersections', None]['pairs']):,}"


def test_distances_beyond_the_edges_are_left_out_where_none_is_given(bench):
    status, result, _ = bench("distance", *STRIP, "--queries", "proximity", "--size", "20")
    edge = result["rows"][0]["median_edge"]
    assert status == 0 and 1e-3 < edge < 1e-2
    assert [row["distance"] for row in result["rows"]] == [None, 1e-5, 1e-4, 1e-3]
    left_out = "folding-strip x 20: d 0.01 left out, beyond its median edge"
    assert any(note.startswith(left_out) for note in result["notes"])
    _, result, _ = bench("distance", *STRIP, "--queries", "proximity", "--separations", "1")
    assert result["rows"][1]["distance"] == 1 > result["rows"][1]["median_edge"]


def test_a_peer_is_asked_the_same(bench):
    pytest.importorskip("ipctk", reason="ipctk is not installed: an optional extra (pip install 'hpccd[bench]')")
    status, result, _ = bench("distance", *STRIP, "--steps", "1", "--separations", "0.002", "--peer", "ipctk")
    assert status == 0
    of = {row["query"]: row for row in result["rows"]}
    assert {query for query, row in of.items() if "ipctk_ms" in row} == {"separation", "proximity", "intersections"}
    for query in ("separation", "proximity", "intersections"):
        row = of[query]
        assert row["times_faster_than_ipctk"] == pytest.approx(row["ipctk_ms"] / row["step_ms"], rel=1e-3)
    assert of["intersections"]["pairs"] > 0 and of["intersections"]["ipctk_pairs"] == 1, "yes or no"
    assert of["proximity"]["ipctk_pairs"] > 0


def test_a_peer_that_is_not_there_is_named(bench, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipctk", None)  # as Python notes a module that cannot be imported
    status, result, _ = bench("distance", *STRIP, "--peer", "ipctk")
    assert status == 2 and result is None
    assert "pip install" in capsys.readouterr().err


@pytest.mark.parametrize("more", [("--backend", "cpu"), ("--backend", "gpu", "--peer", "ipctk")])
def test_arrays_on_a_device_need_one_that_reads_them(bench, capsys, more):
    status, result, _ = bench("distance", *STRIP, "--arrays", "device", *more)
    assert status == 2 and result is None
    assert "--arrays device: needs --backend gpu" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["one", "0", "1e-3,-1", "inf", ""])
def test_wrong_distances_are_explained(bench, capsys, text):
    status, result, _ = bench("distance", *STRIP, "--separations", text)
    assert status == 2 and result is None
    assert f"--separations {text}" in capsys.readouterr().err


def test_what_each_further_pair_takes():
    allowed = Allowance(of_plain=2.0, of_contacts=1.5)
    assert allowed.us_a_pair_beyond(ms=30.0, pairs=15_000, plain_ms=10.0, contacts=10_000, threads=2) is None
    # 10 ms more than twice plain, on two threads, for 5,000 pairs more than 1.5 times the contacts.
    assert allowed.us_a_pair_beyond(ms=30.0, pairs=20_000, plain_ms=10.0, contacts=10_000, threads=2) == 4.0
    assert allowed.us_a_pair_beyond(ms=15.0, pairs=20_000, plain_ms=10.0, contacts=10_000, threads=2) == 0.0
    assert set(ALLOWED) == {"separation", "proximity"}


def test_a_snapshot_is_the_end_of_the_step():
    source = of_scene("folding-strip", 0.1)
    step = source.step(source.n_steps - 1)
    near = Question("proximity", 0.01)
    detector = near.variant({"backend": "cpu"}).detector(step)
    at_start, at_end = (detector.proximity(xyz, 0.01).hash for xyz in (step.vertices_t0, step.vertices_t1))
    assert near.ask(detector, step).hash == at_end != at_start
    assert Question("intersections").ask(detector, step).hash == detector.intersections(step.vertices_t1).hash
    (gap,) = Question("distances").ask(detector, step)
    assert gap.distance == detector.distances(step.vertices_t1)[0].distance == 0
    assert [question.name for question in questions(["proximity", "distances"], [0.5, 2.0])] == [
        "plain",
        "proximity 0.5",
        "proximity 2",
        "distances",
    ]


@pytest.fixture
def data(tmp_path):
    """A folder as HPCCD_DATA: a scene and its truth, which brute force finds."""
    source = of_scene("folding-strip", 0.05)
    step = source.step(source.n_steps - 1)
    v0, v1, faces = step.vertices_t0, step.vertices_t1, step.faces().astype(np.uint32)
    near, separated = (
        oracle.proximity(v1, 0.02, [faces]),
        oracle.brute_force(v0, v1, [faces], minimum_separation=0.02),
    )
    truth = {
        "p_d": 0.02,
        "p_vf": near.vf,
        "p_vf_distance": near.vf_distance,
        "p_ee": near.ee,
        "p_ee_distance": near.ee_distance,
        "s_d": 0.02,
        "s_vf": separated.vf,
        "s_vf_toc": separated.vf_toc,
        "s_ee": separated.ee,
        "s_ee_toc": separated.ee_toc,
        "x_ef": oracle.intersections(v1, [faces]),
    }
    folder = tmp_path / "data"
    (folder / "distance").mkdir(parents=True)
    np.savez(folder / "strip.npz", vertices_t0=v0, vertices_t1=v1, faces=faces)
    np.savez(folder / "distance" / "strip-distance.npz", **truth)
    return folder


ACCURACY = ("accuracy", "--parts", "distance", "--repeat", "1", "--sweep-queries", "30")


def test_wrong_answers_of_each_tier(bench, data):
    status, result, folder = bench(*ACCURACY, "--data", str(data))
    assert status == 0 and result["failures"] == []
    rows = [row for row in result["rows"] if row["part"] == "distance"]
    assert {(row["query"], row["accuracy"]) for row in rows} == {
        (query, tier)
        for query in ("separation", "proximity", "intersections")
        for tier in ("fast", "balanced", "conservative", "exact")
    }
    for row in rows:
        assert row["true"] > 0 and row["scene"] == "strip" and row["step_ms"] > 0
        assert row["accuracy"] != "exact" or row["missed"] == row["invented"] == 0
    hard = [row for row in result["rows"] if row["part"] == "hard distance"]
    assert {row["query"] for row in hard} == {"separation", "proximity", "intersections"}
    assert all(0 < sum(r["true"] for r in hard if r["query"] == q) for q in {row["query"] for row in hard})
    kept = Kept.read(folder / "accuracy-test.json", "accuracy")
    scenes, queries = performance_distance.on_scenes(kept), performance_distance.hard_queries(kept)
    assert len(scenes) == len(queries) == 2 + 3
    assert scenes[2].startswith("| strip | separation | 0.02 |")


@pytest.mark.parametrize("key", ["s_vf", "p_ee", "x_ef"])
def test_a_truth_that_lacks_a_pair_fails_the_benchmark(bench, data, key):
    path = data / "distance" / "strip-distance.npz"
    truth = dict(np.load(path))
    for name in (name for name in truth if name.startswith(key)):
        truth[name] = truth[name][1:]
    np.savez(path, **truth)
    status, result, _ = bench(*ACCURACY[:-1], "0", "--data", str(data))
    assert status == 1
    assert [failure for failure in result["failures"] if "exact: missed 0, invented 1" in failure]


def test_without_truth_the_scenes_are_left_out_and_named(bench, monkeypatch):
    monkeypatch.delenv("HPCCD_DATA", raising=False)
    status, result, _ = bench("accuracy", "--parts", "distance", "--sweep-queries", "10", "--repeat", "1")
    assert status == 0
    assert {row["part"] for row in result["rows"]} == {"hard distance"}
    assert any("HPCCD_DATA" in note for note in result["notes"])


def test_the_default_scenes_are_there():
    from bench.core.distance import SCENES
    from hpccd_ros import scenes

    assert set(SCENES) <= set(scenes.names())
    assert all(f"`{scene}`" in (ROOT / "docs" / "scenes.md").read_text() for scene in SCENES)
