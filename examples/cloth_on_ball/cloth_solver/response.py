# SPDX-License-Identifier: Apache-2.0
"""How near pairs push and rub the cloth: Coulomb's law on positions, all pairs of a sweep at once (Jacobi)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloth_solver.pairs import Pairs
from cloth_solver.setup import Setup

# m/s at which surfaces that lie at their thickness are drawn apart, and faster the nearer they lie: at once would be an
# explosion.
RECOVERY = 0.1
# Over-relaxation of the push of a pair that shares vertices with others.
RELAXATION = 1.5


@dataclass
class FromBall:
    """Momentum (3,), angular momentum about z and work from the ball to the cloth."""

    impulse: np.ndarray
    spin: float = 0.0
    work: float = 0.0


@dataclass
class ToAir:
    """Momentum (3,) and angular momentum about z from the cloth to the air."""

    impulse: np.ndarray
    spin: float = 0.0

    def take(self, impulse: np.ndarray, x: np.ndarray) -> None:
        """impulse (3,V) from vertices at x (3,V)."""
        self.impulse += impulse.sum(axis=1)
        self.spin += float((x[0] * impulse[1] - x[1] * impulse[0]).sum())


def respond(
    x: np.ndarray,
    before: np.ndarray,
    pairs: Pairs,
    goal: np.ndarray,
    setup: Setup,
    n_cloth: int,
    step: float,
    ball: FromBall,
) -> None:
    """One sweep: moves the cloth's part of x (3,V) where the gaps of pairs would be smaller than their goal (N,).

    before: positions `step` seconds ago, the ball's too. A pair's push is shared with the pairs that push the same
    vertices: divided by their number, the same at all four vertices, so that no momentum is made.
    """
    offset = pairs.offset(x)
    gap = _dot(pairs.normal, offset)
    pressed = np.flatnonzero(gap < goal)
    if not len(pressed):
        return
    pairs, offset, push = pairs.only(pressed), offset[:, pressed], (goal - gap)[pressed]
    slide = offset - pairs.offset(before)
    slide -= _dot(pairs.normal, slide) * pairs.normal
    length = np.sqrt(_dot(slide, slide))
    friction = np.where(pairs.of_ball, setup.friction_ball, setup.friction_cloth)
    rub = np.minimum(1.0, friction * push / np.maximum(length, 1e-30))
    movable = pairs.vertex < n_cloth
    sharing = np.bincount(pairs.vertex[movable], minlength=n_cloth)
    share = np.max([np.where(m, sharing[np.where(m, v, 0)], 1) for v, m in zip(pairs.vertex, movable, strict=True)], 0)
    # Mass times length: divided by the step it is the pair's impulse.
    momentum = (push * pairs.normal - rub * slide) / (np.maximum(share / RELAXATION, 1.0) * pairs.compliant)
    part = [np.where(m, w, 0.0) for w, m in zip(pairs.weight, movable, strict=True)]
    _count(ball, pairs, momentum, part, x, before, step)
    vertex = np.where(movable, pairs.vertex, n_cloth).ravel()  # what the ball would get goes into a bin of its own
    for axis in range(3):
        moves = np.concatenate([w * momentum[axis] for w in part])
        x[axis, :n_cloth] += np.bincount(vertex, moves, n_cloth + 1)[:n_cloth] / setup.mass


def goals(gap: np.ndarray, elapsed: float, setup: Setup) -> np.ndarray:
    """(N,) gaps that pairs must have `elapsed` seconds after they had the gaps `gap` (N,)."""
    gap = np.maximum(gap, 0.5 * setup.clearance)
    return np.minimum(setup.thickness, gap + elapsed * RECOVERY * setup.thickness / gap)


def _count(ball, pairs, momentum, part, x, before, step):
    with_ball = np.flatnonzero(pairs.of_ball)
    if not len(with_ball):
        return
    vertex, impulse = pairs.vertex[:, with_ball], momentum[:, with_ball] / step
    for k in range(4):
        given = part[k][with_ball] * impulse
        place = x[:, vertex[k]]
        ball.impulse += given.sum(axis=1)
        ball.spin += float((place[0] * given[1] - place[1] * given[0]).sum())
        # The cloth gets the opposite of what the ball's points get, and these move as they are told.
        told = (pairs.weight[k] - part[k])[with_ball] * (x[:, vertex[k]] - before[:, vertex[k]])
        ball.work -= float(_dot(impulse, told).sum()) / step


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
