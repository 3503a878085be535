# SPDX-License-Identifier: Apache-2.0
"""`python -m bench ...` at tiny sizes: each subject runs, and fails if compared results differ."""

import argparse
import collections
import dataclasses
import sys
import types

import numpy as np
import oracle
import pytest
from oracle import rigid_results

import hpccd_core as hc
from bench import distance, gpu, inside, page, rigid, step, stop
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command, measure, sources
from hpccd_ros.bench.sources import of_scene

ONE = ("--repeat", "1")
STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", *ONE)
FEW_STEPS = ("--sizes", "0.1,0.4", "--steps", "2", "--threads-list", "1,2", *ONE)
SUBJECTS = {
    "scaling": (*STRIP, "--threads-list", "1,2", "--methods", "default,naive"),
    "methods": STRIP,
    "size": ("folding-strip", *FEW_STEPS),
    "memory": ("folding-strip", "--methods", "default,front", *ONE),
    "worlds": ("two-triangles", "--worlds", "3,12", "--threads", "2", *ONE),
    "ropes": ("--segments", "1000", "--segments-a-rope", "100", *ONE),
    "options": ("n-body-like-lr", "--size", "0.02", "--steps", "1", "--landscape", "200", *ONE),
    "distance": (*STRIP, "--separations", "0.02,0.002"),
    "step": STRIP,
    "motion": ("rod-twist-like", "--size", "0.02", "--steps", "1", *ONE),
    "inside": ("--size", "0.02", "--points", "300", *ONE),
    "accuracy": ("--parts", "sweeps", "--sweep-queries", "40"),
    "record": ("--megabytes", "2", "--seconds", "0.1", *ONE),
    "rigid": ("--parts", "truth,bounds", "--queries", "200"),
}


def check_scaling(rows):
    ways = [(method, threads) for method in ("default", "naive") for threads in (1, 2)]
    assert [(row["method"], row["threads"]) for row in rows] == [*ways, ("independent", 2)]
    assert len({row["contacts"] for row in rows}) == 1 and rows[0]["speedup"] == 1
    assert rows[-1]["speedup"] == pytest.approx(2 * rows[0]["step_ms"] / rows[-1]["step_ms"], rel=1e-3)


def check_methods(rows):
    assert {"default", "published", "naive", "front", "scalar"} <= {row["variant"] for row in rows}


def check_size(rows):
    small, _, large, _ = rows
    assert 3 < large["triangles"] / small["triangles"] < 5 and large["bytes"] > small["bytes"]


def check_memory(rows):
    default, front = rows
    assert 0 < default["detector_bytes"] < front["detector_bytes"], "the front keeps pairs of nodes"
    assert default["process_bytes"] > default["detector_bytes"] / 2


def check_worlds(rows):
    few, many = rows
    assert (few["worlds"], few["steps"], many["worlds"], many["steps"]) == (3, 3, 12, 10)
    assert many["contacts"] > few["contacts"] and few["of_all_threads"] > 0 and many["bytes_a_world"] > 100


def check_ropes(rows):
    assert [row["way"] for row in rows] == ["edges", "thin triangles", "cloth"]
    assert rows[0]["contacts"] == rows[1]["contacts"] > 0 and rows[0]["triangles"] == 0


def check_record(rows):
    assert [row["variant"] for row in rows] == ["no sync", "sync", "sync, slow disk"]
    assert all(row["throughput"] > 0 and row["median_us"] <= row["largest_us"] for row in rows)


def check_options(rows):
    by = {row["option"]: row for row in rows}
    full, faces, edges = by["full"], by["vertex-face only"], by["edge-edge only"]
    for less in ("no self-collision", "largest mesh ignored by all"):
        assert by[less]["candidates"] < full["candidates"]
    for key in ("contacts", "candidates"):
        assert faces[key] + edges[key] == full[key]
    around, static = by["landscape around it"], by["the same, static"]
    assert static["contacts"] == around["contacts"] == full["contacts"] and static["candidates"] < around["candidates"]


def check_distance(rows):
    asked = [("plain", None), *((query, d) for query in ("separation", "proximity") for d in (0.002, 0.02))]
    asked += [("intersections", None), ("distances", None)]
    assert [(row["query"], row["distance"]) for row in rows] == asked
    plain, small, large, near, nearer, _, gaps = rows
    assert 0 < plain["pairs"] < small["pairs"] < large["pairs"] and near["pairs"] < nearer["pairs"]
    assert gaps["pairs"] == plain["over_plain"] == 1


def check_step(rows):
    every, first, free, trial = rows
    assert every["contacts"] >= first["contacts"] > 0 and trial["listing_ms"] > 0
    assert 0 <= free["earliest"] <= every["earliest"] == first["earliest"] <= 1


