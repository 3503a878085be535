# SPDX-License-Identifier: Apache-2.0
"""Small scenes of meshes, ropes, points and planes, with thickness and filters: all results by the core and by the
oracle.

One detector computes all scenes of a topology; separations, thickness and planes change from call to call.
"""

from __future__ import annotations

import functools
import itertools
import zlib
from collections.abc import Iterator, Sequence

import numpy as np
from oracle.mixed import CONTACT_KINDS, Values

import hpccd_core as hc

from .mixed_scenes import TOPOLOGIES, Topology
from .motions import KEPT
from .steps import EARLY

TOLERANCE = 1e-12
PROMISING = ("exact", "conservative")

Found = dict[str, tuple[np.ndarray, np.ndarray]]


@functools.lru_cache(maxsize=4096)
def _true_contacts(kind: str, query: bytes) -> Found:
    top = TOPOLOGIES[kind]
    return top.scene.contacts(*top.unpacked(np.frombuffer(query).reshape(-1, 3)))


def true_first(kind: str, queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """hit: whether there is a contact; value: the earliest time, 1 without."""
    first = np.array([_first(_true_contacts(kind, query.tobytes())) for query in queries])
    return np.isfinite(first), np.minimum(first, 1.0)


def core_first(kind: str, queries: np.ndarray, accuracy: str, simd: str) -> tuple[np.ndarray, np.ndarray]:
    """The same by the core."""
    first = np.array([_Scene(kind, query, accuracy, simd).detected().first_toc for query in queries])
    return np.isfinite(first), np.minimum(first, 1.0)


def break_promises(
    kind: str, queries: np.ndarray, distances: np.ndarray, accuracy: str, simd: Sequence[str]
) -> np.ndarray:
    """Mask of the scenes whose results break a promise or contradict each other."""
    scenes = zip(queries, distances, strict=True)
    return np.array([any(broken_promises(kind, *scene, accuracy, simd)) for scene in scenes], bool)


def broken_promises(kind: str, query: np.ndarray, distance: float, accuracy: str, simd: Sequence[str]) -> Iterator[str]:
    """What is wrong, one after the other."""
    scene = _Scene(kind, query, accuracy, simd[0])
    every = scene.detected()
    yield from _of_contacts(scene, every)
    yield from scene.alike(every, simd)
    yield from _of_less(scene, every)
    yield from _of_snapshots(scene, distance)
    yield from _of_motion(scene, every)


def rows_of(found: hc.Contacts | hc.Proximity, value: str = "toc") -> Found:
    """By kind, rows and values."""
    return {kind: (getattr(found, kind), getattr(found, f"{kind}_{value}")) for kind in CONTACT_KINDS}


class _Scene:
    """One query, and the detectors that answer it."""

    def __init__(self, kind: str, query: np.ndarray, accuracy: str, simd: str) -> None:
        self.kind, self.query, self.accuracy, self.simd = kind, query, accuracy, simd
        self.top: Topology = TOPOLOGIES[kind]
        self.rng = np.random.default_rng(zlib.crc32(query.tobytes()))
        start, end, self.values = self.top.unpacked(query)
        with np.errstate(over="ignore", under="ignore"):
            floats = start.astype(np.float32), end.astype(np.float32)
        fit = np.array_equal(floats, (start, end))
        self.start, self.end = floats if fit else (start, end)
        self.promised = accuracy in PROMISING
        self.size = max(float(np.abs(query[: 2 * len(start)]).max()), np.finfo(float).tiny)

    def detector(self, **options: object) -> hc.Detector:
        how = {"accuracy": self.accuracy, "simd": self.simd, "backend": "cpu", "threads": 1} | options
        detector, known = _detector(self.kind, tuple(sorted(how.items())))
        if known[0] != self.query.tobytes():
            _set_values(detector, self.top, self.values)
            known[0] = self.query.tobytes()
        return detector

    def detected(self, **options: object) -> hc.Contacts:
        return self.detector(**options).detect(self.start, self.end)

    def truth(self) -> Found:
        return _true_contacts(self.kind, self.query.tobytes())

    def alike(self, every: hc.Contacts, simd: Sequence[str]) -> Iterator[str]:
        """Results that must be bit-identical: of instruction sets, threads, backends, scenes with these values from the
        start, streams, and worlds."""
        other = [{"simd": s} for s in simd[1:]] + [{"threads": 2}]
        if self.accuracy != "fast":  # which other backends mostly compute as balanced
            other += [{"backend": b, "simd": "auto"} for b in hc.backends() if b != "cpu"]
        for options in other:
            found = self.detected(**options)
            if found != every or found.hash != every.hash:
                yield f"{options} differs"
        how = {"accuracy": self.accuracy, "simd": self.simd, "backend": "cpu", "threads": 1}
        fresh = hc.Detector(_scene(self.top, self.values), **how)
        if (found := fresh.detect(self.start, self.end)) != every or found.hash != every.hash:
            yield "a new scene differs"
        stream = self.detector(threads=2)
        stream.reset()
        stream.step(self.start)
        if stream.step(self.end) != every:
            yield "step differs"
        back = self.detector().detect(self.end, self.start)
        worlds = self.detector(worlds=2)
        both = worlds.detect(np.stack([self.start, self.end]), np.stack([self.end, self.start]))
        if both.world(0) != every or both.world(1) != back:
            yield "worlds differ"


def _of_contacts(scene: _Scene, every: hc.Contacts) -> Iterator[str]:
    found, toc = rows_of(every), [every.vf_toc, every.ee_toc, every.vp_toc, every.vv_toc, every.ve_toc]
    if every.first_toc != min((float(t.min()) for t in toc if len(t)), default=np.inf):
        yield "first_toc is not the least time"
    for kind, (rows, times) in found.items():
        if len(rows) and not (np.lexsort(rows.T[::-1]) == np.arange(len(rows))).all():
            yield f"{kind}: not sorted"
        if not ((times >= 0) & (times <= 1)).all():
            yield f"{kind}: time out of range"
        if scene.promised:
            yield from _differences(scene, kind, (rows, times), scene.truth()[kind])


def _differences(scene: _Scene, kind: str, found: tuple, true: tuple, size: float = 1.0) -> Iterator[str]:
    """Rows and values against the true ones; `conservative` may report more, and earlier."""
    here, there = ({tuple(row): value for row, value in zip(r.tolist(), v, strict=True)} for r, v in (found, true))
    if missed := there.keys() - here.keys():
        yield f"{kind}: missed {sorted(missed)[0]} ({there[sorted(missed)[0]]:.17g})"
    more = sorted(here.keys() - there.keys())
    if more and scene.accuracy == "exact":
        yield f"{kind}: spurious {more[0]} ({here[more[0]]:.17g})"
    if more and len(known := {tuple(row) for row in scene.top.scene.pairs[kind].rows.tolist()}) < len(
        known | set(more)
    ):
        yield f"{kind}: a pair that is not tested {sorted(set(more) - known)[0]}"
    for row in here.keys() & there.keys():
        late = (here[row] - there[row]) / size
        if late > (TOLERANCE if scene.accuracy == "exact" or size != 1 else 0) or (
            scene.accuracy == "exact" and late < -TOLERANCE
        ):
            yield f"{kind}: {row} is {here[row]:.17g}, true {there[row]:.17g}"
            return


def _of_less(scene: _Scene, every: hc.Contacts) -> Iterator[str]:
    """report="first" and "any", and collision-free steps."""
    first, any_ = scene.detected(report="first"), scene.detected(report="any")
    if first.first_toc != every.first_toc:
        yield f"first: {first.first_toc:.17g}, all: {every.first_toc:.17g}"
    for (kind, (rows, toc)), (of_all, all_toc), (of_any, _) in zip(
        rows_of(first).items(), rows_of(every).values(), rows_of(any_).values(), strict=True
    ):
        kept = all_toc == every.first_toc
        if not np.array_equal(rows, of_all[kept]) or toc.tobytes() != all_toc[kept].tobytes():
            yield f"first: other {kind} than the earliest of all"
        if not {tuple(row) for row in of_any.tolist()} <= {tuple(row) for row in of_all.tolist()}:
            yield f"any: {kind} that is not in all"
    if (len(any_) > 0) != (len(every) > 0):
        yield f"any: {len(any_)}, all: {len(every)}"
    steps = [scene.detector(report=report).collision_free_step(scene.start, scene.end) for report in ("all", "first")]
    if steps[0] != steps[1]:
        yield f"steps differ by report: {steps}"
    earliest = min(every.first_toc, np.nextafter(1.0, 0)) if every.first_toc <= 1 else 1.0
    if not earliest - EARLY <= steps[0] <= earliest:
        yield f"step {steps[0]:.17g}, first_toc {every.first_toc:.17g}"
    if scene.promised and steps[0] > min(1.0, _first(scene.truth())):
        yield f"step {steps[0]:.17g} is later than the true {_first(scene.truth()):.17g}"


def _of_snapshots(scene: _Scene, distance: float) -> Iterator[str]:
    """proximity, distances, intersections."""
    start, values, oracle = scene.start.astype(float), scene.values, scene.top.scene
    near = scene.detector().proximity(scene.start, float(distance))
    if scene.detector(threads=2).proximity(scene.start, float(distance)) != near:
        yield "proximity differs by threads"
    hits = scene.detector().intersections(scene.start).ef
    gaps = scene.detector().distances(scene.start)
    if scene.detector(threads=2).distances(scene.start) != gaps:
        yield "distances differ by threads"
    if not scene.promised:
        return
    true = oracle.proximity(start, float(distance), values)
    size = scene.size + sum(float(np.max(t, initial=0)) for t in values.thickness)
    for kind, found in rows_of(near, "distance").items():
        yield from (f"proximity {text}" for text in _differences(scene, kind, found, true[kind], size))
    expected = oracle.intersections(start)
    if (scene.accuracy == "exact" and not np.array_equal(hits, expected)) or not {*map(tuple, expected.tolist())} <= {
        *map(tuple, hits.tolist())
    }:
        yield f"intersections: {hits.tolist()}, true {expected.tolist()}"
    yield from _of_gaps(scene, gaps, oracle.gaps(start, values), size)


def _of_gaps(scene: _Scene, gaps: list[hc.Gap], true: list, size: float) -> Iterator[str]:
    number = {name: n for n, name in enumerate(_names(scene.top))}
    here = {
        (number[gap.mesh_a], number[gap.mesh_b]) if isinstance(gap.mesh_a, str) else (gap.mesh_a, gap.mesh_b): gap
        for gap in gaps
    }
    there = {(gap.mesh_a, gap.mesh_b): gap for gap in true}
    if here.keys() != there.keys():
        yield f"distances of {sorted(here)}, expected {sorted(there)}"
        return
    for pair, gap in here.items():
        if gap.kind == "edge-face":  # any of those that intersect
            sums = scene.top.scene.thickness_of_pairs("ef", scene.values)
            rows = dict(zip(map(tuple, scene.top.scene.pairs["ef"].rows.tolist()), sums, strict=True))
            if not there[pair].intersect or gap.distance != -rows.get(tuple(gap.features), np.inf):
                yield f"distance of {pair} is {gap.distance:.17g} ({gap.kind}), true {there[pair]}"
            continue
        difference = 0.0 if gap.distance == there[pair].distance else abs(gap.distance - there[pair].distance) / size
        if there[pair].intersect or not difference <= TOLERANCE:
            yield f"distance of {pair} is {gap.distance:.17g} ({gap.kind}), true {there[pair].distance:.17g}"


def _of_motion(scene: _Scene, every: hc.Contacts) -> Iterator[str]:
    """collision_free_motion."""
    motion = scene.detector().collision_free_motion(scene.start, scene.end)
    if scene.detector(threads=2).collision_free_motion(scene.start, scene.end) != motion:
        yield "motion differs by threads"
    factors, stuck = motion.factors, motion.stuck
    if not ((factors >= 0) & (factors <= 1)).all() or motion.vertices.dtype != scene.start.dtype:
        yield "motion: a factor beyond [0, 1], or another type"
    for factor, end in ((1, scene.end), (0, scene.start)):
        if not np.array_equal(motion.vertices[factors == factor], end[factors == factor]):
            yield f"motion: factor {factor}, and elsewhere"
    if not np.array_equal(stuck, np.unique(stuck)) or factors[stuck].any():
        yield "motion: stuck is not sorted or moves"
    if not scene.promised:
        return
    touching = scene.top.scene.contacts(scene.start.astype(float), motion.vertices.astype(float), scene.values)
    corners = _vertices_of(scene.top, touching)
    if any(toc.any() for _, toc in touching.values()) or not set(corners) <= set(stuck.tolist()):
        rows = [(kind, rows.tolist()) for kind, (rows, _) in touching.items() if len(rows)]
        yield f"motion: touches: {rows}, stuck {stuck.tolist()}"
    if scene.accuracy == "exact" and set(stuck.tolist()) - set(corners):
        yield f"motion: stuck without contact: {sorted(set(stuck.tolist()) - set(corners))}"
    moves = (scene.start != scene.end).any(axis=1)
    floor = KEPT * (min(1.0, every.first_toc) - EARLY)
    if factors[moves].min(initial=1) < floor and scene.start.dtype == np.float64 and scene.accuracy == "exact":
        part = scene.start + KEPT * min(1.0, every.first_toc) * (scene.end - scene.start)
        less = scene.top.scene.contacts(scene.start, part, scene.values)
        if not any(toc.any() for _, toc in less.values()):
            yield f"motion: factor {factors[moves].min():.17g} though {floor:.17g} is free"


def _vertices_of(top: Topology, found: Found) -> list[int]:
    faces = top.scene.faces
    vertices = [found["vf"][0][:, 0], faces[found["vf"][0][:, 1].astype(int)].ravel(), found["vp"][0][:, 0]]
    vertices += [found[kind][0].ravel() for kind in ("ee", "vv", "ve")]
    return np.unique(np.concatenate(vertices).astype(int)).tolist()


def _first(found: Found) -> float:
    return min((float(toc.min()) for _, toc in found.values() if len(toc)), default=np.inf)


def _names(top: Topology) -> list[str]:
    return [f"mesh{m}" for m in range(len(top.scene.meshes))] + [f"plane{p}" for p in range(top.scene.n_planes)]


def _scene(top: Topology, values: Values | None = None) -> hc.Scene:
    """values: those of the scene from the start; by default separations and thickness are 0."""
    scene, oracle, names = hc.Scene(), top.scene, _names(top)
    for number, mesh in enumerate(oracle.meshes):
        rules = {"self_collision": mesh.self_collision, "static": mesh.static}
        if values is not None:
            rules["thickness"] = values.thickness[number]
        if mesh.points:
            scene.add_points(names[number], mesh.n_vertices, edges=mesh.edges, **rules)
        else:
            scene.add_mesh(names[number], mesh.faces, edges=mesh.edges, n_vertices=mesh.n_vertices, **rules)
    for number in range(oracle.n_planes):
        plane = [0, 0, 1, 0] if values is None else values.planes[number]
        scene.add_plane(names[len(oracle.meshes) + number], normal=plane[:3], offset=plane[3])
    for a, b in oracle.ignored_pairs:
        scene.ignore_pair(names[a], names[b])
    filters = oracle.filters
    for mesh, rings in filters.rings.items():
        scene.ignore_within(names[mesh], rings=rings)
    for mesh, (rest, distance) in filters.rest.items():
        scene.ignore_within(names[mesh], rest_vertices=rest, distance=distance)
    for mesh, faces, other in filters.faces:
        scene.ignore_faces(names[mesh], faces, names[other])
    if len(filters.vf) or len(filters.ee):
        scene.ignore_features(vf=filters.vf, ee=filters.ee)
    if values is not None:
        for a, b in itertools.combinations_with_replacement(range(len(names)), 2):
            if max(a, b) < len(oracle.meshes) or (a < len(oracle.meshes) and a != b):
                scene.set_separation(names[a], names[b], values.separations[a, b])
    return scene


def _set_values(detector: hc.Detector, top: Topology, values: Values) -> None:
    names = _names(top)
    detector.set_separations(values.separations)
    for name, thickness in zip(names, values.thickness, strict=False):
        detector.set_thickness(name, thickness)
    for name, plane in zip(names[len(top.scene.meshes) :], values.planes, strict=True):
        detector.set_plane(name, normal=plane[:3], offset=plane[3])


@functools.cache
def _detector(kind: str, options: tuple[tuple[str, object], ...]) -> tuple[hc.Detector, list[bytes]]:
    """And the query whose values it has now."""
    return hc.Detector(_scene(TOPOLOGIES[kind]), **dict(options)), [b""]
