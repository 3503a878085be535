# SPDX-License-Identifier: Apache-2.0
"""A small scene with every kind of input, and its messages as CDR bytes; recordings of it are seeds too."""

import functools
from collections.abc import Sequence

import numpy as np
from bag_tools import typestore
from mcap_model import Bag
from rosbags.typesys import get_types_from_msg
from sources import ROOT

from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.middleware import message_types as types
from hpccd_ros.middleware import transform_topics
from hpccd_ros.params import robot_parameters

from .robots import URDF
from .target import missing

PARAMETERS = {
    "meshes": ["cloth", "net", "tool", "flag", "hand", "crate"],
    "frame_id": "world",
    "outputs": ["points", "normals"],
    "minimum_separation": 0.01,
    "max_vertices": 100,
    "max_faces": 100,
    "max_edges": 100,
    "mesh.net.input": "points",
    "mesh.net.transform": "tf",
    "mesh.tool.input": "shape",
    "mesh.flag.input": "marker",
    "mesh.hand.input": "pose",
    "mesh.crate.input": "tf",
    "mesh.crate.frame": "crate",
    "robots": ["arm"],
    "robot.arm.description": "robot_description",
    "robot.arm.joint_states": "joint_states",
    "robot.arm.pose": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    "robot.arm.tolerance": 0.5,
}
ALL = ("cloth", "net", "tool", "flag", "hand", "crate", "arm")
# Meshes and robots of scenes: an input of one mesh takes a tenth of the time of one of all.
PARTS = (
    ("cloth", "net", "arm"),
    ("cloth",), ("net",), ("tool",), ("flag",), ("hand",), ("crate", "cloth"), ("arm",),
)  # fmt: skip
# Role in the recording -> type. The topic has the name of the role, with a slash before it.
ROLES = {
    "meshes/cloth/topology": types.TOPOLOGY,
    "meshes/cloth/vertices": types.VERTICES,
    "meshes/net/topology": types.TOPOLOGY,
    "meshes/net/points": types.POINTS,
    "meshes/tool/shape": types.SHAPE,
    "meshes/flag/marker": types.MARKER,
    "meshes/hand/topology": types.TOPOLOGY,
    "meshes/hand/vertices": types.VERTICES,
    "meshes/hand/pose": types.POSE,
    "meshes/crate/topology": types.TOPOLOGY,
    "meshes/crate/vertices": types.VERTICES,
    "transforms": transform_topics.STAMPED,
    "transforms_static": transform_topics.STAMPED,
    "joint_states": types.JOINT_STATES,
    "robot_description": types.DESCRIPTION,
}
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.1]])
_FACES = np.array([0, 1, 2, 1, 3, 2], np.uint32)
_SECOND = 10**9
REQUEST = "hpccd/msg/DetectRequest"  # under a name that rosbags takes


@functools.cache
def _store():
    store = typestore()
    text = (ROOT / "srv" / "Detect.srv").read_text().partition("---")[0].replace("<=1", "")
    store.register(get_types_from_msg(text, REQUEST))
    return store


def parameters(part: Sequence[str]) -> dict:
    """Those of a scene with these meshes and robots."""
    names = {"meshes": [name for name in PARAMETERS["meshes"] if name in part], "robots": list({"arm"} & set(part))}
    kept = {name: value for name, value in PARAMETERS.items() if name.partition(".")[0] not in ("mesh", "robot")}
    kept |= {name: value for name, value in PARAMETERS.items() if name.split(".")[1:2] and name.split(".")[1] in part}
    return kept | names


def robot_values() -> dict:
    return robot_parameters.of(PARAMETERS)["arm"]


def roles(part: Sequence[str]) -> dict[str, str]:
    """The topics of such a scene."""
    unused = () if "arm" in part else ("joint_states", "robot_description")
    return {
        role: kind
        for role, kind in ROLES.items()
        if role not in unused and (not role.startswith("meshes/") or role.split("/")[1] in part)
    }


def topic(role: str) -> str:
    return role if role.startswith("/") else f"/{role}"


def made(kind: str, /, **fields):
    """A message as rosbags knows it; kind: "pkg/msg/Name"."""
    return _store().types[kind](**fields)


def encoded(kind: str, message) -> bytes:
    return bytes(_store().serialize_cdr(message, kind))


