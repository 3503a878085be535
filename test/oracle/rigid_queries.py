# SPDX-License-Identifier: Apache-2.0
"""Random pairs of features that move by screws and joints: rotations from almost none to half a turn, near the origin
and far away, most of them shifted so that they just touch or just do not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.joints import Joint, JointStep, LinkMotion
from hpccd_core.rigid.motion import Motion, ScrewMotion
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import Rigid
from oracle.rigid_paths import LinkPaths, Paths, ScrewPaths
from oracle.rigid_truth import Pairs

KINDS = ("vf", "ee")
MOTIONS = ("screws", "joints")
_MOST_JOINTS = 8


@dataclass(frozen=True, eq=False)
class Queries:
    """``pairs``: the true paths; ``distance``, ``tolerance`` (Q,): of contact, of the deviation."""

    pairs: Pairs
    distance: np.ndarray
    tolerance: np.ndarray

    def motions(self, k: int) -> tuple[Motion, Motion]:
        """Of both sides of query k, as hpccd_core.rigid has them."""
        return random_motion(self.pairs.a, k), random_motion(self.pairs.b, k)


def random_queries(rng: np.random.Generator, n: int, kind: str, motion: str) -> Queries:
    corners = (1, 3) if kind == "vf" else (2, 2)
    size = 10.0 ** rng.uniform(-1, 1, n)
    b = random_paths(rng, n, corners[1], size, "screws")
    a = random_paths(rng, n, corners[0], size, motion)
    distance = np.where(rng.random(n) < 0.25, 0.0, size * 10.0 ** rng.uniform(-6, -1, n))
    pairs = _brought_near(rng, Pairs(a, b, kind), distance, size)
    tolerance = size * 10.0 ** rng.uniform(-5, -0.5, n)
    return Queries(pairs, distance, tolerance)


def random_paths(rng: np.random.Generator, n: int, corners: int, size: np.ndarray, motion: str) -> Paths:
    """Paths of n sets of points within bodies of this size (n,)."""
    return _screws(rng, n, corners, size) if motion == "screws" else _links(rng, n, corners, size)


def _screws(rng, n, corners, size):
    points = _points(rng, n, corners, size)
    # Some pivot about a place far outside of the body, some about one of its points.
    points += _directions(rng, n)[:, None] * (size * rng.choice([0.0, 1.0, 30.0], n))[:, None, None]
    first = _quaternions(rng, n)
    angle = np.where(rng.random(n) < 0.5, 10.0 ** rng.uniform(-12, 0, n), rng.uniform(0, np.pi, n))
    angle[rng.random(n) < 0.1] = 0.0
    axis = _directions(rng, n)
    turn = np.concatenate([axis * np.sin(angle / 2)[:, None], np.cos(angle / 2)[:, None]], axis=1)
    second = _product(turn, first)
    # Exactly half a turn: from the identity, a quaternion whose w is 0.
    half = rng.random(n) < 0.05
    first[half], second[half] = (0, 0, 0, 1), np.concatenate([axis, np.zeros((n, 1))], axis=1)[half]
    second[angle == 0] = first[angle == 0]
    second *= rng.choice([-1.0, 1.0], n)[:, None]  # the same rotations
    shifts = np.empty((n, 2, 3))
    shifts[:, 0] = _directions(rng, n) * size[:, None]
    way = size * np.where(rng.random(n) < 0.2, 0.0, 10.0 ** rng.uniform(-6, 1, n))
    shifts[:, 1] = shifts[:, 0] + _directions(rng, n) * way[:, None]
    given = [[Rigid.of((0, 0, 0), q).quaternion for q in pair] for pair in np.stack([first, second], 1)]
    return ScrewPaths(points, np.array(given), shifts, np.zeros((n, 3)))


def _links(rng, n, corners, size):
    joints = rng.integers(1, _MOST_JOINTS + 1, n)
    there = np.arange(_MOST_JOINTS) >= _MOST_JOINTS - joints[:, None]  # the others are fixed, at no distance
    kinds = rng.choice(3, (n, _MOST_JOINTS), p=[0.65, 0.25, 0.1])
    turns, slides = there & (kinds == 0), there & (kinds == 1)
    quaternions = _quaternions(rng, n * _MOST_JOINTS).reshape(n, _MOST_JOINTS, 4)
    parallel = rng.random(n) < 0.5  # planar arms, whose joints can turn against each other
    quaternions[parallel | ~there.any(axis=1)] = (0, 0, 0, 1)
    quaternions[~there] = (0, 0, 0, 1)
    quaternions = np.array([[Rigid.of((0, 0, 0), q).quaternion for q in chain] for chain in quaternions])
    shifts = _directions(rng, n * _MOST_JOINTS).reshape(n, _MOST_JOINTS, 3) * there[:, :, None] * size[:, None, None]
    axes = _directions(rng, n * _MOST_JOINTS).reshape(n, _MOST_JOINTS, 3)
    axes[parallel] = axes[parallel, :1]
    scale = np.where(slides, size[:, None], 1.0)
    values = np.empty((n, 2, _MOST_JOINTS))
    values[:, 0] = rng.uniform(-3, 3, (n, _MOST_JOINTS)) * scale
    speed = rng.uniform(-1, 1, (n, _MOST_JOINTS)) * (10.0 ** rng.uniform(-6, 0, n))[:, None] * scale
    against = parallel & (rng.random(n) < 0.5)
    for row in np.flatnonzero(against):
        turning = np.flatnonzero(turns[row])
        if len(turning) > 1:
            speed[row, turning[-1]] = -speed[row, turning[:-1]].sum()
    values[:, 1] = values[:, 0] + speed
    points = _points(rng, n, corners, size * 0.5)
    zero = np.zeros((n, 3))
    return LinkPaths(points, turns, slides, quaternions, shifts, axes, values, zero, zero)


def _points(rng, n, corners, size):
    points = rng.uniform(-1, 1, (n, corners, 3)) * size[:, None, None]
    short = rng.random(n) < 0.5
    points[short] = points[short].astype(np.float32)
    return points


def _brought_near(rng, pairs, distance, size):
    """b shifted so that the least distance is the one asked for, but for 1e-9 to 1e-3 of the size to either side."""
    n = len(distance)
    aim = distance + size * rng.choice([-1.0, 1.0], n) * 10.0 ** rng.uniform(-9, -3, n)
    rows = np.arange(n)
    moved = pairs
    for _ in range(3):
        t = _nearest_time(moved)
        apart, direction, *_ = moved.near(rows, t)
        lost = apart < 1e-6 * size  # they cross: no direction
        direction[lost] = _directions(rng, n)[lost]
        step = np.where(lost, size, apart - np.maximum(aim, 0))
        step[rng.random(n) < 0.02] = 0
        shift = (direction * step[:, None])[:, None]
        moved = replace(moved, b=replace(moved.b, shifts=moved.b.shifts + shift))
    # All of it far from the origin.
    far = _directions(rng, n) * (size * rng.choice([0.0, 1.0, 1e3, 1e6], n, p=[0.5, 0.3, 0.1, 0.1]))[:, None]
    b = replace(moved.b, shifts=moved.b.shifts + far[:, None], origins=far)
    if isinstance(moved.a, ScrewPaths):
        return replace(moved, a=replace(moved.a, shifts=moved.a.shifts + far[:, None], origins=far), b=b)
    return replace(moved, a=replace(moved.a, bases=moved.a.bases + far, origins=far), b=b)


def _nearest_time(pairs):
    """About where in the step the features are nearest: samples, ten times finer around the best of them each time."""
    n, samples = len(pairs.a.origins), 25
    middle, half = np.full(n, 0.5), 0.5
    for _ in range(4):
        t = np.clip(middle[:, None] + half * np.linspace(-1, 1, samples), 0, 1)
        rows = np.repeat(np.arange(n), samples)
        apart = pairs.near(rows, t.ravel())[0].reshape(n, samples)
        middle, half = t[np.arange(n), apart.argmin(axis=1)], half / 10
    return middle


def random_motion(paths: Paths, k: int) -> Motion:
    """Of query k, as hpccd_core.rigid has it."""
    body = Body.of(paths.points[k])
    if isinstance(paths, ScrewPaths):
        start, end = (Rigid(q, shift) for q, shift in zip(paths.quaternions[k], paths.shifts[k], strict=True))
        return ScrewMotion(body, Screw.between(start, end))
    kinds = np.where(paths.turns[k], "revolute", np.where(paths.slides[k], "prismatic", "fixed"))
    joints = [
        Joint.of(
            str(kind), number - 1, Rigid(paths.quaternions[k, number], paths.shifts[k, number]), paths.axes[k, number]
        )
        for number, kind in enumerate(kinds)
    ]
    base = Rigid(np.array([0.0, 0.0, 0.0, 1.0]), paths.bases[k])
    return LinkMotion(JointStep(joints, *paths.values[k], base), len(joints) - 1, body)


def _directions(rng, n):
    vectors = rng.standard_normal((n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _quaternions(rng, n):
    q = rng.standard_normal((n, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True) * rng.uniform(0.9995, 1.0005, (n, 1))


def _product(a, b):
    vector = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
    return np.concatenate([vector, a[:, 3:] * b[:, 3:] - (a[:, :3] * b[:, :3]).sum(axis=1, keepdims=True)], axis=1)
