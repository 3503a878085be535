# SPDX-License-Identifier: Apache-2.0
"""Small folded sheets, as many worlds hold them."""

from __future__ import annotations

import numpy as np

from bench.core.two_nets import flat, sheet

COLUMNS, ROWS = 46, 31
DIFFERENT = 256  # worlds with a motion of their own; more of them begin anew
FOLD = 37


def garment() -> np.ndarray:
    """Faces of a garment of 2,700 triangles."""
    return sheet(COLUMNS, ROWS)


def motions(worlds: int) -> tuple[np.ndarray, np.ndarray]:
    """Start and end (worlds, V, 3) float32: folded once, waved and rough, then pressed together at one place and moved
    as a whole, each in its own way."""
    rng = np.random.default_rng(0)
    half = (COLUMNS - 1) / 2
    folded = flat(COLUMNS, ROWS)
    upper = folded[:, 0] > half
    folded[upper, 0] = 2 * half - folded[upper, 0]
    start, end = np.empty((2, min(worlds, DIFFERENT), *folded.shape), np.float32)
    for k in range(len(start)):
        p, phase = folded.copy(), rng.random(3) * 6
        p[:, 2] = 0.8 * np.sin(p[:, 1] / 4 + phase[0]) + 0.5 * np.cos(p[:, 0] / 5 + phase[1])
        p[upper, 2] += 0.6 + 0.05 * np.sin(3 * p[upper, 1] + phase[2])
        p += rng.normal(0, 0.03, p.shape)
        q = p + rng.normal(0, 0.03, p.shape)
        x, y = rng.uniform(6, half - 4), rng.uniform(5, ROWS - 6)
        q[upper, 2] -= np.exp(-((p[:, 0] - x) ** 2 + (p[:, 1] - y) ** 2) / 12.0)[upper]
        start[k], end[k] = p, q + rng.normal(0, 0.3, 3)
    again = np.arange(worlds) % len(start)
    return start[again], end[again]


def folded_sheet() -> tuple[np.ndarray, np.ndarray]:
    """Faces and vertices (V, 3) float32 of a sheet of 2,592 triangles, folded once, its halves 0.3 apart."""
    p = flat(FOLD, FOLD).astype(np.float32)
    upper, line = p[:, 0] > FOLD // 2, p[:, 1].copy()
    p[upper, 0] = FOLD - 1 - p[upper, 0]
    p[upper, 2] = 0.3 + 0.05 * np.sin(line[upper])
    p[:, 2] += 0.2 * np.sin(line / 3)
    return sheet(FOLD, FOLD), p
