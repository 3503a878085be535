# SPDX-License-Identifier: Apache-2.0
"""Positions and results that stay on the GPU, beside the ways to and from the host; where the time goes there."""

from __future__ import annotations

import dataclasses
from functools import partial

import hpccd_core as hc
from bench.core import gpu_work, two_nets
from bench.core.device_arrays import library
from bench.core.gpu_times import StagesDetector, call_times, check, detector_times, device_stages
from hpccd_ros.bench import report as tables


def measure(report, args, part, name, step, accuracy):
    """Adds a row: one step from host to host, from the device to the host, on the device, and in a graph."""
    what = f"{part}, {name}, {accuracy}"
    options, scene = {"accuracy": accuracy, "threads": args.threads}, step.scene()
    arrays = library(f"--parts {part}")
    moved = {end: arrays.array(getattr(step, end)) for end in ("vertices_t0", "vertices_t1")}
    there, stream = dataclasses.replace(step, **moved), arrays.stream()
    on_cpu, expected = detector_times(hc.Detector(scene, backend="cpu", **options), step, args.repeat)
    ways = {}
    for way, given in (("host", step), ("to_host", there)):
        detector = hc.Detector(scene, backend="gpu", **options)
        ways[way], found = detector_times(detector, given, args.repeat)
        check(report, f"{what}, {way}", detector, found.hash == expected.hash)

    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    ask = partial(detector.detect, there.vertices_t0, there.vertices_t1, stream=stream)
    on_device, found = call_times(ask, args.repeat)
    check(report, f"{what}, device", detector, found.hash == expected.hash == found.to_host().hash)
    stats = detector.stats
    prepared = detector.prepare(there.vertices_t0, there.vertices_t1)
    in_graph, _ = call_times(arrays.graph(prepared.enqueue, stream), args.repeat)
    if prepared.contacts().hash != expected.hash:
        report.failure(f"{what}, graph: answers of GPU and CPU differ")
    del prepared, detector, ask, found  # lists of millions of pairs, which the next one needs too
    staged = StagesDetector(scene, backend="gpu", results="device", **options)
    report.add(
        part=part,
        scene=name,
        accuracy=accuracy,
        triangles=step.triangles,
        contacts=len(expected),
        cpu_median_ms=on_cpu.median,
        host_median_ms=ways["host"].median,
        to_host_median_ms=ways["to_host"].median,
        **on_device.as_row(),
        graph_median_ms=in_graph.median,
        bytes=stats["gpu_bytes"],
        candidates=stats["vf_candidates"] + stats["ee_candidates"],
        decided=gpu_work.decided(stats),
        stages_ms=device_stages(staged, partial(staged.detect, there.vertices_t0, there.vertices_t1, stream=stream)),
        floors=gpu_work.floors(args, gpu_work.counts(step, stats)),
    )


def measure_large(report, args, sizes):
    """Two nets that meet nearly edge on edge, of each size."""
    for n in sizes:
        step = two_nets.step(n)
        measure(report, args, "large", f"nets {n}", step, "exact")


def show(rows):
    tables.show(
        "ms a call, by where positions and results lie",
        [
            "scene",
            "accuracy",
            "triangles",
            "contacts",
            "CPU",
            "host to host",
            "device to host",
            "device",
            "p95",
            "best",
            "graph",
            "bytes a triangle",
        ],
        [
            [
                r["scene"],
                r["accuracy"],
                r["triangles"],
                r["contacts"],
                r["cpu_median_ms"],
                r["host_median_ms"],
                r["to_host_median_ms"],
                r["median_ms"],
                r["p95_ms"],
                r["best_ms"],
                r["graph_median_ms"],
                r["bytes"] / r["triangles"],
            ]
            for r in rows
        ],
    )
    show_stages(rows)
    show_decided(rows)


def show_stages(rows):
    """Device time beside the floor of each stage."""
    stages = list(dict.fromkeys(s for r in rows for s in r["stages_ms"]))
    tables.show(
        "device time by stage in calls of their own, ms, and its floor",
        ["stage", *(head for r in rows for head in (f"{r['scene']} {r['accuracy']}", "floor"))],
        [
            [stage, *(cell for r in rows for cell in (r["stages_ms"].get(stage), floor_of(r, stage)))]
            for stage in stages
        ],
        "floor: bytes over --memory, operations over --rate and --single-rate, whichever takes longest "
        "(counted in test/bench/core/gpu_work.py)",
    )


def floor_of(row, stage):
    """ms; None where nothing is counted."""
    of = row["floors"].get(stage.removeprefix("gpu/"))
    return of and of["ms"]


def show_decided(rows):
    names = list(rows[0]["decided"])
    tables.show(
        "which arithmetic decided the candidate pairs",
        ["scene", "accuracy", "candidates", *(name.replace("_", " ") for name in names)],
        [[r["scene"], r["accuracy"], r["candidates"], *(r["decided"][name] for name in names)] for r in rows],
        "first filter, sieve: single precision with proven bounds; extended: twice the precision of doubles",
    )
