# SPDX-License-Identifier: Apache-2.0
"""The report at the end of the example: intersections, momentum, energy, time; and whether they are plausible."""

import numpy as np

# Positions are rounded to float32 in each frame; lengths are of the order of 1 m.
ROUNDING = 2e-7
# Tolerance, as a share of the momentum received: sums of some 10,000 doubles, some 10,000 times.
SUMMED = 1e-9
# Tolerance, as a share of the angular momentum received, or of the largest that the cloth had if the ball gives almost
# none: springs pull along their direction in the middle of a small step, so each step has a small error.
TURNED = 0.05


class Account:
    """Kept frame by frame; the queries' own seconds for the intersections count as hpccd's."""

    def __init__(self, simulation, queries):
        self._simulation, self._queries = simulation, queries
        self._seconds: list[float] = []
        self._asked: list[float] = []  # seconds in hpccd
        self._intersections: list[int] = []
        self._shortened = self._again = 0
        self._height = self._flight = self._error = 0.0
        self._lost = [0.0]
        self._unexplained = self._turning = 0.0

    def enter(self, move, seconds: float) -> None:
        """After a move (None: before the first) that took this many seconds."""
        simulation, ledger = self._simulation, self._simulation.ledger
        before = self._queries.seconds
        self._intersections.append(self._queries.intersections(simulation.positions))
        checked = self._queries.seconds - before
        if move is None:
            self._asked_before = self._queries.seconds
            self._velocity, self._height = 0.0, self._middle()
            return
        self._seconds.append(seconds + checked)
        self._asked.append(self._queries.seconds - self._asked_before)
        self._asked_before = self._queries.seconds
        self._shortened += move.part < 1.0
        self._again += move.attempts > 1
        if not ledger.ball.any():
            self._fall()
        self.state = ledger.state(simulation.positions, simulation.velocity)
        self._turning = max(self._turning, self.state.turning)
        self._lost.append(ledger.lost(self.state))
        self._unexplained = max(self._unexplained, ledger.unexplained_momentum(self.state))

    def _middle(self) -> float:
        return float(self._simulation.positions[: self._simulation.velocity.shape[1], 2].mean(dtype=np.float64))

    def _fall(self):
        """A point falls through the same air for the same time: so must the middle of a cloth that nothing touches."""
        setup = self._simulation.setup
        step = setup.period / setup.substeps
        for _ in range(setup.substeps):
            self._velocity -= step * (setup.drag * self._velocity + setup.gravity)
            self._height += step * self._velocity
        self._flight = self._simulation.time
        self._error = max(self._error, abs(self._height - self._middle()))

    @property
    def plausible(self) -> bool:
        """Whether all that `lines` tells is as it must be."""
        ledger = self._simulation.ledger
        came = np.abs([ledger.gravity, ledger.ball, ledger.air, ledger.held]).sum()
        turned = abs(self.state.spin - ledger.ball_spin - ledger.air_spin - ledger.held_spin)
        return bool(
            sum(self._intersections) == 0
            and self._error <= ROUNDING
            and self._unexplained <= SUMMED * came
            and turned <= TURNED * max(abs(ledger.ball_spin), self._turning)
            and min(np.diff(self._lost)) >= -1e-3 * max(self._lost)
        )

    def lines(self) -> list[str]:
        """In words."""
        ledger, state = self._simulation.ledger, self.state
        start, frames = ledger.start.energy, len(self._seconds)
        took, asked = sum(self._seconds), sum(self._asked)
        return [
            f"intersections  {sum(self._intersections)} in all {len(self._intersections)} frames",
            f"moves          {frames}, {self._shortened} of them shortened, {self._again} solved more than once",
            f"simulated      {self._simulation.time:.3f} s, {1e3 * self._simulation.time / frames:.2f} ms a move",
            f"free fall      first {self._flight:.2f} s: its centre is within {self._error:.1e} m of a falling point",
            f"momentum       gravity, ball, air and held vertices explain it to within {self._unexplained:.1e} N s",
            f"spin           {state.spin:.4f} kg m2/s, of which ball, air and held vertices gave "
            f"{ledger.ball_spin + ledger.air_spin + ledger.held_spin:.4f}",
            f"energy         {start:.3f} J at the start + {ledger.work:.3f} J from the ball + {ledger.held_work:.3f} J "
            f"from held vertices = {state.energy:.3f} J there + {self._lost[-1]:.3f} J lost",
            f"               to friction, air and impacts: in no move less than {min(np.diff(self._lost)):.1e} J",
            f"time           {1e3 * took / frames:.1f} ms a frame (median {1e3 * np.median(self._seconds):.1f}), "
            f"{100 * asked / took:.0f} % of it in hpccd",
            f"plausible      {'yes' if self.plausible else 'NO'}",
        ]
