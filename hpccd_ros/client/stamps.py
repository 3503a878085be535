# SPDX-License-Identifier: Apache-2.0
"""Stamps of messages, from what a program has: a Time, or nanoseconds."""

from __future__ import annotations

import time
import warnings
from typing import TypeAlias

import numpy as np
from builtin_interfaces.msg import Time as TimeMessage
from rclpy.time import Time

from hpccd_core import arguments
from hpccd_ros.middleware.fields import stamp_to_ns

#: Nanoseconds since the epoch, or a Time of rclpy or of a message.
Stamp: TypeAlias = "int | Time | TimeMessage"

# builtin_interfaces/Time counts seconds in 32 bits with a sign.
LAST_STAMP = 2**31 * 10**9 - 1
# An integer so near to the system's time in seconds is no count of nanoseconds. A wider range would hold stamps of
# simulations, which begin at 0: 1.76 s after it there are as many nanoseconds as there are seconds since 1970.
_LIKE_SECONDS = 10


def nanoseconds(name: str, stamp: Stamp) -> int:
    """Nanoseconds since the epoch.

    Raises TypeError for a float, ValueError for a time that a message cannot hold. Warns of an integer that is within
    ten seconds of the system's time in seconds.
    """
    if isinstance(stamp, Time):
        return arguments.whole_number(name, stamp.nanoseconds, 0, LAST_STAMP)
    if isinstance(stamp, TimeMessage):
        try:
            return stamp_to_ns(stamp)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    if isinstance(stamp, (float, np.floating)):
        raise TypeError(
            f"{name}: expected an integer, nanoseconds since the epoch, got {type(stamp).__name__} (seconds?); give a "
            "Time, as node.get_clock().now() returns it, or round(seconds * 1e9)"
        )
    number = arguments.whole_number(name, stamp, 0, LAST_STAMP)
    if abs(number - time.time()) <= _LIKE_SECONDS:
        warnings.warn(
            f"{name}: {number} is the present time in seconds, but counts as nanoseconds; give a Time, as "
            "node.get_clock().now() returns it, or time.time_ns()",
            stacklevel=3,
        )
    return number
