# SPDX-License-Identifier: Apache-2.0
"""Arrays of integers as short byte strings, which `assets/unpack.js` reads."""

import zlib

import numpy as np
from numpy.typing import NDArray

# Of zlib: 9 takes twice as long for 1 % less.
LEVEL = 7


def packed(values: NDArray[np.unsignedinteger]) -> bytes:
    """(G,N,W) uint16 or uint32: differences from group to group, of these from row to row, folded so that small
    negative ones are small too, then all lowest bytes, all second ones and so on, through zlib.

    Groups are frames, rows are vertices: neighbours move alike, so most differences need one byte. All is computed
    modulo 2^16 or 2^32: nothing overflows.
    """
    differences = values.copy()
    differences[1:] -= values[:-1]
    differences[:, 1:] -= differences[:, :-1].copy()
    bits = 8 * differences.itemsize
    negative = differences >> (bits - 1)
    folded = (differences << 1) ^ (0 - negative)
    planes = np.ascontiguousarray(folded, f"<u{differences.itemsize}").view(np.uint8).reshape(-1, differences.itemsize)
    return zlib.compress(planes.T.tobytes(), LEVEL)


class Grid:
    """Places rounded to whole steps from `low`, of which `STEPS` reach over the longest side of the box around them.

    low, high: (3,), of the box. step: the unit; nothing is moved by more than half of it along an axis.
    """

    STEPS = 65535

    def __init__(self, low, high):
        self.low, self.high = np.asarray(low, np.float64), np.asarray(high, np.float64)
        # Halves: the difference of two finite numbers may be infinite.
        step = 2.0 * (float(np.max(0.5 * self.high - 0.5 * self.low)) / self.STEPS)
        self.step = step or 1.0

    def rounded(self, places) -> NDArray[np.uint16]:
        """(...,3) steps from `low`."""
        halves = 0.5 * np.asarray(places, np.float64) - 0.5 * self.low
        return np.clip(np.rint(halves / (0.5 * self.step)), 0, self.STEPS).astype(np.uint16)

    def described(self) -> dict:
        """For the page."""
        return {"low": self.low.tolist(), "high": self.high.tolist(), "step": self.step}
