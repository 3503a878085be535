# SPDX-License-Identifier: Apache-2.0
"""Motions of small scenes that begin free of contacts more often than not: (n,2V,3), all starts, then all ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .disturbances import offset, one_ulp, rotate, scale, single
from .step_scenes import SmallScene

Motions = Callable[[np.random.Generator, int, SmallScene], np.ndarray]


def noise(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Vertices that move by themselves: little at the start, by more than an edge at the end."""
    size = 10.0 ** rng.uniform([[-3], [-1]], [[-1], [0.3]], (2, n))
    ways = rng.normal(0, 1, (2, n, *scene.rest.shape)) * size[..., None, None]
    return _between(scene.rest + ways[0], scene.rest + ways[1])


def thrown(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Rigid meshes: far rotations about themselves, and ways through each other."""
    ends = []
    mesh = np.repeat(np.arange(len(scene.n_vertices)), scene.n_vertices)
    centers = np.stack([scene.rest[mesh == m].mean(axis=0) for m in range(len(scene.n_vertices))])
    for _ in range(2):
        turns = _rotations(rng, n * len(centers)).reshape(n, len(centers), 3, 3)
        offsets = rng.normal(0, 0.7, (n, len(centers), 3)) + centers * rng.choice([0.3, 1.0, 2.0], (n, 1, 1))
        ends.append(np.einsum("nvij,vj->nvi", turns[:, mesh], scene.rest - centers[mesh]) + offsets[:, mesh])
    return _between(*ends)


def wound(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Rolled up to a spiral, some to a helix: patches whose normals cover all directions, or overlap in one plane."""
    ends = []
    axis = rng.integers(0, 2, n)
    for _ in range(2):
        per_length = rng.choice([0.0, 0.2, 0.7, 1.3, 2.0], n) * rng.choice([-1, 1], n)
        radius, thickness, pitch = rng.uniform(0.3, 2, n), rng.choice([0.0, 0.05, 0.2], n), rng.choice([0, 0.1, 0.5], n)
        along = np.where(axis[:, None] == 0, scene.rest[:, 0], scene.rest[:, 1])
        across = np.where(axis[:, None] == 0, scene.rest[:, 1], scene.rest[:, 0])
        angle = along * per_length[:, None]
        out = radius[:, None] + thickness[:, None] * angle + scene.rest[:, 2]
        rolled = [out * np.cos(angle), out * np.sin(angle), across + pitch[:, None] * angle]
        ramp = [(out + across) * np.cos(angle), (out + across) * np.sin(angle), pitch[:, None] * angle]
        ends.append(np.where((rng.random(n) < 0.5)[:, None, None], np.stack(rolled, 2), np.stack(ramp, 2)))
    return _between(*ends)


def bent(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Smooth maps of space, the second far more curved than the first."""
    ends = []
    for strength in (0.15, 1.2):
        wave = rng.normal(0, 0.8, (n, 3, 3))
        phase = rng.uniform(0, 2 * np.pi, (n, 1, 3))
        ends.append(scene.rest + strength * np.sin(scene.rest @ wave + phase) * rng.uniform(0, 2, (n, 1, 3)))
    return _between(*ends)


def folded(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """Over a line, down onto itself: flat at t=1, or through itself by half."""
    direction = rng.normal(0, 1, (n, 3))
    direction[rng.random(n) < 0.5] = rng.choice([[1.0, 0, 0], [0, 1.0, 0], [1, 1, 0]])
    beyond = np.maximum((scene.rest @ direction[:, :, None])[:, :, 0] - rng.uniform(-0.5, 0.5, (n, 1)), 0)
    square = (direction**2).sum(axis=1)[:, None]
    start, end = (np.broadcast_to(scene.rest, (n, *scene.rest.shape)).copy() for _ in range(2))
    end -= (2 * beyond / square)[:, :, None] * direction[:, None]
    start[..., 2] += beyond * rng.choice([0.5, 1.0], (n, 1))
    end[..., 2] += beyond * rng.choice([0.0, 0.1, -0.3], (n, 1))
    return _between(start, end)


def lattice(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """On few places: many contacts at one time, coplanar motion, contact just at the end."""
    rest = np.rint(2 * scene.rest)
    reach = rng.choice([0, 0, 1], (2, n, 1, 1)), rng.choice([0, 1, 2], (2, n, 1, 1))
    start, end = (
        rest + rng.integers(-r[0], r[0] + 1, (n, *rest.shape)) * (rng.random((n, len(rest), 1)) < 0.3) for r in reach
    )
    flat = rng.random(n) < 0.3
    end[flat] *= [1, 1, 0]
    to_a_point = rng.random(n) < 0.05
    end[to_a_point] = end[to_a_point][:, :1]
    return _between(start, end)


def apart(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """All vertices by one vector, plus a little noise: almost no contact."""
    ends = scene.rest + rng.normal(0, 0.05, (2, n, *scene.rest.shape))
    return _between(ends[0], ends[1] + rng.normal(0, 3, (n, 1, 3)))


def together(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """All vertices, or each mesh, by one vector: at rest relative to each other but for rounding."""
    start = _squeezed(rng, n, scene)
    way = rng.normal(0, 1, (n, 1, 3)) * rng.choice([1, 1e3, 1e9], (n, 1, 1))
    of_mesh = np.repeat(rng.normal(0, 1, (n, len(scene.n_vertices), 3)), scene.n_vertices, axis=1)
    return _between(start, start + np.where(rng.random((n, 1, 1)) < 0.5, way, of_mesh))


def pressed(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """From nearly flat, down by ever more upwards: each layer runs into the next."""
    start = _squeezed(rng, n, scene)
    depth = 10.0 ** rng.uniform(-9, 0.5, (n, 1)) * (scene.rest[:, 2] - scene.rest[:, 2].min())
    end = start + rng.normal(0, 1, (n, *scene.rest.shape)) * 10.0 ** rng.uniform(-12, -1, (n, 1, 1))
    end[..., 2] -= depth
    return _between(start, end)


def sliding(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """In the planes of the layers, which stay as near as they are."""
    start = _squeezed(rng, n, scene)
    way = np.repeat(rng.normal(0, 1, (n, len(scene.n_vertices), 3)), scene.n_vertices, axis=1)
    way += rng.normal(0, 0.1, (n, *scene.rest.shape)) * rng.choice([0, 1], (n, 1, 1))
    return _between(start, start + way * [1, 1, 0])


def alone(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """One vertex moves."""
    q = noise(rng, n, scene)
    q[:, : len(scene.rest)] = start = _squeezed(rng, n, scene)
    moves = rng.integers(0, len(scene.rest), n) == np.arange(len(scene.rest))[:, None]
    q[:, len(scene.rest) :] = np.where(moves.T[..., None], q[:, len(scene.rest) :], start)
    return q


def _squeezed(rng: np.random.Generator, n: int, scene: SmallScene) -> np.ndarray:
    """At rest, some flattened until layers are 1e-16 apart, some without any order."""
    rest = scene.rest * np.where(
        rng.random((n, 1, 1)) < 0.5, [1, 1, 1e-9], 10.0 ** rng.uniform([0, 0, -16], 0, (n, 1, 3))
    )
    return rest + rng.normal(0, 1, rest.shape) * rng.choice([0, 0, 1e-12, 0.05], (n, 1, 1))


MOTIONS: dict[str, Motions] = {f.__name__: f for f in (noise, thrown, wound, bent, folded, lattice, apart)}
MORE_MOTIONS = MOTIONS | {f.__name__: f for f in (together, pressed, sliding, alone)}


def extreme(rng: np.random.Generator, q: np.ndarray) -> np.ndarray:
    """About 1e140 or 1e-140, where squares overflow or vanish."""
    _, exponent = np.frexp(np.abs(q).max(axis=(1, 2), keepdims=True))
    return np.ldexp(q, rng.choice([-465, 465], (len(q), 1, 1)) - exponent)


DISTURBANCES = ((rotate, 0.1), (offset, 0.1), (scale, 0.2), (extreme, 0.02), (single, 0.15), (one_ulp, 0.3))


def motions_of(scene: SmallScene, name: str) -> Callable[[np.random.Generator, int], tuple[np.ndarray, np.ndarray]]:
    """Disturbed less than single pairs, so that more scenes are free of contacts at the start; half of the separations
    are 0."""

    def generate(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
        made = MORE_MOTIONS[name](rng, n, scene)
        for change, share in DISTURBANCES:
            chosen = rng.random(n) < share
            made[chosen] = change(rng, made[chosen])
        size = np.abs(made).max(axis=(1, 2))
        distance = size * rng.choice([0, 0, 0, 1e-9, 1e-3, 0.02], n)
        return made, distance

    return generate


def _between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    return np.concatenate([start, end], axis=1)


def _rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    q = rng.normal(0, 1, (n, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]
    q[rng.random(n) < 0.3] = [1, 0, 0, 0]
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
