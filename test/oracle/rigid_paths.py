# SPDX-License-Identifier: Apache-2.0
"""Points of a rigid mesh or a link: many queries at once, in any precision.

It shares no formula with hpccd_core.rigid: a screw is the exponential of its twist, a link a product of matrices.
`kind` is np.float64, or np.longdouble for queries that float64 leaves open.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np


class Paths(Protocol):
    """Of (Q, n) points."""

    def at(self, rows: np.ndarray, t: np.ndarray, kind: type) -> tuple[np.ndarray, np.ndarray]:
        """(N, n, 3) positions less the origin, and velocities, of these queries at these times (N,)."""

    def acceleration(self) -> np.ndarray:
        """(Q,): not below that of any point at any time."""

    def size(self) -> np.ndarray:
        """(Q,): what rounding errors of `at` are proportional to."""


@dataclass(frozen=True, eq=False)
class ScrewPaths:
    """points (Q,n,3) in the body; quaternions (Q,2,4), x y z w, of any length; shifts (Q,2,3); origins (Q,3).

    Results are relative to the origin, so points far away lose no precision.
    """

    points: np.ndarray
    quaternions: np.ndarray
    shifts: np.ndarray
    origins: np.ndarray
    _known: dict = field(default_factory=dict, init=False, repr=False)

    def at(self, rows, t, kind):
        axis, angle, twist, begun = (of_all[rows] for of_all in self._twists(kind))
        phi = (angle * t.astype(kind))[:, None]
        turned = _turned(axis[:, None], phi[:, :, None], begun)
        # V(phi) t rho of the exponential, and its derivative, the turned rho.
        once = _cross(axis, twist)
        twice = _cross(axis, once)
        safe = np.where(phi == 0, kind(1), phi)
        a = np.where(phi == 0, kind(0), 2 * np.sin(safe / 2) ** 2 / safe)
        b = np.where(np.abs(phi) < 0.01, _series(phi, kind), 1 - np.sin(safe) / safe)
        shift = t.astype(kind)[:, None] * (twist + a * once + b * twice)
        start = self.shifts[rows, 0].astype(kind) - self.origins[rows].astype(kind)
        speed = angle[:, None, None] * _cross(axis[:, None], turned) + _turned(axis, phi, twist)[:, None]
        return turned + (start + shift)[:, None], speed

    def acceleration(self):
        rows = np.arange(len(self.points))
        axis, angle, _, _ = self._twists(np.float64)
        _, speed = self.at(rows, np.zeros(len(rows)), np.float64)
        across = np.linalg.norm(_cross(axis[:, None], speed), axis=2).max(axis=1)
        return np.asarray(np.abs(angle) * across * (1 + 1e-6) + 1e-13 * self.size() * np.abs(angle))

    def size(self):
        way = np.linalg.norm(self.shifts[:, 1] - self.shifts[:, 0], axis=1)
        return (
            np.linalg.norm(self.points, axis=2).max(axis=1)
            + way
            + np.linalg.norm(self.shifts[:, 0] - self.origins, axis=1)
        )

    def _twists(self, kind):
        """axis, angle, rho; and the points turned by the first pose."""
        if kind not in self._known:
            self._known[kind] = self._computed_twists(kind)
        return self._known[kind]

    def _computed_twists(self, kind):
        q = self.quaternions.astype(kind)
        q = q / np.sqrt((q * q).sum(axis=2, keepdims=True))
        inverse = q[:, 0] * np.array([-1, -1, -1, 1], kind)
        v = inverse[:, 3:] * q[:, 1, :3] + q[:, 1, 3:] * inverse[:, :3] + _cross(q[:, 1, :3], inverse[:, :3])
        w = q[:, 1, 3] * inverse[:, 3] - (q[:, 1, :3] * inverse[:, :3]).sum(axis=1)
        first = np.take_along_axis(v, (v != 0).argmax(axis=1)[:, None], 1)[:, 0]
        sign = np.where((w < 0) | ((w == 0) & (first < 0)), kind(-1), kind(1))
        v, w = v * sign[:, None], w * sign
        sine = np.sqrt((v * v).sum(axis=1))
        half = np.arctan2(sine, w)
        axis = v / np.where(sine == 0, kind(1), sine)[:, None]
        c = self.shifts[:, 1].astype(kind) - self.shifts[:, 0].astype(kind)
        once = _cross(axis, c)
        safe = np.where(half == 0, kind(1), half)
        cotangent = np.where(
            half < 0.01,
            half**2 / 3 + half**4 / 45 + 2 * half**6 / 945 + half**8 / 4725,
            1 - half * np.cos(half) / np.sin(safe),
        )[:, None]
        twist = c - half[:, None] * once + cotangent * _cross(axis, once)
        vector, scalar = q[:, 0, None, :3], q[:, 0, None, 3:]
        p = self.points.astype(kind)
        begun = p + 2 * (scalar * _cross(vector, p) + _cross(vector, _cross(vector, p)))
        return axis, 2 * half, twist, begun


@dataclass(frozen=True, eq=False)
class LinkPaths:
    """Points (Q,n,3) of the last link of chains of m joints. turns, slides (Q,m): kinds, neither of them: fixed.

    quaternions (Q,m,4), shifts (Q,m,3): each joint's frame in the link before it; axes (Q,m,3); values (Q,2,m); base
    (Q,3).
    """

    points: np.ndarray
    turns: np.ndarray
    slides: np.ndarray
    quaternions: np.ndarray
    shifts: np.ndarray
    axes: np.ndarray
    values: np.ndarray
    origins: np.ndarray
    bases: np.ndarray

    def at(self, rows, t, kind):
        values = self.values[rows].astype(kind)
        speeds = values[:, 1] - values[:, 0]
        values = values[:, 0] + speeds * t.astype(kind)[:, None]
        x, v = self.points[rows].astype(kind), np.zeros_like(self.points[rows], kind)
        # From the tip to the base: x and v as the link before sees them.
        for k in range(self.turns.shape[1] - 1, -1, -1):
            axis = self.axes[rows, k].astype(kind)
            axis = (axis / np.sqrt((axis * axis).sum(axis=1, keepdims=True)))[:, None]
            turn, slide = self.turns[rows, k, None, None], self.slides[rows, k, None, None]
            value, speed = values[:, k, None, None], speeds[:, k, None, None]
            angle = np.where(turn, value, kind(0))
            x, v = _turned(axis, angle, x), _turned(axis, angle, v)
            v = v + np.where(turn, speed, kind(0)) * _cross(axis, x) + np.where(slide, speed, kind(0)) * axis
            x = x + np.where(slide, value, kind(0)) * axis
            q = self.quaternions[rows, k].astype(kind)
            q = q / np.sqrt((q * q).sum(axis=1, keepdims=True))
            vector, scalar = q[:, None, :3], q[:, None, 3:]
            x, v = (y + 2 * (scalar * _cross(vector, y) + _cross(vector, _cross(vector, y))) for y in (x, v))
            x = x + self.shifts[rows, k].astype(kind)[:, None]
        return x + (self.bases[rows].astype(kind) - self.origins[rows].astype(kind))[:, None], v

    def acceleration(self):
        speeds = np.abs(self.values[:, 1] - self.values[:, 0])
        turning, sliding = (speeds * self.turns).sum(axis=1), (speeds * self.slides).sum(axis=1)
        return (turning**2 * self._reach() + 2 * turning * sliding) * (1 + 1e-6)

    def size(self):
        speeds = np.abs(self.values[:, 1] - self.values[:, 0]).sum(axis=1)
        return (1 + speeds) * self._reach() + np.linalg.norm(self.bases - self.origins, axis=1)

    def _reach(self):
        slid = (np.abs(self.values).max(axis=1) * self.slides).sum(axis=1)
        return np.linalg.norm(self.shifts, axis=2).sum(axis=1) + slid + np.linalg.norm(self.points, axis=2).max(axis=1)


def _cross(a, b):
    """Of the last axis; faster than numpy's."""
    shape = np.broadcast_shapes(a.shape, b.shape)
    product = np.empty(shape, np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return product


def _turned(axis, angle, vectors):
    """About unit axes, or not at all about zeros."""
    once = _cross(axis, vectors)
    return vectors + np.sin(angle) * once + 2 * np.sin(angle / 2) ** 2 * _cross(axis, once)


def _series(phi, kind):
    """1 - sin(phi) / phi for a small angle."""
    square = phi * phi
    return square / kind(6) * (1 - square / kind(20) * (1 - square / kind(42) * (1 - square / kind(72))))
