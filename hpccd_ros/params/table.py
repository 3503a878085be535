# SPDX-License-Identifier: Apache-2.0
"""The table of the node's parameters: of it are made checks, declarations and docs/parameters.md."""

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

    ``span``: closed range of a number; ``least``: the smallest beside 0; ``choices``: allowed strings (of each entry).
    ``change``: ALWAYS; UNCONFIGURED: only while the node is unconfigured (before configure, after clean-up), as it is
    read there; NEVER: read-only.
    """

    name: str
    kind: str
    default: Any
    text: str
    unit: str = ""
    span: tuple[float, float] | None = None
    least: float = 0.0
    choices: tuple[str, ...] = ()
    change: str = UNCONFIGURED


# Of the files of a split recording: smaller ones would hold a message each, and beginning a file takes longer (a few
# milliseconds) than messages may wait.
LEAST_SPLIT_SIZE = 0.01  # MB
LEAST_SPLIT_TIME = 0.1  # s
MOST_SPLIT = 1e9  # MB, s

# The largest coordinate that the core takes: no distance between two points is worth asking for beyond a few of it.
FARTHEST = 1e150
# Of a step that is cut.
MOST_PARTS = 1000

SCENE_ROWS = (
    Row(
        "robots",
        "string[]",
        [],
        "Names of robots: each link of one that has geometry is a mesh ROBOT/LINK, behind those of `meshes`. Each name "
        "makes the parameters robot.NAME.*",
        change=NEVER,
    ),
    Row(
        "meshes",
        "string[]",
        [],
        "Names of the meshes of the scene, in the order of the core's numbering. Each name "
        "makes the topics meshes/NAME/... and the parameters mesh.NAME.*",
        change=NEVER,
    ),
    Row(
        "ignored_pairs",
        "string[]",
        [],
        "Pairs of meshes that are never tested against each other, each as NAME:NAME. A robot's name stands for all of "
        "its links, here and in all parameters of pairs",
    ),
    Row(
        "pair_accuracy",
        "string[]",
        [],
        "Pairs of meshes that are tested at another accuracy, each as NAME:NAME:TIER; the same name twice: within it",
    ),
    Row(
        "pair_features",
        "string[]",
        [],
        "Pairs of meshes of which other features are tested, each as NAME:NAME:KIND with vertex_face or edge_edge; two "
        "entries of a pair: both; the same name twice: within it",
    ),
    Row(
        "autostart",
        "bool",
        True,
        "Configure and activate at once; false: wait for the life-cycle services",
        change=NEVER,
    ),
)

DETECTION_ROWS = (
    Row("accuracy", "string", "exact", "Tier of the elementary tests", choices=ACCURACIES, change=ALWAYS),
    Row("backend", "string", "auto", "Where the core runs", choices=BACKENDS, change=ALWAYS),
    Row("threads", "int", 0, "Threads of the core; 0: all cores", span=(0, 1024), change=ALWAYS),
    Row(
        "report",
        "string",
        "all",
        "Every contact, those at the earliest time, or any one",
        choices=REPORTS,
        change=ALWAYS,
    ),
    Row(
        "features",
        "string[]",
        list(FEATURES),
        "What is tested at all: vertices against faces, edges against edges, or both",
        choices=FEATURES,
        change=ALWAYS,
    ),
    Row("outputs", "string[]", [], "Computed and sent beside the contacts", choices=OUTPUTS, change=ALWAYS),
    Row(
        "minimum_separation",
        "float",
        0.0,
        "A contact is a pair of features that comes this near, or touches; 0: that touches. Keep it below the shortest "
        "edge: neighbours count that share no vertex",
        unit="unit of the vertices",
        span=(0.0, FARTHEST),
        change=ALWAYS,
    ),
    Row(
        "pair_separation",
        "string[]",
        [],
        "Pairs of meshes with a separation of their own, each as NAME:NAME:DISTANCE; the same name twice: within it",
        change=ALWAYS,
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
        "Publish on pairs, for each pair of meshes, how many contacts the step has, the time of the first, and the "
        "smallest distance where `distances` is true",
        change=ALWAYS,
    ),
    Row(
        "rigid_tolerance",
        "float",
        1e-3,
        "Meshes that move by poses turn, and the core knows straight lines: a step is cut into as few parts as bring "
        "the two this near to each other. Nothing is missed; what is reported comes within the separation and twice "
        "the bounds of both meshes, which each answer tells",
        unit="unit of the vertices",
        span=(1e-9, FARTHEST),
        change=ALWAYS,
    ),
    Row(
        "rigid_parts",
        "int",
        64,
        "Most parts of a step. Where more were needed, bounds exceed rigid_tolerance, and still nothing is missed",
        span=(1, MOST_PARTS),
        change=ALWAYS,
    ),
    Row(
        "max_contacts",
        "int",
        200_000,
        "Most contacts in one message: the earliest are kept, `truncated` is set; 0: no limit",
        span=(0, 100_000_000),
        change=ALWAYS,
    ),
)

INPUT_ROWS = (
    Row(
        "frame_id",
        "string",
        "",
        "Coordinate frame of the scene, which all vertex messages must carry or be transformed to; empty: that of the "
        "first one, until a restart or a new publisher brings another",
    ),
    Row(
        "frame_queue",
        "int",
        1,
        "Complete frames that may wait for the detection; 1: only the latest. The oldest gives "
        "way, counted as overload",
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
        "How frames of several meshes are joined: equal stamps, or nearest to those of the first deforming mesh",
        choices=("exact", "nearest"),
    ),
    Row(
        "stamp_tolerance",
        "float",
        0.01,
        "Largest difference of stamps for stamp_match nearest",
        unit="s",
        span=(0.0, 3600.0),
    ),
    Row(
        "restart_after",
        "int",
        5,
        "Frames in a row with increasing stamps before the last accepted one, or in another coordinate frame than the "
        "first one brought, that are taken as a restart of the stream; 0: never",
        span=(0, 1_000_000),
        change=ALWAYS,
    ),
    Row(
        "input_reliability",
        "string",
        "reliable",
        "Reliability of the subscriptions to vertices, points, shapes, markers, poses and joint states; best_effort "
        "also accepts best-effort publishers, and may lose large messages",
        choices=("reliable", "best_effort"),
    ),
    Row(
        "input_depth",
        "int",
        10,
        "QoS history depth of the vertex subscriptions: messages that may come at once without loss",
        span=(1, 1000),
    ),
    Row("max_vertices", "int", 5_000_000, "Largest mesh accepted", unit="vertices", span=(1, 1_000_000_000)),
    Row("max_faces", "int", 10_000_000, "Largest mesh accepted", unit="triangles", span=(1, 1_000_000_000)),
    Row(
        "max_edges",
        "int",
        10_000_000,
        "Most edges beside those of the triangles",
        unit="edges",
        span=(1, 1_000_000_000),
    ),
    Row(
        "max_rate",
        "float",
        1000.0,
        "Most messages a second that are looked at of each input topic, as a mean over a second; more are dropped, "
        "counted as rate; 0: no limit",
        unit="Hz",
        span=(0.0, 1e6),
    ),
    Row(
        "count_unknown_meshes",
        "bool",
        True,
        "Subscribe (raw) to vertex topics of meshes that are not in `meshes`, to "
        "count their frames; false: only name the topics in the diagnostics",
    ),
)

SERVICE_ROWS = (
    Row("max_meshes", "int", 1000, "Most meshes in a request of ~/detect", span=(1, 1_000_000)),
    Row(
        "detect_jobs",
        "int",
        2,
        "Requests of ~/detect that are computed at the same time; of as many scenes what was built is kept for further "
        "requests, until nobody asks about them for a minute",
        span=(1, 256),
    ),
    Row(
        "detect_waiting",
        "int",
        8,
        "Requests of ~/detect that may wait; more, up to 1,000 at once, are refused as busy",
        span=(0, 10_000),
    ),
    Row(
        "detect_time_limit",
        "float",
        30.0,
        "Answer of ~/detect after this time at the latest, where the request sets no limit, which counts up to a day",
        unit="s",
        span=(0.001, 86_400.0),
        change=ALWAYS,
    ),
    Row(
        "service_introspection",
        "string",
        "off",
        "Publish the events of ~/detect on ~/detect/_service_event: who asked and was answered when, or also what",
        choices=("off", "metadata", "contents"),
        change=ALWAYS,
    ),
)

OUTPUT_ROWS = (
    Row(
        "contacts_durability",
        "string",
        "volatile",
        "QoS of contacts; transient_local also gives the last answers to subscribers that come later and ask for it",
        choices=("volatile", "transient_local"),
    ),
    Row("diagnostics_period", "float", 1.0, "Period of /diagnostics", unit="s", span=(0.05, 3600.0)),
    Row(
        "markers",
        "bool",
        False,
        "For viewers: publish contact points and normals on markers, and the vertices on surface",
        change=ALWAYS,
    ),
    Row("markers_max", "int", 2000, "Most contacts drawn; evenly thinned out", span=(1, 1_000_000), change=ALWAYS),
    Row("markers_rate", "float", 10.0, "Most marker messages a second", unit="Hz", span=(0.001, 1000.0), change=ALWAYS),
    Row(
        "markers_size",
        "float",
        0.01,
        "Diameter of a point; a normal is ten times as long",
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
        "Record the meshes and contacts while active: a file ending in .mcap, or a folder; % codes of strftime for "
        "the date, a number is added where it exists; empty: do not. Changing it begins and ends recordings",
        change=ALWAYS,
    ),
    Row(
        "record_compression", "string", "none", "Of the next recording", choices=("none", "lz4", "zstd"), change=ALWAYS
    ),
    Row(
        "record_split_size",
        "float",
        0.0,
        "A new file after so much, before compression, in a folder; 0: no limit. For the next recording",
        unit="MB",
        span=(0.0, MOST_SPLIT),
        least=LEAST_SPLIT_SIZE,
        change=ALWAYS,
    ),
    Row(
        "record_split_time",
        "float",
        0.0,
        "A new file after so long, in a folder; 0: no limit. For the next recording",
        unit="s",
        span=(0.0, MOST_SPLIT),
        least=LEAST_SPLIT_TIME,
        change=ALWAYS,
    ),
    Row(
        "record_flush",
        "float",
        0.5,
        "Most that a killed node can lose of the next recording",
        unit="s",
        span=(0.0, 3600.0),
        change=ALWAYS,
    ),
)

STOP_ROWS = (
    Row(
        "stop_distance",
        "float",
        -1.0,
        "Publish on stop whether different meshes came this near, or touched, on the last step, or nobody knows; 0: "
        "only whether they touched; negative: no topic stop. It can be made larger or smaller at any time, but not be "
        "switched on or off while the node is configured",
        unit="unit of the vertices",
        span=(-1.0, FARTHEST),
        change=ALWAYS,
    ),
    Row(
        "stop_timeout",
        "float",
        0.5,
        "stop is true when no result was produced for a frame of which all messages, the oldest included, were sent "
        "within this time; stop is published four times in this time, which is also its deadline and liveliness lease",
        unit="s",
        span=(0.01, 3600.0),
    ),
    Row(
        "clock_error",
        "float",
        CLOCK_ERROR,
        "Largest difference between the system clocks of the machines (NTP, PTP). A message from further in the "
        "future, or a larger jump of the system clock, makes stop true until the clocks have agreed for stop_timeout",
        unit="s",
        span=(0.0, 10.0),
    ),
)

# Under the headings that the documentation gives them.
NODE_GROUPS = {
    "Scene and start": SCENE_ROWS,
    "Detection": DETECTION_ROWS,
    "Stop": STOP_ROWS,
    "Input": INPUT_ROWS,
    "Service `~/detect`": SERVICE_ROWS,
    "What is published": OUTPUT_ROWS,
    "Recording": RECORDING_ROWS,
}
NODE_ROWS = tuple(row for rows in NODE_GROUPS.values() for row in rows)

# Of pairs of meshes: pairs.NAME.*, where NAME is any.
PAIRS = "pairs"

# None: not said; "" and [] say nothing either.
PAIR_ROWS = (
    Row("meshes", "string[]", [], "The two meshes of the pair; the same name twice: within it"),
    Row("accuracy", "string", "", "Tier, instead of `accuracy`; empty: that one", choices=ACCURACIES),
    Row(
        "separation",
        "float",
        None,
        "Contact from this distance on, instead of `minimum_separation`; not set: that one",
        unit="unit of the vertices",
        span=(0.0, FARTHEST),
        change=ALWAYS,
    ),
    Row("features", "string[]", [], "What is tested, instead of `features`; empty: that", choices=FEATURES),
    Row("ignored", "bool", None, "Never tested against each other; not set: what `ignored_pairs` says"),
)

MESH_ROWS = (
    Row(
        "input",
        "string",
        "vertices",
        "Topic of the positions: meshes/NAME/vertices (MeshVertices) or meshes/NAME/points (PointCloud2); of positions "
        "and topology: meshes/NAME/shape (shape_msgs/Mesh) or meshes/NAME/marker (Marker of type TRIANGLE_LIST); of a "
        "mesh that keeps its shape: meshes/NAME/pose (PoseStamped), or tf: no topic, the transform from `frame` to "
        "frame_id moves it",
        choices=INPUTS,
    ),
    Row("static", "bool", False, "Does not move: positions from the file or from one message"),
    Row("self_collision", "bool", True, "Test the mesh against itself"),
    Row(
        "file",
        "string",
        "",
        "Mesh file (OBJ, PLY, STL, or DAE, which needs the extra meshes) with the topology, version 0, and for a "
        "static mesh the positions: a path, package://PACKAGE/PATH or file:///PATH",
    ),
    Row(
        "transform",
        "string",
        "none",
        "How the positions of the messages get into the scene's frame: as they are; by `pose`; or by the "
        "transform from header.frame_id to `frame_id` at their stamp, from /tf or transforms",
        choices=("none", "pose", "tf"),
    ),
    Row(
        "frame",
        "string",
        "",
        "Coordinate frame that the messages must carry, where they are transformed; taken where theirs is "
        "empty; empty: any",
    ),
    Row(
        "pose",
        "float[]",
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        "Where the file's vertices, and with transform pose those of the messages, are placed: translation x y z, unit "
        "quaternion x y z w",
        unit="unit of the vertices",
    ),
)

# Of robots: robot.NAME.* of each NAME in `robots`.
ROBOT = "robot"

ROBOT_ROWS = (
    Row(
        "description",
        "string",
        "robot_description",
        "The URDF: the name of a topic of std_msgs/String, latched, as robot_state_publisher offers it; or a file, "
        "whose name has a point: a path, package://PACKAGE/PATH or file:///PATH",
    ),
    Row("geometry", "string", "collision", "Which shapes of the links count", choices=("collision", "visual")),
    Row("srdf", "string", "", "SRDF file: what it disables is never tested; empty: neighbouring links alone are not"),
    Row(
        "joint_states",
        "string",
        "",
        "Topic of sensor_msgs/JointState by which the joints move; empty: links move by the transforms from "
        "`frame_prefix` + LINK to `frame_id`",
    ),
    Row("frame_prefix", "string", "", "Before the names of links in transforms"),
    Row(
        "pose",
        "float[]",
        [],
        "With `joint_states`: where the root link stands in the scene, translation x y z, unit quaternion x y z w; "
        "empty: the transform from `frame_prefix` + ROOT to `frame_id` says it",
        unit="unit of the vertices",
    ),
    Row(
        "tolerance",
        "float",
        1e-3,
        "How far the triangles of cylinders, spheres and capsules may stand out of them",
        unit="unit of the vertices",
        span=(1e-9, FARTHEST),
    ),
)
