# SPDX-License-Identifier: Apache-2.0
"""The table of the node's parameters, from which checks, declarations and docs/parameters.md are made."""

from dataclasses import dataclass
from typing import Any

from hpccd_core.options import ACCURACIES, BACKENDS, FEATURES, OUTPUTS, REPORTS
from hpccd_ros.base.clocks import CLOCK_ERROR
from hpccd_ros.middleware.topic_names import INPUTS

# When a parameter may be changed.
ALWAYS, UNCONFIGURED, NEVER = "always", "unconfigured", "never"


@dataclass(frozen=True)
class Row:
    """One parameter.

    ``span``: closed range of a number; ``least``: smallest value besides ``span[0]``, which means off; ``choices``:
    allowed strings (of each entry). ``change``: ALWAYS; UNCONFIGURED: only while the node is unconfigured, because it
    is read when the node is configured; NEVER: read-only. ``example``: for messages, where the default is none.
    """

    name: str
    kind: str
    default: Any
    text: str
    unit: str = ""
    span: tuple[float, float] | None = None
    least: float | None = None
    choices: tuple[str, ...] = ()
    change: str = UNCONFIGURED
    example: Any = None


# Smallest files of a split recording: smaller ones would contain one message each, and opening a file takes a few
# milliseconds, longer than messages may wait.
LEAST_SPLIT_SIZE = 0.01  # MB
LEAST_SPLIT_TIME = 0.1  # s
MOST_SPLIT = 1e9  # MB, s

# The largest coordinate that the core accepts, and the largest distance.
FARTHEST = 1e150
# Most parts into which a step is cut.
MOST_PARTS = 1000

SCENE_ROWS = (
    Row(
        "robots",
        "string[]",
        [],
        "Names of robots. Each link with geometry is a mesh ROBOT/LINK, after those of `meshes`; each name "
        "has parameters robot.NAME.*",
        change=NEVER,
        example=["arm"],
    ),
    Row(
        "meshes",
        "string[]",
        [],
        "Names of the meshes of the scene, in the order of scene-wide indices. Each name has topics "
        "meshes/NAME/... and parameters mesh.NAME.*",
        change=NEVER,
        example=["cloth"],
    ),
    Row(
        "planes",
        "string[]",
        [],
        "Names of planes, such as a floor. Each bounds a half-space, costs almost nothing, and has parameters "
        "plane.NAME.*; parameters of pairs name it like a mesh",
        change=NEVER,
        example=["floor"],
    ),
    Row(
        "points",
        "string[]",
        [],
        "Those of `meshes` that are points, without triangles: with `thickness` vertices are spheres and edges "
        "capsules, tested against all meshes. In other meshes, vertices in no edge and no triangle are tested against "
        "triangles only",
        example=["grains"],
    ),
    Row(
        "ignored_pairs",
        "string[]",
        [],
        "Pairs of meshes that are not tested against each other, as NAME:NAME. The name of a robot means all "
        "its links, here and in all parameters of pairs",
        example=["cloth:floor"],
    ),
    Row(
        "pair_accuracy",
        "string[]",
        [],
        "Pairs of meshes with another tier, as NAME:NAME:TIER. The same name twice: within that mesh",
        example=["cloth:floor:fast"],
    ),
    Row(
        "pair_features",
        "string[]",
        [],
        "Pairs of meshes with other features, as NAME:NAME:KIND, where KIND is vertex_face or edge_edge. Two "
        "entries for a pair: both kinds. The same name twice: within that mesh",
        example=["cloth:floor:edge_edge"],
    ),
    Row(
        "autostart",
        "bool",
        True,
        "Configure and activate at start; false: wait for the life-cycle services",
        change=NEVER,
    ),
)

