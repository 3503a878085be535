# SPDX-License-Identifier: Apache-2.0
"""Samples over time that are interpolated between two stamps: transforms and joint values. No ROS. Bounded.

**A clock that is set back.** Earlier samples belong to another run and are not mixed with later ones. If one frame or
joint goes back by more than a second, all samples restart. If it goes back by less, its samples may only be late, until
RESTART_AFTER samples in a row have increasing stamps, all before its last one. If a mesh is known to have restarted
(`forget_future`), samples from before are discarded at once.

**A stamp far ahead.** A sample more than HISTORY_NS after all others may have a wrong stamp. It is used for its own
time, earlier samples stay, and the time between is unknown until the next sample: one that continues from there
confirms it; one that continues from before makes it a stray, which is removed.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable
from typing import Any, Generic, TypeVar

from hpccd_ros.frames.restart import IncreasingStamps

HISTORY_NS = 10_000_000_000
# A larger step back is a restart; late samples may be earlier by up to this.
RESTART_NS = 1_000_000_000
RESTART_AFTER = 5  # the default of the parameter restart_after
MOST_SAMPLES = 1000  # of one frame or joint: 100 Hz for the whole history

Value = TypeVar("Value")


class Samples(Generic[Value]):
    """Samples of one frame or joint, in the order of their stamps.

    ``numbers``: of the samples, counted in order of arrival over all frames or joints. ``since``: number and stamp of
    the first sample of the last run that arrived in increasing order but behind the newest stamp; None: the last
    sample did not. ``sent``: when the messages of the samples were sent, ns of the system clock.
    """

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self.samples: list[Value] = []
        self.numbers: list[int] = []
        self.sent: list[int] = []
        self.since: tuple[int, int] | None = None
        self._behind = IncreasingStamps()

    def restarts(self, stamp: int) -> bool:
        return bool(self.stamps) and stamp < self.stamps[-1] - RESTART_NS

    @property
    def doubtful(self) -> bool:
        """Whether the newest sample may have a wrong stamp."""
        return len(self.stamps) > 1 and self.stamps[-1] - self.stamps[-2] > HISTORY_NS

    def in_doubt(self, stamp: int) -> bool:
        """Whether the next sample decides about ``stamp``."""
        return self.doubtful and self.stamps[-2] < stamp < self.stamps[-1]

    def makes_stray(self, stamp: int) -> bool:
        """Whether a sample of ``stamp`` continues from before the newest one, which was far ahead."""
        return self.doubtful and self.stamps[-2] - RESTART_NS <= stamp < self.stamps[-1] - RESTART_NS

    def forget_newest(self, number: int) -> None:
        """If it has this number."""
        if self.numbers and self.numbers[-1] == number:
            del self.stamps[-1], self.samples[-1], self.numbers[-1], self.sent[-1]
            self.since, self._behind = None, IncreasingStamps()

    def forget_before(self, number: int) -> None:
        """Keep only samples with this number or later ones."""
        kept = [place for place, came in enumerate(self.numbers) if came >= number]
        self.stamps = [self.stamps[place] for place in kept]
        self.samples = [self.samples[place] for place in kept]
        self.numbers = [self.numbers[place] for place in kept]
        self.sent = [self.sent[place] for place in kept]
        self.since, self._behind = None, IncreasingStamps()

    def sent_at(self, stamp: int) -> int:
        """When the older of the two samples around ``stamp``, which is between the first and the last, was sent."""
        if self.stamps[-1] == stamp:
            return self.sent[-1]
        at = bisect_left(self.stamps, stamp)
        return self.sent[at] if self.stamps[at] == stamp else min(self.sent[at - 1], self.sent[at])

    def add(self, stamp: int, sample: Value, number: int, sent: int = 0) -> bool:
        """Whether enough samples arrived behind the newest one that they belong to another run."""
        run = 0
        if self.stamps and stamp < self.stamps[-1]:
            run = self._behind.next(stamp)
            if run == 1:
                self.since = number, stamp
        elif self.since is not None:
            self.since, self._behind = None, IncreasingStamps()
        at = bisect_left(self.stamps, stamp)
        if at < len(self.stamps) and self.stamps[at] == stamp:
            self.samples[at], self.numbers[at], self.sent[at] = sample, number, sent
            return run >= RESTART_AFTER
        self.stamps.insert(at, stamp)
        self.samples.insert(at, sample)
        self.numbers.insert(at, number)
        self.sent.insert(at, sent)
        certain = self.stamps[-2 if self.doubtful else -1]
        old = max(bisect_left(self.stamps, certain - HISTORY_NS), len(self.stamps) - MOST_SAMPLES)
        del self.stamps[:old], self.samples[:old], self.numbers[:old], self.sent[:old]
        return run >= RESTART_AFTER


class Run:
    """The frames or joints that share a clock. all_samples: of each of them.

    ``begun``: how often their time went back, so that all were discarded.
    """

    def __init__(self, all_samples: Callable[[], Iterable[Samples[Any]]]) -> None:
        self._all = all_samples
        self.begun = 0
        self._came = 0  # messages so far
        self._first_after_restart: int | None = None  # the first stamp of the current run

    def add(self, stamp: int, of_message: Iterable[tuple[Samples[Value], Value]], sent: int = 0) -> int | None:
        """Add the values of one message, which was sent at ``sent``. Returns the stamp of an earlier message that was a
        stray and was removed."""
        self._came += 1
        stray = None
        for samples, value in of_message:
            if samples.makes_stray(stamp):
                stray = samples.stamps[-1]
                self._leave_out(samples.numbers[-1], stamp)
            elif samples.restarts(stamp):
                self._restart(self._came, stamp)
            if samples.add(stamp, value, self._came, sent) and samples.since is not None:
                self._restart(*samples.since)
        return stray

    def forget_future(self, stamp: int) -> None:
        """A mesh restarts at ``stamp``: discard samples beyond it, except those that have restarted too."""
        with_it = self._first_after_restart is not None and abs(stamp - self._first_after_restart) <= RESTART_NS
        for samples in self._all():
            if samples.since is not None:
                number, self._first_after_restart = samples.since
                samples.forget_before(number)
            elif samples.restarts(stamp) or (samples.stamps and samples.stamps[-1] > stamp and not with_it):
                samples.forget_before(self._came + 1)

    def _leave_out(self, number: int, stamp: int) -> None:
        """Remove the samples of the message with this number; the time is ``stamp`` again."""
        for samples in self._all():
            samples.forget_newest(number)
        self._first_after_restart = stamp

    def _restart(self, number: int, stamp: int) -> None:
        """Discard earlier samples, which would be interpolated with later ones."""
        for samples in self._all():
            samples.forget_before(number)
        self._first_after_restart = stamp
        self.begun += 1


def stray_text(stamp: int) -> str:
    """Why a message was removed."""
    return (
        f"one of stamp {stamp} ns came more than {HISTORY_NS / 1e9:g} s ahead of those before and after it, and is "
        "left out; its publisher must stamp by the clock of the others, in sec and nanosec"
    )
