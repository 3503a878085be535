# SPDX-License-Identifier: Apache-2.0
"""Numbers that stand for many times."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np


@dataclasses.dataclass(frozen=True)
class Times:
    """Wall-clock times of repeated calls, in ms."""

    calls: int
    average: float
    median: float
    p95: float
    best: float

    def as_row(self) -> dict[str, float]:
        """{"calls": ..., "average_ms": ..., "median_ms": ..., "p95_ms": ..., "best_ms": ...}"""
        ms = {f"{key}_ms": getattr(self, key) for key in ("average", "median", "p95", "best")}
        return {"calls": self.calls, **ms}


def times(ms: Sequence[float]) -> Times:
    """Average, median and 95th percentile (linear between neighbours) of at least one time in ms."""
    if not len(ms):
        raise ValueError("ms: no time was measured")
    array = np.asarray(ms, float)
    return Times(
        len(array), float(array.mean()), float(np.median(array)), float(np.percentile(array, 95)), float(array.min())
    )


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """Exponent p of the power law y ~ x^p that fits best: the least-squares slope of log y over log x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])
