# SPDX-License-Identifier: Apache-2.0
"""Fields of a message straight from its CDR bytes, one after the other.

rclpy makes a Python object of each point: 56 ms for a marker of 10,000 triangles, and as much again to make an array of
them. From the bytes it is half a millisecond.
"""

import numpy as np
from numpy.typing import NDArray

from hpccd_ros.frames.drops import Reason
from hpccd_ros.middleware.fields import InvalidMessageError

# Behind these bytes, which tell the encoding, the message begins, and alignment counts.
_HEADER = 4
_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}


class CdrReader:
    """data: with its header. All raise InvalidMessageError where the bytes are not what they should be."""

    def __init__(self, data: bytes) -> None:
        order = _ORDERS.get(bytes(data[:2]))
        if order is None or len(data) < _HEADER:
            raise _malformed(f"its bytes begin with {bytes(data[:_HEADER]).hex() or 'nothing'}, which is no plain CDR")
        self._data, self._order, self._at = data, order, _HEADER

    def numbers(self, code: str, count: int) -> NDArray:
        """So many of the kind that numpy calls by this code, in an array of its own."""
        kind = np.dtype(code)
        if count:  # an empty array is not aligned
            self._at += -(self._at - _HEADER) % kind.itemsize
        end = self._at + count * kind.itemsize
        if end > len(self._data):
            raise _malformed(f"it has {len(self._data)} bytes, and its fields need {end} or more")
        found = np.frombuffer(self._data, kind.newbyteorder(self._order), count, self._at)
        self._at = end
        return found.astype(kind)

    def number(self, code: str) -> int:
        return int(self.numbers(code, 1)[0])

    def text(self) -> str:
        text = self.numbers("u1", self.number("u4")).tobytes()
        try:
            return text.rstrip(b"\0").decode()
        except UnicodeDecodeError as error:
            raise _malformed(f"a text in it is not UTF-8: {error}") from error


def _malformed(why: str) -> InvalidMessageError:
    return InvalidMessageError(Reason.MALFORMED, f"{why}; build its publisher with the same definition of the message")