DETECTION_ROWS = (
    Row("accuracy", "string", "exact", "Accuracy tier of the narrow phase", choices=ACCURACIES, change=ALWAYS),
    Row(
        "backend",
        "string",
        "auto",
        "Where the core computes; auto: the fastest for the scene and machine",
        choices=BACKENDS,
        change=ALWAYS,
    ),
    Row("threads", "int", 0, "Threads of the core; 0: all cores", span=(0, 1024), change=ALWAYS),
    Row(
        "report",
        "string",
        "all",
        "All contacts of the step, those at the earliest time of impact, or any one contact",
        choices=REPORTS,
        change=ALWAYS,
    ),
    Row(
        "features",
        "string[]",
        list(FEATURES),
        "Pairs of features that are tested: vertices against faces, edges against edges, or both",
        choices=FEATURES,
        change=ALWAYS,
    ),
    Row(
        "outputs",
        "string[]",
        [],
        "Additional arrays of each contact: contact points, normals, nearest points of both sides, weights of the "
        "vertices with their approach",
        choices=OUTPUTS,
        change=ALWAYS,
        example=["points"],
    ),
    Row(
        "minimum_separation",
        "float",
        0.0,
        "A pair of features whose distance is at most this value at some time of the step is a contact; 0: "
        "only pairs that touch. Keep it below the distance of neighbours within each mesh, or these are "
        "contacts in every step",
        unit="unit of the vertices",
        span=(0.0, FARTHEST),
        change=ALWAYS,
        example=0.01,
    ),
    Row(
        "pair_separation",
        "string[]",
        [],
        "Pairs of meshes with another separation, as NAME:NAME:DISTANCE. The same name twice: within that mesh",
        change=ALWAYS,
        example=["cloth:floor:0.01"],
    ),
    Row(
        "thickness",
        "string[]",
        [],
        "Thickness of meshes on each side of their triangles, half of that of a sheet, as NAME:THICKNESS; the name of "
        "a robot means all its links. It is added to the separation of each pair, and distances are between the thick "
        "surfaces",
        change=ALWAYS,
        example=["cloth:0.002"],
    ),
    Row(
        "distances",
        "bool",
        False,
        "Publish on distances the smallest distance of each pair of meshes at the end of each step",
        change=ALWAYS,
    ),
    Row(
        "pair_summaries",
        "bool",
        False,
        "Publish on pairs, for each pair of meshes, the number of contacts, the first time of impact and, "
        "with `distances`, the smallest distance",
        change=ALWAYS,
    ),
    Row(
        "rigid_tolerance",
        "float",
        1e-3,
        "Largest deviation of straight lines from the rotation of meshes that move by poses; each step is cut"
        " into as few parts as this requires. No false negatives; false positives are within the separation "
        "plus twice the bounds of both meshes, which each result contains",
        unit="unit of the vertices",
        span=(1e-9, FARTHEST),
        change=ALWAYS,
    ),
    Row(
        "rigid_parts",
        "int",
        64,
        "Largest number of parts of a step. If more are required, the bounds exceed rigid_tolerance; there "
        "are still no false negatives",
        span=(1, MOST_PARTS),
        change=ALWAYS,
    ),
    Row(
        "max_contacts",
        "int",
        200_000,
        "Most contacts in a message: the earliest are kept, and `truncated` is set; 0: no limit",
        span=(0, 100_000_000),
        change=ALWAYS,
    ),
)

INPUT_ROWS = (
    Row(
        "frame_id",
        "string",
        "",
        "Coordinate frame of the scene, which all vertex messages must have or be transformed to. Empty: that"
        " of the first message, until a restart or a new publisher brings another",
    ),
    Row(
        "frame_queue",
        "int",
        1,
        "Complete frames that may wait for the detection; 1: only the newest. The oldest is dropped and "
        "counted as overload",
        span=(1, 100_000),
    ),
    Row(
        "pending_frames",
        "int",
        8,
        "Frames of a mesh that may wait for a topology or for other meshes",
        span=(1, 10_000),
    ),
    Row(
        "stamp_match",
        "string",
        "exact",
        "How frames of several meshes are joined: by equal stamps, or by the stamp nearest to that of the "
        "first deforming mesh",
        choices=("exact", "nearest"),
    ),
    Row(
        "stamp_tolerance",
        "float",
        0.01,
        "Largest difference of stamps with stamp_match nearest",
        unit="s",
        span=(0.0, 3600.0),
    ),
    Row(
        "restart_after",
        "int",
        5,
        "A stream restarts after this number of frames in a row with increasing stamps before the last "
        "accepted one, or in another coordinate frame than the first message; 0: never",
        span=(0, 1_000_000),
        change=ALWAYS,
    ),
    Row(
        "input_reliability",
        "string",
        "reliable",
        "Reliability of the subscriptions to vertices, points, shapes, markers, poses and joint states. "
        "best_effort also connects to best-effort publishers, and may lose large messages",
        choices=("reliable", "best_effort"),
    ),
    Row(
        "input_depth",
        "int",
        10,
        "QoS history depth of the vertex subscriptions: messages that may arrive at once without loss",
        span=(1, 1000),
    ),
    Row("max_vertices", "int", 5_000_000, "Most vertices of a mesh", unit="vertices", span=(1, 1_000_000_000)),
    Row("max_faces", "int", 10_000_000, "Most triangles of a mesh", unit="triangles", span=(1, 1_000_000_000)),
    Row(
        "max_edges",
        "int",
        10_000_000,
        "Most edges of a mesh, besides those of its triangles",
        unit="edges",
        span=(1, 1_000_000_000),
    ),
    Row(
        "max_rate",
        "float",
        1000.0,
        "Most messages per second of each input topic, averaged over a second. Further ones are dropped and "
        "counted as rate; 0: no limit",
        unit="Hz",
        span=(0.0, 1e6),
    ),
    Row(
        "count_unknown_meshes",
        "bool",
        True,
        "Subscribe to vertex topics of meshes that are not in `meshes`, to count their frames; false: only "
        "name the topics on /diagnostics",
    ),
)

