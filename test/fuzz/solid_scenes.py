# SPDX-License-Identifier: Apache-2.0
"""Closed and open meshes for winding numbers, separating translations and depth, and degenerate points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hpccd_core import shapes

from .disturbances import disturb_still, factors
from .step_scenes import grid, octahedron, ring

Generator = Callable[[np.random.Generator, int], np.ndarray]


class Meshes(NamedTuple):
    """faces: of each mesh, its own indices; rest: of each mesh its positions."""

    faces: list[np.ndarray]
    rest: list[np.ndarray]

    @property
    def ends(self) -> np.ndarray:
        return np.cumsum([len(points) for points in self.rest])


TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]), np.array([[0, 0, 0], *np.eye(3)]) * 2 - 0.5
CUBE_POINTS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
_HALF = [[0, 1, 3], [0, 3, 2], [0, 4, 5], [0, 5, 1], [0, 2, 6], [0, 6, 4]]
CUBE = np.array(_HALF + [[7 - a, 7 - c, 7 - b] for a, b, c in _HALF]), CUBE_POINTS
PILLOW = np.array([[0, 1, 2], [2, 1, 0]]), np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], float)
LIDLESS = CUBE[0][:-2], CUBE_POINTS


def _torus(n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    i, j = (k.ravel() for k in np.mgrid[0:n, 0:m])
    u, v = 2 * np.pi * i / n, 2 * np.pi * j / m
    out = 2 + 0.75 * np.cos(v)
    at = lambda a, b: (a % n) * m + b % m  # noqa: E731
    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return faces, np.stack([out * np.cos(u), out * np.sin(u), 0.75 * np.sin(v)], 1)


TORUS = _torus(5, 3)


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """One mesh of several components."""
    starts = np.cumsum([0, *(len(points) for _, points in parts)])
    faces = np.concatenate([faces + start for (faces, _), start in zip(parts, starts, strict=False)])
    return faces, np.concatenate([points for _, points in parts])


def flipped(mesh: tuple[np.ndarray, np.ndarray], size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    return mesh[0][:, ::-1], mesh[1] * size


def meshes(*parts: tuple[np.ndarray, np.ndarray]) -> Meshes:
    return Meshes([faces for faces, _ in parts], [points for _, points in parts])


SHELL = joined(CUBE, flipped(CUBE, 0.5))
TWO = joined(TETRAHEDRON, (octahedron()[0], octahedron()[1] + (3, 0, 0)))
WINDING_SCENES = {
    "tetrahedron": meshes(TETRAHEDRON),
    "cube": meshes(CUBE),
    "pillow": meshes(PILLOW),
    "torus": meshes(TORUS),
    "sphere": meshes(shapes.icosphere(2)[::-1]),
    "several": meshes(joined(CUBE, flipped(octahedron(), 1.5), TETRAHEDRON, CUBE)),
}
TRANSLATION_SCENES = {
    "tetrahedra": meshes(TETRAHEDRON, TETRAHEDRON),
    "box in open box": meshes(CUBE, LIDLESS),
    "stick and ring": meshes(TETRAHEDRON, TORUS),
    "sheets": meshes(grid(2, 3), ring(4, 0.5)),
    "components and shell": meshes(TWO, SHELL),
    "triangles": meshes((np.array([[0, 1, 2]]), np.eye(3)), PILLOW),
}


def lattice(rng: np.random.Generator, rest: np.ndarray, n: int) -> np.ndarray:
    """Few places: many vertices coincide, and faces lie in each other's planes."""
    return rng.integers(-2, 3, (n, *rest.shape)).astype(float)


def shaped(rng: np.random.Generator, rest: np.ndarray, n: int) -> np.ndarray:
    """The rest shape, mirrored, stretched along the axes and placed by multiples of 1/8."""
    sizes = rng.integers(1, 13, (n, 1, 3)) * rng.choice([-1, 1], (n, 1, 3)) / 4
    return np.round(8 * (sizes * rest + rng.integers(-8, 9, (n, 1, 3)) / 4)) / 8


def crumpled(rng: np.random.Generator, rest: np.ndarray, n: int) -> np.ndarray:
    return shaped(rng, rest, n) + rng.normal(0, 0.3, (n, *rest.shape))


PLACES = {function.__name__: function for function in (lattice, shaped, crumpled)}
POINTS_OF_A_MESH = 50


