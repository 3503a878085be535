# SPDX-License-Identifier: Apache-2.0
"""Notice messages that cannot be deserialised: the middleware drops them without a word.

A subscription is ready only where a message waits; if none can be taken then, those that waited were unreadable. Seen
with Fast DDS 2.14: never else, neither for publishers that end or are killed nor for a history that overflows. How many
they were only the gap in the publisher's numbers tells, and unreadable ones in front of a readable one only that gap.
"""

import weakref
from collections.abc import Callable
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.subscription import Subscription

_watched: weakref.WeakKeyDictionary[Subscription, Callable[[], None]] = weakref.WeakKeyDictionary()


def watch(subscription: Subscription, on_unreadable: Callable[[], None]) -> None:
    """Call ``on_unreadable`` at each sign of them, where an UnreadableExecutor runs the node."""
    _watched[subscription] = on_unreadable


class UnreadableExecutor(SingleThreadedExecutor):
    """Tells those that `watch`."""

    def _take_subscription(self, subscription: Subscription) -> Any:
        work = super()._take_subscription(subscription)
        if work is None and (tell := _watched.get(subscription)) is not None:
            tell()
        return work
