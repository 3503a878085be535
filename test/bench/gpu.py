# SPDX-License-Identifier: Apache-2.0
"""The GPU and hybrid backends compared with the CPU, and positions and results that stay on the device.

  python -m bench gpu data                      the scene files of HPCCD_DATA, all parts
  python -m bench gpu cloth-ball --repeat 100 --parts frames
  python -m bench gpu --parts worlds --worlds 64,1024 --repeat 20

  frames    ms per frame from host to host, and device time by stage (in separate calls)
  threads   Fig. 6 of Kim et al. 2009: threads by GPUs, default and published method
  device    from the device to the host, on the device, and in a CUDA graph (PyTorch or CuPy)
  large     the same for two nets that collide nearly edge on edge (--sizes)
  distances smallest distances in two frames in turn, also of two large deforming spheres (--spheres)
  poses     the same of two rigid spheres by poses, new in each call: no positions are uploaded (--spheres)
  worlds    contacts of a folded garment, and near pairs in a folded sheet, many times in one call (--worlds)

Fails if results differ from the CPU's, or if a device left a frame to the CPU.
"""

from __future__ import annotations

import dataclasses
import itertools
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import hpccd_core as hc
from bench import lab, shapes
from bench.device import library
from hpccd_core._core import MOST_WORLDS
from hpccd_ros.bench.sources import Step
from hpccd_ros.scenes.scene import Mesh

OF_SCENES = ("frames", "threads", "device", "distances")
PARTS = (*OF_SCENES, "poses", "large", "worlds")
GAPS = 0.1, -0.3  # of two spheres; below 0 they intersect
TIERS = ("balanced", "exact")
NEAR = 0.35  # of proximity in folded sheets, whose vertices are 1 apart
FEWEST, SECONDS = 5, 1.0  # rounds of each way: at least FEWEST, and no more once SECONDS have passed
WARM_UP = 8  # the lists on the devices reach their size
COLUMNS = {
    "part": "part",
    "scene": "scene",
    "accuracy": "accuracy",
    "triangles": "triangles",
    "contacts": "contacts",
    "CPU, ms": "cpu_median_ms",
    "hybrid": "hybrid_median_ms",
    "host to host": "host_median_ms",
    "device to host": "to_host_median_ms",
    "this way": "median_ms",
    "p95": "p95_ms",
    "graph": "graph_median_ms",
}
WORLDS = {
    "query": "query",
    "worlds": "worlds",
    "triangles": "triangles",
    "pairs": "pairs",
    "CPU, ms": "cpu_median_ms",
    "GPU, ms": "median_ms",
    "us a world": "us_a_world",
}
DISTANCES = {
    "scene": "scene",
    "triangles": "triangles",
    "pairs of meshes": "pairs",
    "CPU, ms": "cpu_median_ms",
    "host to host": "host_median_ms",
    "device to host": "median_ms",
    "p95": "p95_ms",
}
POSES = {
    "scene": "scene",
    "triangles": "triangles",
    "CPU, ms": "cpu_median_ms",
    "GPU, ms": "median_ms",
    "p95": "p95_ms",
    "first": "first_ms",
}
THREADS = {key: key for key in ("scene", "method", "threads", "gpus", "median_ms", "speedup")}


