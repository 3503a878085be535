# SPDX-License-Identifier: Apache-2.0
"""`python -m bench gpu` without a GPU: what it refuses, what it checks and keeps. The CPU stands for the device."""

import types

import numpy as np
import pytest

import hpccd_core as hc
from bench.core import (
    device_arrays,
    gpu,
    gpu_device,
    gpu_times,
    gpu_work,
    gpu_worlds,
    many_garments,
    two_nets,
)

OF_A_GPU = (
    "by_tolerance",
    "by_extended",
    "by_integers",
    "single_root",
    "many_roots",
    "undecided",
    "proven_contacts",
    "rejected_coplanarity",
    "rejected_projection",
    "rejected_roots",
)


class CpuAsGpu(hc.Detector):
    """Answers as a detector on the GPU: hpccd_core.Detector where the benchmark makes one."""

    wrong = 0

    def __init__(self, scene, *, backend="cpu", results="host", **options):
        super().__init__(scene, backend="cpu", **options)
        self._device = results == "device"

    def detect(self, start, end, stream=None):
        return self._there(super().detect(start, end))

    def proximity(self, vertices, distance, stream=None):
        return self._there(super().proximity(vertices, distance))

    def prepare(self, start, end):
        found = types.SimpleNamespace(hash=self.detect(start, end).hash)
        return types.SimpleNamespace(enqueue=lambda stream: None, contacts=lambda: found)

    def _there(self, found):
        if not self._device:
            return found
        return types.SimpleNamespace(hash=found.hash + self.wrong, to_host=lambda: found)

    @property
    def stats(self):
        absent = {f"{kind}_{name}": 0 for kind in ("vf", "ee") for name in OF_A_GPU}
        return absent | {"gpu_fallbacks": 0, "gpu_exact_on_cpu": 0, "gpu_bytes": 7000} | super().stats

    @property
    def profile(self):
        return super().profile | {"gpu/bounds": 0.5, "gpu/upload": 0.25}


class OnHost:
    def array(self, xyz):
        return xyz

    def stream(self):
        return 1

    def graph(self, enqueue, stream):
        return lambda: enqueue(stream)


@pytest.fixture
def device(monkeypatch):
    """CpuAsGpu, in whose place the command believes a GPU."""

    class Staged(CpuAsGpu):
        pass

    for module in (gpu_device, gpu_worlds):
        monkeypatch.setattr(module, "library", lambda option: OnHost())
        monkeypatch.setattr(module, "StagesDetector", Staged)
    monkeypatch.setattr(gpu, "library", lambda option: OnHost())
    monkeypatch.setattr(hc, "Detector", CpuAsGpu)
    monkeypatch.setattr(hc, "backends", lambda: ["cpu", "gpu", "hybrid"])
    monkeypatch.setattr(gpu_times, "SECONDS", 0.0)
    return CpuAsGpu


def test_results_on_the_device(bench, device):
    status, result, _ = bench("gpu", "folding-strip", "--size", "0.1", "--parts", "device", "--repeat", "5")
    assert status == 0 and result["failures"] == []
    assert [(row["part"], row["accuracy"]) for row in result["rows"]] == [("device", "balanced"), ("device", "exact")]
    for row in result["rows"]:
        assert row["candidates"] > 0 and row["bytes"] == 7000
        medians = ("cpu_median", "host_median", "to_host_median", "median", "graph_median")
        assert min(row[f"{key}_ms"] for key in medians) > 0
        assert row["stages_ms"] == {"gpu/bounds": 0.5, "gpu/upload": 0.25}
        assert row["floors"]["bounds"]["ms"] > 0


def test_generated_parts_need_no_scenes(bench, device):
    status, result, _ = bench("gpu", "--parts", "large,worlds", "--sizes", "12", "--worlds", "3,1", "--repeat", "5")
    assert status == 0 and result["failures"] == []
    nets, *worlds = result["rows"]
    assert nets["part"] == "large" and nets["triangles"] == 4 * 11**2 and nets["contacts"] > 100
    assert [(row["query"], row["worlds"]) for row in worlds] == [
        ("detect", 1),
        ("proximity", 1),
        ("detect", 3),
        ("proximity", 3),
    ]
    assert worlds[2]["floors"]["bounds"]["moved"] == pytest.approx(3 * worlds[0]["floors"]["bounds"]["moved"])
    assert worlds[2]["pairs"] / 3 > 100 and worlds[3]["pairs"] == 3 * worlds[1]["pairs"] > 0


