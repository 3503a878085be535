# SPDX-License-Identifier: Apache-2.0
"""Scenes of meshes in each other, and which lie inside which, by the core and by the oracle.

Each mesh is made of parts: closed surfaces, open ones, ropes and points. A generator places the parts: nested, beside
each other, chained, mirrored (the faces turn inwards), on a grid so that many touch. The results are one for each two
meshes in each order, all (Q, 2 P): whether the first has a part inside the second. One detector computes all scenes of
a kind, so that decisions that are kept from scene to scene count too.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import oracle

import hpccd_core as hc

from .disturbances import disturb_still

Points = Callable[[np.random.Generator, int], np.ndarray]


@dataclass(frozen=True)
class Part:
    """A connected surface, rope or point around the origin."""

    vertices: np.ndarray
    faces: np.ndarray
    closed: bool = True
    edges: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Kind:
    """Meshes by their parts."""

    meshes: tuple[tuple[Part, ...], ...]

    @property
    def parts(self) -> list[Part]:
        return [part for mesh in self.meshes for part in mesh]

    @property
    def n_vertices(self) -> list[int]:
        return [sum(len(part.vertices) for part in mesh) for mesh in self.meshes]

    def faces(self, mesh: int) -> np.ndarray:
        starts = np.cumsum([0, *(len(part.vertices) for part in self.meshes[mesh])])
        return np.concatenate([p.faces + start for p, start in zip(self.meshes[mesh], starts, strict=False)])

    def edges(self, mesh: int) -> np.ndarray:
        starts = np.cumsum([0, *(len(part.vertices) for part in self.meshes[mesh])])
        edges = [(a + s, b + s) for p, s in zip(self.meshes[mesh], starts, strict=False) for a, b in p.edges]
        return np.array(edges, int).reshape(-1, 2)

    def closed(self, mesh: int) -> bool:
        faces = [part for part in self.meshes[mesh] if len(part.faces)]
        return bool(faces) and all(part.closed for part in faces)


def _box(without: int = 0) -> Part:
    vertices, faces = hc.shapes.box((2.0, 2.0, 2.0))
    return Part(vertices, faces[without:].astype(int), closed=without == 0)


def _cup() -> Part:
    """A closed solid with a pit: boxes above its floor are not inside it."""
    outer, faces = hc.shapes.box((2.0, 2.0, 2.0))
    top = [f for f, corners in enumerate(faces) if (outer[corners, 2] == 1).all()]
    pit = outer * (0.5, 0.5, 0.5) + (0, 0, 0.5)
    sides = np.delete(faces, top, axis=0)
    rim = [i for i in range(8) if outer[i, 2] == 1]
    # Around the rim: each side of the top square of the box, joined with that of the pit.
    around = [(a, b) for f in faces[top] for a, b in zip(f, np.roll(f, -1), strict=True)]
    border = [(a, b) for a, b in around if (b, a) not in around]
    assert len(border) == len(rim) == 4
    joined = [f for a, b in border for f in ((a, b, b + 8), (a, b + 8, a + 8))]
    faces = np.concatenate([sides, sides[:, ::-1] + 8, joined]).astype(int)
    return Part(np.vstack([outer, pit]), faces)


TETRAHEDRON = Part(
    np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]),
    np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]),
)
OCTAHEDRON = Part(
    np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]]),
    np.array([[i, (i + 1) % 4, 4] for i in range(4)] + [[(i + 1) % 4, i, 5] for i in range(4)]),
)
NO_FACES = np.empty((0, 3), int)
POINT = Part(np.zeros((1, 3)), NO_FACES)
ROPE = Part(np.array([[-1, 0, 0], [0, 1, 0], [1, 0, 1.0]]), NO_FACES, edges=((0, 1), (1, 2)))
BOX, OPEN_BOX, CUP = _box(), _box(1), _cup()

CONTAINMENT_KINDS = {
    "solids": Kind(((BOX, BOX), (OCTAHEDRON, BOX), (TETRAHEDRON, TETRAHEDRON, OCTAHEDRON), (CUP,))),
    "ropes-and-points": Kind(((CUP, POINT), (ROPE, POINT, POINT), (OPEN_BOX, TETRAHEDRON), (BOX, ROPE))),
    "grains": Kind(((CUP,), (POINT,) * 24 + (TETRAHEDRON,) * 6)),
}


def scattered(kind: Kind, n: int, rng: np.random.Generator) -> np.ndarray:
    """Parts of any size anywhere, on a coarse grid: some touch, some are in each other, some in chains."""
    size = 2 ** rng.integers(0, 5, (n, len(kind.parts)))
    center = rng.integers(-8, 9, (n, len(kind.parts), 3))
    return _placed(kind, size, center, rng)


def nested(kind: Kind, n: int, rng: np.random.Generator) -> np.ndarray:
    """Around one centre, in any order; a few are moved."""
    size = rng.permuted(np.tile(2 ** np.arange(len(kind.parts)) % 4093, (n, 1)), axis=1)
    center = np.zeros((n, len(kind.parts), 3), int)
    moved = rng.random((n, len(kind.parts))) < 0.3
    center[moved] = rng.integers(-64, 65, (moved.sum(), 3))
    return _placed(kind, size, center, rng)


def stretched(kind: Kind, n: int, rng: np.random.Generator) -> np.ndarray:
    """Flat and long parts, one axis at a time."""
    size = 2 ** rng.integers(0, 7, (n, len(kind.parts), 3))
    center = rng.integers(-16, 17, (n, len(kind.parts), 3))
    return _placed(kind, size, center, rng)


def moving(kind: Kind, n: int, rng: np.random.Generator) -> np.ndarray:
    """A sequence: small steps, rests, motions of all together, and now and then a jump."""
    generate = scattered if len(kind.parts) < 20 else full_cup
    starts = generate(kind, n, rng)
    scenes, current = np.empty_like(starts), starts[0]
    for i in range(n):
        way = rng.choice(5, p=(0.4, 0.2, 0.2, 0.1, 0.1))
        size = np.ptp(current)
        if way == 0:
            current = current + rng.normal(0, 0.002 * size, current.shape)
        elif way == 1:
            current = current + rng.normal(0, 10 * size, 3)
        elif way == 2:
            part = np.repeat(np.arange(len(kind.parts)), [len(part.vertices) for part in kind.parts])
            current = current + rng.normal(0, 0.01 * size, (len(kind.parts), 3))[part]
        elif way == 3:
            current = starts[i]
        scenes[i] = current
    return scenes


def full_cup(kind: Kind, n: int, rng: np.random.Generator) -> np.ndarray:
    """Small parts in the pit of the cup, seldom in its wall."""
    size = np.append(256, np.ones(len(kind.parts) - 1, int))[None] * np.ones((n, 1), int)
    low = np.where(rng.random((n, 1, 1)) < 0.2, (-250, -250, -250), (-120, -120, 8))
    center = rng.integers(low, np.array([120, 120, 240]), (n, len(kind.parts), 3))
    center[:, 0] = 0
    return _placed(kind, size, center, rng)


def _placed(kind: Kind, size: np.ndarray, center: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    mirror = np.where(rng.random((len(size), len(kind.parts), 1)) < 0.25, (1, 1, -1), (1, 1, 1))
    scale = mirror * size.reshape(len(size), len(kind.parts), -1)
    of_parts = [part.vertices[None] * scale[:, i, None] + center[:, i, None] for i, part in enumerate(kind.parts)]
    return np.concatenate(of_parts, axis=1).astype(float)


def _disturbed(generate: Callable, kind: Kind) -> Points:
    def points(rng: np.random.Generator, n: int) -> np.ndarray:
        scenes = generate(kind, n, rng)
        if generate is moving:
            return scenes
        disturbed = rng.random(n) < 0.15
        scenes[disturbed] = disturb_still(rng, scenes[disturbed])
        return scenes

    return points


CONTAINMENT_POINTS: dict[str, dict[str, Points]] = {
    name: {g.__name__: _disturbed(g, kind) for g in (scattered, nested, stretched, moving)}
    for name, kind in CONTAINMENT_KINDS.items()
}
CONTAINMENT_POINTS["grains"][full_cup.__name__] = _disturbed(full_cup, CONTAINMENT_KINDS["grains"])


def true_containment(name: str, queries: np.ndarray, threads: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """hit and value, (Q, 2 P) of P pairs of meshes; queries: (Q,V,3)."""
    hit = np.array([_true_of_scene(CONTAINMENT_KINDS[name], points, threads) for points in queries])
    return hit, np.zeros(hit.shape)


def _true_of_scene(kind: Kind, points: np.ndarray, threads: int) -> list[bool]:
    starts = np.cumsum([0, *kind.n_vertices])
    pairs = list(itertools.combinations(range(len(kind.meshes)), 2))
    around = {}  # by (inner, outer): whether the winding number around a part is not 0
    for inner, outer in [*pairs, *((b, a) for a, b in pairs)]:
        around[inner, outer] = False
        if kind.closed(outer):
            ends = starts[inner] + np.cumsum([len(part.vertices) for part in kind.meshes[inner]])
            surface = points[starts[outer] :][: kind.n_vertices[outer]], kind.faces(outer)
            numbers, _ = oracle.winding_numbers(surface, points[ends - 1], threads)  # one of each part
            around[inner, outer] = bool(numbers.any())
    candidates = [(a, b) for a, b in pairs if around[a, b] or around[b, a]]
    touching = _touching(kind, points, candidates, threads) if candidates else set()
    return [around[p] and (a, b) not in touching for a, b in pairs for p in ((a, b), (b, a))]


def _touching(kind: Kind, points: np.ndarray, pairs: list[tuple[int, int]], threads: int) -> set[tuple[int, int]]:
    meshes = range(len(kind.meshes))
    mesh_of_vertex = np.repeat(meshes, kind.n_vertices)
    mesh_of_face = np.repeat(meshes, [len(kind.faces(m)) for m in meshes])
    scene = {
        "n_vertices": kind.n_vertices,
        "edges_per_mesh": [kind.edges(m) for m in meshes],
        "no_self_collision": meshes,
        "ignored_pairs": [pair for pair in itertools.combinations(meshes, 2) if pair not in pairs],
        "threads": threads,
    }
    faces = [kind.faces(m) for m in meshes]
    edge_face = oracle.intersections(points, faces, **scene)
    near = oracle.proximity(points, 0.0, faces, **scene)
    found = np.concatenate(
        [
            np.column_stack([mesh_of_vertex[edge_face[:, 0]], mesh_of_face[edge_face[:, 2]]]),
            np.column_stack([mesh_of_vertex[near.vf[:, 0]], mesh_of_face[near.vf[:, 1]]]),
            mesh_of_vertex[near.ee[:, [0, 2]]],
        ]
    )
    return set(map(tuple, np.sort(found, axis=1).tolist()))


def core_containment(name: str, queries: np.ndarray, accuracy: str, simd: str) -> tuple[np.ndarray, np.ndarray]:
    detector = _detector(name, accuracy, simd)
    hit = np.array(
        [[gap.inside in (side, "both") for gap in detector.distances(p) for side in ("a", "b")] for p in queries]
    )
    return hit, np.zeros(hit.shape)


@functools.cache
def _detector(name: str, accuracy: str, simd: str) -> hc.Detector:
    return hc.Detector(scene_of(CONTAINMENT_KINDS[name]), accuracy=accuracy, simd=simd, backend="cpu", threads=1)


def scene_of(kind: Kind) -> hc.Scene:
    scene = hc.Scene()
    for m, n in enumerate(kind.n_vertices):
        scene.add_mesh(f"mesh{m}", kind.faces(m), edges=kind.edges(m), n_vertices=n, self_collision=False)
    return scene
