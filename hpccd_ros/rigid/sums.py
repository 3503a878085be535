# SPDX-License-Identifier: Apache-2.0
"""Sums with the same last bits anywhere: those of the built-in sum changed with Python 3.12, which compensates them."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray


def in_order(values: Iterable[float]) -> float:
    """One after the other, from 0.0 on, each rounded."""
    total = 0.0
    for value in values:
        total += value
    return total


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Of two vectors of the same few numbers."""
    return in_order((a * b).tolist())
