# SPDX-License-Identifier: Apache-2.0
"""What the sequence numbers of a publisher tell: messages lost on the way, and a new publisher."""


class SequenceWatch:
    """Follows the publication sequence numbers that come with the messages of one topic.

    A reader's history that is overwritten before the node gets to it is no "lost message" to DDS: only the
    gap in these numbers shows it.

    ``before_first``: messages that publishers numbered before the first one that was read here: written
    before this reader was known to them, or lost; the numbers cannot tell.
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
            self.forget()

    def forget(self) -> None:
        """The numbers to come have nothing to do with those before."""
        self._last = None

    def next(self, number: int) -> tuple[int, bool]:
        """(messages missing before this one, whether it is the first of another publisher).

        A number that does not grow means another publisher, which counts from the start.
        """
        last, self._last = self._last, number
        first, self._seen_any = not self._seen_any, True
        if last is None:
            self.before_first += number - 1
        new_publisher = not first if last is None else number <= last
        self._unnoticed |= new_publisher
        return 0 if last is None or new_publisher else number - last - 1, new_publisher

    def notice(self) -> bool:
        """Whether there was a new publisher since this was asked last: its first message may have been refused, and the
        next one stands for it."""
        unnoticed, self._unnoticed = self._unnoticed, False
        return unnoticed
