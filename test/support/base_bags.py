# SPDX-License-Identifier: Apache-2.0
"""Small valid recordings, verified by a replay; hostile ones are derived from them."""

import numpy as np
from bag_tools import typestore
from mcap_model import Bag
from sources import ROOT

from hpccd_core.options import OUTPUTS
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.middleware import contact_messages, result_fields, snapshot_messages
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

SECOND = 1_000_000_000
FIRST, FRAMES = 55, 8  # of the recording of the repository: its contacts are of both kinds
SCENE = {
    "meshes": ["cloth", "net", "floor"],
    "frame_id": "world",
    "outputs": list(OUTPUTS),
    "minimum_separation": 1e-3,
    "pair_separation": ["cloth:net:0.002"],
    "mesh.floor.static": True,
    "mesh.floor.file": "somewhere/floor.obj",
    "mesh.floor.self_collision": False,
    "mesh.floor.pose": [0.0, 0.0, -0.1, 0.0, 0.0, 0.6, 0.8],
    "mesh.net.input": "points",
    "mesh.net.transform": "tf",
    "mesh.net.frame": "hand",
}
FLOOR = b"v -2 -2 0\nv 2 -2 0\nv 2 2 0.01\nv -2 2 0\nf 1 2 3 4\n"
N = 5  # vertices along a side of a sheet


def write_all(folder) -> None:
    """streams.mcap and everything.mcap, as below."""
    of_streams(ROOT / "bags" / "cloth-drop-small.mcap").write(folder / "streams.mcap")
    of_everything(folder).write(folder / "everything.mcap")


def of_streams(source) -> Bag:
    """Two meshes as MeshTopology and MeshVertices: some frames of the recording of the repository."""
    bag = Bag.read(source)
    wanted = []
    for channel in bag.channels:
        messages = bag.of_topic(channel.topic)
        if not channel.topic.endswith("topology"):
            messages = messages[FIRST : FIRST + FRAMES - channel.topic.endswith("contacts")]
        wanted += map(id, messages)
    bag.messages = [message for message in bag.messages if id(message) in wanted]
    return bag


def of_everything(folder) -> Bag:
    """A mesh of float64 vertices, one of point clouds in a moving frame, and a static one from a file."""
    silent, whole = folder / "silent.mcap", folder / "whole.mcap"
    _write(silent, [])
    _write(whole, _results(silent))
    return Bag.read(whole)


def _write(path, results):
    store = typestore()
    topics = {
        "/transforms": ("transforms", "geometry_msgs/msg/TransformStamped"),
        "/transforms_static": ("transforms_static", "geometry_msgs/msg/TransformStamped"),
        "/meshes/cloth/topology": ("meshes/cloth/topology", "hpccd/msg/MeshTopology"),
        "/meshes/cloth/vertices": ("meshes/cloth/vertices", "hpccd/msg/MeshVertices"),
        "/meshes/net/topology": ("meshes/net/topology", "hpccd/msg/MeshTopology"),
        "/meshes/net/points": ("meshes/net/points", "sensor_msgs/msg/PointCloud2"),
        "/contacts": ("contacts", "hpccd/msg/ContactArray"),
        "/distances": ("distances", "hpccd/msg/DistanceArray"),
    }
    info = {
        "format": 1,
        "hpccd": "0",
        "node": "/hpccd",
        "parameters": SCENE,
        "topics": {name: role for name, (role, _) in topics.items()},
    }
    bag = BagWriter(path, info=info, attachments=[("mesh/floor/floor.obj", FLOOR)])
    for name, (_, type_name) in topics.items():
        bag.add_topic(Topic(name, type_name, []))
    times = iter(range(10**18, 2 * 10**18, 1_000_000))

    def write(topic, message):
        time = next(times)
        bag.write(topic, bytes(store.serialize_cdr(message, topics[topic][1])), time, time, 1 + time % 10**18)

    for message in _inputs(Maker(store)):
        write(*message)
    for contacts, distances in results:
        write("/contacts", contacts)
        write("/distances", distances)
    bag.close()