SERVICE_ROWS = (
    Row("max_meshes", "int", 1000, "Most meshes in a request", span=(1, 1_000_000)),
    Row(
        "detect_jobs",
        "int",
        2,
        "Requests that are computed at the same time. The scenes of this number of requests are kept for "
        "further requests, until none has used them for a minute",
        span=(1, 256),
    ),
    Row(
        "detect_waiting",
        "int",
        8,
        "Requests that may wait. Up to 1,000 more are rejected as busy",
        span=(0, 10_000),
    ),
    Row(
        "detect_time_limit",
        "float",
        30.0,
        "Time limit of a request that sets none. A request may set up to a day",
        unit="s",
        span=(0.001, 86_400.0),
        change=ALWAYS,
    ),
    Row(
        "service_introspection",
        "string",
        "off",
        "Publish events of the service on ~/detect/_service_event: metadata (time, client, sequence number), "
        "or also the contents of requests and responses",
        choices=("off", "metadata", "contents"),
        change=ALWAYS,
    ),
)

OUTPUT_ROWS = (
    Row(
        "contacts_durability",
        "string",
        "volatile",
        "Durability of contacts. With transient_local, subscribers that request it receive the last results when "
        "they connect: as many as the depth in qos_overrides, by default 10; none if the publisher is best_effort",
        choices=("volatile", "transient_local"),
    ),
    Row("diagnostics_period", "float", 1.0, "Period of /diagnostics", unit="s", span=(0.05, 3600.0)),
    Row(
        "markers",
        "bool",
        False,
        "Publish contact points and normals on markers, and vertices on surface, for viewers",
        change=ALWAYS,
    ),
    Row(
        "markers_depth",
        "bool",
        False,
        "With markers: an arrow for each pair of meshes that intersect or contain one another: the shortest "
        "translation found that frees the first mesh of the second one. Computed in a thread of its own, for tens of "
        "ms to more than a second for each pair; frames that come meanwhile are not shown",
        change=ALWAYS,
    ),
    Row(
        "markers_intersections",
        "bool",
        True,
        "With markers: intersection curves, between meshes and within them. Computed in a thread of its own, once for "
        "each message of markers, if it has subscribers",
        change=ALWAYS,
    ),
    Row(
        "markers_max",
        "int",
        2000,
        "Most contacts drawn, sampled evenly, and most points of intersection curves",
        span=(1, 1_000_000),
        change=ALWAYS,
    ),
    Row(
        "markers_rate", "float", 10.0, "Most marker messages per second", unit="Hz", span=(0.001, 1000.0), change=ALWAYS
    ),
    Row(
        "markers_size",
        "float",
        0.01,
        "Diameter of a point and of the heads of arrows; normals are ten times as long",
        unit="unit of the vertices",
        span=(1e-9, 1e9),
        change=ALWAYS,
    ),
)