def check_motion(rows):
    alike, each = rows
    assert (alike["way"], each["way"]) == ("step", "motion") and alike["touching"] == each["touching"] == 0
    assert each["mean"] > alike["mean"] == pytest.approx(0.9 * alike["step"])
    assert each["smallest_over_step"] >= 0.9 * (1 - 1e-9)


def check_inside(rows):
    by = {part: [row for row in rows if row["part"] == part] for part in inside.PARTS}
    assert len(by["points"]) == 4 * (len(inside.KINDS) + 1) and not any(row["wrong"] for row in by["points"])
    hard = [row for row in by["points"] if row["points"] == "hard" and row["state"] == "still"]
    assert len(hard) == 4 and all(row["on_surface"] > 0 for row in hard)
    assert all(row["curves"] > 0 and row["length"] > 1 for row in by["curves"])
    assert [row["mesh"] for row in by["containment"]] == list(inside.STREAMS)
    assert len(by["penetration"]) == 9 and all(0 < row["lower_bound"] <= row["depth"] for row in by["penetration"])


def check_accuracy(rows):
    hard = {tier: [r for r in rows if r["part"] == "adversarial" and r["accuracy"] == tier] for tier in page.TIERS}
    assert all(row["missed"] == row["invented"] == 0 for row in hard["exact"])
    assert any(row["missed"] + row["invented"] for row in hard["balanced"]), "these queries are not hard"


def check_rigid(rows):
    for row in rows:
        if row["part"] == "truth":
            assert row["touching"] > 10 and row["missed"] == row["late"] == row["beyond"] == row["open"] == 0
        else:
            assert 0 < row["low"] <= row["median"] <= row["largest"] <= 1


@pytest.mark.parametrize("name", [pytest.param(s, marks=pytest.mark.long) if s == "rigid" else s for s in SUBJECTS])
def test_subject(bench, name):
    status, result, _ = bench(name, *SUBJECTS[name])
    assert status == 0 and result["failures"] == [] and result["command"].startswith(f"python -m bench {name}")
    globals()[f"check_{name}"](result["rows"])


def test_cost_of_poses_and_joints(bench):
    few = ("--parts", "cost", "--size", "0.02", "--turns", "1,20", "--tolerances", "1e-3", "--threads", "1", *ONE)
    status, result, _ = bench("rigid", *few)
    ball, fast = (row for row in result["rows"] if row["scene"] == "spinning ball")
    assert status == 0 and (ball["parts"], fast["parts"]) == (1, 3) and ball["contacts"] > 0


def test_solved_cloth_is_a_source(bench):
    status, result, _ = bench("step", "cloth-ball-trial", "--size", "0.03", "--steps", "1", *ONE)
    assert status == 0 and result["rows"][0]["contacts"] > 0


def test_worlds_whose_results_differ_fail(bench, monkeypatch):
    detect, calls = hc.Detector.detect, collections.Counter()

    def from_the_second_call_on(self, *args, **options):
        calls[id(self)] += 1
        return detect(self, args[0], args[0] if self.worlds and calls[id(self)] > 1 else args[1], **options)

    monkeypatch.setattr(hc.Detector, "detect", from_the_second_call_on)
    status, result, _ = bench("worlds", "two-triangles", "--worlds", "12", "--repeat", "2", "--threads", "1")
    assert status == 1 and any("one_thread: contacts of world" in text for text in result["failures"])


@pytest.mark.long
def test_missed_motions_of_poses_fail(bench, monkeypatch):
    monkeypatch.setattr(rigid_results, "grown", lambda d, a, b: d)
    status, result, _ = bench("rigid", "--parts", "truth", "--queries", "400")
    assert status == 1 and any("missed" in text for text in result["failures"])


def test_steps_that_contradict_each_other_are_seen():
    source = of_scene("folding-strip", 0.1)
    last = source.step(source.n_steps - 1)
    runners = [step.StepRunner(query, {"backend": "cpu", "threads": 1}) for query in step.QUERIES]
    starts = {runner.name: [] for runner in runners}
    for runner in runners:
        for _ in range(4):
            runner.run(last)
            starts[runner.name].append(runner.prepared(last).vertices_t0.tobytes())
    assert step.contradictions(runners, "exact") == [] and len(set(starts["trial"])) == 1
    every, first, free, trial = runners
    place = next(iter(every.earliest))
    free.earliest[place] = every.earliest[place] + 1e-15
    first.earliest[place] = every.earliest[place] - 1e-15
    trial.hashes[place].add(1)
    assert [text.split(":")[0] for text in step.contradictions(runners, "exact")] == ["trial", "first", "step"]


