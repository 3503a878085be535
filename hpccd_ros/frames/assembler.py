# SPDX-License-Identifier: Apache-2.0
"""Joins frames of single meshes to frames of the scene: versions, order, matching. No ROS, no threads.

Rules, in the order in which they are applied to a vertex message:

1. Its topology version must be the current one (topology_version.py). A whole mesh contains its topology, which
   becomes the current one. Otherwise topology and vertices are separate topics without a common order: a newer frame
   waits for its topology, at most ``max_pending`` frames per mesh; an older one is used with its own topology until a
   frame of a later one was accepted, and rejected afterwards.
2. The number of vertices must be that of the topology.
3. The frame_id must equal that of the scene (an empty one fits all): the required one, or that of the first
   message. If none is required, a stream that continues in another one is a restart, as in 4, because neither a stray
   first message nor a simulation that has ended may fix it: at once if the message comes from a new publisher that is
   the only one of its mesh; otherwise after ``restart_after`` increasing stamps in a row, if no mesh sends in the
   scene's frame meanwhile, because two meshes in different frames would alternate. Static meshes do not determine the
   frame: their positions are stored by frame_id and used if it is that of the scene (restart.py).
4. Its stamp must be later than the mesh's last one. A stream that continues from an earlier time (``restart_after``
   increasing stamps in a row, or the first message of a new publisher) is a restart of the whole scene (restart.py).
   A mesh that follows has no order of its own: its frames are requested for accepted stamps of another mesh.
5. Frames of several meshes are joined by their stamps (matching.py); static meshes keep their last positions.
"""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hpccd_ros.base.quoting import listed
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.matching import ExactMatcher, Match, Matcher, NearestMatcher
from hpccd_ros.frames.restart import CoordinateFrame, Restart, StampOrder
from hpccd_ros.frames.topology_version import TopologyHistory, check_frame, check_successor, is_early, rejected_topology
from hpccd_ros.frames.types import (
    NO_FACES,
    OUTDATED,
    AssemblyRules,
    MeshFrame,
    MeshSettings,
    Origin,
    Outcome,
    SceneFrame,
    Topology,
)


class _MeshState:
    """The state of one mesh."""

    def __init__(self, settings: MeshSettings, max_pending: int) -> None:
        self.name = settings.name
        self.static = settings.static
        self.whole = settings.whole
        self.topologies = TopologyHistory(max_pending)
        self.early: deque[MeshFrame] = deque()  # their topology has not arrived
        self.positions = StaticPositions()
        self.newest = 0.0  # arrival of the last message with the position of a static mesh, whether or not it is in use
        self.stamps = StampOrder(settings.name)
        self.new_publisher = False  # it sent messages, and none of them was accepted yet
        self.follows = False  # its frames are requested for accepted stamps of another mesh


