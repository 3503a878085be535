# SPDX-License-Identifier: Apache-2.0
"""The bounded queue between the receiving and the detecting thread: it keeps the latest frames. No ROS."""

import threading
from collections import deque
from dataclasses import dataclass

from hpccd_ros.frames.types import SceneFrame


@dataclass(frozen=True, eq=False)
class Queued:
    """``first``: there is no motion from the previous frame to this one; it is only the start of the next step."""

    frame: SceneFrame
    first: bool


class FrameQueue:
    """Holds at most ``capacity`` frames that end a step; a newer one replaces the oldest.

    Capacity 1 is the latest-frame policy: memory and latency stay bounded however slow the detection is.
    Frames that only start a step cost no detection and have separate places; otherwise two frames that arrive at once
    would lose their only step.
    """

    def __init__(self, capacity: int) -> None:
        if capacity < 1:
            raise ValueError(f"capacity must be at least 1, got {capacity}")
        self._capacity = capacity
        self._items: deque[Queued] = deque()
        self._newest: SceneFrame | None = None
        self._changed = threading.Condition()
        self._closed = False

    def put(self, frame: SceneFrame) -> list[SceneFrame]:
        """Add ``frame``; return the frames that it replaces (after close: the frame itself)."""
        with self._changed:
            if self._closed:
                return [frame]
            before, self._newest = self._newest, frame
            first = before is None or not before.same_scene(frame) or frame.stamp <= before.stamp
            lost = []
            if first and self._items and self._items[-1].first:
                lost.append(self._items.pop().frame)  # nothing starts from it any more
            self._items.append(Queued(frame, first))
            ends = [item for item in self._items if not item.first]
            if len(ends) > self._capacity:
                self._items.remove(ends[0])
                lost.append(ends[0].frame)
                lost += self._starts_without_end()
            self._changed.notify()
            return lost

    def _starts_without_end(self) -> list[SceneFrame]:
        """Remove starts whose end is gone, except the last one, whose end may still arrive."""
        items = list(self._items)
        useless = [a for a, b in zip(items, items[1:], strict=False) if a.first and b.first]
        for item in useless:
            self._items.remove(item)
        return [item.frame for item in useless]

    def pop(self) -> Queued | None:
        """Wait for the oldest frame; None once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._items or self._closed)
            return None if self._closed else self._items.popleft()

    def close(self) -> list[SceneFrame]:
        """Wake the reader; return the remaining frames."""
        with self._changed:
            self._closed = True
            left = self.frames()
            self._items.clear()
            self._changed.notify_all()
            return left

    def frames(self) -> list[SceneFrame]:
        """A copy of the waiting frames."""
        with self._changed:
            return [item.frame for item in self._items]
