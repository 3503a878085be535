# SPDX-License-Identifier: Apache-2.0
"""The fingers of robots/arm.py as what cloth meets: boxes that push out, and a hold on what they have taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpccd_ros.robots import arm
from hpccd_ros.scenes.cloth import rub
from hpccd_ros.scenes.exactmath import sincos

WIDTH, THICKNESS, LENGTH = arm.FINGER_SIZE


class Gripper:
    """The fingers at a time. Their own coordinates: u across the way they close, v along it, w up from their tips."""

    def __init__(self, time: float):
        self._tip, yaw = arm.tip(time)
        self._sine, self._cosine = (float(x) for x in sincos(yaw))
        self.opening = arm.finger(time)

    def local(self, p: np.ndarray) -> np.ndarray:
        """Points (3, ...) of the scene -> u, v, w."""
        x, y = p[0] - self._tip[0], p[1] - self._tip[1]
        return np.stack([self._cosine * x + self._sine * y, self._cosine * y - self._sine * x, p[2] - self._tip[2]])

    def scene(self, q: np.ndarray) -> np.ndarray:
        """u, v, w (3, ...) -> points of the scene."""
        x, y = self._cosine * q[0] - self._sine * q[1], self._sine * q[0] + self._cosine * q[1]
        return np.stack([x + self._tip[0], y + self._tip[1], q[2] + self._tip[2]])


@dataclass(frozen=True, eq=False)
class Hold:
    """Points that go along with a finger: `mask` of all, where they are seen from that finger, and which it is."""

    mask: np.ndarray
    place: np.ndarray
    side: np.ndarray  # of v, 1 or -1

    @classmethod
    def of(cls, p: np.ndarray, mask: np.ndarray, gripper: Gripper) -> Hold:
        place = gripper.local(p[:, mask])
        side = np.where(place[1] > 0.0, 1.0, -1.0)
        place[1] -= side * gripper.opening
        return cls(mask, place, side)

    def take_along(self, p: np.ndarray, gripper: Gripper) -> None:
        place = self.place.copy()
        place[1] += self.side * gripper.opening
        p[:, self.mask] = gripper.scene(place)


def under_tips(q: np.ndarray, opening: float, margin: float) -> np.ndarray:
    """Which points `q` (u, v, w) lie under the fingertips, or beside these by `margin` at most."""
    beside = np.abs(np.abs(q[1]) - (opening + THICKNESS / 2)) <= THICKNESS / 2 + margin
    return beside & (np.abs(q[0]) <= WIDTH / 2 + margin)


def in_grip(q: np.ndarray, opening: float, margin: float) -> np.ndarray:
    """Which points `q` (u, v, w) lie between the fingers, or in their inner faces by `margin` at most."""
    beside = (np.abs(q[0]) <= WIDTH / 2) & (np.abs(q[1]) <= opening + margin)
    return beside & (q[2] >= 0.0) & (q[2] <= LENGTH)


def push_out(p, before, earlier: Gripper, now: Gripper, depth: float, friction: float) -> None:
    """Points (3,n,n) deeper than `depth` in a finger go to that depth of its nearest side, with Coulomb's friction.

    before: where they were when the gripper was as `earlier`.
    """
    q = now.local(p)
    for side in (1.0, -1.0):
        into = side * q[1] - now.opening  # from the inner face on
        inside = (np.abs(q[0]) < WIDTH / 2 - depth) & (into > depth) & (into < THICKNESS - depth)
        inside &= (q[2] > depth) & (q[2] < LENGTH)
        if not inside.any():
            continue
        u, v, w = q[0][inside], into[inside], q[2][inside]
        ways = np.stack([WIDTH / 2 - depth - np.abs(u), v - depth, THICKNESS - depth - v, w - depth])
        way = np.minimum(np.minimum(ways[0], ways[1]), np.minimum(ways[2], ways[3]))
        by_end, by_inner, by_outer, by_tip = (each == way for each in ways)
        out = np.stack(
            [
                np.where(by_end, np.where(u > 0.0, WIDTH / 2 - depth, depth - WIDTH / 2), u),
                np.where(by_inner, depth, np.where(by_outer, THICKNESS - depth, v)),
                np.where(by_tip, depth, w),
            ]
        )
        was = earlier.local(before[:, inside])
        was[1] = side * was[1] - earlier.opening
        slide = np.where(np.stack([by_end, by_inner | by_outer, by_tip]), 0.0, out - was)
        out -= rub(slide, way, friction)
        out[1] = side * (out[1] + now.opening)
        p[:, inside] = now.scene(out)
