# SPDX-License-Identifier: Apache-2.0
"""Join the frames of several deforming meshes by their stamps. No ROS, no threads.

Both matchers rely on each mesh's frames coming in order of their stamps (the assembler sees to that), so a mesh
that has reached stamp s will never fill a gap before s.
"""

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.frames.types import MeshFrame

# For missing frames that no publisher sends, so their stamps cannot be wrong.
_MOVED = "descriptions, joint states or transforms for that stamp did not arrive in time; /diagnostics names them"


@dataclass(frozen=True, eq=False)
class Match:
    """One frame of each deforming mesh. ``fresh`` names the meshes whose frame is used for the first time."""

    stamp: int
    frames: dict[str, MeshFrame]
    fresh: tuple[str, ...]


class Matched(NamedTuple):
    """Result of one frame: the ``matches`` that it completes, oldest first, and frames that are dropped."""

    matches: list[Match]
    rejections: list[Rejection]


class Matcher(Protocol):
    def add(self, mesh: str, frame: MeshFrame) -> Matched:
        """Add one frame to those that wait."""

    def take(self, meshes: Collection[str]) -> list[tuple[str, MeshFrame]]:
        """Remove and return the frames of these meshes that were in no match yet, by stamp."""

    def clear(self, reason: Reason) -> list[Rejection]:
        """Drop all waiting frames, for ``reason``."""

    @property
    def waiting(self) -> int:
        """Number of messages that wait for their partners."""


class ExactMatcher:
    """A match is one frame of each mesh with the same stamp.

    At most ``max_pending`` stamps wait; then the oldest is dropped. following: meshes without a publisher.
    """

    def __init__(self, meshes: list[str], max_pending: int, following: Collection[str] = ()) -> None:
        self._meshes = meshes
        self._following = frozenset(following)
        self._max_pending = max_pending
        self._pending: dict[int, dict[str, MeshFrame]] = {}
        self._closed_up_to: int | None = None

    def add(self, mesh: str, frame: MeshFrame) -> Matched:
        if self._closed_up_to is not None and frame.stamp <= self._closed_up_to:
            text = f"stamp {frame.stamp} ns was already processed or given up"
            return Matched([], [Rejection(mesh, Reason.LATE, text)])
        group = self._pending.setdefault(frame.stamp, {})
        group[mesh] = frame
        if len(group) == len(self._meshes):
            del self._pending[frame.stamp]
            self._closed_up_to = frame.stamp
            earlier = [stamp for stamp in self._pending if stamp < frame.stamp]
            rejections = [rejection for stamp in earlier for rejection in self._give_up(stamp)]
            return Matched([Match(frame.stamp, group, tuple(self._meshes))], rejections)
        if len(self._pending) > self._max_pending:
            self._closed_up_to = min(self._pending)
            return Matched([], self._give_up(self._closed_up_to))
        return Matched([], [])

    def _give_up(self, stamp: int) -> list[Rejection]:
        group = self._pending.pop(stamp)
        missing = [m for m in self._meshes if m not in group]
        remedy = _MOVED if self._following.issuperset(missing) else "stamps must be equal (or set stamp_match: nearest)"
        text = f"stamp {stamp} ns has no frame of {', '.join(missing)}; {remedy}"
        return [Rejection(mesh, Reason.INCOMPLETE, text) for mesh in group]

    def take(self, meshes: Collection[str]) -> list[tuple[str, MeshFrame]]:
        return [
            (mesh, group.pop(mesh)) for _, group in sorted(self._pending.items()) for mesh in meshes if mesh in group
        ]

    def clear(self, reason: Reason) -> list[Rejection]:
        rejections = [Rejection(mesh, reason) for group in self._pending.values() for mesh in group]
        self._pending.clear()
        self._closed_up_to = None
        return rejections

    @property
    def waiting(self) -> int:
        return sum(len(group) for group in self._pending.values())