def test_another_answer_fails(bench, device, monkeypatch):
    monkeypatch.setattr(device, "wrong", 1)
    status, result, _ = bench("gpu", "--parts", "large,worlds", "--sizes", "8", "--worlds", "2", "--repeat", "5")
    assert status == 1
    assert [text.split(":")[0] for text in result["failures"]] == [
        "large, nets 8, exact, device",
        "large, nets 8, exact, graph",
        "worlds, detect in 2",
        "worlds, proximity in 2",
    ]


def test_a_frame_left_to_the_cpu_fails(bench, device, monkeypatch):
    monkeypatch.setattr(device, "stats", property(lambda d: {"gpu_fallbacks": 1, **_counts(d)}))
    status, result, _ = bench("gpu", "--parts", "large", "--sizes", "8", "--repeat", "5")
    assert status == 1 and "large, nets 8, exact, device: frames left to the CPU: " in result["failures"]


def _counts(detector):
    kinds = {f"{kind}_{name}": 0 for kind in ("vf", "ee") for name in (*OF_A_GPU, "candidates", "contacts")}
    return kinds | {"gpu_exact_on_cpu": 0, "gpu_bytes": 0, "node_pairs": 0, "leaf_pairs": 0}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (
            ("--parts", "frames,all"),
            "--parts frames,all: 'all' is not known; choose from frames, threads, segments, device, large, worlds",
        ),
        (("--sizes", "1,8"), "--sizes 1,8: a net has at least 2 vertices along a side"),
        (("--worlds", "64,70000"), "--worlds 64,70000: a detector takes at most 65,536"),
        (("--worlds", "many"), "--worlds many: numbers with commas between"),
    ],
)
def test_wrong_use_is_explained(bench, capsys, arguments, text):
    status, result, _ = bench("gpu", *arguments)
    assert status == 2 and result is None
    assert text in capsys.readouterr().err


def test_without_a_gpu_it_says_why(bench, capsys):
    if "gpu" in hc.backends():
        pytest.skip("a GPU is here")
    assert bench("gpu", "--parts", "worlds")[0] == 2
    assert "no usable GPU: " in capsys.readouterr().err


def test_without_a_library_of_arrays_it_says_which(monkeypatch):
    def absent():
        raise ImportError

    monkeypatch.setattr(device_arrays, "_Torch", absent)
    monkeypatch.setattr(device_arrays, "_Cupy", absent)
    with pytest.raises(gpu.UserError, match="--parts device: neither torch nor cupy is installed"):
        device_arrays.library("--parts device")


def test_all_candidates_are_decided_by_one_arithmetic():
    kind = {
        "candidates": 100,
        "rejected_coplanarity": 60,
        "single_root": 20,
        "many_roots": 5,
        "undecided": 4,
        "by_tolerance": 0,
        "by_extended": 2,
        "by_integers": 1,
    }
    stats = {f"{k}_{name}": n for k in ("vf", "ee") for name, n in kind.items()} | {"gpu_exact_on_cpu": 2}
    found = gpu_work.decided(stats)
    assert sum(found.values()) == 200
    assert (found["first_filter"], found["sieve"], found["doubles"], found["integers"]) == (120, 30, 42, 2)


def test_each_item_names_a_count_and_a_stage_of_the_device():
    step = two_nets.step(4)
    stats = _counts(None) | {"vf_candidates": 1000}
    of = gpu_work.counts(step, stats)
    assert {item.count for item in gpu_work.TABLE} <= of.keys()
    assert of["vertices"] == 32 and of["groups"] == 32 + 2 * 33 and of["features"] == 2 * 33 + 36
    args = types.SimpleNamespace(memory=1.0, rate=1.0, single_rate=1.0)
    assert gpu_work.floors(args, of)["candidates"]["singles"] > 1000 * 100


def test_generated_worlds():
    start, end = many_garments.motions(300)
    assert start.shape == end.shape == (300, 1426, 3) and len(many_garments.garment()) == 2700
    assert len(np.unique(start[:, 0], axis=0)) == 256 and np.array_equal(start[:44], start[256:])
    faces, xyz = many_garments.folded_sheet()
    assert len(faces) == 2592 and xyz.dtype == np.float32
