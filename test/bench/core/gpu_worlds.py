# SPDX-License-Identifier: Apache-2.0
"""Many worlds in one call: contacts of garments in motion, and what is near in folded sheets at rest."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial

import numpy as np

import hpccd_core as hc
from bench.core import gpu_work, many_garments
from bench.core.device_arrays import library
from bench.core.gpu_times import StagesDetector, call_times, check, device_stages
from hpccd_ros.bench import report as tables
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh

NEAR = 0.35  # in folded sheets, whose vertices are 1 apart


@dataclasses.dataclass(frozen=True)
class Case:
    """ask(detector, arrays, **options) of so many worlds; of_world: the step of the first one."""

    query: str
    of_world: Step
    arrays: tuple[np.ndarray, ...]
    ask: Callable


def cases(worlds: int):
    """Each is made when it is asked for: positions of thousands of worlds take room."""
    start, end = many_garments.motions(worlds)
    mesh = Mesh("garment", many_garments.garment(), start.shape[1])
    yield Case("detect", Step((mesh,), 0, start[0], end[0]), (start, end), lambda d, a, **o: d.detect(*a, **o))
    faces, xyz = many_garments.folded_sheet()
    all_ = np.repeat(xyz[None], worlds, axis=0)
    step = Step((Mesh("sheet", faces, len(xyz)),), 0, xyz, xyz)
    yield Case("proximity", step, (all_,), lambda d, a, **o: d.proximity(*a, NEAR, **o))


def measure(report, args, worlds):
    """Adds a row for each query."""
    for case in cases(worlds):
        _measure(report, args, worlds, case)


def _measure(report, args, worlds, case):
    what = f"worlds, {case.query} in {worlds:,}"
    arrays, scene = library("--parts worlds"), case.of_world.scene()
    options = {"worlds": worlds, "threads": args.threads}
    on_cpu = hc.Detector(scene, backend="cpu", **options)
    cpu, expected = call_times(partial(case.ask, on_cpu, case.arrays), args.repeat)
    there, stream = tuple(map(arrays.array, case.arrays)), arrays.stream()
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    ask = partial(case.ask, detector, there, stream=stream)
    on_device, found = call_times(ask, args.repeat)
    same = found.hash == expected.hash and np.array_equal(_hashes(found.to_host()), _hashes(expected))
    check(report, what, detector, same)
    stats = detector.stats
    del detector, ask, found  # lists of millions of pairs, which the next one needs too
    staged = StagesDetector(scene, backend="gpu", results="device", **options)
    row = report.add(
        part="worlds",
        query=case.query,
        worlds=worlds,
        triangles=case.of_world.triangles,
        pairs=len(expected),
        cpu_median_ms=cpu.median,
        **on_device.as_row(),
        us_a_world=1e3 * on_device.median / worlds,
        bytes=stats["gpu_bytes"],
        stages_ms=device_stages(staged, partial(case.ask, staged, there, stream=stream)),
    )
    if case.query == "detect":
        row["candidates"] = stats["vf_candidates"] + stats["ee_candidates"]
        row["decided"] = gpu_work.decided(stats)
        row["floors"] = gpu_work.floors(args, gpu_work.counts(case.of_world, stats, worlds))


def _hashes(found):
    """Of each world, in order."""
    return [found.hash] if found.slices is None else found.slices.hashes


def show(rows):
    tables.show(
        "many worlds in one call, positions and results on the device, exact",
        ["query", "worlds", "triangles a world", "pairs", "CPU ms", "GPU ms", "p95", "us a world", "bytes a world"],
        [
            [
                r["query"],
                r["worlds"],
                r["triangles"],
                r["pairs"],
                r["cpu_median_ms"],
                r["median_ms"],
                r["p95_ms"],
                r["us_a_world"],
                r["bytes"] / r["worlds"],
            ]
            for r in rows
        ],
    )
    stages = list(dict.fromkeys(s for r in rows for s in r["stages_ms"]))
    tables.show(
        "device time by stage in calls of their own, ms",
        ["stage", *(f"{r['query']} {r['worlds']}" for r in rows)],
        [[stage, *(r["stages_ms"].get(stage) for r in rows)] for stage in stages],
    )
