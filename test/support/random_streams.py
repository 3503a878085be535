# SPDX-License-Identifier: Apache-2.0
"""Random streams to a node that records itself. Results depend on the order of messages of several topics: shapes and
static meshes sent again, a base moved by transforms besides joint states, restarts with equal stamps."""

import random

import crane
import numpy as np
from geometry_msgs.msg import PoseStamped, TransformStamped
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import fields, qos
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N = 4
FACES = sheet_faces(N)
FIRST, TICK = 10**10, 20 * 10**6  # ns
QUAD = np.array([[0, 1, 2], [1, 3, 2]])
SQUARE = np.array([[-0.4, -0.4, 0.0], [0.4, -0.4, 0.0], [-0.4, 0.4, 0.0], [0.4, 0.4, 0.0]])
SCENES = (("cloth", "tool", "table"), ("table", "crane"), ("cloth", "tool", "table", "crane"))
MOST_BURST = 30  # messages of a topic that the recording holds at once are bounded


def parameters(rng: random.Random, scene, record) -> dict:
    meshes = {"tool": {"input": "pose"}, "table": {"static": True}}
    found = {
        "meshes": [name for name in scene if name != "crane"],
        "mesh": {k: v for k, v in meshes.items() if k in scene},
        "frame_id": "world",
        "minimum_separation": 0.05,
        "rigid_tolerance": 0.02,
        "frame_queue": 1000,
        "input_depth": 200,
        "restart_after": rng.choice((1, 2, 5)),
        "distances": rng.random() < 0.5,
        "record": str(record),
        "record_compression": rng.choice(("none", "zstd")),
        "max_contacts": 50,
    }
    if "crane" in scene:
        found |= {
            "robots": ["crane"],
            "robot": {"crane": {"description": "robot_description", "joint_states": "joint_states"}},
        }
    return found


