# SPDX-License-Identifier: Apache-2.0
"""Join the frames of several deforming meshes by their stamps. No ROS, no threads.

Both matchers rely on each mesh's frames coming in order of their stamps (the assembler sees to that), so a mesh
that has reached stamp s will never fill a gap before s.
"""

from collections import deque
from dataclasses import dataclass
from typing import Protocol

from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.types import MeshFrame


@dataclass(frozen=True, eq=False)
class Match:
    """One frame of each deforming mesh. ``fresh`` names the meshes whose frame is used for the first time."""

    stamp: int
    frames: dict[str, MeshFrame]
    fresh: tuple[str, ...]


class Matcher(Protocol):
    def add(self, mesh: str, frame: MeshFrame) -> list[Match]:
        """Take one frame; return the matches that it completes, oldest first."""

    def clear(self, reason: Reason) -> None:
        """Drop all that waits, counted as ``reason``."""

    @property
    def waiting(self) -> int:
        """Messages that wait for their partners."""


class ExactMatcher:
    """A match is one frame of each mesh with the very same stamp.

    At most ``max_pending`` stamps wait; the oldest gives way.
    """

    def __init__(self, meshes: list[str], drops: DropCounter, max_pending: int) -> None:
        self._meshes = meshes
        self._drops = drops
        self._max_pending = max_pending
        self._pending: dict[int, dict[str, MeshFrame]] = {}
        self._closed_up_to: int | None = None

    def add(self, mesh: str, frame: MeshFrame) -> list[Match]:
        if self._closed_up_to is not None and frame.stamp <= self._closed_up_to:
            self._drops.count(mesh, Reason.LATE, f"stamp {frame.stamp} ns was already answered or given up")
            return []
        group = self._pending.setdefault(frame.stamp, {})
        group[mesh] = frame
        if len(group) == len(self._meshes):
            del self._pending[frame.stamp]
            for stamp in [s for s in self._pending if s < frame.stamp]:
                self._give_up(stamp)
            self._closed_up_to = frame.stamp
            return [Match(frame.stamp, group, tuple(self._meshes))]
        if len(self._pending) > self._max_pending:
            oldest = min(self._pending)
            self._give_up(oldest)
            self._closed_up_to = oldest
        return []

    def _give_up(self, stamp: int) -> None:
        group = self._pending.pop(stamp)
        missing = ", ".join(m for m in self._meshes if m not in group)
        for mesh in group:
            self._drops.count(mesh, Reason.INCOMPLETE, f"stamp {stamp} ns has no frame of {missing}")

    def clear(self, reason: Reason) -> None:
        for group in self._pending.values():
            for mesh in group:
                self._drops.count(mesh, reason)
        self._pending.clear()
        self._closed_up_to = None

    @property
    def waiting(self) -> int:
        return sum(len(group) for group in self._pending.values())


class NearestMatcher:
    """A match is one frame of the first mesh and, of each other mesh, the frame nearest in time.

    A frame farther than ``tolerance`` ns away is no match. The other meshes may be slower: their frames are
    used again while they are the nearest. At most ``max_pending`` frames of each mesh wait.
    """

    def __init__(self, meshes: list[str], drops: DropCounter, max_pending: int, tolerance: int) -> None:
        self._reference, *self._others = meshes
        self._drops = drops
        self._max_pending = max_pending
        self._tolerance = tolerance
        self._queues: dict[str, deque[MeshFrame]] = {m: deque() for m in meshes}
        self._used: set[int] = set()  # id() of queued frames of the other meshes that were in a match

    def add(self, mesh: str, frame: MeshFrame) -> list[Match]:
        self._queues[mesh].append(frame)
        matches = self._advance()
        queue = self._queues[mesh]
        if len(queue) > self._max_pending:
            if mesh == self._reference:
                text = f"stamp {queue[0].stamp} ns waited in vain for the other meshes"
                self._drops.count(mesh, Reason.INCOMPLETE, text)
                queue.popleft()
            else:
                self._discard(mesh, Reason.INCOMPLETE)
        return matches

    def _advance(self) -> list[Match]:
        matches = []
        references = self._queues[self._reference]
        while references:
            stamp = references[0].stamp
            # The nearest is known only when a mesh has reached the stamp: a nearer one may still come.
            if any(not q or q[-1].stamp < stamp for q in map(self._queues.get, self._others)):
                break
            reference = references.popleft()
            nearest = {m: self._nearest(m, stamp) for m in self._others}
            far = [m for m, f in nearest.items() if abs(f.stamp - stamp) > self._tolerance]
            if far:
                self._drops.count(
                    self._reference,
                    Reason.INCOMPLETE,
                    f"stamp {stamp} ns has no frame of {', '.join(far)} within the tolerance "
                    f"of {self._tolerance} ns (parameter stamp_tolerance)",
                )
                continue
            fresh = [self._reference] + [m for m, f in nearest.items() if id(f) not in self._used]
            self._used.update(map(id, nearest.values()))
            matches.append(Match(stamp, {self._reference: reference, **nearest}, tuple(fresh)))
        return matches

    def _nearest(self, mesh: str, stamp: int) -> MeshFrame:
        queue = self._queues[mesh]
        # References come in order, so what is farther than its successor now is so for all that follow.
        while len(queue) > 1 and abs(queue[1].stamp - stamp) <= abs(queue[0].stamp - stamp):
            self._discard(mesh, Reason.INCOMPLETE)
        return queue[0]

    def _discard(self, mesh: str, reason: Reason) -> None:
        frame = self._queues[mesh].popleft()
        if id(frame) in self._used:
            self._used.remove(id(frame))
        else:
            self._drops.count(mesh, reason, f"stamp {frame.stamp} ns is the nearest of no other frame")

    def clear(self, reason: Reason) -> None:
        for mesh, queue in self._queues.items():
            for frame in queue:
                if id(frame) not in self._used:
                    self._drops.count(mesh, reason)
            queue.clear()
        self._used.clear()

    @property
    def waiting(self) -> int:
        return sum(id(f) not in self._used for q in self._queues.values() for f in q)
