# SPDX-License-Identifier: Apache-2.0
"""Records of checked messages and of the frames made from them, with numpy arrays. No ROS."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpccd_core.rigid.body import Body
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.frames.drops import Aspect, Reason, Rejection

# Values of parameter mesh.NAME.input for meshes that move by poses; JOINTS: by the joints of their robot.
POSE, TF, JOINTS = "pose", "tf", "joints"

# Times at which messages were sent, ``sent``: the DDS source timestamp, ns of the system clock. UNKNOWN_TIME: the
# middleware gave none, so the age is unknown. ALWAYS: the message holds at all times (a static transform) and has no
# age. OUTDATED: a newer message was rejected, or is waiting and not in use yet.
UNKNOWN_TIME = 0
ALWAYS = 2**63 - 1
OUTDATED = -1


@dataclass(frozen=True)
class MeshSettings:
    """Settings of a mesh (parameters ``mesh.NAME.*``). ``input``: "" if it does not matter. ``points``: in parameter
    ``points``."""

    name: str
    static: bool = False
    self_collision: bool = True
    transform: str = "none"
    frame: str = ""
    pose: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    input: str = ""
    whole: bool = False  # each message with vertices contains the topology, or is a cloud of all points of a mesh
    ignored_rings: int = 0
    ignored_at_rest: float | None = None
    points: bool = False

    @property
    def rigid(self) -> bool:
        """Whether it keeps its shape and moves by poses."""
        return self.input in (POSE, TF, JOINTS)


@dataclass(frozen=True)
class AssemblyRules:
    """How messages of the meshes are joined to frames of the scene (parameters of the same names; see assembler.py).

    max_pending: bound on the frames a mesh that wait for a topology, a transform or other meshes.
    restart_after: increasing stamps in a row, all before the last accepted one, that make a restart; 0: never.
    tolerance: None: stamps must be equal; else the largest difference in ns to the first deforming mesh.
    frame_id: the coordinate frame of all messages; "": that of the first one.
    """

    max_pending: int = 8
    restart_after: int = 5
    tolerance: int | None = None
    frame_id: str = ""


NO_EDGES = np.empty((0, 2), np.uint32)
NO_EDGES.flags.writeable = False
NO_FACES = np.empty((0, 3), np.uint32)
NO_FACES.flags.writeable = False


@dataclass(frozen=True, eq=False)
class Topology:
    """Triangles of one mesh, ``faces`` (F,3) uint32, and further edges, ``edges`` (E,2) uint32; indices are below
    ``n_vertices``. ``sent``: when its message was sent. ``rest``: (n_vertices,3), the shape at rest, of a mesh file."""

    version: int
    n_vertices: int
    faces: NDArray[np.uint32]
    edges: NDArray[np.uint32] = field(default_factory=lambda: NO_EDGES)
    sent: int = UNKNOWN_TIME
    rest: NDArray[np.float64] | None = None

    def same_content(self, other: "Topology") -> bool:
        """Whether both are equal except for the version."""
        return (
            self.n_vertices == other.n_vertices
            and np.array_equal(self.faces, other.faces)
            and np.array_equal(self.edges, other.edges)
            and (self.rest is other.rest or (self.rest is not None and np.array_equal(self.rest, other.rest)))
        )


@dataclass(frozen=True, eq=False)
class Placement:
    """Position of a rigid mesh: ``pose`` transforms coordinates of ``body`` to those of the frame."""

    body: Body
    pose: Rigid

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """(n,3). Read-only."""
        return self.pose.apply(self.body.vertices)

    def moved(self, rigid: Rigid) -> "Placement":
        return Placement(self.body, rigid.after(self.pose))


@dataclass(frozen=True, eq=False)
class PoseFrame:
    """One pose message of one mesh: the other fields as of `MeshFrame`."""

    stamp: int
    pose: Rigid
    frame_id: str = ""
    received: float = 0.0
    only_publisher: bool = True
    sent: int = UNKNOWN_TIME


@dataclass(frozen=True, eq=False)
class MeshFrame:
    """One vertex message of one mesh.

    ``stamp`` ns, end of the step. ``version``: of the topology it belongs to; None (PointCloud2 has none):
    the one in force. ``step``: the publisher's number, or None. ``vertices`` (n,3) float32
    or float64, finite. ``received``: time.monotonic() at its arrival; ``only_publisher``: its mesh had no other one of
    vertices then. ``topology``: carried by messages of whole meshes, else set by the assembler. ``placement``: of a
    mesh that moves by poses, which gives these vertices. ``sent``: when the oldest message that determines
    the mesh's position was sent, among its own and the transforms and joint states used. ``shape_sent``: when the shape
    of a mesh that moves by poses was sent.
    """

    stamp: int
    vertices: np.ndarray
    version: int | None = None
    step: int | None = None
    frame_id: str = ""
    received: float = 0.0
    only_publisher: bool = True
    topology: Topology | None = None
    placement: Placement | None = None
    sent: int = UNKNOWN_TIME
    shape_sent: int = UNKNOWN_TIME

    def of_topology(self, topology: Topology) -> "MeshFrame":
        """Used for each mesh of each frame of the scene: dataclasses.replace() takes four times as long."""
        if topology is self.topology:
            return self
        frame = object.__new__(MeshFrame)
        frame.__dict__.update(self.__dict__, topology=topology)
        return frame


class Origin(NamedTuple):
    """When the messages that determine the state of a mesh were sent: ``place``: the oldest one about its position;
    ``shape``: that of its shape, if it moves by poses; ``topology``: the last valid one."""

    place: int = UNKNOWN_TIME
    shape: int = UNKNOWN_TIME
    topology: int = UNKNOWN_TIME

    def of(self, aspect: Aspect) -> int:
        return {Aspect.PLACE: self.place, Aspect.SHAPE: self.shape, Aspect.TOPOLOGY: self.topology}[aspect]


@dataclass(frozen=True, eq=False)
class SceneFrame:
    """Positions of all meshes at one time, in the order of the scene (parameter ``meshes``).

    ``step``: of the first mesh that has one, otherwise a counter of complete frames.
    ``fresh``: meshes whose message is used for the first time here. ``received``: of the last message needed.
    ``placements``: of meshes that move by poses, None of others; empty: none does. ``origins``: of all meshes.
    ``inputs``: number of inputs that the node had taken when the frame was complete (taken_inputs.py).
    """

    stamp: int
    step: int
    frame_id: str
    topologies: tuple[Topology, ...]
    vertices: tuple[np.ndarray, ...]
    fresh: tuple[str, ...]
    received: float
    placements: tuple[Placement | None, ...] = ()
    origins: tuple[Origin, ...] = ()
    inputs: int = 0

    def after_inputs(self, count: int) -> "SceneFrame":
        frame = object.__new__(SceneFrame)
        frame.__dict__.update(self.__dict__, inputs=count)
        return frame

    def same_scene(self, other: "SceneFrame") -> bool:
        """True if a motion from one to the other exists: the same topology of every mesh, one coordinate frame."""
        elsewhere = self.frame_id and other.frame_id and self.frame_id != other.frame_id
        return not elsewhere and all(a is b for a, b in zip(self.topologies, other.topologies, strict=True))

    def rejected(self, reason: Reason) -> list[Rejection]:
        """One rejection for each message that is used nowhere else."""
        return [Rejection(mesh, reason) for mesh in self.fresh]


@dataclass(eq=False, slots=True)
class Outcome:
    """``frames`` of the scene that a message completes (usually none or one), ``rejections``: messages not used.

    ``restarts``: why the stream restarts, in words. ``static_taken``: accepted messages of static meshes, and shapes of
    those that move by poses. ``asked``: the mesh of each frame that was requested of transforms: it counts as a
    message. ``joined``: (mesh, stamp ns, time of arrival) of frames that were accepted. ``unplaced``:
    static meshes whose positions a new topology has invalidated, and when the positions were sent.
    """

    frames: list[SceneFrame] = field(default_factory=list)
    rejections: list[Rejection] = field(default_factory=list)
    restarts: list[str] = field(default_factory=list)
    static_taken: int = 0
    asked: list[str] = field(default_factory=list)
    joined: list[tuple[str, int, float]] = field(default_factory=list)
    unplaced: tuple[tuple[str, int], ...] = ()

    def __iadd__(self, other: "Outcome") -> "Outcome":
        self.frames += other.frames
        self.rejections += other.rejections
        self.restarts += other.restarts
        self.static_taken += other.static_taken
        self.asked += other.asked
        self.joined += other.joined
        self.unplaced += other.unplaced
        return self