def configure(parser):
    lab.configure(parser, ("data",), rounds=50)
    add = parser.add_argument
    add("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    add("--sizes", default="224,708,1415", metavar="N,...", help="vertices along a side of each net")
    add("--spheres", default="500,1369", metavar="N,...", help="rings of each sphere, of 4 N^2 triangles")
    add("--worlds", default="64,1024,4096,8192", metavar="W,...", help="how many in a call (default: %(default)s)")


def run(args) -> lab.Report:
    parts = lab.listed("--parts", args.parts, PARTS)
    named = ("sizes", "spheres", "worlds")
    sizes, spheres, worlds = (lab.numbers(f"--{name}", getattr(args, name), int) for name in named)
    if sizes[0] < 2:
        raise lab.UserError(f"--sizes {args.sizes}: a net has at least 2 vertices along a side")
    if worlds[-1] > MOST_WORLDS:
        raise lab.UserError(f"--worlds {args.worlds}: a detector takes at most {MOST_WORLDS:,}; name fewer")
    if "gpu" not in hc.backends():
        raise lab.UserError(f"no usable GPU: {hc.gpu_status()['reason']}")
    if set(parts) & {"device", "distances", "large", "worlds"}:
        library("--parts device, distances, large or worlds")
    if not set(parts) & set(OF_SCENES):
        args.default_sources = ()
    result, sources = lab.begin(args)
    for source in sources:
        for part, measure in (("frames", _frame), ("device", _on_device)):
            for accuracy in TIERS if part in parts else ():
                measure(result, args, part, source.name, source.step(0), accuracy)
        if "threads" in parts:
            _threads(result, args, source.name, source.step(0))
        if "distances" in parts:
            _distances(result, args, source.name, source.step(source.n_steps // 2))
    for n in spheres if "distances" in parts else ():
        for gap in GAPS:
            _distances(result, args, f"spheres {n}, {gap:+g}", shapes.two_spheres(n, gap))
    for n in spheres if "poses" in parts else ():
        _poses(result, args, n)
    for n in sizes if "large" in parts else ():
        _on_device(result, args, "large", f"nets {n}", shapes.two_nets(n), "exact")
    for count in worlds if "worlds" in parts else ():
        _worlds(result, args, count)
    for title, columns, of in (
        ("ms a call", COLUMNS, ("frames", "device", "large")),
        ("Fig. 6: ms, and times one CPU thread with the published method", THREADS, ("threads",)),
        ("smallest distances, ms a call", DISTANCES, ("distances",)),
        ("smallest distances by poses, ms a call", POSES, ("poses",)),
        ("many worlds in one call, positions and results on the device", WORLDS, ("worlds",)),
    ):
        if rows := [row for row in result.rows if row["part"] in of]:
            lab.show(title, columns, rows)
    return result


class StagesDetector(hc.Detector):
    """Its profile has device time by stage; events cost time themselves, so its calls are not those that count."""

    _gpu_stages = True


def call_times(ask: Callable, repeat: int):
    """(times of ask(), its last result) after a warm-up; rounds end early where they take long."""
    began = time.perf_counter()
    for _ in range(WARM_UP):
        found = ask()
        if time.perf_counter() - began > SECONDS:
            break
    ms = []
    began = time.perf_counter()
    while len(ms) < repeat and (len(ms) < FEWEST or time.perf_counter() - began < SECONDS):
        start = time.perf_counter()
        found = ask()
        ms.append(1e3 * (time.perf_counter() - start))
    return lab.times(ms), found


def detector_times(detector, step, repeat):
    return call_times(lambda: detector.detect(step.vertices_t0, step.vertices_t1), repeat)


def _stages(detector: StagesDetector, ask: Callable) -> dict[str, float]:
    """Device ms by stage, the median over calls after a warm-up."""
    calls = []
    for _ in range(2 * WARM_UP):
        ask()
        calls.append({name: ms for name, ms in detector.profile.items() if name.startswith("gpu/")})
    of = calls[WARM_UP:]
    return {name: lab.times([call.get(name, 0.0) for call in of])["median_ms"] for name in of[-1]}


def _check(result, what: str, detector, same: bool) -> None:
    if not same:
        result.failure(f"{what}: results of GPU and CPU differ")
    if detector.stats.get("gpu_fallbacks"):
        result.failure(f"{what}: frames left to the CPU: {detector.last_gpu_error}")


def _frame(result, args, part, name, step, accuracy):
    of, took = _Step(result, args, part, name, step, accuracy), {}
    for backend in ("cpu", "hybrid", "gpu"):
        took[backend] = of.timed(backend, step, backend)
    staged = StagesDetector(of.scene, backend="gpu", **of.options)
    stages = _stages(staged, lambda: staged.detect(step.vertices_t0, step.vertices_t1))
    of.add(hybrid_median_ms=took["hybrid"]["median_ms"], **took["gpu"], stages_ms=of.profile | stages)


def _on_device(result, args, part, name, step, accuracy):
    """One step from host to host, from the device to the host, on the device, and in a graph."""
    of, arrays = _Step(result, args, part, name, step, accuracy), library(f"--parts {part}")
    moved = {end: arrays.array(getattr(step, end)) for end in ("vertices_t0", "vertices_t1")}
    there, stream = dataclasses.replace(step, **moved), arrays.stream()
    of.timed("cpu", step, "cpu")
    ways = {way: of.timed("gpu", given, way) for way, given in (("host", step), ("to_host", there))}
    detector = hc.Detector(of.scene, backend="gpu", results="device", **of.options)
    ends = there.vertices_t0, there.vertices_t1
    on_device, found = call_times(lambda: detector.detect(*ends, stream=stream), args.repeat)
    _check(result, f"{of.what}, device", detector, found.hash == of.expected == found.to_host().hash)
    held = detector.stats["gpu_bytes"]
    prepared = detector.prepare(*ends)
    in_graph, _ = call_times(arrays.graph(prepared.enqueue, stream), args.repeat)
    if prepared.contacts().hash != of.expected:
        result.failure(f"{of.what}, graph: results of GPU and CPU differ")
    detector = prepared = found = None  # lists of millions of pairs, which the next one needs too
    staged = StagesDetector(of.scene, backend="gpu", results="device", **of.options)
    of.add(
        **{f"{way}_median_ms": took["median_ms"] for way, took in ways.items()},
        **on_device,
        graph_median_ms=in_graph["median_ms"],
        bytes=held,
        stages_ms=_stages(staged, lambda: staged.detect(*ends, stream=stream)),
    )


def _distances(result, args, name, step):
    """Positions of two frames in turn, so that each call refits and the last nearest pairs are not the next ones."""
    arrays, scene = library("--parts distances"), step.scene()
    frames = step.vertices_t0, step.vertices_t1
    there = [arrays.array(xyz) for xyz in frames]
    took, gaps = {}, {}
    for way, backend, given in (("cpu", "cpu", frames), ("host", "gpu", frames), ("device", "gpu", there)):
        detector, turns = hc.Detector(scene, backend=backend, threads=args.threads), itertools.cycle(given)
        took[way], _ = call_times(lambda of=detector, turns=turns: of.distances(next(turns)), args.repeat)
        gaps[way] = [
            [(gap.distance, gap.kind, gap.features, gap.inside) for gap in detector.distances(x)] for x in given
        ]
        _check(result, f"distances, {name}, {way}", detector, gaps[way] == gaps["cpu"])
    held = detector.stats["gpu_bytes"]
    detector = None
    staged, turns = StagesDetector(scene, backend="gpu", threads=args.threads), itertools.cycle(there)
    result.add(
        part="distances",
        scene=name,
        triangles=step.triangles,
        pairs=len(gaps["cpu"][0]),
        distance=[min((gap[0] for gap in frame), default=None) for frame in gaps["cpu"]],
        cpu_median_ms=took["cpu"]["median_ms"],
        host_median_ms=took["host"]["median_ms"],
        **took["device"],
        bytes=held,
        stages_ms=_stages(staged, lambda: staged.distances(next(turns))),
    )


def _poses(result, args, n, backend="gpu"):
    """Two rigid spheres that move and turn a little from call to call; one of each kind of detector for all gaps."""
    scene, triangles = shapes.rigid_spheres(n)
    options = {"threads": args.threads}
    detectors = [hc.Detector(scene, backend="cpu", **options)]
    detectors += [kind(scene, backend=backend, **options) for kind in (hc.Detector, StagesDetector)]
    for gap in GAPS:
        name, took, gaps, first_ms = f"rigid spheres {n}, {gap:+g}", [], [], []
        for detector in detectors:
            turns = map(shapes.poses_of_spheres, itertools.repeat(gap), itertools.count())
            began = time.perf_counter()
            detector.distances(poses=next(turns))
            first_ms.append(1e3 * (time.perf_counter() - began))

            def ask(of=detector, turns=turns):
                return of.distances(poses=next(turns))

            if isinstance(detector, StagesDetector):
                stages = _stages(detector, ask)
                continue
            took.append(call_times(ask, args.repeat)[0])
            last = (shapes.poses_of_spheres(gap, k) for k in range(8))
            gaps.append([(g.distance, g.kind, g.features, g.inside) for x in last for g in detector.distances(poses=x)])
            _check(result, name, detector, gaps[-1] == gaps[0])
        if backend == "gpu" and (detectors[1].backend != "gpu" or "node_pairs" in detectors[1].stats):
            result.failure(f"{name}: not computed by poses on the GPU")
        result.add(
            part="poses",
            scene=name,
            triangles=triangles,
            distance=gaps[0][-1][0],
            cpu_median_ms=took[0]["median_ms"],
            **took[1],
            first_ms=first_ms[1],
            bytes=detectors[1].stats.get("gpu_bytes"),
            stages_ms=stages,
        )


class _Step:
    """A step of a scene and its row: every way is held against the first one that was timed, on the CPU."""

    def __init__(self, result, args, part, name, step, accuracy):
        self._result, self._repeat, self.expected = result, args.repeat, None
        self.what, self.scene = f"{part}, {name}, {accuracy}", step.scene()
        self.options = {"accuracy": accuracy, "threads": args.threads}
        self._row = {"part": part, "scene": name, "accuracy": accuracy, "triangles": step.triangles}

    def timed(self, backend: str, step, way: str) -> dict:
        detector = hc.Detector(self.scene, backend=backend, **self.options)
        took, found = detector_times(detector, step, self._repeat)
        if self.expected is None:
            self.expected = found.hash
            self._row |= {"contacts": len(found), "cpu_median_ms": took["median_ms"]}
        _check(self._result, f"{self.what}, {way}", detector, found.hash == self.expected)
        self.profile = detector.profile
        return took

    def add(self, **more) -> None:
        self._result.add(**self._row, **more)


def _threads(result, args, name, step):
    """Over one CPU thread with the published method."""
    gpus = range(len(hc.gpu_status()["devices"]) + 1)
    counts = sorted({*(1 << k for k in range(lab.cores().bit_length()) if 1 << k <= lab.cores()), lab.cores()})
    every = [(method, n, g) for method in ("published", "default") for n in counts for g in gpus]
    runs = dict.fromkeys([("published", 1, 0), *every])
    base = expected = None
    for method, threads, n_gpus in runs:
        where = {"backend": "hybrid", "gpus": n_gpus} if n_gpus else {"backend": "cpu"}
        detector = hc.Detector(step.scene(), accuracy="balanced", method=method, threads=threads, **where)
        took, contacts = detector_times(detector, step, args.repeat)
        base, expected = base or took["median_ms"], expected or contacts.hash
        _check(result, f"{name}, {method}, {threads} threads, {n_gpus} GPUs", detector, contacts.hash == expected)
        run = {"method": method, "threads": threads, "gpus": n_gpus, "speedup": base / took["median_ms"]}
        result.add(part="threads", scene=name, **run, **took)


def _worlds(result, args, worlds):
    start, end = shapes.motions(worlds)
    faces, xyz = shapes.folded_sheet()
    garment = Step((Mesh("garment", shapes.garment(), start.shape[1]),), 0, start[0], end[0])
    sheet = Step((Mesh("sheet", faces, len(xyz)),), 0, xyz, xyz)
    motions, folded = (start, end), (np.repeat(xyz[None], worlds, axis=0),)
    _world_query(result, args, worlds, "detect", garment, motions, lambda d, a, **o: d.detect(*a, **o))
    _world_query(result, args, worlds, "proximity", sheet, folded, lambda d, a, **o: d.proximity(*a, NEAR, **o))


def _world_query(result, args, worlds, query, of_world, given, ask):
    arrays, scene, options = library("--parts worlds"), of_world.scene(), {"worlds": worlds, "threads": args.threads}
    cpu, expected = call_times(partial(ask, hc.Detector(scene, backend="cpu", **options), given), args.repeat)
    there, stream = tuple(map(arrays.array, given)), arrays.stream()
    detector = hc.Detector(scene, backend="gpu", results="device", **options)
    on_device, found = call_times(partial(ask, detector, there, stream=stream), args.repeat)
    same = found.hash == expected.hash and np.array_equal(_hashes(found.to_host()), _hashes(expected))
    _check(result, f"worlds, {query} in {worlds:,}", detector, same)
    held = detector.stats["gpu_bytes"]
    detector = found = None  # lists of millions of pairs, which the next one needs too
    staged = StagesDetector(scene, backend="gpu", results="device", **options)
    result.add(
        part="worlds",
        query=query,
        worlds=worlds,
        triangles=of_world.triangles,
        pairs=len(expected),
        cpu_median_ms=cpu["median_ms"],
        **on_device,
        us_a_world=1e3 * on_device["median_ms"] / worlds,
        bytes=held,
        stages_ms=_stages(staged, partial(ask, staged, there, stream=stream)),
    )


def _hashes(found):
    return [found.hash] if found.slices is None else found.slices.hashes
