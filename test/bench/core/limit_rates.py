# SPDX-License-Identifier: Apache-2.0
"""What this machine can do at most, measured on it, and the least time that work takes at these rates."""

from __future__ import annotations

import dataclasses

from bench.core.limit_work import Work
from hpccd_core import _core

# Of a core's second cache, half: so that the rest of the process does not push it out.
SECOND_CACHE = 1 << 19
# A stage's data lie in whichever cache holds them, or in memory: at most as much is measured.
MOST = 1 << 28


@dataclasses.dataclass(frozen=True)
class Least:
    """ms, and what takes so long: "comparing", "computing", "moving" (data, once) or "touching" (again and again)."""

    ms: float
    by: str


class Rates:
    """Per second, of so many threads together. Measured when first asked for, 0.1 to 0.5 s each."""

    def __init__(self, threads: int, simd: str = "auto"):
        self.threads = threads
        self.measured: dict[tuple[str, int], float] = {}
        self._simd = _core.Simd.__members__[simd]

    def of(self, name: str, size: int = 0) -> float:
        if (name, size) not in self.measured:
            rate = _core.Rate.__members__[name]
            self.measured[name, size] = _core.machine_rate(rate, self._simd, self.threads, size)
        return self.measured[name, size]

    def least(self, work: Work, single: bool) -> Least:
        """Arithmetic and data go side by side: the longer of them counts. single: flops are of single precision."""
        size = _power_of_two(work.read + work.written)
        seconds = {
            "comparing": work.comparisons / self.of("comparisons"),
            "computing": work.flops / self.of("floats" if single else "doubles"),
            # What is written takes as long as to copy so much, which reads as much as well.
            "moving": work.written / self.of("copy", size) + max(0.0, work.read - work.written) / self.of("read", size),
            "touching": work.touched / self.of("read", SECOND_CACHE * self.threads),
        }
        arithmetic = seconds["comparing"] + seconds["computing"]  # by the same units
        longest = max(seconds, key=lambda name: seconds[name])
        return Least(1e3 * max(arithmetic, seconds["moving"], seconds["touching"]), longest)


def _power_of_two(size: float) -> int:
    """Not above `size`, so that the rate is none too low."""
    return min(MOST, 1 << max(12, int(size).bit_length() - 1))