class Maker:
    """Messages as rosbags knows them."""

    def __init__(self, store):
        self._types = store.types

    def header(self, stamp, frame_id):
        return self._types["std_msgs/msg/Header"](stamp=self.time(stamp), frame_id=frame_id)

    def time(self, stamp):
        return self._types["builtin_interfaces/msg/Time"](*divmod(stamp, SECOND))

    def topology(self, faces, n_vertices):
        return self._types["hpccd/msg/MeshTopology"](
            header=self.header(0, ""),
            version=0,
            n_vertices=n_vertices,
            faces=faces.astype(np.uint32).reshape(-1),
            edges=np.empty(0, np.uint32),
        )

    def vertices(self, stamp, step, xyz):
        return self._types["hpccd/msg/MeshVertices"](
            header=self.header(stamp, "world"),
            topology_version=0,
            step=step,
            vertices_f32=np.zeros(0, np.float32),
            vertices_f64=xyz.reshape(-1),
        )

    def cloud(self, stamp, xyz):
        fields = [self._types["sensor_msgs/msg/PointField"](name, 4 * k, 7, 1) for k, name in enumerate("xyz")]
        data = np.frombuffer(xyz.astype(np.float32).tobytes(), np.uint8)
        return self._types["sensor_msgs/msg/PointCloud2"](
            header=self.header(stamp, "hand"),
            height=1,
            width=len(xyz),
            fields=fields,
            is_bigendian=False,
            point_step=12,
            row_step=12 * len(xyz),
            data=data,
            is_dense=True,
        )

    def transform(self, parent, child, shift, stamp):
        turn = self._types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.6, 0.8)
        motion = self._types["geometry_msgs/msg/Transform"](self._types["geometry_msgs/msg/Vector3"](*shift), turn)
        return self._types["geometry_msgs/msg/TransformStamped"](self.header(stamp, parent), child, motion)


def _inputs(make):
    grid = np.array([[x, y, 0.0] for x in range(N) for y in range(N)]) / N
    quads = np.array([[a, a + 1, a + N, a + N + 1] for a in range(N * N - N) if a % N < N - 1])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [1, 3, 2]]])
    yield "/transforms_static", make.transform("world", "arm", (0.1, 0.2, 0.0), 0)
    yield "/transforms", make.transform("arm", "hand", (0.0, 0.0, 0.1), 0)
    yield "/transforms", make.transform("arm", "hand", (0.0, 0.0, -0.3), 10 * SECOND)
    yield "/meshes/cloth/topology", make.topology(faces, N * N)
    yield "/meshes/net/topology", make.topology(faces, N * N)
    for k in range(6):
        wave = 0.05 * np.sin(7.0 * grid[:, :1] + k) + 0.03 * np.cos(5.0 * grid[:, 1:2] * k)
        yield (
            "/meshes/cloth/vertices",
            make.vertices((k + 1) * SECOND, k, grid + [0, 0, 0.05 - 0.04 * k] + wave * [0, 0, 1]),
        )
        yield "/meshes/net/points", make.cloud((k + 1) * SECOND, grid * [1, -1, 1] - wave * [0, 0, 1])


def _results(path):
    """The results of a node as rosbags' messages: contacts and smallest distances of each step."""
    from hpccd.msg import ContactArray, DistanceArray

    store = typestore()
    make = Maker(store)

    def plain(message, **given):
        values = {
            name: np.array(value) if kind.startswith("sequence<") and "string" not in kind else value
            for name, kind in message.get_fields_and_field_types().items()
            for value in [getattr(message, name)]
        }
        return store.types[f"hpccd/msg/{type(message).__name__}"](**values | given)

    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        detector = StepDetector(setup.builder, setup.options("exact", "cpu", 1))
        for step in Replay(recording, setup, outputs=OUTPUTS, backend="cpu").steps():
            contacts = ContactArray(step=step.step, accuracy="exact", backend="cpu")
            contact_messages.fill_contacts(contacts, step.contacts, step.layout)
            result_fields.fill_separation(contacts, step.separation)
            distances = DistanceArray(step=step.step, accuracy="exact", backend="cpu")
            snapshot_messages.fill_distances(distances, detector.distances(step.end_frame), step.layout)
            header = make.header(step.end, "world")
            yield plain(contacts, header=header, start=make.time(step.start)), plain(distances, header=header)
