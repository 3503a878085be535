# SPDX-License-Identifier: Apache-2.0
"""Collision-free motions of small scenes by the core; the oracle tests that nothing touches in them."""

from __future__ import annotations

import functools
import zlib
from collections.abc import Callable, Sequence

import numpy as np
import oracle

import hpccd_core as hc

from .disturbances import disturb
from .generators import GENERATORS
from .step_motions import MORE_MOTIONS, motions_of
from .step_scenes import MOTION_SCENES
from .steps import EARLY, ends_of

# Guarantee: no factor is below this part of the collision-free step, unless rounding lets features touch there.
KEPT = 0.9

Generator = Callable[[np.random.Generator, int], "tuple[np.ndarray, np.ndarray]"]


def _pairs(kind: str, name: str) -> Generator:
    def generate(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
        made = disturb(rng, GENERATORS[kind][name](rng, n), kind)
        return made, np.abs(made).max(axis=(1, 2)) * rng.choice([0, 0, 0, 1e-9, 1e-3, 0.02], n)

    return generate


FREE_MOTIONS: dict[str, dict[str, Generator]] = {
    kind: {name: _pairs(kind, name) for name in GENERATORS[kind]}
    if kind in GENERATORS
    else {name: motions_of(scene, name) for name in MORE_MOTIONS}
    for kind, scene in MOTION_SCENES.items()
}


def core_motions(
    kind: str, queries: np.ndarray, distances: np.ndarray, accuracy: str, simd: str
) -> tuple[np.ndarray, np.ndarray]:
    """hit: whether anything touches, by factors and stuck vertices; value: the smallest factor of a moving vertex."""
    hit, value = np.zeros(len(queries), bool), np.ones(len(queries))
    for i, (start, end, distance) in enumerate(zip(*ends_of(queries), distances, strict=True)):
        motion = _asked(kind, start, end, distance, accuracy, simd)
        value[i] = motion.factors[(start != end).any(axis=1)].min(initial=1)
        hit[i] = value[i] < 1 or len(motion.stuck) > 0
    return hit, value


def break_promises(
    kind: str, queries: np.ndarray, distances: np.ndarray, accuracy: str, simd: Sequence[str], steps: np.ndarray
) -> np.ndarray:
    """Mask of the scenes whose motions break a promise or differ by instruction sets; steps: (Q,), the true ones."""
    scenes = zip(*ends_of(queries), distances, steps, strict=True)
    return np.array([bool(broken_promise(kind, *scene, accuracy, simd)) for scene in scenes], bool)


def broken_promise(
    kind: str, start: np.ndarray, end: np.ndarray, distance: float, step: float, accuracy: str, simd: Sequence[str]
) -> str:
    """The first one, or nothing."""
    motion, *others = (_asked(kind, start, end, distance, accuracy, s) for s in simd)
    start, end, groups = _arguments(kind, start, end)
    factors, stuck = motion.factors, motion.stuck
    moves, whole, none = (start != end).any(axis=1), factors == 1, factors == 0
    is_stuck = np.isin(np.arange(len(start)), stuck)
    exact = start + factors[:, None] * (end.astype(float) - start)
    shared = [factors[groups == group] for group in np.unique(groups[groups >= 0])]
    mistakes = {
        "instruction sets differ": any(other != motion for other in others),
        "type": motion.vertices.dtype != start.dtype,
        "factors beyond [0, 1]": not ((factors >= 0) & (factors <= 1)).all(),
        "1 is not the end": not np.array_equal(motion.vertices[whole], end[whole]),
        "0 is not the start": not np.array_equal(motion.vertices[none], start[none]),
        "others are elsewhere": (
            np.abs(motion.vertices - exact) > 2 * np.spacing(np.maximum(abs(start), abs(end)))
        ).any(),
        "stuck is not sorted or moves": not np.array_equal(stuck, np.unique(stuck)) or factors[stuck].any(),
        "shortened at rest": not whole[~moves & ~is_stuck & (groups < 0)].all(),
        "a group has two factors": any(len(np.unique(of_group)) > 1 for of_group in shared),
    }
    if accuracy in ("exact", "conservative"):
        mistakes["touches"] = not _is_free(kind, start, motion.vertices, distance, stuck)
        if factors[moves].min(initial=1) < KEPT * (step - EARLY):
            floor = _rounded(start, end, KEPT * min(step, 1))
            mistakes["too short"] = _is_free(kind, start, floor, distance, stuck)
    return next((mistake for mistake, made in mistakes.items() if made), "")


def _rounded(start: np.ndarray, end: np.ndarray, factor: float) -> np.ndarray:
    """A part of the motion; floats are rounded towards the start."""
    there = start + factor * (end.astype(float) - start)
    near = there.astype(start.dtype)
    beyond = np.where(there > start, near > there, near < there)
    return np.where(beyond, np.nextafter(near, start), near)


def _is_free(kind: str, start: np.ndarray, end: np.ndarray, distance: float, stuck: np.ndarray) -> bool:
    """Whether nothing touches but pairs of stuck vertices at the start."""
    scene = MOTION_SCENES[kind]
    beside = {"edges_per_mesh": scene.edges, "n_vertices": scene.n_vertices, "threads": 1}
    found = oracle.brute_force(start, end, scene.faces, minimum_separation=distance, **beside)
    before = np.cumsum([0, *scene.n_vertices[:-1]])
    faces = np.concatenate([np.reshape(f, (-1, 3)) + b for f, b in zip(scene.faces, before, strict=True)])
    touching = np.concatenate([found.vf[:, 0], faces[found.vf[:, 1]].ravel(), found.ee.ravel()]).astype(int)
    return not found.vf_toc.any() and not found.ee_toc.any() and np.array_equal(np.unique(touching), stuck)


def _arguments(kind: str, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """As floats where these hold the numbers, and groups; the same for the same positions."""
    rng = np.random.default_rng(zlib.crc32(np.stack([start, end]).tobytes()))
    with np.errstate(over="ignore", under="ignore"):
        single = start.astype(np.float32), end.astype(np.float32)
    if np.array_equal(single, (start, end)):
        start, end = single
    n_vertices = MOTION_SCENES[kind].n_vertices
    groups = np.full(len(start), -1)
    if rng.random() < 0.3:
        groups = np.repeat(rng.integers(-1, len(n_vertices), len(n_vertices)), n_vertices)
    elif rng.random() < 0.2:
        groups = rng.integers(-1, 6, len(start))
    return start, end, groups


def _asked(
    kind: str, start: np.ndarray, end: np.ndarray, distance: float, accuracy: str, simd: str
) -> hc.CollisionFreeMotion:
    detector, now = _detector(kind, accuracy, simd)
    if now != [distance]:
        n_meshes = len(MOTION_SCENES[kind].n_vertices)
        detector.set_separations(np.full((n_meshes, n_meshes), distance))
        now[:] = [distance]
    start, end, groups = _arguments(kind, start, end)
    return detector.collision_free_motion(start, end, groups if (groups >= 0).any() else None)


@functools.cache
def _detector(kind: str, accuracy: str, simd: str) -> tuple[hc.Detector, list[float]]:
    """And the separation that it has now."""
    scene = hc.Scene()
    small = MOTION_SCENES[kind]
    for number, (faces, edges, n) in enumerate(zip(small.faces, small.edges, small.n_vertices, strict=True)):
        scene.add_mesh(f"mesh{number}", faces, edges=edges, n_vertices=n)
    return hc.Detector(scene, accuracy=accuracy, simd=simd, backend="cpu", threads=1), [0.0]