@pytest.mark.parametrize("key", ["", "s_vf", "p_ee", "x_ef"])
def test_distance_queries_against_the_truth(bench, tmp_path, key):
    """A truth that lacks a pair of this kind fails."""
    source = of_scene("folding-strip", 0.05)
    last = source.step(source.n_steps - 1)
    v0, v1, faces = last.vertices_t0, last.vertices_t1, last.faces().astype(np.uint32)
    near, apart = oracle.proximity(v1, 0.02, [faces]), oracle.brute_force(v0, v1, [faces], minimum_separation=0.02)
    truth = {"p_d": 0.02, "s_d": 0.02, "x_ef": oracle.intersections(v1, [faces])}
    truth |= {f"p_{name}": getattr(near, name) for name in ("vf", "vf_distance", "ee", "ee_distance")}
    truth |= {f"s_{name}": getattr(apart, name) for name in ("vf", "vf_toc", "ee", "ee_toc")}
    truth |= {name: rows[1:] for name, rows in truth.items() if key and name.startswith(key)}
    (tmp_path / "distance").mkdir()
    np.savez(tmp_path / "strip.npz", vertices_t0=v0, vertices_t1=v1, faces=faces)
    np.savez(tmp_path / "distance" / "strip-distance.npz", **truth)
    few = ("--parts", "distance", "--sweep-queries", "0", "--data", str(tmp_path), *ONE)
    status, result, _ = bench("accuracy", *few)
    assert status == (1 if key else 0)
    assert not key or any("exact: missed 0, invented 1" in text for text in result["failures"])


def test_time_of_each_further_pair(monkeypatch):
    plain = {"step_ms": 10.0, "pairs": 10_000}
    for pairs, ms, us in ((15_000, 30.0, None), (20_000, 30.0, 4.0), (20_000, 15.0, 0.0)):
        assert distance.us_a_pair_beyond("separation", {"step_ms": ms, "pairs": pairs}, plain, threads=2) == us


def test_a_short_step_of_a_file_is_timed_more_often():
    class Takes:
        carries_state = True

        def __init__(self, ms):
            self.name, self.ms = f"{ms} ms", ms

        def run(self, step):
            return measure.Sample(self.ms, 0, 0, {}, {})

    source = of_scene("folding-strip", 0.1)
    one = type(source)("one", 1, lambda k: source.step(source.n_steps - 1))
    series = measure.measure(one, [Takes(2.0), Takes(50.0)], rounds=3)
    assert [len(of.by_step[0]) for of in series.values()] == [3 * measure.TURN_MS / 2.0, 3]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("scaling", *STRIP, "--threads-list", "0"), "--threads-list"),
        (("scaling", *STRIP, "--threads-list", "1,100000"), "at most 1024"),
        (("size", "folding-strip", "--sizes", "one"), "--sizes"),
        (("size", "cloth-ball"), "generated"),
        (("ropes", "cloth-drop"), "makes its own scenes"),
        (("ropes", "--segments", "100000000000000"), "ropes: does not fit into memory"),
        (("memory", "folding-strip", "--methods", ","), "--methods"),
        (("worlds", "breaking-like", "--size", "0.02", "--worlds", "8"), "topology changes"),
        (("worlds", "two-triangles", "--worlds", "65537"), "at most 65,536"),
        (("distance", *STRIP, "--separations", "1e-3,-1"), "--separations"),
        (("distance", *STRIP, "--arrays", "device"), "needs --backend gpu"),
        (("gpu", "--parts", "frames,all"), "'all' is not known"),
        (("ros", "--seconds", "nan"), "--seconds nan: must be a finite number"),
        (("soak", "--rate", "inf"), "--rate inf: must be a finite number"),
        (("rigid", "--turns", "0.5,nan,3"), "--turns"),
        (("accuracy", "--seed", "-1"), "--seed -1: must be a finite number"),
        (("stop", "--margin", "nan"), "--margin nan: must be a finite number"),
        (("step", "cloth-ball-trial", "--size", "65"), "is outside"),
        (("gpu", "--sizes", "1,8"), "at least 2 vertices"),
    ],
)
def test_wrong_use_is_explained(bench, capsys, arguments, text):
    status, result, _ = bench(*arguments)
    assert status == 2 and result is None and text in capsys.readouterr().err


def test_an_option_that_a_subject_does_not_use_is_rejected(bench, capsys):
    for subject, option in (("memory", "--steps"), ("gpu", "--steps"), ("soak", "--threads")):
        with pytest.raises(SystemExit):
            bench(subject, option, "2")
        assert f"unrecognized arguments: {option}" in capsys.readouterr().err


def test_steps_without_a_motion_are_rejected_first(tmp_path):
    none = sources.Source("none", 3, lambda k: None)
    parser = argparse.ArgumentParser()
    command.configure(parser, ("none",), steps=2)
    parser.set_defaults(benchmark="none", parser=parser, out=str(tmp_path))
    with pytest.raises(UserError, match="none: none of its measured steps keeps its topology"):
        command.begin(parser.parse_args([]), lambda *_: [none])


