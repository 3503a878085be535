# SPDX-License-Identifier: Apache-2.0
"""Messages as CDR bytes: deserialised, checked, and assembled to frames as in the node, without DDS."""

import functools
import struct
from random import Random

import numpy as np
from hpccd.srv import Detect
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from hpccd_ros.bag.reader import RecordedMessage, Recording, RecordingError
from hpccd_ros.detect.core import Cancellation, Options, unusable_topology
from hpccd_ros.detect.kept_detectors import KeptDetectors
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.types import MeshSettings, Topology
from hpccd_ros.middleware import mesh_inputs, robot_files, topic_names
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.node import detect_request
from hpccd_ros.node.detect_query import RequestError
from hpccd_ros.node.joint_state_watch import JointStateWatch
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.frames import FrameSource
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.geometry import no_files

from . import scene
from .cdr_mutations import with_number
from .mutations import Mutate
from .target import LONGEST_MESSAGE, Fault, Target, file_of

_ROLES = list(scene.ROLES)
_HEAD = struct.Struct("<BH")  # number of the role, bytes of the message
_MOST = 64  # messages of one input
_LIMITS = {"max_meshes": 8, "max_vertices": 64, "max_faces": 64, "max_edges": 64, "max_contacts": 50}


def _joined(stream) -> bytes:
    return b"".join(_HEAD.pack(number % 256, len(data)) + data for number, data in stream)


def _split(data: bytes) -> list[tuple[int, bytes]]:
    found, at = [], 0
    while at + _HEAD.size <= len(data) and len(found) < _MOST:
        number, length = _HEAD.unpack_from(data, at)
        at += _HEAD.size
        found.append((number, data[at : at + length]))
        at += length
    return found


@functools.cache
def _valid() -> list[tuple[int, bytes]]:
    return [(_ROLES.index(role), data) for role, data in scene.messages() if role != "robot_description"]


@functools.cache
def _setup(part: int):
    """(setup of a replay, its topics) for one of scene.PARTS."""
    names = scene.PARTS[part]
    bag = scene.recording(scene.parameters(names), scene.roles(names), scene.messages(names))
    with Recording(file_of(bag.bytes(), "scene.mcap")) as recording:
        return recorded_setup.of_recording(recording), recording.topics


class _Source(FrameSource):
    """Checks texts of rejections, which the node logs."""

    def _counted(self, outcome):
        for rejection in outcome.rejections:
            if not rejection.text.isprintable() or len(rejection.text) > LONGEST_MESSAGE:
                raise Fault(f"the text of a rejection is {rejection.text[:500]!r}")
        return super()._counted(outcome)


def _read_stream(data: bytes) -> None:
    """data: the number of the scene, then for each message the number of its role, its length and its bytes."""
    setup, topics = _setup(data[0] % len(scene.PARTS) if data else 0)
    source = _Source(setup, topics)
    watch = JointStateWatch("joint_states")
    watch.use([{joint.name: joint for joint in robot.description.joints} for robot in setup.robots.values()])
    for at, (number, payload) in enumerate(_split(data[1:])):
        if number >= len(_ROLES):
            _check(source.happen(*_EVENTS[number % len(_EVENTS)]))
        elif scene.topic(role := _ROLES[number]) in source.topics:
            if role == "joint_states":
                _watch(watch, payload)
            try:
                frames = source.push(RecordedMessage(scene.topic(role), 0, scene.sent(at), 1 + at, payload))
            except RecordingError:  # it cannot be deserialised; the node counts it
                continue
            _check(frames)


def _watch(watch: JointStateWatch, payload: bytes) -> None:
    try:
        state = deserialize_message(payload, JointState)
    except (RuntimeError, MemoryError):  # rclpy's
        return
    stamp = state.header.stamp
    watch.receive(stamp.sec * 10**9 + stamp.nanosec, state.name, state.position)
    watch.warnings()


_EVENTS = ((taken_inputs.STOPPED, 0), (taken_inputs.RESTART_AFTER, 2))


def _check(frames) -> None:
    """Whatever completes a frame of the scene fits together."""
    for frame in frames:
        for topology, vertices in zip(frame.topologies, frame.vertices, strict=True):
            if vertices.shape != (topology.n_vertices, 3) or not np.isfinite(vertices).all():
                raise Fault(f"a frame has vertices of shape {vertices.shape} for {topology.n_vertices}, or not finite")
            if len(topology.faces) and topology.faces.max() >= topology.n_vertices:
                raise Fault("a frame has faces beyond its vertices")