class FrameAssembler:
    """Joins checked messages of the meshes into frames of the scene.

    meshes: in the order of the scene; at least one must not be static. following: names of the meshes whose frames are
    requested, each for an accepted stamp of another mesh.
    """

    def __init__(self, meshes: Sequence[MeshSettings], rules: AssemblyRules, following: Collection[str] = ()) -> None:
        deforming = [m.name for m in meshes if not m.static]
        if not deforming:
            raise ValueError("meshes: at least one mesh must not be static, otherwise nothing moves")
        if len({m.name for m in meshes}) != len(meshes):
            raise ValueError(f"meshes: names must differ, got {[m.name for m in meshes]}")
        self._meshes = {m.name: _MeshState(m, rules.max_pending) for m in meshes}
        for name in following:
            self._meshes[name].follows = True
        self._max_early = rules.max_pending
        self.restart_after = rules.restart_after
        self._frame = CoordinateFrame(rules.frame_id)
        self._completed = 0
        self._matcher: Matcher = (
            ExactMatcher(deforming, rules.max_pending, following)
            if rules.tolerance is None
            else NearestMatcher(deforming, rules.max_pending, rules.tolerance)
        )

    @property
    def waiting(self) -> int:
        """Messages received that are neither passed on nor dropped yet."""
        return self._matcher.waiting + sum(len(m.early) for m in self._meshes.values())

    @property
    def coordinate_frame(self) -> tuple[str, str]:
        """(frame_id in force or "", where it comes from)."""
        return self._frame.name, self._frame.source

    def warnings(self) -> list[str]:
        """Positions of static meshes that are not used."""
        scene = self._frame.name
        last_sent = {name: state.positions.frame_ids[-1:] for name, state in self._meshes.items()}
        return [
            f"the last positions of static mesh {name} are in frame {last!r}, the scene is in {scene!r}"
            for name, frame_ids in last_sent.items()
            for last in frame_ids
            if scene and last not in ("", scene)
        ]

    def topology(self, mesh: str) -> Topology | None:
        """The current topology, or None."""
        return self._meshes[mesh].topologies.current

    def set_topology(self, mesh: str, topology: Topology, new_publisher: bool = False) -> Outcome:
        """Make a topology the current one; frames that waited for it continue.

        A lower version than the current one is rejected, unless it comes from a new publisher (restarted simulations
        count from the start again).
        """
        state = self._meshes.get(mesh)
        if state is None:
            return self._unknown(mesh, Input.TOPOLOGY)
        if state.whole:
            text = f"the topology comes with the positions (parameter mesh.{mesh}.input); publish no other one"
            return Outcome(rejections=[rejected_topology(mesh, Reason.TOPOLOGY_CONFLICT, text, topology)])
        current = state.topologies.current
        if current is not None and topology.version == current.version and topology.same_content(current):
            state.topologies.sent, state.topologies.rejected = topology.sent, ""
            return Outcome()
        if current is not None and not new_publisher and (rejection := check_successor(mesh, topology, current)):
            return Outcome(rejections=[rejection])
        state.topologies.put(topology)
        placed = state.positions.last_sent
        state.positions.clear()
        early, state.early = state.early, deque()
        outcome = Outcome()
        for frame in early:
            outcome += self._admit(state, frame)
        if placed is not None and not state.positions.frame_ids:
            outcome.unplaced += ((mesh, placed),)
        return outcome

    def topology_rejected(self, mesh: str, why: str) -> None:
        """Remember for frames that wait why the last message with a topology of ``mesh`` was rejected."""
        self._meshes[mesh].topologies.rejected = why

    def hear(self, mesh: str, received: float) -> None:
        """A message with the position of ``mesh`` was received; if it is static, its current positions are outdated."""
        if (state := self._meshes.get(mesh)) is not None:
            state.newest = received

    def add(self, mesh: str, frame: MeshFrame, new_publisher: bool = False) -> Outcome:
        """Add one vertex message."""
        state = self._meshes.get(mesh)
        if state is None:
            return self._unknown(mesh, Input.VERTICES)
        state.new_publisher |= new_publisher
        return self._admit(state, frame)

    def inherit(self, other: "FrameAssembler", meshes: Collection[str]) -> Outcome:
        """Take over topologies, static positions and waiting frames of these meshes, which both have."""
        outcome = Outcome()
        for name in meshes:
            ours, theirs = self._meshes[name], other._meshes[name]
            ours.topologies, ours.positions, ours.newest = theirs.topologies, theirs.positions, theirs.newest
            ours.early, theirs.early = theirs.early, deque()
        for name, frame in other._matcher.take(meshes):
            outcome += self.add(name, frame)
        return outcome

    def clear(self, reason: Reason) -> list[Rejection]:
        """Discard all frames, but not topologies and static positions. Waiting messages are dropped for ``reason``."""
        rejections = self._matcher.clear(reason)
        for state in self._meshes.values():
            rejections += [Rejection(state.name, reason) for _ in state.early]
            state.early.clear()
            state.stamps.reset()
        self._frame.reset()
        return rejections

    def _unknown(self, mesh: str, what: Input) -> Outcome:
        text = f"no such mesh; parameter meshes has {listed(self._meshes)}"
        return Outcome(rejections=[Rejection(mesh, Reason.UNKNOWN_MESH, text, what=what)])

    def _admit(self, state: _MeshState, frame: MeshFrame) -> Outcome:
        if state.whole and frame.topology is None:  # a cloud of points
            n = len(frame.vertices)
            frame = frame.of_topology(Topology(n, n, NO_FACES, sent=frame.sent))
        if frame.topology is not None:
            topology = state.topologies.same_as(frame.topology)
        elif is_early(frame, state.topologies.current):
            return Outcome(rejections=self._hold(state, frame))
        else:
            topology = state.topologies.current if state.static else state.topologies.of(frame)
        if rejection := check_frame(state.name, frame, topology):
            return Outcome(rejections=[rejection])
        frame = frame.of_topology(topology)
        return self._keep_positions(state, frame) if state.static else self._join(state, frame)

    def _hold(self, state: _MeshState, frame: MeshFrame) -> list[Rejection]:
        state.early.append(frame)
        if len(state.early) <= self._max_early:
            return []
        lost = state.early.popleft()
        topology = "topology" if lost.version is None else f"topology version {lost.version}"
        why = state.topologies.rejected
        lacking = f"no {topology}, as the last one was rejected ({why})" if why else f"{topology} has not arrived"
        text = (
            f"{lacking}; publish {'a valid one' if why else 'it'} on meshes/{state.name}/topology (reliable, transient "
            "local) before the vertices"
        )
        return [Rejection(state.name, Reason.NO_TOPOLOGY, text, sent=lost.sent)]

    def _keep_positions(self, state: _MeshState, frame: MeshFrame) -> Outcome:
        if rejection := self._frame.check_static(state.name, frame):
            return Outcome(rejections=[rejection])
        if state.topologies.accept(frame):
            state.positions.clear()
        state.positions.keep(frame)
        state.new_publisher = False
        return Outcome(static_taken=1)

    def _join(self, state: _MeshState, frame: MeshFrame) -> Outcome:
        outcome = Outcome()
        for check in (self._check_frame_id,) if state.follows else (self._check_frame_id, self._check_stamp):
            verdict = check(state, frame)
            if isinstance(verdict, Rejection):
                outcome.rejections.append(replace(verdict, sent=frame.sent))
                return outcome
            if isinstance(verdict, Restart):
                outcome.restarts.append(f"{verdict.text}: taken as a restart")
                outcome.rejections += self.clear(Reason.RESTART)
        self._frame.adopt(state.name, frame.frame_id)
        state.stamps.accept(frame.stamp)
        state.topologies.accept(frame)
        state.new_publisher = False
        outcome.joined.append((state.name, frame.stamp, frame.received))
        matches, rejections = self._matcher.add(state.name, frame)
        outcome.rejections += rejections
        for match in matches:
            completed = self._complete(match)
            if isinstance(completed, SceneFrame):
                outcome.frames.append(completed)
            else:
                outcome.rejections += completed
        return outcome

    def _check_frame_id(self, state: _MeshState, frame: MeshFrame) -> Rejection | Restart | None:
        new_and_alone = state.new_publisher and frame.only_publisher
        return self._frame.check(state.name, frame, self.restart_after, new_and_alone)

    def _check_stamp(self, state: _MeshState, frame: MeshFrame) -> Rejection | Restart | None:
        return state.stamps.check(frame.stamp, self.restart_after, state.new_publisher)

    def _complete(self, match: Match) -> SceneFrame | list[Rejection]:
        frames = []
        origins = []
        frame_id = self._frame.name
        for name, state in self._meshes.items():
            if not state.static:
                frame = match.frames[name]
                place = frame.sent if frame.topology is state.topologies.current else OUTDATED
            elif (kept := state.positions.fitting(frame_id)) is not None:
                frame = kept.frame
                place = kept.newest.sent if kept.newest.received >= state.newest else OUTDATED
            else:
                text = _no_positions(state, frame_id)
                missing = Reason.STATIC_MISSING
                return [Rejection(fresh, missing, text, aspect=Aspect.NOTHING) for fresh in match.fresh]
            frames.append(frame)
            origins.append(Origin(place, frame.shape_sent, state.topologies.sent_of(frame.topology)))
            frame_id = frame_id or frame.frame_id
        moving = [match.frames[n] for n in self._meshes if n in match.frames]
        step = next((f.step for f in moving if f.step is not None), self._completed)
        self._completed += 1
        return SceneFrame(
            stamp=match.stamp,
            step=step,
            frame_id=frame_id,
            topologies=tuple(f.topology for f in frames),
            vertices=tuple(f.vertices for f in frames),
            fresh=match.fresh,
            received=max(f.received for f in moving),
            placements=tuple(f.placement for f in frames) if any(f.placement for f in frames) else (),
            origins=tuple(origins),
        )


