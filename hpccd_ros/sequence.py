# SPDX-License-Identifier: Apache-2.0
"""What the sequence numbers of a publisher tell: messages lost on the way, and a new publisher."""


class SequenceWatch:
    """Follows the publication sequence numbers that come with the messages of one topic.

    A reader's history that is overwritten before the node gets to it is no "lost message" to DDS: only the gap in
    these numbers shows it.
    """

    def __init__(self) -> None:
        self._last: int | None = None

    def next(self, number: int) -> tuple[int, bool]:
        """(messages missing before this one, whether it comes from a new publisher).

        A number that does not grow means another publisher, which counts from the start.
        """
        last, self._last = self._last, number
        if last is None:
            return 0, False
        return (number - last - 1, False) if number > last else (0, True)
