# SPDX-License-Identifier: Apache-2.0
"""How a stream that starts anew is told from one with stray messages: by increasing stamps in a row. No ROS."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Restart:
    """The stream starts anew with the message that is looked at; ``text``: in what way."""

    text: str


class IncreasingStamps:
    """Counts messages with increasing stamps in a row."""

    def __init__(self) -> None:
        self._count = 0
        self._last = 0

    def next(self, stamp: int) -> int:
        self._count = self._count + 1 if stamp > self._last else 1
        self._last = stamp
        return self._count
