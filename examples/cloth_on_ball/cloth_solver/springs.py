# SPDX-License-Identifier: Apache-2.0
"""The cloth's own forces: springs along the threads, the diagonals, and between every second vertex.

Extended position-based dynamics with one sweep a small step (Macklin et al. 2019, "Small steps in physics simulation").
Springs are coloured, so that those of one colour share no vertex and numpy moves them all at once.
"""

from __future__ import annotations

import numpy as np

from cloth_solver.setup import Setup


class Springs:
    """Springs of a grid of (cells + 1)**2 vertices of equal mass; positions are (3, n, n)."""

    def __init__(self, setup: Setup, step: float):
        self._colours = []
        for rows, columns, stiffness in (
            (0, 1, setup.stretch),
            (1, 0, setup.stretch),
            (1, 1, setup.shear),
            (1, -1, setup.shear),
            (0, 2, setup.bend),
            (2, 0, setup.bend),
        ):
            rest = setup.spacing * float(rows * rows + columns * columns) ** 0.5
            softness = setup.mass / (stiffness * step * step)
            for a, b in _colours(setup.cells + 1, rows, columns):
                self._colours.append((a, b, rest, stiffness, softness))

    def relax(self, x: np.ndarray) -> None:
        """One sweep: implicit in the force of each spring, which no sum of momenta notices."""
        for a, b, rest, _, softness in self._colours:
            d = x[a] - x[b]
            length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            d *= (length - rest) / (length * (2.0 + softness))
            x[a] -= d
            x[b] += d

    def energy(self, x: np.ndarray) -> float:
        """J, stored in all springs."""
        total = 0.0
        for a, b, rest, stiffness, _ in self._colours:
            d = x[a] - x[b]
            strain = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) - rest
            total += 0.5 * stiffness * float((strain * strain).sum())
        return total


def _colours(n: int, rows: int, columns: int):
    """Pairs of slices of (3, n, n) that are `rows` and `columns` apart, no vertex twice in one pair of slices."""
    axis, reach = (1, rows) if rows else (2, columns)
    for colour in range(2 * reach):
        # Runs of `reach` vertices that begin every 2 * reach are what neighbours in the next run can pair with.
        a, b = [slice(None)] * 3, [slice(None)] * 3
        a[axis] = slice(colour, n - reach, 2 * reach)
        b[axis] = slice(colour + reach, n, 2 * reach)
        if rows and columns:
            a[2], b[2] = (slice(None, -1), slice(1, None))[::columns]
        if colour < n - reach:
            yield tuple(a), tuple(b)
