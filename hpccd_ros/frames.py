# SPDX-License-Identifier: Apache-2.0
"""From frames of single meshes to frames of the scene: versions, order, matching. No ROS, no threads.

Rules, in the order in which they are applied to a vertex message:

1. Its topology version must be the one in force. An older one is refused; a newer one waits for its topology
   (topology and vertices are separate topics, nothing orders them), at most ``max_pending`` frames a mesh.
2. The number of vertices must be that of the topology.
3. The frame_id must equal that of the scene (an empty one fits all).
4. Its stamp must be later than the mesh's last. A stream that goes on from an earlier time (``restart_after``
   increasing stamps in a row, or the first message of a new publisher) is a restart: all starts anew.
5. Frames of several meshes are joined by their stamps (matching.py); static meshes keep their last positions.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hpccd_ros.drops import DropCounter, Reason
from hpccd_ros.matching import ExactMatcher, Match, Matcher, NearestMatcher
from hpccd_ros.messages import MeshFrame, MeshSettings, SceneFrame, Topology


class _MeshState:
    """What is known of one mesh."""

    def __init__(self, settings: MeshSettings, max_pending: int) -> None:
        self.settings = settings
        self.topology: Topology | None = None
        self.early: deque[MeshFrame] = deque()
        self.max_early = max_pending
        self.last_stamp: int | None = None
        self.static_frame: MeshFrame | None = None
        self.backward_run = 0
        self.last_backward = 0

    def forget_stamps(self) -> None:
        self.last_stamp = None
        self.backward_run = 0


class FrameAssembler:
    """Joins checked messages of the meshes into frames of the scene.

    meshes: in the order of the scene; at least one must not be static.
    drops: counts vertex messages that are not used. refused: counts topologies that are not taken.
    max_pending: bound on the frames a mesh that wait for a topology or for other meshes.
    restart_after: increasing stamps in a row, all before the last accepted one, that make a restart; 0:
    never.
    tolerance: None: stamps must be equal; else the largest difference in ns to the first deforming mesh.
    frame_id: what all messages must carry; "": what the first one carries.
    on_restart: called with a text when the stream starts anew.

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
        self._on_restart = on_restart
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

    def topology(self, mesh: str) -> Topology | None:
        """The topology in force, or None."""
        return self._meshes[mesh].topology

    def static_vertices(self, mesh: str) -> np.ndarray | None:
        """The last positions of a static mesh, or None."""
        frame = self._meshes[mesh].static_frame
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
        state.static_frame = None
        early, state.early = state.early, deque()
        return [scene for frame in early for scene in self._route(state, frame, new_publisher=False)]

    def add(self, mesh: str, frame: MeshFrame, new_publisher: bool = False) -> list[SceneFrame]:
        """Take one vertex message; return the scene frames that it completes (usually none or one)."""
        state = self._state(mesh, self._drops)
        return [] if state is None else self._route(state, frame, new_publisher)

    def clear(self, reason: Reason) -> None:
        """Forget all frames (not topologies and static positions); what waits is counted as ``reason``."""
        self._matcher.clear(reason)
        for state in self._meshes.values():
            for _ in state.early:
                self._drops.count(state.settings.name, reason)
            state.early.clear()
            state.forget_stamps()
        self._frame_id = self._fixed_frame_id

    def _state(self, mesh: str, counter: DropCounter) -> _MeshState | None:
        state = self._meshes.get(mesh)
        if state is None:
            counter.count(mesh, Reason.UNKNOWN_MESH, f"no such mesh; parameter meshes has {', '.join(self._meshes)}")
        return state

    def _route(self, state: _MeshState, frame: MeshFrame, new_publisher: bool) -> list[SceneFrame]:
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
        if not self._fits_frame_id(mesh, frame.frame_id):
            return []
        frame = replace(frame, topology=topology)
        if state.settings.static:
            return self._take_static(state, frame)
        if not self._in_order(state, frame, new_publisher):
            return []
        state.last_stamp = frame.stamp
        state.backward_run = 0
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

    def _fits_frame_id(self, mesh: str, frame_id: str) -> bool:
        if not frame_id or frame_id == self._frame_id:
            return True
        if not self._frame_id:
            self._frame_id = frame_id
            return True
        self._drops.count(
            mesh,
            Reason.FRAME_ID,
            f"frame_id {frame_id!r}, the scene is in {self._frame_id!r}; publish all meshes in one coordinate frame",
        )
        return False

    def _take_static(self, state: _MeshState, frame: MeshFrame) -> list[SceneFrame]:
        known = state.static_frame
        if known is None or not np.array_equal(known.vertices, frame.vertices):
            state.static_frame = frame
        self.static_taken += 1
        return []

    def _in_order(self, state: _MeshState, frame: MeshFrame, new_publisher: bool) -> bool:
        mesh, last = state.settings.name, state.last_stamp
        if last is None or frame.stamp > last:
            return True
        if frame.stamp == last and not new_publisher:
            self._drops.count(
                mesh,
                Reason.REPEATED,
                f"stamp {frame.stamp} ns came before; each frame needs a later stamp than the one before",
            )
            return False
        state.backward_run = state.backward_run + 1 if frame.stamp > state.last_backward else 1
        state.last_backward = frame.stamp
        enough = self.restart_after > 0 and state.backward_run >= self.restart_after
        if not (new_publisher or enough):
            self._drops.count(mesh, Reason.BACKWARD, f"stamp {frame.stamp} ns is before the last one, {last} ns")
            return False
        self.restarts += 1
        self.clear(Reason.RESTART)
        self._on_restart(f"mesh {mesh} goes on from stamp {frame.stamp} ns after {last} ns: taken as a restart")
        return True

    def _complete(self, match: Match) -> list[SceneFrame]:
        frames = []
        for name, state in self._meshes.items():
            frame = state.static_frame if state.settings.static else match.frames[name]
            if frame is None:
                for fresh in match.fresh:
                    self._drops.count(
                        fresh,
                        Reason.STATIC_MISSING,
                        f"static mesh {name} has no positions yet; "
                        f"publish them once or give a file (parameter mesh.{name}.file)",
                    )
                return []
            frames.append(frame)
        moving = [match.frames[n] for n in self._meshes if n in match.frames]
        step = next((f.step for f in moving if f.step is not None), self._completed)
        self._completed += 1
        return [
            SceneFrame(
                stamp=match.stamp,
                step=step,
                frame_id=self._frame_id,
                topologies=tuple(f.topology for f in frames),
                vertices=tuple(f.vertices for f in frames),
                fresh=match.fresh,
                received=max(f.received for f in moving),
            )
        ]