def _mutate_stream(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    if rng.random() < 0.02 or not data:
        return bytes([rng.randrange(len(scene.PARTS))]) + data[1:]
    stream = _split(data[1:]) or list(_valid())
    at = rng.randrange(len(stream))
    number, payload = stream[at]
    match rng.choice(("bytes", "bytes", "number", "number", "topic", "repeat", "drop", "swap", "insert")):
        case "bytes":
            stream[at] = number, mutate(payload, len(payload) + 64)
        case "number":
            stream[at] = number, with_number(rng, payload)
        case "topic":
            stream[at] = rng.randrange(len(_ROLES) + 2), payload
        case "repeat":
            stream.insert(rng.randrange(len(stream) + 1), stream[at])
        case "drop":
            del stream[at]
        case "swap":
            other = rng.randrange(len(stream))
            stream[at], stream[other] = stream[other], stream[at]
        case _:
            stream.insert(at, rng.choice(_valid()))
    return data[:1] + _joined((number, payload[:65535]) for number, payload in stream[:_MOST])


_KINDS = {
    kind: _ROLES.index(f"meshes/{mesh}/{kind}")
    for kind, mesh in (
        ("topology", "cloth"),
        ("vertices", "cloth"),
        ("points", "net"),
        ("shape", "tool"),
        ("marker", "flag"),
        ("pose", "hand"),
    )
}


def _read_one(data: bytes) -> None:
    """data: a number of _KINDS, then a message."""
    kind = list(_KINDS)[data[0] % len(_KINDS)] if data else "topology"
    message = data[1:]
    if kind not in topic_names.WHOLE:
        try:
            message = deserialize_message(message, mesh_inputs.TYPES[kind])
        except (RuntimeError, MemoryError):  # rclpy's
            return
    found = mesh_inputs.read(kind, message, _LIMITS, sent=1)
    for topology in (found, getattr(found, "topology", None)):
        if isinstance(topology, Topology):
            if len(topology.faces) and topology.faces.max() >= topology.n_vertices:
                raise Fault("a topology has faces beyond its vertices")
            unusable_topology(topology)
    if kind not in ("topology", "pose") and not np.isfinite(found.vertices).all():
        raise Fault("vertices are not finite")


def _ones() -> list[bytes]:
    valid = dict(reversed(_valid()))
    return [bytes([number]) + valid[role] for number, role in enumerate(_KINDS.values())]


def _mutate_one(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    if rng.random() < 0.5:
        return data[:1] + with_number(rng, data[1:])
    return data[:1] + mutate(data[1:], len(data) + 64)


_BUILDER = SceneBuilder((MeshSettings("cloth"), MeshSettings("net")))
_SCENE = detect_request.NodeScene(
    _BUILDER, {"cloth": Topology(0, 4, np.array([[0, 1, 2], [1, 3, 2]], np.uint32)), "net": None}
)


def _requests() -> list[bytes]:
    def request(**fields):
        plain = {
            "mesh_names": ["cloth", "net"],
            "topologies": [scene.topology(), scene.topology()],
            "start": [scene.vertices(0, 0), scene.vertices(0, 0, scene.CORNERS + [0.1, 0.2, 0.3])],
            "end": [scene.vertices(1, 1), scene.vertices(1, 1, scene.CORNERS - [0.1, 0.2, 0.3], np.float64)],
            "accuracy": "",
            "report": "",
            "time_limit": 0.0,
            "query": "",
            "minimum_separation": np.zeros(0),
            "distance": np.zeros(0),
            "features": [],
        }
        return scene.encoded(scene.REQUEST, scene.made(scene.REQUEST, **plain | fields))

    own = {"mesh_names": ["cloth"], "topologies": [], "start": [scene.vertices(0, 0)], "end": [scene.vertices(1, 1)]}
    queries = [{"query": query} for query in ("intersections", "distances", "collision_free_step")]
    return [
        request(),
        request(**own, accuracy="conservative", report="first"),
        request(query="proximity", distance=np.array([0.1]), features=["vertex_face"]),
        request(minimum_separation=np.array([0.01])),
        *map(lambda query: request(**query), queries),
    ]


def _read_request(data: bytes) -> None:
    try:
        request = deserialize_message(data, Detect.Request)
    except (RuntimeError, MemoryError):
        return
    options = Options(backend="cpu", threads=1, outputs=("points", "normals"))
    detect_request.compute(request, _SCENE, options, _LIMITS, KeptDetectors(0), Cancellation())


def _mutate_text(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    """The length of the text fits mostly."""
    changed = mutate(data, len(data) + 64)
    return changed[:4] + struct.pack("<I", max(0, len(changed) - 8)) + changed[8:] if rng.random() < 0.9 else changed


def _mutate_request(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    return with_number(rng, data) if rng.random() < 0.5 else mutate(data, len(data) + 64)


_WORDS = (
    b"contacts",
    b"proximity",
    b"distances",
    b"exact",
    b"first",
    b"edge_edge",
    b"cloth",
    b"\0\0\x7f\xff",
    b"\0\1\0\0",
)


def _streams() -> list[bytes]:
    return [
        bytes([number])
        + _joined((_ROLES.index(role), data) for role, data in scene.messages(part, 2) if role != "robot_description")
        for number, part in enumerate(scene.PARTS)
    ]


def _read_description(data: bytes) -> None:
    try:
        text = deserialize_message(data, String).data
    except (RuntimeError, MemoryError):  # rclpy's
        return
    robot_files.robot_of("arm", scene.robot_values(), text, None, no_files)


TARGETS = {
    "stream": Target(_read_stream, _streams, (), _mutate_stream, largest=1200, words=_WORDS),
    "one": Target(_read_one, _ones, (InvalidMessageError,), _mutate_one, largest=600),
    "description": Target(
        _read_description, lambda: [dict(scene.messages())["robot_description"]], (RobotError,), _mutate_text
    ),
    "request": Target(
        _read_request, _requests, (RequestError, ValueError), _mutate_request, largest=2000, words=_WORDS
    ),
}
