# SPDX-License-Identifier: Apache-2.0
"""A triangle that points down at a large one: their distance is its height."""

import numpy as np

FACES = np.array([[0, 1, 2]], np.uint32)
MESHES = ("hand", "table")
TABLE = np.array([[-9.0, -9, 0], [9, -9, 0], [0, 9, 0]])


def hand(height: float) -> np.ndarray:
    """Positions of the hand with its lowest vertex at this height above the middle of the table."""
    return np.array([[0, 0, height], [1, 0, height + 1], [0, 1, height + 1]])