RECORDING_ROWS = (
    Row(
        "record",
        "string",
        "",
        "Record inputs and results while active: a file ending in .mcap, or a folder. It may contain strftime"
        " codes (%Y...) for the date; a number is added if it exists. Empty: no recording. Setting it starts "
        "and ends recordings",
        change=ALWAYS,
    ),
    Row(
        "record_compression",
        "string",
        "none",
        "Compression of the next recording",
        choices=("none", "lz4", "zstd"),
        change=ALWAYS,
    ),
    Row(
        "record_split_size",
        "float",
        0.0,
        "Size of a file, before compression, after which the next one begins, in a folder; 0: no limit. For "
        "the next recording",
        unit="MB",
        span=(0.0, MOST_SPLIT),
        least=LEAST_SPLIT_SIZE,
        change=ALWAYS,
        example=512.0,
    ),
    Row(
        "record_split_time",
        "float",
        0.0,
        "Duration of a file after which the next one begins, in a folder; 0: no limit. For the next recording",
        unit="s",
        span=(0.0, MOST_SPLIT),
        least=LEAST_SPLIT_TIME,
        change=ALWAYS,
        example=60.0,
    ),
    Row(
        "record_flush",
        "float",
        0.5,
        "Most that a killed node loses of the next recording",
        unit="s",
        span=(0.0, 3600.0),
        change=ALWAYS,
    ),
    Row(
        "record_sync",
        "bool",
        False,
        "Make the next recording durable (fsync) each time that messages are flushed, so that it survives a power "
        "failure",
        change=ALWAYS,
    ),
)

STOP_ROWS = (
    Row(
        "stop_distance",
        "float",
        -1.0,
        "Publish on stop whether different meshes were within this distance, or touched, during the last "
        "step, or one is inside another, or positions are unknown; 0: only touching counts as near; -1: no topic stop. "
        "It may be changed at any time, but only switched on or off while the node is unconfigured",
        unit="unit of the vertices",
        span=(-1.0, FARTHEST),
        least=0.0,
        change=ALWAYS,
        example=0.05,
    ),
    Row(
        "stop_timeout",
        "float",
        0.5,
        "stop is true when no result was produced for a frame whose messages were all, the oldest included, "
        "sent within this time. stop is published four times in this time, which is also its deadline and "
        "liveliness lease",
        unit="s",
        span=(0.01, 3600.0),
    ),
    Row(
        "approach_time",
        "float",
        0.0,
        "Publish on speed_scale how far to slow down before stop: the least min(1, (distance - stop_distance) / "
        "(speed of approach * approach_time)) of all pairs of different meshes, and 0 while stop is true; 0: no topic "
        "speed_scale. It may be changed at any time, but only switched on or off while the node is unconfigured",
        unit="s",
        span=(0.0, 3600.0),
        change=ALWAYS,
        example=1.0,
    ),
    Row(
        "stop_detail",
        "string[]",
        [],
        "Meshes that are searched for stop on coarse faces with a proven bound, as NAME:RATIO of their faces; the name "
        "of a robot means all its links. stop is never later than without, and may be true a little earlier. Needs the "
        "package fast-simplification",
        example=["cloth:0.1"],
    ),
    Row(
        "clock_error",
        "float",
        CLOCK_ERROR,
        "Largest difference between the system clocks of the machines (NTP, PTP). A message from further in "
        "the future, or a larger jump of the system clock, makes stop true until the clocks have agreed for "
        "stop_timeout",
        unit="s",
        span=(0.0, 10.0),
    ),
)

# Heading in the documentation -> rows.
NODE_GROUPS = {
    "Scene and start": SCENE_ROWS,
    "Detection": DETECTION_ROWS,
    "Stop": STOP_ROWS,
    "Input": INPUT_ROWS,
    "Service `~/detect`": SERVICE_ROWS,
    "Output": OUTPUT_ROWS,
    "Recording": RECORDING_ROWS,
}
NODE_ROWS = tuple(row for rows in NODE_GROUPS.values() for row in rows)

# Prefix of the parameters of pairs of meshes: pairs.NAME.*, with any NAME.
PAIRS = "pairs"

# Defaults None, "" and [] mean: not set.
PAIR_ROWS = (
    Row(
        "meshes",
        "string[]",
        [],
        "The two meshes of the pair; the same name twice: within that mesh. A new NAME is only read at the start",
        example=["cloth", "floor"],
    ),
    Row("accuracy", "string", "", "Tier, instead of `accuracy`; empty: that one", choices=ACCURACIES),
    Row(
        "separation",
        "float",
        None,
        "Separation, instead of `minimum_separation`; not set: that one",
        unit="unit of the vertices",
        span=(0.0, FARTHEST),
        change=ALWAYS,
        example=0.01,
    ),
    Row(
        "features",
        "string[]",
        [],
        "Pairs of features that are tested, instead of `features`; empty: those",
        choices=FEATURES,
        example=["edge_edge"],
    ),
    Row("ignored", "bool", None, "Do not test the pair; not set: as in `ignored_pairs`", example=True),
)

