# SPDX-License-Identifier: Apache-2.0
"""Moves of the cloth, each proven free of contacts before it is made.

trial   where the cloth would go without contacts: what comes close on this motion are the pairs
solve   small steps with springs and pairs; repeated where new pairs turn up
guard   the detector returns how much of the solved move is free; a move that is not free is shortened: by one factor
        for all vertices ("global"), or by a factor for each ("vertices")
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

    positions: (V,3) float32 at its end, cloth and obstacles. time: s, at its end. attempts: how often it was solved.
    part: how much of it was made, the mean of the cloth's vertices. pairs: that it was solved with.
    """

    positions: np.ndarray
    time: float
    attempts: int
    part: float
    pairs: int


class Simulation:
    """A cloth and a ball, and how both have moved so far.

    step: "global" or "vertices", see above. positions: (V,3) float32, proven. velocity: (3, V of the cloth) float64.
    late: s by which the ball lags behind since the cloth blocked it. ledger: of momentum and energy.
    """

    def __init__(self, setup: Setup, queries: Queries, seed: int = 0, step: str = "global"):
        self.setup, self._queries, self._step = setup, queries, step
        cloth, _ = setup.cloth(seed)
        self._ball, _ = setup.ball()
        self._n_cloth = len(cloth)
        self.positions = np.concatenate([cloth, self._ball, setup.plate()[0]]).astype(np.float32)
        self.velocity = np.zeros((3, self._n_cloth))
        self.time = self.late = 0.0
        self._stuck = 0
        self._ticks = 0  # whole periods
        self.ledger = Ledger(setup, self._n_cloth)
        self.ledger.open(self.positions, self.velocity)

    def move(self) -> Move:
        """Make the next move. Raises Stuck."""
        setup, start = self.setup, self.positions
        period = (self._ticks + 1) * setup.period - self.time
        trial = self.trial(period)
        obstacles, pairs = trial[self._n_cloth :], self._pairs(start, trial)
        for attempt in range(1, ATTEMPTS + 1):
            end, velocity, ball_gave, air = self._solve(obstacles, pairs, period, SWEEPS * attempt)
            free = self._queries.free_part(start, end)
            if free == 1.0:
                break
            new = self._pairs(start, end)
            pairs = pairs.and_those_of(new.only(new.gap(end.T.astype(np.float64)) < PRESSED * setup.thickness))
        shorten = self._each_vertex if self._step == "vertices" else self._all_alike
        self.positions, velocity, factor, passed = shorten(start, end, velocity, free)
        self.ledger.enter(passed, passed * period, ball_gave, air)
        self.velocity = velocity
        self.time += passed * period
        if passed == 1.0:
            self._ticks += 1
            self.time = self._ticks * setup.period
        self._stuck = self._stuck + 1 if factor < STUCK else 0
        if self._stuck > PATIENCE:
            first = "" if self._step == "vertices" else "the step 'vertices', "
            raise Stuck(
                f"the cloth is stuck at {self.time:.3f} s: {PATIENCE} moves in a row were shortened to less than "
                f"{STUCK}; take {first}a finer cloth, a slower ball or a shorter period"
            )
        return Move(self.positions, self.time, attempt, factor, len(pairs))

    def _all_alike(self, start, end, velocity, free):
        """(positions, velocity, factor, part of the period that passed): all vertices and the time have one factor."""
        part = 1.0
        while free < 1.0:  # what is made is what is asked about, its rounding to float32 included
            part *= CAUTION * free
            shorter = (start + part * (end.astype(np.float64) - start)).astype(np.float32)
            free = self._queries.free_part(start, shorter)
            if free == 1.0:
                end = shorter
        return end, part * velocity + (1.0 - part) * self.velocity, part, part

    def _each_vertex(self, start, end, velocity, free):
        """(positions, velocity, mean factor, 1): each vertex has a factor of its own, and the whole period passes.

        The ball rotates: shortened along chords it would shrink. So it is placed at the pose that it reaches, and the
        detector is asked again.
        """
        n, n_ball, solved, factors, turned = self._n_cloth, len(self._ball), end, np.ones(len(end)), 1.0
        while free < 1.0:
            end, kept = self._queries.free_motion(start, end)
            factors *= kept
            free = kept[n]
            if free < 1.0:
                turned *= CAUTION * free
                turned = turned if turned > STUCK else 0.0
                end[n : n + n_ball] = self._ball_in(turned * self.setup.period) if turned else start[n : n + n_ball]
        self.late += (1.0 - turned) * self.setup.period
        factors = factors[:n]
        slower = factors * velocity
        self.ledger.hold(self.ledger.state(solved, velocity), self.ledger.state(end, slower))
        return end, slower, float(factors.mean()), 1.0

    def trial(self, period: float) -> np.ndarray:
        """(V,3) float32: where all would be in `period` seconds if nothing were in the cloth's way."""
        velocity = self.velocity.copy()
        velocity[2] -= self.setup.gravity * period
        cloth = self.positions[: self._n_cloth] + (period * velocity).T
        plate = self.positions[self._n_cloth + len(self._ball) :]
        return np.concatenate([cloth.astype(np.float32), self._ball_in(period), plate])

    def _ball_in(self, period: float) -> np.ndarray:
        """The ball's vertices `period` seconds from now, if nothing blocks it."""
        return self.setup.turned(self._ball, self.time - self.late + period).astype(np.float32)

    def _pairs(self, start: np.ndarray, end: np.ndarray) -> Pairs:
        return Pairs.of(self._queries.near(start, end), self.setup, self._n_cloth)

    def _solve(self, obstacles: np.ndarray, pairs: Pairs, period: float, sweeps: int):
        """(end, velocity, what the ball gave, what the air took) of the move, solved in small steps."""
        setup, n = self.setup, self._n_cloth
        step = period / setup.substeps
        springs = Springs(setup, step)
        x = np.ascontiguousarray(self.positions.T, dtype=np.float64)
        grid = x[:, :n].reshape(3, setup.cells + 1, setup.cells + 1)  # a view
        velocity = self.velocity.copy()
        obstacle_step = (obstacles.T - x[:, n:]) / setup.substeps
        ball_gave, air = FromBall(np.zeros(3)), ToAir(np.zeros(3))
        gap = pairs.gap(x)
        for small in range(setup.substeps):
            before = x.copy()
            slowed = setup.drag * step * velocity
            air.take(setup.mass * slowed, x[:, :n])
            velocity -= slowed
            velocity[2] -= setup.gravity * step
            x[:, :n] += step * velocity
            x[:, n:] += obstacle_step
            springs.relax(grid)
            goal = goals(gap, (small + 1) * step, setup)
            for _ in range(sweeps):
                respond(x, before, pairs, goal, setup, n, step, ball_gave)
            velocity = (x[:, :n] - before[:, :n]) / step
        end = np.ascontiguousarray(x.T, dtype=np.float32)
        end[n:] = obstacles
        return end, velocity, ball_gave, air