def points_and_mesh(kind: str, place: str) -> Generator:
    """(n,V+1,3): the vertices of a closed mesh, many rows with the same, and a point on, beside or in line with its
    vertices, edges and faces."""
    (faces,), (rest,) = WINDING_SCENES[kind]

    def made(rng: np.random.Generator, n: int) -> np.ndarray:
        groups = -(-n // POINTS_OF_A_MESH)
        vertices = PLACES[place](rng, rest, groups)
        scenes = disturb_still(rng, np.concatenate([vertices, _points(rng, vertices, faces)], axis=1))
        vertices, points = scenes[:, : len(rest)], scenes[:, len(rest) :]
        same = np.broadcast_to(vertices[:, None], (groups, POINTS_OF_A_MESH, *rest.shape))
        return np.concatenate([same, points[:, :, None]], axis=2).reshape(-1, len(rest) + 1, 3)[:n]

    return made


def _points(rng: np.random.Generator, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    shape = len(vertices), POINTS_OF_A_MESH
    corners = np.take_along_axis(vertices[:, None], faces[rng.integers(0, len(faces), shape)][..., None], axis=2)
    weights = rng.choice([(4, 0, 0), (2, 2, 0), (1, 3, 0), (2, 1, 1), (1, 1, 2)], size=shape)
    points = (rng.permuted(weights, axis=2)[..., None] * corners).sum(axis=2) / 4
    points += rng.integers(-3, 4, (*shape, 3)) * (rng.random((*shape, 3)) < 0.3) / 4  # along one axis, mostly
    middle = (points + np.roll(points, 1, axis=1)) / 2
    anywhere = rng.uniform(vertices.min(axis=1)[:, None], vertices.max(axis=1)[:, None], (*shape, 3))
    return np.where((rng.random(shape) < 0.2)[..., None], middle, points) * 1.0 + np.where(
        (rng.random(shape) < 0.1)[..., None], anywhere - points, 0
    )


def nested(rng: np.random.Generator, scene: Meshes, n: int) -> np.ndarray:
    """Components of several sizes about one place, a few of them elsewhere."""
    faces, rest = joined(*zip(*scene, strict=True))
    placed = np.empty((n, *rest.shape))
    for part in components(faces, len(rest)):
        size = 2.0 ** rng.integers(-4, 3, (n, 1, 1))
        centred = rest[part] - rest[part].mean(axis=0)
        places = size * (centred + rng.integers(-1, 2, (n, 1, 3)) / 4)
        far = (rng.random(n) < 0.1)[:, None, None]
        placed[:, part] = np.round((places + far * rng.integers(-6, 7, (n, 1, 3))) * 64) / 64
    return placed


def components(faces: np.ndarray, n_vertices: int) -> list[np.ndarray]:
    """Vertices that faces join, one mask for each component."""
    label = np.arange(n_vertices)
    while not (label[faces] == label[faces].min(axis=1, keepdims=True)).all():
        np.minimum.at(label, faces, label[faces].min(axis=1, keepdims=True))
    return [label == i for i in np.unique(label)]


def meshes_and_direction(kind: str, place: str) -> Generator:
    """(n,V+1,3): two meshes, and a direction, often along an axis, an edge or between vertices."""
    scene = TRANSLATION_SCENES[kind]

    def made(rng: np.random.Generator, n: int) -> np.ndarray:
        if place == nested.__name__:
            scenes = nested(rng, scene, n)
        else:
            scenes = np.concatenate([PLACES[place](rng, rest, n) for rest in scene.rest], axis=1)
        scenes = disturb_still(rng, scenes)
        rows, count = np.arange(n), scenes.shape[1]
        along = scenes[rows, rng.integers(0, count, n)] - scenes[rows, rng.integers(0, count, n)]
        # Scaled and shifted meshes have differences that are sums of few bits or are rounded: both are directions.
        random = np.where((rng.random(n) < 0.5)[:, None], rng.integers(-1, 2, (n, 3)), rng.normal(size=(n, 3)))
        direction = np.where((rng.random(n) < 0.4)[:, None], along, random * factors(rng, n)[:, None])
        direction[~direction.any(axis=1)] = (0, 0, 1)
        return np.concatenate([scenes, direction[:, None]], axis=1)

    return made


WINDING_POINTS = {kind: {place: points_and_mesh(kind, place) for place in PLACES} for kind in WINDING_SCENES}
TRANSLATIONS = {
    kind: {place: meshes_and_direction(kind, place) for place in (*PLACES, nested.__name__)}
    for kind in TRANSLATION_SCENES
}


# Convex meshes and their affine images; no plane holds more than three of their vertices, so that they remain convex
# when those are rounded.
CONVEX = {"tetrahedron": TETRAHEDRON, "octahedron": octahedron(), "icosahedron": shapes.icosphere(1)[::-1]}
DEPTH_SCENES = {
    f"{a}, {b}": meshes(CONVEX[a], CONVEX[b])
    for a, b in (("tetrahedron", "octahedron"), ("octahedron", "icosahedron"), ("icosahedron", "icosahedron"))
}


def convex_pairs(kind: str, step: float) -> Generator:
    """(n,V,3): two convex meshes that nearly always overlap; coordinates are multiples of the step."""
    scene = DEPTH_SCENES[kind]

    def made(rng: np.random.Generator, n: int) -> np.ndarray:
        placed = []
        for rest in scene.rest:
            turn = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
            shape = turn * 2.0 ** rng.uniform(-2, 1, (n, 1, 3)) @ np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
            shape[:, 0] *= np.sign(np.linalg.det(shape))[:, None]
            placed.append((rest - rest.mean(axis=0)) @ shape + rng.normal(0, 0.3, (n, 1, 3)))
        return np.round(np.concatenate(placed, axis=1) / step) * step

    return made


DEPTHS = {kind: {f"step {step}": convex_pairs(kind, step) for step in (2.0**-12, 2.0**-20)} for kind in DEPTH_SCENES}