def time(stamp: int):
    return made("builtin_interfaces/msg/Time", sec=stamp // _SECOND, nanosec=stamp % _SECOND)


def header(stamp: int, frame_id: str = "world"):
    return made("std_msgs/msg/Header", stamp=time(stamp), frame_id=frame_id)


def topology(edges=(0, 3)):
    return made(
        types.TOPOLOGY,
        header=header(0, ""),
        version=0,
        n_vertices=4,
        faces=_FACES,
        edges=np.array(edges, np.uint32),
    )


def vertices(stamp: int, step: int, xyz=CORNERS, dtype=np.float32, frame_id: str = "world"):
    empty = {"vertices_f32": np.zeros(0, np.float32), "vertices_f64": np.zeros(0)}
    given = {"vertices_f32" if dtype == np.float32 else "vertices_f64": xyz.astype(dtype).reshape(-1)}
    return made(types.VERTICES, header=header(stamp, frame_id), topology_version=0, step=step, **empty | given)


_BEFORE_SHAPE = ("joint_states", "transforms", "meshes/cloth/vertices", "meshes/net/points")


def _vector(x, y, z, kind="Vector3"):
    return made(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)


def _turn():
    return made("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.6, w=0.8)


def _pose(z):
    return made("geometry_msgs/msg/Pose", position=_vector(0.0, 0.0, z, "Point"), orientation=_turn())


def _transform(stamp, parent, child, z):
    motion = made("geometry_msgs/msg/Transform", translation=_vector(0.0, 0.0, z), rotation=_turn())
    return made(transform_topics.STAMPED, header=header(stamp, parent), child_frame_id=child, transform=motion)


def _cloud(stamp, xyz):
    fields = [
        made("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate("xyz")
    ]
    data = np.frombuffer(xyz.astype(np.float32).tobytes(), np.uint8)
    return made(
        types.POINTS,
        header=header(stamp, "net"),
        height=1,
        width=len(xyz),
        fields=fields,
        is_bigendian=False,
        point_step=12,
        row_step=12 * len(xyz),
        data=data,
        is_dense=True,
    )


def _shape(z):
    triangles = [made("shape_msgs/msg/MeshTriangle", vertex_indices=row) for row in _FACES.reshape(-1, 3)]
    points = [_vector(*(row + [0, 0, z]), "Point") for row in CORNERS]
    return made(types.SHAPE, triangles=triangles, vertices=points)


def _marker(stamp, z):
    empty = made("sensor_msgs/msg/CompressedImage", header=header(0, ""), format="", data=np.zeros(0, np.uint8))
    return made(
        types.MARKER,
        header=header(stamp),
        ns="",
        id=0,
        type=11,
        action=0,
        pose=_pose(z),
        scale=_vector(1.0, 1.0, 1.0),
        color=made("std_msgs/msg/ColorRGBA", r=1.0, g=0.0, b=0.0, a=1.0),
        lifetime=made("builtin_interfaces/msg/Duration", sec=0, nanosec=0),
        frame_locked=False,
        points=[_vector(*CORNERS[k], "Point") for k in _FACES[:3]],
        colors=[],
        texture_resource="",
        texture=empty,
        uv_coordinates=[],
        text="",
        mesh_resource="",
        mesh_file=made("visualization_msgs/msg/MeshFile", filename="", data=np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )


def _joints(stamp, angle):
    return made(
        types.JOINT_STATES,
        header=header(stamp, ""),
        name=["turn"],
        position=np.array([angle]),
        velocity=np.zeros(0),
        effort=np.zeros(0),
    )


def sent(number: int) -> int:
    """When a message of a stream is sent, ns."""
    return 10**18 + number * 10**6


def messages(part: Sequence[str] = ALL, frames: int = 3) -> list[tuple[str, bytes]]:
    """(role, CDR) of a scene, first of what does not move."""
    wanted = roles(part)
    found = [("robot_description", made(types.DESCRIPTION, data=URDF.decode()))]
    found += [(role, topology()) for role, kind in ROLES.items() if kind == types.TOPOLOGY]
    found += [(f"meshes/{mesh}/vertices", vertices(0, 0)) for mesh in ("hand", "crate")]
    found += [("transforms_static", _transform(0, "world", "net", 0.1))]
    for k in range(1, frames + 1):
        # A shape has no stamp: it is that at which it is sent.
        before = sum(role in wanted for role in _BEFORE_SHAPE)
        stamp, z = sent(len([role for role, _ in found if role in wanted]) + before), 0.3 - 0.2 * k
        found += [
            ("joint_states", _joints(stamp, 0.1 * k)),
            ("transforms", _transform(stamp, "world", "crate", z)),
            ("meshes/cloth/vertices", vertices(stamp, k, CORNERS + [0, 0, z], np.float64)),
            ("meshes/net/points", _cloud(stamp, CORNERS)),
            ("meshes/tool/shape", _shape(z)),
            ("meshes/flag/marker", _marker(stamp, z)),
            ("meshes/hand/pose", made(types.POSE, header=header(stamp), pose=_pose(2 * z))),
        ]
        found = [(role, message) for role, message in found if role in wanted]
    return [(role, encoded(ROLES[role], message)) for role, message in found]


def recording(parameters: dict, roles: dict[str, str], stream, attachments=()) -> Bag:
    """A recording as `hpccd record` writes it. stream: (role, CDR), a millisecond apart."""
    path = missing("seed.mcap")
    info = {
        "format": 1,
        "hpccd": "0",
        "node": "/hpccd",
        "parameters": parameters,
        "topics": {topic(role): role for role in roles},
    }
    writer = BagWriter(path, info=info, attachments=list(attachments))
    for role, kind in roles.items():
        writer.add_topic(Topic(topic(role), kind, []))
    for number, (role, data) in enumerate(stream):
        at = sent(number)
        writer.write(topic(role), data, at, at, 1 + number)
    writer.close()
    bag = Bag.read(path)
    for schema in bag.schemas:  # their comments would be most of a small recording
        lines = (line.partition(b"#")[0].rstrip() for line in schema.data.splitlines())
        schema.data = b"\n".join(line for line in lines if line)
    return bag
