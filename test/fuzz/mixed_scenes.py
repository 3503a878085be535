# SPDX-License-Identifier: Apache-2.0
"""Small scenes of meshes, ropes, points and planes with thickness and filters; their motions and values.

A query holds all positions at t=0, those at t=1, the normal of each plane, and rows of three numbers: offsets of the
planes, separations of all pairs, thickness of all meshes, and zeros up to a full row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from oracle.mixed import Filters, MixedMesh, MixedScene, Values

from .disturbances import factors, offset, one_ulp, rotate, single
from .step_motions import MORE_MOTIONS
from .step_scenes import SmallScene, grid, octahedron, points, ring, rope

Shape = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Topology:
    """scene: what is tested; rest: (V,3); scalar: by mesh, whether it has one thickness for all its features."""

    scene: MixedScene
    rest: np.ndarray
    scalar: tuple[bool, ...]

    @property
    def small(self) -> SmallScene:
        meshes = self.scene.meshes
        return SmallScene(
            [m.faces for m in meshes], [m.edges for m in meshes], [m.n_vertices for m in meshes], self.rest
        )

    @property
    def static(self) -> np.ndarray:
        """(V,) bool: vertices that do not move."""
        return np.array([mesh.static for mesh in self.scene.meshes], bool)[self.scene.mesh_of_vertex]

    @property
    def n_thickness(self) -> list[int]:
        return [
            1 if one else len(mesh.faces) or len(mesh.edges) or mesh.n_vertices
            for mesh, one in zip(self.scene.meshes, self.scalar, strict=True)
        ]

    @property
    def n_pairs(self) -> int:
        n = len(self.scene.meshes) + self.scene.n_planes
        return n * (n + 1) // 2

    def packed(self, ends: np.ndarray, normals: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        n_rows = -(-numbers.shape[1] // 3)
        rows = np.zeros((len(ends), n_rows, 3))
        rows.reshape(len(ends), -1)[:, : numbers.shape[1]] = numbers
        return np.concatenate([ends, normals, rows], axis=1)

    def unpacked(self, query: np.ndarray) -> tuple[np.ndarray, np.ndarray, Values]:
        """Positions at both ends, and the values."""
        n, n_planes = len(self.rest), self.scene.n_planes
        normals, numbers = query[2 * n : 2 * n + n_planes], query[2 * n + n_planes :].ravel()
        offsets, numbers = numbers[:n_planes], numbers[n_planes:]
        n_meshes = len(self.scene.meshes) + n_planes
        separations = np.zeros((n_meshes, n_meshes))
        upper = np.triu_indices(n_meshes)
        separations[upper] = separations.T[upper] = numbers[: self.n_pairs]
        ends = np.cumsum(self.n_thickness)
        each = np.split(numbers[self.n_pairs : self.n_pairs + ends[-1]], ends[:-1])
        thickness = [t[0] if one else t for t, one in zip(each, self.scalar, strict=True)]
        planes = np.column_stack([normals, offsets]) if n_planes else np.empty((0, 4))
        return (
            np.ascontiguousarray(query[:n]),
            np.ascontiguousarray(query[n : 2 * n]),
            Values(planes, separations, thickness),
        )


def topology(
    *meshes: tuple[Shape, dict],
    n_planes: int = 0,
    ignored_pairs: tuple[tuple[int, int], ...] = (),
    filters: Filters = Filters(),  # noqa: B008 frozen
    apart: float = 1.0,
) -> Topology:
    """The meshes one above the other; each with its shape and options, "scalar" among them."""
    rest, parts, scalar = [], [], []
    for level, ((indices, vertices), options) in enumerate(meshes):
        how = dict(options)
        scalar.append(how.pop("scalar", False))
        rest.append(vertices + [0, 0, apart * level])
        beside = np.reshape(how.pop("edges", np.empty((0, 2), int)), (-1, 2))
        twos = indices.shape[1] == 2
        faces = np.empty((0, 3), int) if twos else indices
        parts.append(MixedMesh(faces, len(vertices), indices if twos else beside, **how))
    return Topology(MixedScene(parts, n_planes, ignored_pairs, filters), np.concatenate(rest), tuple(scalar))


def with_points(shape: Shape, n: int) -> Shape:
    """More vertices, which are in no face and no edge."""
    indices, vertices = shape
    return indices, np.concatenate([vertices, 0.5 + points(n)[1]])


SHEET, STRIP = grid(3, 3), grid(2, 4)
DOUBLED = np.repeat(np.arange(4), 2)  # vertices of a strip whose ends are the same places at rest

TOPOLOGIES: dict[str, Topology] = {
    "thick-sheet-body": topology((SHEET, {}), (octahedron(), {})),
    "thick-layers": topology(
        *[(grid(2, 3), {})] * 3, (octahedron(), {"self_collision": False, "scalar": True}), apart=0.5
    ),
    "planes": topology(
        (grid(2, 3), {"scalar": True}),
        (rope(3), {}),
        (with_points(grid(2, 2), 2), {"scalar": True, "static": True}),
        n_planes=2,
        ignored_pairs=((1, 4),),
    ),
    "points": topology((points(6), {"points": True}), apart=0.5),
    "points-rope-sheet": topology(
        (points(4), {"points": True}),
        (rope(4), {}),
        (grid(2, 3), {}),
        (points(2), {"points": False, "scalar": True}),
        apart=0.5,
    ),
    "capsules": topology(
        (with_points(rope(3), 3), {"points": True, "scalar": True}),
        (points(3), {"points": True, "self_collision": False}),
        (with_points(grid(2, 2), 2), {"scalar": True, "edges": [[4, 0]]}),
        (octahedron(), {"static": True, "scalar": True}),
        (points(2), {"points": True, "static": True}),
        apart=0.5,
    ),
    "rings": topology(
        (grid(3, 4), {}), (rope(6), {}), (ring(8, 0), {"scalar": True}), filters=Filters(rings={0: 1, 1: 2, 2: 2})
    ),
    "rest": topology(
        (grid(3, 4), {}), (STRIP, {}), filters=Filters(rest={0: (grid(3, 4)[1], 1.0), 1: (STRIP[1][DOUBLED], 0.5)})
    ),
    "face-groups": topology(
        (SHEET, {}),
        (octahedron(), {"scalar": True}),
        (rope(3), {}),
        filters=Filters(faces=[(0, [0, 1, 5], 1), (0, [2, 6], 0), (1, [0, 3], 2), (0, [7], 2)]),
    ),
    "single-pairs": topology(
        (grid(2, 3), {}),
        (octahedron(), {}),
        filters=Filters(
            vf=[(6, 0), (7, 1), (0, 5), (0, 3)], ee=[(0, 1, 6, 8), (9, 6, 4, 1), (6, 8, 7, 9), (1, 0, 5, 2)]
        ),
    ),
    "everything": topology(
        (grid(3, 3), {}),
        (octahedron(), {"static": True}),
        (rope(4), {}),
        (points(3), {"points": True}),
        n_planes=2,
        ignored_pairs=((3, 5), (1, 2)),
        filters=Filters(
            rings={0: 1}, rest={2: (rope(4)[1], 1.0)}, faces=[(0, [0, 4], 1)], vf=[(20, 0)], ee=[(0, 1, 15, 16)]
        ),
        apart=0.5,
    ),
}

# Lengths that points of a grid have: exact contact at the separation is common.
LENGTHS = np.array([0.0, 0.0, 0.25, 0.25, 0.5, 0.75, 1.0])
NORMALS = np.array([[0, 0, 1], [0, 0, 2], [1, 0, 0], [1, 2, 2], [-2, 3, 6], [3, 4, 0], [0, -1, 0.25], [1, 1, 1]], float)


def integers(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Vertices on a coarse grid: exact distances, coincident points, flat and parallel features."""
    reach = rng.choice([1, 2, 3], (n, 1, 1))
    ends = rng.integers(-reach, reach + 1, (2, n, *scene.rest.shape)).astype(float)
    at_rest = rng.random((n, len(scene.rest), 1)) < rng.choice([0, 0.3, 0.9], (n, 1, 1))
    return np.concatenate([ends[0], np.where(at_rest, ends[0], ends[1])], axis=1)