class RandomStream:
    """A node with a random scene of this seed. ``recordings``: paths so far; `record` adds one."""

    def __init__(self, start_node, folder, seed: int) -> None:
        self._rng = rng = random.Random(seed)
        self._folder, self._seed = folder, seed
        self._scene = SCENES[seed % len(SCENES)]
        self.recordings = [folder / f"{seed}-0.mcap"]
        self._node = start_node(parameters(rng, self._scene, self.recordings[0]))
        self._peer = self._node.peer
        self._sent = self._version = self._k = 0
        self._open()

    def record(self, ticks: int) -> None:
        """Send this number of ticks of the stream, into the current recording."""
        for tick in range(ticks):
            if self._rng.random() < 0.03 or self._k >= 70:
                self._k = self._rng.choice((0, 0, max(0, self._k - 20)))  # a restart; by more and less than a second
            self._tick()
            self._spin(self._rng.choice((0.0, 0.0, 0.002, 0.01)))
            if tick % MOST_BURST == MOST_BURST - 1:
                self._spin(0.3)
            if self._rng.random() < 0.02:
                name, values = self._rng.choice(
                    (
                        ("restart_after", (1, 3, 5)),
                        ("report", ("all", "first", "any")),
                        ("minimum_separation", (0.02, 0.05)),
                        ("accuracy", ("exact", "balanced")),
                    )
                )
                assert set_parameter(self._node, name, self._rng.choice(values)).successful
        results = -1
        while results != len(self._peer.received):  # those that wait for detection belong to this recording
            results = len(self._peer.received)
            self._spin(0.7)

    def next_recording(self) -> None:
        """In the middle of the stream, or after the node was inactive."""
        self.recordings.append(self._folder / f"{self._seed}-{len(self.recordings)}.mcap")
        assert set_parameter(self._node, "record", "").successful
        if again := self._rng.random() < 0.5:
            assert change_state(self._node, Transition.TRANSITION_DEACTIVATE)
        assert set_parameter(self._node, "record", str(self.recordings[-1])).successful
        if again:
            assert change_state(self._node, Transition.TRANSITION_ACTIVATE)
        for topic in self._topics:
            self._peer.await_readers(topic)
        self._spin(0.3)

    def end(self) -> None:
        assert self._node.stop() == 0, self._node.output()

    def _open(self) -> None:
        """Publishers with readers, so that the first messages reach node and recording."""
        peer, scene = self._peer, self._scene
        self._topics = []
        for name in scene:
            if name == "crane":
                if self._rng.random() < 0.5:
                    self._describe()
                peer.publisher(JointState, "joint_states")
                peer.publisher(TransformStamped, "transforms", qos.TRANSFORMS)
                self._topics += ["joint_states", "transforms"]
                continue
            faces, count = (FACES, N * N) if name == "cloth" else (QUAD, 4)
            peer.topology(name, faces, count)
            if name == "tool":
                peer.publisher(PoseStamped, "meshes/tool/pose")
                self._topics.append("meshes/tool/pose")
            self._send(name)
            self._topics.append(f"meshes/{name}/vertices")
        for name in ("tool", "table"):
            if name in scene:
                self._send(name)
        self._spin(0.2)
        if "crane" in scene and "robot_description" not in peer._publishers:
            for _ in range(5):
                self._tick()
            self._describe()

    def _describe(self) -> None:
        self._peer.publisher(String, "robot_description", qos.DESCRIPTION).publish(String(data=crane.URDF))

    def _spin(self, seconds: float) -> None:
        end = self._peer.node.get_clock().now().nanoseconds + seconds * 1e9
        self._peer.executor.spin_once(timeout_sec=0)
        while self._peer.node.get_clock().now().nanoseconds < end:
            self._peer.executor.spin_once(timeout_sec=0.005)

    def _tick(self) -> None:
        """Random messages between two frames, in any order."""
        self._k += 1
        often = {"cloth": 0.95, "pose": 0.95, "tool": 0.4, "table": 0.3, "joints": 0.9, "base": 0.7, "topology": 0.03}
        kinds = [kind for kind, share in often.items() if self._rng.random() < share]
        self._rng.shuffle(kinds)
        of = {"pose": "tool", "joints": "crane", "base": "crane", "topology": "cloth"}
        for kind in kinds:
            if of.get(kind, kind) in self._scene:
                self._send(kind)

    def _send(self, kind: str) -> None:
        self._sent += 1
        n, peer, stamp = self._sent, self._peer, FIRST + self._k * TICK
        if kind == "cloth":
            peer.vertices("cloth", sheet_positions(N, n), stamp, topology_version=self._version, frame_id="world")
        elif kind == "topology":
            self._version += 1
            peer.topology("cloth", np.roll(FACES, self._version, axis=0), N * N, version=self._version)
        elif kind in ("tool", "table"):
            height = 0.02 * np.sin(n) + 0.05 * (kind == "table")
            peer.vertices(kind, SQUARE * (1 + 0.1 * np.cos(n)) + (0.2, 0.3, height), stamp, frame_id="world")
        elif kind == "joints":
            joints = peer.publisher(JointState, "joint_states")
            joints.publish(crane.joint_state(n, stamp + TICK // 3))
        else:
            message = TransformStamped(child_frame_id=crane.ROOT) if kind == "base" else PoseStamped()
            message.header.stamp, message.header.frame_id = fields.ns_to_stamp(stamp), "world"
            place, turn = (
                (message.transform.translation, message.transform.rotation)
                if kind == "base"
                else (message.pose.position, message.pose.orientation)
            )
            place.x, place.y, place.z = 0.1 * np.sin(n), 0.1 * np.cos(n), 0.02 * np.sin(2 * n)
            turn.z, turn.w = np.sin(0.1 * n), np.cos(0.1 * n)
            topic = "transforms" if kind == "base" else "meshes/tool/pose"
            peer.publisher(type(message), topic).publish(message)


def verified(path) -> int:
    """The number of verified results of a recording; fails if one is not verified."""
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    bad = [
        f"{step.step}: {step.difference or step.missing}"
        for step in steps
        if step.difference or (step.missing and not step.before_recording)
    ]
    assert not bad and not replay.diverged and not replay.unverified, f"{path}: {len(bad)} of {len(steps)}: {bad[:3]}"
    told = replay.distances
    assert not told.diverged and not told.unverified, f"{path}: {told.first}"
    return replay.verified
