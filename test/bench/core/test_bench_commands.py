# SPDX-License-Identifier: Apache-2.0
"""`python -m bench ...`: each command runs, checks what it promises to check, and writes what it says."""

import collections

import pytest

import hpccd_core as hc

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")


def check_files(result):
    """Rows, and no failed check."""
    assert result["failures"] == []
    assert result["machine"]["commit"] and result["machine"]["cores"] >= 1
    assert len(result["rows"]) > 0


def test_cpu(bench):
    status, result, folder = bench("cpu", *STRIP, "--report", "all,first,any")
    assert status == 0
    check_files(result)
    every, first, any_ = result["rows"]
    assert every["contacts"] >= first["contacts"] >= any_["contacts"]
    assert every["stages_ms"]["total"] > 0 and every["candidates"] > every["contacts"]
    assert (
        result["command"] == "python -m bench cpu folding-strip --size 0.1 --steps 2 --repeat 1 --report all,first,any"
    )


def test_scaling(bench):
    status, result, folder = bench("scaling", *STRIP, "--threads-list", "1,2", "--methods", "default,naive")
    assert status == 0
    check_files(result)
    assert [(r["method"], r["threads"]) for r in result["rows"]] == [
        ("default", 1),
        ("default", 2),
        ("naive", 1),
        ("naive", 2),
        ("independent", 2),
    ]
    assert len({r["contacts"] for r in result["rows"]}) == 1
    assert result["rows"][0]["efficiency"] == 1
    alone, at_once = result["rows"][0], result["rows"][-1]
    assert at_once["speedup"] == pytest.approx(2 * alone["sequence_ms"] / at_once["sequence_ms"], rel=0.05)


def test_nothing_to_hold_independent_detectors_against(bench):
    status, result, _ = bench("scaling", *STRIP, "--threads-list", "2", "--methods", "naive")
    assert status == 0
    assert [(r["method"], r["threads"]) for r in result["rows"]] == [("naive", 2)]


def test_methods(bench):
    status, result, folder = bench("methods", *STRIP, "--threads", "2")
    assert status == 0
    check_files(result)
    assert all(row["same_contacts"] for row in result["rows"])
    assert {"default", "published", "naive", "front", "scalar"} <= {row["variant"] for row in result["rows"]}


def test_size(bench):
    few = ("--steps", "2", "--repeat", "1", "--threads-list", "1,2")
    status, result, folder = bench("size", "folding-strip", "--sizes", "0.1,0.4", *few)
    assert status == 0
    check_files(result)
    small, _, large, _ = result["rows"]
    assert 3 < large["triangles"] / small["triangles"] < 5
    assert large["bytes_per_triangle"] > 50
    assert sum("time ~ triangles^" in note for note in result["notes"]) == 2


def test_memory(bench):
    status, result, folder = bench("memory", "folding-strip", "--repeat", "1", "--methods", "default,front")
    assert status == 0
    check_files(result)
    default, front = result["rows"]
    assert 0 < default["detector_bytes"] < front["detector_bytes"], "the front keeps pairs of nodes"
    assert default["process_bytes"] > default["detector_bytes"] / 2
    assert default["all_candidates_bytes"] == 8 * default["candidates"] > 0


def test_worlds(bench):
    status, result, folder = bench("worlds", "two-triangles", "--worlds", "3,12", "--repeat", "1", "--threads", "2")
    assert status == 0
    check_files(result)
    few, many = result["rows"]
    assert (few["worlds"], many["worlds"]) == (3, 12) and few["threads"] == 2
    assert many["contacts"] > few["contacts"]
    assert (few["steps"], many["steps"]) == (3, 10)
    of_all = few["one_detector_core_ms"] / few["one_call_core_ms"] / 2
    assert few["of_all_threads"] == pytest.approx(of_all, rel=1e-3), "kept with six digits after the point"
    assert many["bytes_a_world"] > 100


