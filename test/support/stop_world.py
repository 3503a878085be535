# SPDX-License-Identifier: Apache-2.0
"""Random sequences of events for a node with `stop` and the processes around it, compared with a model of its promise.

The classes of the node run, from the callbacks of its subscriptions to the published `stop`; the test replaces
executor, detection thread, DDS and clocks. Meshes move along z above a table, far apart from each other.
"""

import math
from collections import deque

import numpy as np
from geometry_msgs.msg import PoseStamped, TransformStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool
from stop_promise import Promise

from hpccd_ros import client
from hpccd_ros.base.clocks import Clocks
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.middleware import fields, mesh_messages
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.configuration import Configuration
from hpccd_ros.node.input_subscription import hand_over
from hpccd_ros.node.stop_doubts import WatchedScene
from hpccd_ros.node.stop_state import StopState
from hpccd_ros.node.stream_detection import Subscriptions
from hpccd_ros.params import robot_parameters, scene_parameters
from hpccd_ros.robots.robot import Robot

TIMEOUT, DISTANCE, ERROR = 0.5, 0.25, 0.02
TICK = 0.05  # s between the frames
FACES = np.array([[0, 1, 2]])
CORNER = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 1]], float)
TABLE = np.array([[-500, -500, 0], [500, -500, 0], [0, 500, 0]], float)
ARM = """<robot name="arm"><link name="base"/><link name="tip"><collision><geometry><box size="0.1 0.1 0.1"/></geometry>
</collision></link><joint name="z" type="prismatic"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-9" upper="9"/></joint></robot>"""
PARAMETERS = {
    "meshes": ["hand", "tool", "cart", "table"],
    "mesh.tool.input": "pose",
    "mesh.cart.input": "tf",
    "mesh.cart.frame": "cart",
    "mesh.table.static": True,
    "robots": ["arm"],
    "robot.arm.joint_states": "joint_states",
    "robot.arm.pose": [60.0, 0.0, 0.05, 0.0, 0.0, 0.0, 1.0],
    "frame_id": "world",
    "stop_distance": DISTANCE,
    "stop_timeout": TIMEOUT,
    "clock_error": ERROR,
    "stamp_tolerance": 0.2,
    "max_rate": 0.0,
}
# Mesh -> topic that says where it is.
PLACES = {"hand": "vertices", "tool": "pose", "cart": "transforms", "arm/tip": "joint_states", "table": "vertices"}
MOVING = {"hand": "frame", "tool": "frame", "cart": "between", "arm/tip": "between"}
SHAPED = {"tool": 20.0, "cart": 0.0}  # where its corner stands, along x
DEPTHS = {"joint_states": 100, "transforms": 100}


