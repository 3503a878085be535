# SPDX-License-Identifier: Apache-2.0
"""Moves of the cloth, each proven free of contacts before it is made.

trial   where the cloth would go without contacts: what comes close on this motion are the pairs
solve   small steps with springs and pairs; repeated where new pairs turn up
guard   the detector tells how much of the solved move is free; a move that is not free is shortened
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloth_solver.ledger import Ledger
from cloth_solver.pairs import Pairs
from cloth_solver.queries import Queries
from cloth_solver.response import FromBall, ToAir, goals, respond
from cloth_solver.setup import Setup
from cloth_solver.springs import Springs

# Share of the free part that a blocked move takes. The rest leaves a gap for the next move.
CAUTION = 0.9
# Attempts to solve a move, each with the pairs that the one before ran into.
ATTEMPTS = 4
# Jacobi sweeps over the pairs a small step, in the first attempt; each later one takes as many more.
SWEEPS = 2
# Pairs of a failed attempt are new to the next where it left them nearer than this part of the thickness.
PRESSED = 0.6
# Consecutive moves that took less than this share, before it is an error.
STUCK, PATIENCE = 0.01, 20


class Stuck(RuntimeError):
    """Many moves in a row were shortened to nearly nothing."""


@dataclass(frozen=True)
class Move:
    """A move that was made, from the end of the one before.

    positions: (V,3) float32 at its end, cloth and ball. time: s, at its end. attempts: how often it was solved. part:
    how much of it was made. pairs: that it was solved with.
    """

    positions: np.ndarray
    time: float
    attempts: int
    part: float
    pairs: int


class Simulation:
    """A cloth above a ball, and how both have moved so far.

    positions: (V,3) float32, proven. velocity: (3, V of the cloth) float64. ledger: of momentum and energy.
    """

    def __init__(self, setup: Setup, queries: Queries, seed: int = 0):
        self.setup, self._queries = setup, queries
        cloth, cloth_faces = setup.cloth(seed)
        self._ball, ball_faces = setup.ball()
        self._n_cloth = len(cloth)
        self._faces = np.concatenate([cloth_faces.astype(np.int64), ball_faces.astype(np.int64) + len(cloth)])
        self.positions = np.concatenate([cloth, self._ball]).astype(np.float32)
        self.velocity = np.zeros((3, self._n_cloth))
        self.time, self._stuck = 0.0, 0
        self._ticks = 0  # whole periods
        self.ledger = Ledger(setup, self._n_cloth)
        self.ledger.open(self.positions, self.velocity)

    def move(self) -> Move:
        """Make the next move. Raises Stuck."""
        setup, start = self.setup, self.positions
        period = (self._ticks + 1) * setup.period - self.time
        trial = self.trial(period)
        ball, pairs = trial[self._n_cloth :], self._pairs(start, trial)
        for attempt in range(1, ATTEMPTS + 1):
            end, velocity, ball_gave, air = self._solve(ball, pairs, period, SWEEPS * attempt)
            free = self._queries.free_part(start, end)
            if free == 1.0:
                break
            new = self._pairs(start, end)
            pairs = pairs.and_those_of(new.only(new.gap(end.T.astype(np.float64)) < PRESSED * setup.thickness))
        part = 1.0
        while free < 1.0:  # what is made is what is asked about, its rounding to float32 included
            part *= CAUTION * free
            shorter = (start + part * (end.astype(np.float64) - start)).astype(np.float32)
            free = self._queries.free_part(start, shorter)
            if free == 1.0:
                end = shorter
        self._stuck = self._stuck + 1 if part < STUCK else 0
        if self._stuck > PATIENCE:
            raise Stuck(
                f"the cloth is stuck at {self.time:.3f} s: {PATIENCE} moves in a row were shortened to less than "
                f"{STUCK}; take a finer cloth, a slower ball or a shorter period"
            )
        self.positions = end
        self.velocity += part * (velocity - self.velocity)
        self.time += part * period
        if part == 1.0:
            self._ticks += 1
            self.time = self._ticks * setup.period
        self.ledger.enter(part, part * period, ball_gave, air)
        return Move(end, self.time, attempt, part, len(pairs))

    def trial(self, period: float) -> np.ndarray:
        """(V,3) float32: where all would be in `period` seconds if nothing were in the cloth's way."""
        ball = self.setup.turned(self._ball, self.time + period).astype(np.float32)
        velocity = self.velocity.copy()
        velocity[2] -= self.setup.gravity * period
        cloth = self.positions[: self._n_cloth] + (period * velocity).T
        return np.concatenate([cloth.astype(np.float32), ball])

    def _pairs(self, start: np.ndarray, end: np.ndarray) -> Pairs:
        near = self._queries.near(start, end)
        return Pairs.of(near, self._faces, start.astype(np.float64), end.astype(np.float64), self.setup, self._n_cloth)

    def _solve(self, ball: np.ndarray, pairs: Pairs, period: float, sweeps: int):
        """(end, velocity, what the ball gave, what the air took) of the move, solved in small steps."""
        setup, n = self.setup, self._n_cloth
        step = period / setup.substeps
        springs = Springs(setup, step)
        x = np.ascontiguousarray(self.positions.T, dtype=np.float64)
        grid = x[:, :n].reshape(3, setup.cells + 1, setup.cells + 1)  # a view
        velocity = self.velocity.copy()
        ball_step = (ball.T - x[:, n:]) / setup.substeps
        ball_gave, air = FromBall(np.zeros(3)), ToAir(np.zeros(3))
        gap = pairs.gap(x)
        for small in range(setup.substeps):
            before = x.copy()
            slowed = setup.drag * step * velocity
            air.take(setup.mass * slowed, x[:, :n])
            velocity -= slowed
            velocity[2] -= setup.gravity * step
            x[:, :n] += step * velocity
            x[:, n:] += ball_step
            springs.relax(grid)
            goal = goals(gap, (small + 1) * step, setup)
            for _ in range(sweeps):
                respond(x, before, pairs, goal, setup, n, step, ball_gave)
            velocity = (x[:, :n] - before[:, :n]) / step
        end = np.ascontiguousarray(x.T, dtype=np.float32)
        end[n:] = ball
        return end, velocity, ball_gave, air