def test_close_distances_are_two_questions():
    assert distance.Question("proximity", 0.01).name != distance.Question("proximity", 0.0100000001).name


def test_a_peer_that_is_not_installed_is_named(bench, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipctk", None)  # as Python notes a module that cannot be imported
    assert bench("peer", *STRIP)[0] == 2
    assert "pip install" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "trueform", None)
    assert bench("inside", "--peers", "trueform")[0] == 2
    assert "pip install trueform" in capsys.readouterr().err


def test_a_peer_beside_it(bench):
    pytest.importorskip("ipctk", reason="ipctk is not installed: an optional extra (pip install 'hpccd[bench]')")
    for words in (("peer", *STRIP), ("step", *STRIP, "--peer", "ipctk"), ("distance", *STRIP, "--peer", "ipctk")):
        status, result, _ = bench(*words)
        assert status == 0 and any(row.get("times_faster_than_ipctk", 0) > 0 for row in result["rows"])


def test_distances_by_poses_without_a_gpu():
    rows, failures = [], []
    result = types.SimpleNamespace(add=lambda **row: rows.append(row), failure=failures.append)
    gpu._poses(result, argparse.Namespace(repeat=2, threads=1), 6, backend="cpu")
    assert failures == [] and [row["triangles"] for row in rows] == [288, 288]
    assert rows[0]["distance"] > 0 == rows[1]["distance"] and all(row["median_ms"] > 0 for row in rows)


@pytest.mark.skipif("gpu" not in hc.backends(), reason="no usable GPU")
def test_gpu(bench):
    few = ("folding-strip", "--size", "0.1", "--repeat", "5", "--sizes", "12", "--worlds", "1,3", "--threads", "2")
    status, result, _ = bench("gpu", *few, "--parts", "frames,threads")
    assert status == 0 and result["failures"] == [] and {r["part"] for r in result["rows"]} == {"frames", "threads"}
    pytest.importorskip("torch", reason="PyTorch is not installed: positions on the device are not measured")
    status, result, _ = bench("gpu", *few, "--spheres", "6", "--parts", "device,distances,poses,large,worlds")
    assert status == 0 and result["failures"] == []
    assert [sum(row["part"] == part for row in result["rows"]) for part in ("distances", "poses")] == [3, 2]
    detect = [row for row in result["rows"] if row.get("query") == "detect"]
    assert [row["worlds"] for row in detect] == [1, 3] and min(row["pairs"] for row in detect) > 0


def test_the_page_shows_the_kept_results():
    text = page.PAGE.read_text(encoding="utf-8")
    assert text == page.page(text), "PYTHONPATH=test python -m bench.page"
    assert [found["name"] for found in page.TABLE.finditer(text)] == list(dict.fromkeys(page.TABLES))
    assert all(f"results/{path.name}" in text for path in page.RESULTS.glob("*.json"))
    assert len(text.splitlines()) <= 400
    for path in page.RESULTS.glob("*.json"):
        kept = page.read(page.RESULTS, path.stem)
        assert kept["command"].startswith(("hpccd bench ", "python -m bench ")), path
        assert kept["rows"] and not kept["failures"], path
        assert "+changes" not in kept["machine"]["commit"], "measured on sources that are in no commit"


def test_missed_motions_of_poses_are_failures(bench, monkeypatch):
    wrong = rigid_results.Verdict(
        **{field.name: 0 for field in dataclasses.fields(rigid_results.Verdict)} | {"queries": 1, "missed": 1}
    )
    none = np.zeros(1)
    monkeypatch.setattr(rigid, "ask", lambda queries: rigid_results.Results(none, none, none, none, none, 0.0))
    monkeypatch.setattr(rigid, "judge", lambda queries, results: wrong)
    status, result, _ = bench("rigid", "--parts", "truth", "--queries", "2")
    assert status == 1 and len(result["failures"]) == 4 and all(" 1 missed" in text for text in result["failures"])


def test_a_near_step_without_a_rise_is_missed():
    """Of three steps the second comes near; frames come each tenth of a second."""
    ears, sent = object.__new__(stop.Ears), [0.0, 0.1, 0.2, 0.3]
    for changes, missed, late, rises in (
        ([(0.0, False)], 1, 0, 0),  # never
        ([(0.0, False), (0.25, True)], 0, 0, 1),
        ([(0.0, False), (0.35, True)], 0, 1, 1),
        ([(0.0, False), (0.66, True)], 1, 0, 0),  # only by silence
    ):
        ears.changes = changes
        judged = stop.judge([False, True, False], sent, ears, 0.1, 0.5)
        assert (judged["near"], judged["missed"], judged["late"], judged["rises"]) == (1, missed, late, rises)
