# SPDX-License-Identifier: Apache-2.0
"""From frames of single meshes to frames of the scene: versions, order, matching. No ROS, no threads.

Rules, in the order in which they are applied to a vertex message:

1. Its topology version must be the one in force. An older one is refused; a newer one waits for its topology
   (topology and vertices are separate topics, nothing orders them), at most ``max_pending`` frames a mesh.
2. The number of vertices must be that of the topology.
3. The frame_id must equal that of the scene (an empty one fits all): the one demanded, else that of the first
   message. Where none is demanded, a stream that goes on in another one is a restart, as in 4, for neither a stray
   first message nor a simulation that has ended may bind those that follow: at once if it comes from a new publisher
   that is its mesh's only one; else after ``restart_after`` increasing stamps in a row, if no mesh sends in the
   scene's frame meanwhile, as two meshes in different frames would take turns. Static meshes do not determine the
   frame: their positions are kept by frame_id, and used where it is the scene's.
4. Its stamp must be later than the mesh's last. A stream that goes on from an earlier time (``restart_after``
   increasing stamps in a row, or the first message of a new publisher) is a restart: all starts anew.
5. Frames of several meshes are joined by their stamps (matching.py); static meshes keep their last positions.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.matching import ExactMatcher, Match, Matcher, NearestMatcher
from hpccd_ros.frames.types import MeshFrame, MeshSettings, SceneFrame, Topology

# Of one static mesh: bounds what strangers can make the node keep.
_MOST_STATIC_FRAMES = 4


class _Run:
    """Counts frames with increasing stamps in a row."""

    def __init__(self) -> None:
        self.count = 0
        self._last = 0

    def next(self, stamp: int) -> int:
        self.count = self.count + 1 if stamp > self._last else 1
        self._last = stamp
        return self.count


class _MeshState:
    """What is known of one mesh. ``statics``: positions by frame_id, the last one taken last."""

    def __init__(self, settings: MeshSettings, max_pending: int) -> None:
        self.settings = settings
        self.topology: Topology | None = None
        self.early: deque[MeshFrame] = deque()
        self.max_early = max_pending
        self.statics: dict[str, MeshFrame] = {}
        self.new_publisher = False  # came, and none of its frames was taken yet
        self.forget_stamps()

    def forget_stamps(self) -> None:
        self.last_stamp: int | None = None
        self.backward = _Run()

    def static_in(self, frame_id: str) -> MeshFrame | None:
        """The last positions in this coordinate frame; those that name none fit all, as does an empty frame_id."""
        fitting = [frame for name, frame in self.statics.items() if name in ("", frame_id) or not frame_id]
        return fitting[-1] if fitting else None


class FrameAssembler:
    """Joins checked messages of the meshes into frames of the scene.

    meshes: in the order of the scene; at least one must not be static.
    drops: counts vertex messages that are not used. refused: counts topologies that are not taken.
    max_pending: bound on the frames a mesh that wait for a topology or for other meshes.
    restart_after: increasing stamps in a row, all before the last accepted one, that make a restart; 0:
    never.
    tolerance: None: stamps must be equal; else the largest difference in ns to the first deforming mesh.
    frame_id: what all messages must carry; "": see rule 3.
    on_restart: called with a text when the stream starts anew.
    only_publisher: whether a mesh has no other publisher of vertices than the one heard last.

    Counters: ``restarts``; ``static_taken``: accepted messages of static meshes.
    """

    def __init__(
        self,
        meshes: list[MeshSettings],
        drops: DropCounter,
        refused: DropCounter,
        *,
        max_pending: int = 8,
        restart_after: int = 5,
        tolerance: int | None = None,
        frame_id: str = "",
        on_restart: Callable[[str], None] = lambda text: None,
        only_publisher: Callable[[str], bool] = lambda mesh: True,
    ) -> None:
        deforming = [m.name for m in meshes if not m.static]
        if not deforming:
            raise ValueError("meshes: at least one mesh must not be static, or nothing ever moves")
        if len({m.name for m in meshes}) != len(meshes):
            raise ValueError(f"meshes: names must differ, got {[m.name for m in meshes]}")
        self._meshes = {m.name: _MeshState(m, max_pending) for m in meshes}
        self._drops = drops
        self._refused = refused
        self.restart_after = restart_after
        self._fixed_frame_id = frame_id
        self._frame_id = frame_id
        self._pinned_by = ""
        self._elsewhere: dict[str, tuple[str, _Run]] = {}  # mesh -> another frame that it sends in
        self._on_restart = on_restart
        self._only_publisher = only_publisher
        self.restarts = 0
        self.static_taken = 0
        self._completed = 0
        self._matcher: Matcher = (
            ExactMatcher(deforming, drops, max_pending)
            if tolerance is None
            else NearestMatcher(deforming, drops, max_pending, tolerance)
        )

    @property
    def waiting(self) -> int:
        """Messages received that are neither handed on nor dropped yet."""
        return self._matcher.waiting + sum(len(m.early) for m in self._meshes.values())

    @property
    def coordinate_frame(self) -> tuple[str, str]:
        """(frame_id in force or "", where it comes from)."""
        if self._fixed_frame_id:
            return self._frame_id, "parameter frame_id"
        return self._frame_id, f"a message of mesh {self._pinned_by}" if self._pinned_by else ""

    def warnings(self) -> list[str]:
        """Positions of static meshes that are not used."""
        return [
            f"the last positions of static mesh {name} are in frame {last!r}, the scene is in {self._frame_id!r}"
            for name, state in self._meshes.items()
            if self._frame_id and (last := next(reversed(state.statics), "")) not in ("", self._frame_id)
        ]

    def topology(self, mesh: str) -> Topology | None:
        """The topology in force, or None."""
        return self._meshes[mesh].topology

    def static_vertices(self, mesh: str) -> np.ndarray | None:
        """The last positions of a static mesh, or None."""
        frame = self._meshes[mesh].static_in(self._frame_id)
        return None if frame is None else frame.vertices

    def set_topology(self, mesh: str, topology: Topology, new_publisher: bool = False) -> list[SceneFrame]:
        """Put a topology in force; return the scene frames that waiting messages now complete.

        A lower version than the one in force is refused, unless it comes from a new publisher (restarted
        simulations count from the start again).
        """
        state = self._state(mesh, self._refused)
        if state is None:
            return []
        current = state.topology
        if current is not None:
            if topology.version == current.version:
                if topology.same_content(current):
                    return []
                if not new_publisher:
                    self._refused.count(
                        mesh,
                        Reason.TOPOLOGY_CONFLICT,
                        f"version {topology.version} is in force "
                        "with other content; count the version up with each change",
                    )
                    return []
            elif topology.version < current.version and not new_publisher:
                self._refused.count(
                    mesh,
                    Reason.OLD_TOPOLOGY,
                    f"version {topology.version} is older than {current.version}, now in force",
                )
                return []
        state.topology = topology
        state.statics.clear()
        early, state.early = state.early, deque()
        return [scene for frame in early for scene in self._route(state, frame)]

    def add(self, mesh: str, frame: MeshFrame, new_publisher: bool = False) -> list[SceneFrame]:
        """Take one vertex message; return the scene frames that it completes (usually none or one)."""
        state = self._state(mesh, self._drops)
        if state is None:
            return []
        state.new_publisher |= new_publisher
        return self._route(state, frame)

    def clear(self, reason: Reason) -> None:
        """Forget all frames (not topologies and static positions); what waits is counted as ``reason``."""
        self._matcher.clear(reason)
        for state in self._meshes.values():
            for _ in state.early:
                self._drops.count(state.settings.name, reason)
            state.early.clear()
            state.forget_stamps()
        self._frame_id = self._fixed_frame_id
        self._pinned_by = ""
        self._elsewhere.clear()

    def _state(self, mesh: str, counter: DropCounter) -> _MeshState | None:
        state = self._meshes.get(mesh)
        if state is None:
            counter.count(mesh, Reason.UNKNOWN_MESH, f"no such mesh; parameter meshes has {listed(self._meshes)}")
        return state

    def _route(self, state: _MeshState, frame: MeshFrame) -> list[SceneFrame]:
        mesh = state.settings.name
        topology = state.topology
        if topology is None or (frame.version is not None and frame.version > topology.version):
            self._hold(state, frame)
            return []
        if frame.version is not None and frame.version < topology.version:
            self._drops.count(
                mesh,
                Reason.OLD_TOPOLOGY,
                f"vertices belong to topology version {frame.version}, version {topology.version} is in force",
            )
            return []
        if len(frame.vertices) != topology.n_vertices:
            self._drops.count(
                mesh,
                Reason.WRONG_COUNT,
                f"{len(frame.vertices)} vertices, topology version {topology.version} has {topology.n_vertices}",
            )
            return []
        frame = replace(frame, topology=topology)
        if state.settings.static:
            return self._take_static(state, frame)
        if not (self._in_frame(state, frame) and self._in_order(state, frame)):
            return []
        if frame.frame_id and not self._frame_id:
            self._frame_id, self._pinned_by = frame.frame_id, mesh
        state.new_publisher = False
        state.last_stamp = frame.stamp
        state.backward = _Run()
        return [s for match in self._matcher.add(mesh, frame) for s in self._complete(match)]

    def _hold(self, state: _MeshState, frame: MeshFrame) -> None:
        mesh = state.settings.name
        state.early.append(frame)
        if len(state.early) > state.max_early:
            lost = state.early.popleft()
            version = "" if lost.version is None else f" version {lost.version}"
            self._drops.count(
                mesh,
                Reason.NO_TOPOLOGY,
                f"topology{version} has not come; publish it on "
                f"meshes/{mesh}/topology (reliable, transient local) before the vertices",
            )

    def _in_frame(self, state: _MeshState, frame: MeshFrame) -> bool:
        mesh = state.settings.name
        if not frame.frame_id or not self._frame_id:
            return True
        if frame.frame_id == self._frame_id:
            self._elsewhere.clear()
            return True
        if not self._fixed_frame_id:
            frame_id, run = self._elsewhere.get(mesh, ("", _Run()))
            if frame_id != frame.frame_id:
                run = _Run()
            self._elsewhere[mesh] = frame.frame_id, run
            if 0 < self.restart_after <= run.next(frame.stamp) or (state.new_publisher and self._only_publisher(mesh)):
                self._restart(f"mesh {mesh} goes on in frame {quoted(frame.frame_id)} after {quoted(self._frame_id)}")
                return True
        self._refuse_frame_id(mesh, frame.frame_id)
        return False

    def _refuse_frame_id(self, mesh: str, frame_id: str) -> None:
        _, source = self.coordinate_frame
        self._drops.count(
            mesh,
            Reason.FRAME_ID,
            f"frame_id {quoted(frame_id)}, the scene is in {quoted(self._frame_id)} (by {source}); publish all meshes "
            "in one coordinate frame",
        )

    def _take_static(self, state: _MeshState, frame: MeshFrame) -> list[SceneFrame]:
        if self._fixed_frame_id and frame.frame_id not in ("", self._fixed_frame_id):
            self._refuse_frame_id(state.settings.name, frame.frame_id)
            return []
        known = state.statics.pop(frame.frame_id, None)
        same = known is not None and np.array_equal(known.vertices, frame.vertices)
        state.statics[frame.frame_id] = known if same else frame
        if len(state.statics) > _MOST_STATIC_FRAMES:
            del state.statics[next(iter(state.statics))]
        state.new_publisher = False
        self.static_taken += 1
        return []

    def _in_order(self, state: _MeshState, frame: MeshFrame) -> bool:
        mesh, last = state.settings.name, state.last_stamp
        if last is None or frame.stamp > last:
            return True
        if frame.stamp == last and not state.new_publisher:
            self._drops.count(
                mesh,
                Reason.REPEATED,
                f"stamp {frame.stamp} ns came before; each frame needs a later stamp than the one before",
            )
            return False
        enough = 0 < self.restart_after <= state.backward.next(frame.stamp)
        if not (state.new_publisher or enough):
            self._drops.count(mesh, Reason.BACKWARD, f"stamp {frame.stamp} ns is before the last one, {last} ns")
            return False
        self._restart(f"mesh {mesh} goes on from stamp {frame.stamp} ns after {last} ns")
        return True

    def _restart(self, text: str) -> None:
        self.restarts += 1
        self.clear(Reason.RESTART)
        self._on_restart(f"{text}: taken as a restart")

    def _complete(self, match: Match) -> list[SceneFrame]:
        frames = []
        frame_id = self._frame_id
        for name, state in self._meshes.items():
            frame = state.static_in(frame_id) if state.settings.static else match.frames[name]
            if frame is None:
                others = ", ".join(map(repr, state.statics))
                there = f" in frame {frame_id!r}, only in {others}" if others else ""
                for fresh in match.fresh:
                    self._drops.count(
                        fresh,
                        Reason.STATIC_MISSING,
                        f"static mesh {name} has no positions{there} yet; "
                        f"publish them once or give a file (parameter mesh.{name}.file)",
                    )
                return []
            frames.append(frame)
            frame_id = frame_id or frame.frame_id
        moving = [match.frames[n] for n in self._meshes if n in match.frames]
        step = next((f.step for f in moving if f.step is not None), self._completed)
        self._completed += 1
        return [
            SceneFrame(
                stamp=match.stamp,
                step=step,
                frame_id=frame_id,
                topologies=tuple(f.topology for f in frames),
                vertices=tuple(f.vertices for f in frames),
                fresh=match.fresh,
                received=max(f.received for f in moving),
            )
        ]