MIXED_MOTIONS = {**MORE_MOTIONS, integers.__name__: integers}


def queries_of(kind: str, name: str) -> Callable[[np.random.Generator, int], tuple[np.ndarray, np.ndarray]]:
    """Queries and the distance for each that near pairs are asked for."""
    top = TOPOLOGIES[kind]

    def generate(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
        ends = MIXED_MOTIONS[name](rng, n, top.small)
        for change, share in ((rotate, 0.1), (offset, 0.05)):
            chosen = rng.random(n) < share
            ends[chosen] = change(rng, ends[chosen])
        n_separations, n_thickness = top.n_pairs, sum(top.n_thickness)
        lengths = _lengths(rng, n, n_separations + n_thickness + 1)
        normals = NORMALS[rng.integers(len(NORMALS), size=(n, top.scene.n_planes))]
        # Through a vertex, before, after or while it moves.
        vertex = rng.integers(ends.shape[1], size=(n, top.scene.n_planes))
        through = np.take_along_axis(ends, vertex[:, :, None], axis=1)
        heights = rng.choice([0.0, 0.0, -0.5, 0.25], normals.shape[:2]) * np.linalg.norm(normals, axis=2)
        offsets = (normals * through).sum(axis=2) + heights
        # Lengths, and with them the offsets; then normals.
        chosen = np.flatnonzero(rng.random(n) < 0.3)
        factor = factors(rng, len(chosen))
        ends[chosen] *= factor[:, None, None]
        lengths[chosen] *= factor[:, None]
        offsets[chosen] *= factor[:, None]
        factor = np.where(rng.random((n, top.scene.n_planes)) < 0.2, 2.0 ** rng.integers(-60, 60, offsets.shape), 1.0)
        normals, offsets = normals * factor[..., None], offsets * factor
        for change, share in ((single, 0.15), (one_ulp, 0.3)):
            chosen = rng.random(n) < share
            ends[chosen] = change(rng, ends[chosen])
        ends[:, len(top.rest) :][:, top.static] = ends[:, : len(top.rest)][:, top.static]
        beside = rng.random(lengths.shape) < 0.03
        lengths[beside] = np.nextafter(lengths[beside], rng.choice([0.0, np.inf], beside.sum()))
        numbers = np.hstack([offsets, lengths[:, :-1]])
        return top.packed(ends, normals, numbers), lengths[:, -1]

    return generate


def _lengths(rng: np.random.Generator, n: int, count: int) -> np.ndarray:
    """Separations and thickness: none, dyadic, any, or very different ones; separations are smaller, most of them 0."""
    style = rng.integers(0, 6, (n, 1))
    dyadic = rng.choice(LENGTHS, (n, count))
    anything = rng.uniform(0, 0.3, (n, count)) * (rng.random((n, count)) < 0.8)
    uneven = 10.0 ** rng.uniform(-20, -0.3, (n, count))
    one = np.where(rng.random((n, count)) < 0.1, 0.5, 0.0)
    return np.select([style == 0, style <= 2, style == 3, style == 4], [0 * dyadic, dyadic, anything, uneven], one)


MIXED_SCENES: dict[str, dict[str, Callable]] = {
    kind: {name: queries_of(kind, name) for name in MIXED_MOTIONS} for kind in TOPOLOGIES
}
