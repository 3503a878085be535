# SPDX-License-Identifier: Apache-2.0
"""Stamps and array fields of messages, without copies if possible.

Array fields are never assigned from numpy: rclpy's setter would walk it element by element (123 ms for 5 MB
of float32), while ``array.array`` filled from the buffer takes 0.5 ms. A message made with check_fields=True
takes such an array as it is; others copy it once more.
"""

from array import array

import numpy as np
from builtin_interfaces.msg import Time

from hpccd_ros.base.quoting import printable
from hpccd_ros.frames.drops import Input, Reason, Rejection

_NS = 1_000_000_000
_CODES = {np.dtype(np.float32): "f", np.dtype(np.float64): "d", np.dtype(np.uint32): "I", np.dtype(np.uint8): "B"}


class InvalidMessageError(ValueError):
    """An invalid message: ``reason`` for the counters; the text has the problem and the remedy."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(printable(text))  # names in it are those of the message
        self.reason = reason

    def rejection(self, mesh: str, what: Input) -> Rejection:
        """The rejection of the message, as one of ``mesh``."""
        return Rejection(mesh, self.reason, str(self), what=what)


def stamp_to_ns(stamp: Time) -> int:
    """Nanoseconds since the epoch. Raises InvalidMessageError: before it, or a whole second in nanosec."""
    if stamp.sec < 0 or stamp.nanosec >= _NS:
        raise InvalidMessageError(
            Reason.MALFORMED,
            f"stamp has sec {stamp.sec} and nanosec {stamp.nanosec}; sec must not be negative, nanosec below {_NS}",
        )
    return stamp.sec * _NS + stamp.nanosec


def ns_to_stamp(ns: int) -> Time:
    """Time message of nanoseconds since the epoch."""
    sec, nanosec = divmod(ns, _NS)
    return Time(sec=sec, nanosec=nanosec)


def to_field(values: np.ndarray) -> array:
    """``array.array`` for an array field of a message; any shape, flattened in C order.

    values: float32, float64, uint32 or uint8.
    """
    values = np.ascontiguousarray(values)
    field = array(_CODES[values.dtype])
    field.frombytes(memoryview(values).cast("B") if values.size else b"")
    return field


def zeros(code: str, count: int) -> array:
    """A field to write into through np.frombuffer: to_field would copy a temporary."""
    return array(code, [0]) * count
