# SPDX-License-Identifier: Apache-2.0
"""Momentum and energy of the cloth, and what changed them: gravity, the ball, the air."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cloth_solver.response import FromBall, ToAir
from cloth_solver.setup import Setup
from cloth_solver.springs import Springs


@dataclass(frozen=True)
class State:
    """State of the cloth: momentum (3,) kg m/s, energies in J, angular momentum about z in kg m^2/s.

    turning: the same with both directions of rotation added, not subtracted.
    """

    momentum: np.ndarray
    spin: float
    turning: float
    kinetic: float
    height: float  # energy of
    elastic: float

    @property
    def energy(self) -> float:
        return self.kinetic + self.height + self.elastic


class Ledger:
    """Momentum and energy received since the start, besides the present ones.

    gravity, ball, air, held: (3,) momentum that each gave (ball: with the plate; held: vertices that were held back);
    ball_spin, air_spin, held_spin: angular momentum about z; work, held_work: of the ball, of holding vertices back.
    """

    def __init__(self, setup: Setup, n_cloth: int):
        self._setup, self._n = setup, n_cloth
        self._springs = Springs(setup, setup.period / setup.substeps)
        self.gravity, self.ball, self.air, self.held = np.zeros((4, 3))
        self.ball_spin = self.air_spin = self.held_spin = self.work = self.held_work = 0.0

    def open(self, positions: np.ndarray, velocity: np.ndarray) -> None:
        """The state at the start."""
        self.start = self.state(positions, velocity)

    def enter(self, part: float, period: float, ball: FromBall, air: ToAir) -> None:
        """A move of `period` seconds, of which what came in counts to this part."""
        self.gravity[2] -= self._n * self._setup.mass * self._setup.gravity * period
        self.ball += part * ball.impulse
        self.ball_spin += part * ball.spin
        self.work += part * ball.work
        self.air -= part * air.impulse
        self.air_spin -= part * air.spin

    def hold(self, solved: State, kept: State) -> None:
        """What the cloth loses, or gains, where vertices keep a share of their solved move."""
        self.held += kept.momentum - solved.momentum
        self.held_spin += kept.spin - solved.spin
        self.held_work += kept.energy - solved.energy

    def state(self, positions: np.ndarray, velocity: np.ndarray) -> State:
        setup, n = self._setup, self._n
        x = np.ascontiguousarray(positions[:n].T, dtype=np.float64)
        spins = x[0] * velocity[1] - x[1] * velocity[0]
        return State(
            setup.mass * velocity.sum(axis=1),
            setup.mass * float(spins.sum()),
            setup.mass * float(np.abs(spins).sum()),
            0.5 * setup.mass * float((velocity * velocity).sum()),
            setup.mass * setup.gravity * float(x[2].sum()),
            self._springs.energy(x.reshape(3, setup.cells + 1, setup.cells + 1)),
        )

    def unexplained_momentum(self, now: State) -> float:
        """Length of the momentum that nothing in the ledger explains, kg m/s."""
        rest = now.momentum - self.start.momentum - self.gravity - self.ball - self.air - self.held
        return float(np.sqrt((rest * rest).sum()))

    def lost(self, now: State) -> float:
        """J that friction, the air, impacts and the springs' own damping took: what came in less what is there."""
        return self.start.energy + self.work + self.held_work - now.energy