def test_worlds_whose_answers_differ_fail(bench, monkeypatch):
    """The last round is looked at as well, and rows beside hashes."""
    detect, calls = hc.Detector.detect, collections.Counter()

    def from_the_second_call_on(self, *args, **options):
        found = detect(self, *args, **options)
        calls[id(self)] += 1
        return detect(self, args[0], args[0]) if self.worlds and calls[id(self)] > 1 else found

    monkeypatch.setattr(hc.Detector, "detect", from_the_second_call_on)
    status, result, _ = bench("worlds", "two-triangles", "--worlds", "12", "--repeat", "2", "--threads", "1")
    assert status == 1 and any("one_thread: contacts of world" in text for text in result["failures"])


def test_nothing_is_measured_where_a_later_scene_will_not_do(bench, capsys, monkeypatch):
    monkeypatch.setattr(hc, "Detector", None)
    status, result, _ = bench("worlds", "two-triangles", "breaking-like", "--size", "0.02", "--worlds", "8")
    assert status == 2 and result is None
    assert "breaking-like x 0.02: its topology changes" in capsys.readouterr().err


def test_wrong_answers(bench):
    few = ("--parts", "sweeps", "--sweep-queries", "40")
    status, result, folder = bench("accuracy", *few)
    assert status == 0
    check_files(result)
    parts = {name: [r for r in result["rows"] if r["part"] == name] for name in ("adversarial", "sweep")}
    hard = {tier: [r for r in parts["adversarial"] if r["accuracy"] == tier] for tier in ("balanced", "exact")}
    assert all(r["missed"] == r["invented"] == 0 for r in hard["exact"])
    assert any(r["missed"] + r["invented"] > 0 for r in hard["balanced"]), "these queries are not hard"
    assert {r["at"] for r in parts["sweep"] if r["sweep"] == "scale"} >= {1e-30, 1e30}
    assert max(r["at"] for r in parts["sweep"] if r["sweep"] == "offset") == 1e12


def test_options(bench):
    few = ("--size", "0.02", "--steps", "1", "--repeat", "1", "--landscape", "200")
    status, result, folder = bench("options", "n-body-like-lr", *few)
    assert status == 0
    check_files(result)
    rows = {row["option"]: row for row in result["rows"]}
    full = rows["full"]
    assert full["over_full"] == 1
    assert rows["no self-collision"]["candidates"] < full["candidates"]
    assert rows["largest mesh ignored by all"]["candidates"] < full["candidates"]
    faces, edges = rows["vertex-face only"], rows["edge-edge only"]
    assert faces["contacts"] + edges["contacts"] == full["contacts"]
    assert faces["candidates"] + edges["candidates"] == full["candidates"]
    assert rows["report any"]["contacts"] <= 1
    assert rows["the same, static"]["contacts"] == rows["landscape around it"]["contacts"] == full["contacts"]
    assert rows["the same, static"]["candidates"] < rows["landscape around it"]["candidates"]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("cpu", "no-such-scene"), "no-such-scene"),
        (("cpu", *STRIP[:-1], "0"), "--repeat"),
        (("scaling", *STRIP, "--threads-list", "0"), "--threads-list"),
        (("size", "folding-strip", "--sizes", "one"), "--sizes"),
        (("size", "cloth-ball"), "generated"),
        (("accuracy", "--tiers", "best"), "best"),
        (("memory", "folding-strip", "--methods", ","), "--methods"),
        (("worlds", "breaking-like", "--size", "0.02", "--worlds", "8"), "topology changes"),
        (("worlds", "two-triangles", "--worlds", "65537"), "at most 65,536"),
        (("accuracy", "--threads", "100000"), "at most 1024"),
        (("limit", *STRIP, "--threads-list", "1,100000"), "at most 1024"),
    ],
)
def test_wrong_use_is_explained(bench, capsys, arguments, text):
    status, result, _ = bench(*arguments)
    assert status == 2 and result is None
    assert text in capsys.readouterr().err