class NearestMatcher:
    """A match is one frame of the first mesh and, of each other mesh, the frame nearest in time.

    A frame farther than ``tolerance`` ns away is no match. The other meshes may be slower: their frames are
    used again while they are the nearest. At most ``max_pending`` frames of each mesh wait.
    """

    def __init__(self, meshes: list[str], max_pending: int, tolerance: int) -> None:
        self._reference, *self._others = meshes
        self._max_pending = max_pending
        self._tolerance = tolerance
        self._queues: dict[str, deque[MeshFrame]] = {m: deque() for m in meshes}
        self._used: set[int] = set()  # id() of queued frames of the other meshes that were in a match

    def add(self, mesh: str, frame: MeshFrame) -> Matched:
        queue = self._queues[mesh]
        queue.append(frame)
        matches, rejections = self._advance()
        if len(queue) > self._max_pending:
            if mesh == self._reference:
                text = f"stamp {queue.popleft().stamp} ns got no frames of the other meshes"
                rejections.append(Rejection(mesh, Reason.INCOMPLETE, text))
            else:
                rejections += self._discard(mesh)
        return Matched(matches, rejections)

    def _advance(self) -> Matched:
        matches, rejections = [], []
        references = self._queues[self._reference]
        while references:
            stamp = references[0].stamp
            # The nearest is known only when a mesh has reached the stamp: a nearer one may still come.
            if any(not q or q[-1].stamp < stamp for q in map(self._queues.get, self._others)):
                break
            reference = references.popleft()
            for mesh in self._others:
                rejections += self._discard_farther(mesh, stamp)
            nearest = {mesh: self._queues[mesh][0] for mesh in self._others}
            far = [m for m, f in nearest.items() if abs(f.stamp - stamp) > self._tolerance]
            if far:
                text = (
                    f"stamp {stamp} ns has no frame of {', '.join(far)} within the tolerance "
                    f"of {self._tolerance} ns (parameter stamp_tolerance)"
                )
                rejections.append(Rejection(self._reference, Reason.INCOMPLETE, text))
                continue
            fresh = [self._reference] + [m for m, f in nearest.items() if id(f) not in self._used]
            self._used.update(map(id, nearest.values()))
            matches.append(Match(stamp, {self._reference: reference, **nearest}, tuple(fresh)))
        return Matched(matches, rejections)

    def _discard_farther(self, mesh: str, stamp: int) -> list[Rejection]:
        """Leave the frame that is nearest to ``stamp`` as the first of its queue."""
        queue, rejections = self._queues[mesh], []
        # References come in order: a frame that is farther than its successor stays so.
        while len(queue) > 1 and abs(queue[1].stamp - stamp) <= abs(queue[0].stamp - stamp):
            rejections += self._discard(mesh)
        return rejections

    def _discard(self, mesh: str) -> list[Rejection]:
        frame = self._queues[mesh].popleft()
        if id(frame) in self._used:
            self._used.remove(id(frame))
            return []
        text = f"stamp {frame.stamp} ns is not the nearest to a frame of the first mesh"
        return [Rejection(mesh, Reason.INCOMPLETE, text)]

    def take(self, meshes: Collection[str]) -> list[tuple[str, MeshFrame]]:
        taken = []
        for mesh in meshes:
            if mesh in self._queues:
                queue = self._queues[mesh]
                taken += [(mesh, frame) for frame in queue if id(frame) not in self._used]
                self._used -= set(map(id, queue))
                queue.clear()
        return sorted(taken, key=lambda item: item[1].stamp)

    def clear(self, reason: Reason) -> list[Rejection]:
        rejections = [
            Rejection(mesh, reason) for mesh, queue in self._queues.items() for f in queue if id(f) not in self._used
        ]
        for queue in self._queues.values():
            queue.clear()
        self._used.clear()
        return rejections

    @property
    def waiting(self) -> int:
        return sum(id(f) not in self._used for q in self._queues.values() for f in q)
