# SPDX-License-Identifier: Apache-2.0
"""Rate limits, and lost messages and new publishers found by sequence numbers. No ROS."""

import time
from collections.abc import Callable


class RateLimit:
    """Token bucket: ``rate`` a second as a mean, bursts of one second's worth (at least one). 0: no limit."""

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate = rate
        self._most = max(1.0, rate)
        self._clock = clock
        self._tokens = self._most
        self._filled = clock()

    def allows(self) -> bool:
        """True where one more is within the limit; it is then counted."""
        if self._rate == 0.0:
            return True
        now = self._clock()
        self._tokens = min(self._most, self._tokens + self._rate * (now - self._filled))
        self._filled = now
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True


class SequenceWatch:
    """Follows the publication sequence numbers that come with the messages of one topic.

    DDS does not report messages that are overwritten in the reader's history as lost: only a gap in these numbers
    shows them.

    ``before_first``: messages with smaller numbers than the first one read here. They were written before the
    publisher knew this reader, or lost.
    """

    def __init__(self) -> None:
        self._last: int | None = None
        self._seen_any = False
        self.before_first = 0
        self._unnoticed = False

    def matched(self, total: int, new: int) -> None:
        """``new`` publishers were matched since the last call, ``total`` so far. Their numbers are unrelated to those
        before. The middleware may report the first publisher after its first message: there is nothing to forget then.
        """
        if 0 < new and 1 < total:
            self._last = None

    def next(self, number: int) -> tuple[int, bool]:
        """(messages missing before this one, whether it is the first of another publisher).

        A number that does not increase means another publisher, which counts from the start.
        """
        last, self._last = self._last, number
        first, self._seen_any = not self._seen_any, True
        if last is None:
            self.before_first += number - 1
        new_publisher = not first if last is None else number <= last
        self._unnoticed |= new_publisher
        return 0 if last is None or new_publisher else number - last - 1, new_publisher

    def notice(self) -> bool:
        """Whether there was a new publisher since the last call. Its first message may have been rejected; then the
        next one counts as the first."""
        unnoticed, self._unnoticed = self._unnoticed, False
        return unnoticed


class InterleavedSequences:
    """Finds lost messages on a topic of several publishers, whose messages the middleware does not distinguish.

    Each number is assigned to the sequence with the largest number below it. If that sequence is another
    publisher's, a loss can stay hidden, until two messages were read while there was one publisher alone.
    """

    MOST = 16  # sequences that are remembered

    def __init__(self) -> None:
        self._lasts: list[int] = []  # of each sequence, the one read last at the end
        self._unread = 0  # publishers reported and not read; below 0: read and not reported
        self._alone = False

    def matched(self, new: int, ended: int) -> None:
        """``new`` publishers were reported since the last call, and the end of ``ended`` ones."""
        self._unread += new
        if ended:
            self._unread = min(self._unread, 0)  # a publisher may end unheard

    def missing(self, number: int, alone: bool) -> int:
        """Messages lost before this one. alone: there is one publisher now."""
        if alone and self._alone:
            self._lasts = self._lasts[-1:]  # the other sequences are those of publishers that ended
        self._alone = alone
        last = max((last for last in self._lasts if last < number), default=None)
        if last is None or (last < number - 1 and self._unread > 0):
            self._unread -= 1
            self._lasts = [*self._lasts, number][-self.MOST :]
            return 0
        self._lasts.remove(last)
        self._lasts.append(number)
        return number - last - 1
