# SPDX-License-Identifier: Apache-2.0
"""Makes frames of the scene from recorded messages, with the node's rules."""

from collections import OrderedDict, deque

from hpccd_ros.bag.decode import checked_type, make_decoder
from hpccd_ros.base.quoting import quoted
from hpccd_ros.frames import taken_inputs
from hpccd_ros.frames.arrivals import SequenceWatch
from hpccd_ros.frames.drops import Input, RejectionCounter
from hpccd_ros.frames.taken_inputs import NEW_PUBLISHER, SEVERAL_PUBLISHERS
from hpccd_ros.frames.types import Outcome, SceneFrame
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import joint_messages, mesh_inputs, topic_names, transform_topics
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.params import robot_parameters, scene_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.replay.recorded_setup import ReplaySetup

# Frames for which a result waits that was written before its own; far fewer than in the window, which must still
# contain the frames of later results.
PATIENCE = 16


class FrameSource:
    """Pushes recorded messages into a pipeline like that of the node.

    ordered: they arrive in the order in which the node took them. rejected: rejected messages, by reason, counted as in
    the node; transforms by topic.
    """

    def __init__(self, setup: ReplaySetup, topics, ordered: bool = False):
        self._setup = setup
        self._settings = setup.settings
        # Otherwise the order of messages across topics may differ between recorder and node.
        self._patience = 1 if ordered else 4
        self.rejected = {what: RejectionCounter() for what in Input}
        self._decoders = {
            name: _checked_bytes(topics[name]) if kind in topic_names.WHOLE else make_decoder(topics[name])
            for name, (_, kind) in setup.roles.items()
            if name in topics
        }
        self.restart(all_known=True)

    @property
    def topics(self) -> list[str]:
        return list(self._decoders)

    def listed_name(self, topic: str) -> str:
        """The name of a recorded topic in the lists of results."""
        mesh, kind = self._setup.roles[topic]
        return topic_names.of_mesh(mesh, kind) if mesh else kind

    def restart(self, all_known: bool) -> None:
        """Reset to the state of a node that was just configured. all_known: descriptions of its robots are known."""
        setup, self._settings = self._setup, self._setup.settings
        described = robot_parameters.topics(setup.settings[ROBOT])
        self._make([name for name in setup.robots if all_known or name not in described])
        for mesh, (topology, positions) in setup.files.items():
            self._pipeline.load(mesh, topology, positions)
        self._listen()

    def push(self, message, flags: int | None = None) -> list[SceneFrame]:
        """Frames that this recorded message completes. flags: those in the node's list; None: there is no list."""
        mesh, kind = self._setup.roles[message.topic]
        decoded = self._decoders[message.topic](message)
        if kind in transform_topics.ALL:
            topic = transform_topics.ALL[kind]
            outcome = self._retried(transform_topics.fill(self._pipeline.transforms, decoded, topic))
        elif not mesh and kind in self._by_joints:
            if (kept := joint_messages.kept(decoded)) is not None:
                self._recent[kind].append(kept)
            outcome = self._retried(joint_messages.fill(self._by_joints[kind], decoded, kind))
        else:
            outcome = self._push_mesh(mesh, kind, decoded, message, flags)
        return self._counted(outcome)

    def happen(self, event: str, value: int) -> list[SceneFrame]:
        """Apply an event listed by a result; returns frames that it completes. Raises ValueError if it is unknown."""
        outcome = Outcome()
        if event == taken_inputs.STOPPED:
            outcome = self._pipeline.stop()
            self._listen()
        elif event == taken_inputs.RESTART_AFTER:
            self._settings = {**self._settings, "restart_after": value}
            self._pipeline.set_restart_after(value)
        elif (names := taken_inputs.known_robots(event)) is not None and set(names) <= set(self._setup.robots):
            outcome = self._set_robots(names)
        else:
            raise ValueError(f"it lists the event {quoted(event)}, which does not belong to this recording")
        return self._counted(outcome)

    def _make(self, known: list[str]) -> None:
        """A pipeline with these robots."""
        settings, robots = self._settings, {name: self._setup.robots[name] for name in known}
        pending = self._patience * settings["pending_frames"]
        by_joints = robot_parameters.followers(settings, robots, pending)
        self._pipeline = scene_parameters.frame_pipeline(
            settings, self._setup.meshes, pending, robots, by_joints.values()
        )
        self._by_joints = {
            topic: [by_joints[robot] for robot in moved if robot in by_joints]
            for topic, moved in robot_parameters.joint_topics(settings[ROBOT]).items()
        }

    def _listen(self) -> None:
        """Reset the state of the node's subscriptions, which are made when it is activated."""
        self._watches = {name: SequenceWatch() for name in self._setup.roles}
        self._weldings = {name: Welding() for name in self._setup.roles}
        self._recent = {topic: deque(maxlen=joint_messages.MOST_RECENT) for topic in self._by_joints}

    def _set_robots(self, names: list[str]) -> Outcome:
        """Apply a received description like StreamDetection.remake."""
        before = self._pipeline
        self._make(names)
        outcome = self._pipeline.inherit(before, self._setup.meshes)
        for topic, moved in self._by_joints.items():
            for message in self._recent[topic]:
                joint_messages.fill(moved, message, topic)
        outcome.rejections += before.stop().rejections
        outcome += self._retried([])
        return outcome

    def _counted(self, outcome: Outcome) -> list[SceneFrame]:
        for rejection in outcome.rejections:
            self.rejected[rejection.what].count(rejection)
        return outcome.frames

    def _push_mesh(self, mesh, kind, decoded, message, flags) -> Outcome:
        watch = self._watches[message.topic]
        # Sequence 0: the recorder did not know the publisher's numbers.
        new_publisher = bool(message.sequence) and watch.next(message.sequence)[1]
        several = bool((flags or 0) & SEVERAL_PUBLISHERS)
        try:
            checked = mesh_inputs.read(
                kind,
                decoded,
                self._settings,
                0.0,
                not several,
                sent=message.publish_time,
                welding=self._weldings[message.topic],
            )
        except InvalidMessageError as error:
            return Outcome(rejections=[error.rejection(mesh, mesh_inputs.INPUTS[kind])])
        if kind != "topology":
            new_publisher = watch.notice()
        if flags is not None:
            new_publisher = bool(flags & NEW_PUBLISHER)
        return self._pipeline.push(mesh, checked, new_publisher)

    def _retried(self, rejections) -> Outcome:
        outcome = Outcome(rejections=rejections)
        for part in self._pipeline.retry():
            outcome += part
        return outcome


class FrameWindow:
    """The last frames, by stamp: a result names the two frames of its step."""

    def __init__(self, capacity: int):
        self._capacity = capacity
        self._frames: OrderedDict[int, SceneFrame] = OrderedDict()
        self.first: int | None = None  # stamp of the very first frame

    def put(self, frame: SceneFrame) -> None:
        if self.first is None:
            self.first = frame.stamp
        self._frames.pop(frame.stamp, None)  # after a restart of the stream, a stamp may come again
        self._frames[frame.stamp] = frame
        if len(self._frames) > self._capacity:
            self._frames.popitem(last=False)

    def get(self, stamp: int) -> SceneFrame | None:
        return self._frames.get(stamp)


def _checked_bytes(topic):
    """Function (RecordedMessage -> its CDR) for a topic whose CDR is read without ROS."""
    checked_type(topic)
    return lambda message: message.data