# Prefix of the parameters of planes: plane.NAME.* for each NAME in `planes`.
PLANE = "plane"

PLANE_ROWS = (
    Row(
        "normal",
        "float[]",
        [0.0, 0.0, 1.0],
        "Normal x y z of any length: it points to the side on which meshes must stay",
    ),
    Row(
        "offset",
        "float",
        0.0,
        "normal . x on the plane: meshes must stay where normal . x >= offset",
        unit="unit of the vertices times the length of the normal",
        span=(-FARTHEST, FARTHEST),
        example=0.0,
    ),
)

MESH_ROWS = (
    Row(
        "input",
        "string",
        "vertices",
        "Source of the positions. vertices (MeshVertices), points (PointCloud2): on the topic "
        "meshes/NAME/INPUT. shape (shape_msgs/Mesh), marker (Marker of type TRIANGLE_LIST): positions and "
        "topology on that topic. For a rigid mesh pose (PoseStamped on that topic), or tf: no topic, the "
        "transform from `frame` to frame_id moves it",
        choices=INPUTS,
    ),
    Row("static", "bool", False, "Does not move: positions from the file or from one message"),
    Row("self_collision", "bool", True, "Test the mesh against itself"),
    Row(
        "ignored_rings",
        "int",
        0,
        "Do not test features of the mesh against each other that are joined by at most this number of edges; 0: only "
        "those that share a vertex. For thickness beyond the length of edges",
        span=(0, 1000),
        example=2,
    ),
    Row(
        "ignored_at_rest",
        "float",
        -1.0,
        "Do not test features of the mesh against each other that are within this distance at rest: in `file`; without "
        "a file, in the first frame with these triangles. 0: those that touch; -1: test all",
        unit="unit of the vertices",
        span=(-1.0, FARTHEST),
        least=0.0,
        example=0.005,
    ),
    Row(
        "file",
        "string",
        "",
        "Mesh file (OBJ, PLY, STL; DAE with the extra meshes) with the topology, as version 0, and the "
        "positions of a static or rigid mesh: a path, package://PACKAGE/PATH or file:///PATH",
    ),
    Row(
        "transform",
        "string",
        "none",
        "How positions are transformed to the scene: none; by `pose`; or by the transform from "
        "header.frame_id to `frame_id` at their stamp, from /tf or transforms",
        choices=("none", "pose", "tf"),
    ),
    Row(
        "frame",
        "string",
        "",
        "Coordinate frame of messages that are transformed: others are rejected, and an empty header.frame_id"
        " means this one; empty: any. With input tf: the frame of the mesh",
    ),
    Row(
        "pose",
        "float[]",
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        "Placement of the vertices of the file and, with transform pose, of the messages: translation x y z, "
        "unit quaternion x y z w",
        unit="unit of the vertices",
    ),
)

# Prefix of the parameters of robots: robot.NAME.* for each NAME in `robots`.
ROBOT = "robot"

ROBOT_ROWS = (
    Row(
        "description",
        "string",
        "robot_description",
        "URDF: a latched topic of std_msgs/String, as published by robot_state_publisher; or a file, if the "
        "name contains a dot: a path, package://PACKAGE/PATH or file:///PATH",
    ),
    Row("geometry", "string", "collision", "Which shapes of the links are used", choices=("collision", "visual")),
    Row("srdf", "string", "", "SRDF file whose disabled pairs are not tested; empty: only neighbouring links are not"),
    Row(
        "joint_states",
        "string",
        "",
        "Topic of sensor_msgs/JointState that moves the joints; empty: links move by the transforms from "
        "`frame_prefix` + LINK to `frame_id`",
    ),
    Row("frame_prefix", "string", "", "Prefix of the names of links in transforms"),
    Row(
        "pose",
        "float[]",
        [],
        "With `joint_states`: placement of the root link in the scene, translation x y z, unit quaternion x y"
        " z w; empty: the transform from `frame_prefix` + ROOT to `frame_id`",
        unit="unit of the vertices",
        example=[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    ),
    Row(
        "tolerance",
        "float",
        1e-3,
        "How far the triangles of cylinders, spheres and capsules may stand out of the shape",
        unit="unit of the vertices",
        span=(1e-9, FARTHEST),
    ),
)