def _no_positions(state: _MeshState, frame_id: str) -> str:
    others = ", ".join(map(repr, state.positions.frame_ids))
    there = f" in frame {frame_id!r}, only in {others}" if others else ""
    return (
        f"static mesh {state.name} has no valid positions{there} yet; "
        f"publish them once or give a file (parameter mesh.{state.name}.file)"
    )


# Limits what untrusted publishers can make the node store.
_MOST_FRAMES = 4


class Kept(NamedTuple):
    """``frame``: the first message with these positions; ``newest``: the last one, with the same positions."""

    frame: MeshFrame
    newest: MeshFrame


class StaticPositions:
    def __init__(self) -> None:
        self._by_frame_id: dict[str, Kept] = {}  # in the order of arrival

    @property
    def frame_ids(self) -> list[str]:
        """In the order of sending."""
        return list(self._by_frame_id)

    @property
    def last_sent(self) -> int | None:
        """When the last positions were sent; None: there are none."""
        return max((kept.newest.sent for kept in self._by_frame_id.values()), default=None)

    def keep(self, frame: MeshFrame) -> None:
        known = self._by_frame_id.pop(frame.frame_id, None)
        same = known is not None and np.array_equal(known.frame.vertices, frame.vertices)
        self._by_frame_id[frame.frame_id] = Kept(known.frame if same else frame, frame)
        if len(self._by_frame_id) > _MOST_FRAMES:
            del self._by_frame_id[next(iter(self._by_frame_id))]

    def fitting(self, frame_id: str) -> Kept | None:
        """The last positions in this coordinate frame. Positions without one fit all, and so does an empty frame_id."""
        fitting = [kept for name, kept in self._by_frame_id.items() if name in ("", frame_id) or not frame_id]
        return fitting[-1] if fitting else None

    def clear(self) -> None:
        self._by_frame_id.clear()
