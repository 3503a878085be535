# SPDX-License-Identifier: Apache-2.0
"""A bounded queue between the thread that receives and the thread that detects: the latest frames win."""

import threading
from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Holds at most ``capacity`` items. A newer item pushes the oldest out; the caller counts what was lost.

    Capacity 1 is the latest-frame policy: memory and latency stay bounded however slow the reader is.
    """

    def __init__(self, capacity: int) -> None:
        if capacity < 1:
            raise ValueError(f"capacity must be at least 1, got {capacity}")
        self._capacity = capacity
        self._items: deque[T] = deque()
        self._changed = threading.Condition()
        self._closed = False

    def put(self, item: T) -> list[T]:
        """Add ``item``; return what had to give way (after close: the item itself)."""
        with self._changed:
            if self._closed:
                return [item]
            self._items.append(item)
            lost = [self._items.popleft()] if len(self._items) > self._capacity else []
            self._changed.notify()
            return lost

    def take(self) -> T | None:
        """Wait for the oldest item; None once the box is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._items or self._closed)
            return None if self._closed else self._items.popleft()

    def close(self) -> list[T]:
        """End the waiting of the reader; return what was left in the box."""
        with self._changed:
            self._closed = True
            left = list(self._items)
            self._items.clear()
            self._changed.notify_all()
            return left

    def items(self) -> list[T]:
        """What is in the box: a copy."""
        with self._changed:
            return list(self._items)
