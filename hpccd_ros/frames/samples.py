# SPDX-License-Identifier: Apache-2.0
"""What came over time and is looked at between two stamps: transforms, values of joints. No ROS. Bounded.

**A clock that is set back.** What came before is of another run, and is not mixed with what comes now. What goes back
by more than a second has begun anew, and so has all. What goes back by less may only be late: until RESTART_AFTER
samples in a row have increasing stamps, all before its last one. Where a mesh is known to have begun anew
(`forget_future`) there is no doubt: what came before it went back is forgotten.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

from hpccd_ros.frames.restart import IncreasingStamps

HISTORY_NS = 10_000_000_000
# What goes back by more has begun anew; what came late may be so much earlier.
RESTART_NS = 1_000_000_000
RESTART_AFTER = 5  # as parameter restart_after has it by default
MOST_SAMPLES = 1000  # of one thing: 100 Hz for the whole history

Value = TypeVar("Value")


class Samples(Generic[Value]):
    """Of one thing, in the order of their stamps.

    ``numbers``: of the samples, in the order in which those of all things came. ``since``: number and stamp of the
    first of those that came last, in increasing order, behind the newest stamp; None: the last one did not.
    """

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self.samples: list[Value] = []
        self.numbers: list[int] = []
        self.since: tuple[int, int] | None = None
        self._behind = IncreasingStamps()

    def begins_anew(self, stamp: int) -> bool:
        return bool(self.stamps) and stamp < self.stamps[-1] - RESTART_NS

    def forget_before(self, number: int) -> None:
        """Only samples that came with this number or later stay."""
        kept = [place for place, came in enumerate(self.numbers) if came >= number]
        self.stamps = [self.stamps[place] for place in kept]
        self.samples = [self.samples[place] for place in kept]
        self.numbers = [self.numbers[place] for place in kept]
        self.since, self._behind = None, IncreasingStamps()

    def add(self, stamp: int, sample: Value, number: int) -> bool:
        """Whether so many came behind the newest one that they are of another run."""
        run = 0
        if self.stamps and stamp < self.stamps[-1]:
            run = self._behind.next(stamp)
            if run == 1:
                self.since = number, stamp
        elif self.since is not None:
            self.since, self._behind = None, IncreasingStamps()
        at = bisect_left(self.stamps, stamp)
        if at < len(self.stamps) and self.stamps[at] == stamp:
            self.samples[at], self.numbers[at] = sample, number
            return run >= RESTART_AFTER
        self.stamps.insert(at, stamp)
        self.samples.insert(at, sample)
        self.numbers.insert(at, number)
        old = max(bisect_left(self.stamps, self.stamps[-1] - HISTORY_NS), len(self.stamps) - MOST_SAMPLES)
        del self.stamps[:old], self.samples[:old], self.numbers[:old]
        return run >= RESTART_AFTER


class Run:
    """Of things that share a clock. all_samples: of each of them, as they are now."""

    def __init__(self, all_samples: Callable[[], Iterable[Samples[Any]]]) -> None:
        self._all = all_samples
        self._came = 0  # messages so far
        self._anew: int | None = None  # the first stamp after it last began anew

    def add(self, stamp: int, of_message: Iterable[tuple[Samples[Value], Value]]) -> None:
        """What one message tells of some things."""
        self._came += 1
        for samples, value in of_message:
            if samples.begins_anew(stamp):
                self._begin_anew(self._came, stamp)
            if samples.add(stamp, value, self._came) and samples.since is not None:
                self._begin_anew(*samples.since)

    def forget_future(self, stamp: int) -> None:
        """A mesh begins anew with ``stamp``: samples beyond it are from before, but those that have begun anew too."""
        with_it = self._anew is not None and abs(stamp - self._anew) <= RESTART_NS
        for samples in self._all():
            if samples.since is not None:
                number, self._anew = samples.since
                samples.forget_before(number)
            elif samples.begins_anew(stamp) or (samples.stamps and samples.stamps[-1] > stamp and not with_it):
                samples.forget_before(self._came + 1)

    def _begin_anew(self, number: int, stamp: int) -> None:
        """What came before would be interpolated with what comes now, of one thing and across things."""
        for samples in self._all():
            samples.forget_before(number)
        self._anew = stamp