class World:
    """node: a plain one with PARAMETERS that is not spun. ``false``, ``allowed``: number of looks at which stop was
    false, and at which it might have been."""

    def __init__(self, node, configuration: Configuration, rng):
        self.rng, self.now, self.stamp = rng, 1000.0, 0
        self.offset = 0.0  # of the node's system clock
        self.ahead = dict.fromkeys(PLACES, 0.0)  # of the publishers' clocks
        self.alive = dict.fromkeys(PLACES, True)
        self.numbers = {}
        self.inbox = {}
        self.held = self.listener_held = self.busy = 0  # ticks left; busy: only the executor
        # Ticks by which the stamps of messages that move the hand's followers are ahead of it.
        self.lead = {mesh: int(rng.choice([0, 0, 0, 3, 8])) for mesh, kind in MOVING.items() if kind == "between"}
        self.versions = dict.fromkeys(("hand", "tool", "cart", "table"), 0)
        self.promise = Promise(MOVING, ["table"], TIMEOUT, DISTANCE, ERROR)
        self.false = self.allowed = self.looks = self.read = 0
        self.words = deque(maxlen=10)
        self.last_word = None
        clocks = Clocks(lambda: self.now, self.system)
        self.settings, self.meshes = configuration.settings, configuration.meshes
        self.options = configuration.options
        self.robot = Robot.of(ARM, name="arm")
        self.state = StopState(DISTANCE, TIMEOUT, clock_error=ERROR, clocks=clocks)
        self.state.next(0.0)
        self.accounts = Accounts(lambda text: None)
        self.accounts.on_rejected = self.state.rejected
        self.accounts.on_received = lambda kind, name, info: self.state.received(f"{kind} of {name}", name, info)
        self.subscriptions = Subscriptions(node, self.settings, self.meshes)
        self.node, self.clocks = node, clocks
        self.listener = self.listening()
        self.make()
        self.subscriptions.open(self.pipeline, self.by_joints, self.accounts)
        self.start()
        for mesh in self.versions:
            self.topology(mesh)
        self.shape("tool"), self.shape("cart"), self.table()

    def listening(self):
        made = client.StopListener(self.node, "stop", TIMEOUT, clock_error=ERROR)
        made._clocks, made._begun = self.clocks, self.system()
        return made

    def close(self):
        self.subscriptions.close()
        self.listener.close()

    def system(self):
        return round(1e9 * (self.now + self.offset))

    # The work of the node around its classes.

    def make(self):
        robots = {"arm": self.robot}
        self.builder = scene_parameters.scene_builder(self.settings, self.meshes, robots)
        self.by_joints = robot_parameters.followers(self.settings, robots, self.settings["pending_frames"])
        self.pipeline = scene_parameters.frame_pipeline(
            self.settings, self.meshes, self.settings["pending_frames"], robots, self.by_joints.values()
        )
        links = robot_parameters.links(robots)
        self.scene = WatchedScene.of(self.builder, self.settings, links)

    def start(self):
        self.queue, self.begun_with = self.pipeline.start(1), None
        self.nearness = Nearness(self.builder, self.options, DISTANCE)
        self.state.begin(self.scene)
        self.promise.last = None

    def detect(self):
        """The work of the detection thread on queued frames."""
        while self.queue.frames():
            item = self.queue.pop()
            if item.first:
                self.state.first()
            else:
                near, distance = self.nearness.within(self.begun_with, item.frame)
                self.state.answered(near, distance, item.frame.origins)
                self.promise.last = self.heights(self.begun_with), self.heights(item.frame), item.frame.stamp
            self.begun_with = item.frame

    def heights(self, frame):
        return dict(zip(self.scene.meshes, (xyz[:, 2].min() for xyz in frame.vertices), strict=True))

    def spin(self):
        """Take queued messages, topics in random order."""
        while waiting := [topic for topic, messages in self.inbox.items() if messages]:
            topic = waiting[self.rng.integers(len(waiting))]
            callback, message, info, taken = self.inbox[topic].popleft()
            mesh, what, sent, stamp, height, new_version = taken
            self.promise.take(mesh, what, sent, stamp, height)
            if new_version is not None:
                places = self.promise.taken[mesh, "place"]
                places[:] = [place for place in places if place.stamp == new_version]
            if 1e-9 * (info["source_timestamp"] - min(info["received_timestamp"], self.system())) > ERROR + 1e-6:
                self.promise.clocks = self.now
            callback(message, info)
            if self.rng.random() < 0.9:
                self.detect()

    def say(self):
        why = self.state.next(0.0)
        self.looks += 1
        broken = self.promise.broken(self.now)
        assert why is not None or not broken, f"stop is false, but {broken}, at {self.now:.2f} s"
        self.allowed += not broken
        self.false += why is None
        self.last_word = Bool(data=why is not None), self.system(), self.now
        self.words.append(self.last_word)

    def listen(self):
        if not self.listener_held:
            while self.words:
                word, sent, _ = self.words.popleft()
                self.listener._on_message(word, {"source_timestamp": sent, "received_timestamp": sent})
        if not self.listener.stop:
            word, _, said = self.last_word
            late = self.now - said > TIMEOUT + ERROR
            assert not late, f"the listener reads false, of a word that was said {self.now - said:.2f} s before"
            assert self.listener_held or not word.data, "the listener reads false, and true was said"
            self.read += 1

    # Publishers.

    def send(self, topic, mesh, message, what, height, stamp=0, new_version=None):
        """new_version: of a topology of the table, which makes positions of others void; their stamps are versions."""
        if not self.promise.active:
            return
        number = self.numbers[topic] = self.numbers.get(topic, 0) + 1
        sent = self.system() + round(1e9 * self.ahead.get(mesh, 0.0))
        info = {
            "source_timestamp": sent,
            "received_timestamp": self.system(),
            "publication_sequence_number": number,
            "reception_sequence_number": None,
        }
        queue = self.inbox.setdefault(topic, deque(maxlen=DEPTHS.get(topic, 10)))
        queue.append((self.callback(topic), message, info, (mesh, what, self.now, stamp, height, new_version)))

    def callback(self, topic):
        mesh, _, kind = topic.rpartition("/")
        for part in (*self.subscriptions._of_meshes, *self.subscriptions._of_others):
            if mesh and getattr(part, "_reception", None) is not None and part._reception.mesh == mesh:
                return next(found.receive for found in part.topics if found.kind == kind)
            for subscription in getattr(part, "_subscriptions", ()):
                if not mesh and subscription.topic.endswith(f"/{topic}"):
                    return subscription.subscription.callback
        raise LookupError(topic)

    def topology(self, mesh, bad=False):
        faces = FACES + 9 if bad else FACES
        message = mesh_messages.topology_message(faces, 3, version=self.versions[mesh] + bad)
        new_version = self.versions[mesh] if mesh == "table" and not bad else None
        height = math.nan if bad else 0.0
        self.send(f"{mesh}/topology", mesh, message, "topology", height, new_version=new_version)

    def shape(self, mesh, bad=False):
        scale = math.nan if bad else 1.0
        corners = CORNER * scale * self.rng.choice([0.5, 1.0]) + [SHAPED[mesh], 0, 0]
        message = mesh_messages.vertices_message(corners, 1, topology_version=self.versions[mesh])
        self.send(f"{mesh}/vertices", mesh, message, "shape", scale)

    def table(self, bad=False):
        height = float(self.rng.choice([0.0, -0.5, -1.0]) + 1e-6 * self.rng.random())
        places = TABLE + [0, 0, height]
        if bad:
            places = [places * math.nan, places[:2]][self.rng.integers(2)]
        fields_of = dict(frame_id="world", topology_version=self.versions["table"])
        message = mesh_messages.vertices_message(places, 1, **fields_of)
        version = self.versions["table"]
        self.send("table/vertices", "table", message, "place", math.nan if bad else height, stamp=version)

    def place(self, mesh, bad=False):
        """A message with the position of a moving mesh; its kinds are the names of what can be wrong with it."""
        height = float(self.rng.uniform(-0.2, 0.2) if self.rng.random() < 0.01 else self.rng.uniform(0.3, 3.0))
        stamp_ns = self.stamp + round(1e9 * TICK) * self.lead.get(mesh, 0)
        at, stamp = math.nan if bad else height, fields.ns_to_stamp(stamp_ns)
        topic, known = PLACES[mesh], math.nan if bad else height
        if mesh == "hand":
            corners = CORNER + [0, 0, at]
            if bad and self.rng.random() < 0.5:
                corners = CORNER[:2] + [0, 0, height]
            message = mesh_messages.vertices_message(
                corners, self.stamp, frame_id="world", topology_version=self.versions[mesh]
            )
            topic = "hand/vertices"
        elif mesh == "tool":
            message, topic = PoseStamped(), "tool/pose"
            message.header.stamp, message.header.frame_id = stamp, "world"
            message.pose.position.z, message.pose.orientation.w = at, 1.0
        elif mesh == "cart":
            message = TransformStamped(child_frame_id="cart")
            message.header.stamp, message.header.frame_id = stamp, "world"
            message.transform.translation.x, message.transform.translation.z = 40.0, at
            message.transform.rotation.w = 1.0
        else:
            twice = bad and self.rng.random() < 0.5
            message = JointState(name=["z"] * (1 + twice), position=[height if twice else at] * (1 + twice))
            message.header.stamp = stamp
        self.send(topic, mesh, message, "place", known, stamp_ns)

    # Events.

    def tick(self, ticks=1):
        for _ in range(ticks):
            self.now += TICK
            self.stamp += round(1e9 * TICK)
            for mesh in self.rng.permutation(list(MOVING)):
                if self.alive[mesh]:
                    self.place(mesh, bad=self.rng.random() < 0.002)
            self.held, self.listener_held = max(self.held - 1, 0), max(self.listener_held - 1, 0)
            self.busy = max(self.busy - 1, 0)
            if not self.held and not self.busy and self.promise.active:
                self.spin()
                self.detect()
            if not self.held:
                self.say()
            self.listen()

    def pass_silently(self):
        """All publishers are silent."""
        self.now += self.rng.uniform(0.1, 1.5) * TIMEOUT
        if not self.held:
            self.say()
        self.listen()

    def hold(self):
        self.held = int(self.rng.integers(2, 40))

    def keep_busy(self):
        """The executor takes nothing for a while, in which all publishers may end."""
        self.busy = int(self.rng.integers(4, 14))
        if self.rng.random() < 0.5:
            self.tick(self.busy // 2)
            self.alive = dict.fromkeys(self.alive, False)

    def hold_listener(self):
        self.listener_held = int(self.rng.integers(2, 40))

    def late_listener(self):
        """A new listener receives the latched message."""
        self.listener.close()
        self.listener = self.listening()
        self.words = deque([self.last_word] if self.last_word else [], maxlen=10)

    def die(self):
        self.alive[self.any(MOVING)] = False

    def revive(self):
        self.alive = dict.fromkeys(self.alive, True)

    def reject(self):
        self.rng.choice(
            [
                lambda: self.table(bad=True),
                lambda: self.place(self.any(MOVING), bad=True),
                lambda: self.shape(self.any(SHAPED), bad=True),
                lambda: self.topology(self.any(self.versions), bad=True),
            ]
        )()

    def resend(self):
        """All inputs are sent again, valid."""
        for mesh in self.versions:
            self.topology(mesh)
        self.shape("tool"), self.shape("cart"), self.table()

    def move_table(self):
        self.table()

    def refine(self):
        """A new topology; positions of the table follow at once, later, or never."""
        mesh = self.any(self.versions)
        self.versions[mesh] += 1
        self.topology(mesh)
        if mesh in SHAPED and self.rng.random() < 0.8:
            self.shape(mesh)
        if mesh == "table" and self.rng.random() < 0.5:
            self.table()

    def restart(self):
        """The simulation begins again, with new publishers."""
        self.stamp = 0
        self.numbers = {topic: 0 for topic in self.numbers}
        self.promise.taken = type(self.promise.taken)(
            list,
            {
                (mesh, what): [taken._replace(stamp=-1) if mesh in MOVING else taken for taken in messages]
                for (mesh, what), messages in self.promise.taken.items()
            },
        )

    def jump(self):
        before, self.offset = self.offset, float(self.rng.choice([0.0, 0.0, 0.4, -0.4, 3600.0]))
        if before != self.offset:
            self.promise.clocks = self.now

    def differ(self):
        self.ahead = dict.fromkeys(self.ahead, 0.0)
        self.ahead[self.any(PLACES)] = float(self.rng.choice([0.019, 0.015, 0.3, -0.3]))

    def describe(self):
        """A description is rejected; later a valid one arrives."""
        bad = self.rng.random() < 0.5
        self.promise.take("arm", "description", self.now, 0, math.nan if bad else 0.0)
        self.state.robots({"arm": "its description was rejected"} if bad else {})

    def remake(self):
        """Another description of the robot arrives: the scene is built again."""
        self.promise.take("arm", "description", self.now, 0, 0.0)
        self.state.robots({})
        self.state.end()
        before = self.pipeline
        self.make()
        inherited = self.pipeline.inherit(before, self.meshes)
        self.accounts.add(before.stop())
        self.start()
        self.subscriptions.use(self.pipeline, self.by_joints)
        for outcome in (inherited, *self.pipeline.retry()):
            hand_over(outcome, self.pipeline, self.accounts)

    def switch(self):
        """Deactivated, or active again."""
        self.promise.active = not self.promise.active
        if self.promise.active:
            self.start()
            return
        self.state.end()
        self.inbox.clear()
        self.accounts.add(self.pipeline.stop())

    def fail(self):
        self.state.rejected(Rejection("hand", Reason.DETECTION_FAILED))

    def any(self, names):
        return self.rng.choice(list(names))

    EVENTS = {
        "tick": 30,
        "pass_silently": 1,
        "hold": 1,
        "keep_busy": 1,
        "hold_listener": 1,
        "late_listener": 0.5,
        "die": 0.7,
        "revive": 4,
        "reject": 1.5,
        "refine": 0.5,
        "resend": 6,
        "move_table": 1,
        "restart": 0.5,
        "jump": 0.4,
        "differ": 0.4,
        "describe": 0.4,
        "remake": 0.3,
        "switch": 0.4,
        "fail": 0.5,
    }

    def step(self):
        """One event, then time passes."""
        names, weights = list(self.EVENTS), np.array(list(self.EVENTS.values()))
        event = self.rng.choice(names, p=weights / weights.sum())
        getattr(self, event)()
        if not self.promise.active and self.rng.random() < 0.3:
            self.switch()
        if event != "tick":
            self.tick(int(self.rng.integers(1, 4)))
        return event
