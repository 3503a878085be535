# SPDX-License-Identifier: Apache-2.0
"""From recorded messages to frames of the scene, by the node's own rules."""

from collections import OrderedDict

from hpccd_ros.bag.decode import make_completer, make_decoder
from hpccd_ros.frames.drops import Input, RefusalCounter
from hpccd_ros.frames.outcome import Outcome
from hpccd_ros.frames.sequence import SequenceWatch
from hpccd_ros.frames.types import SceneFrame
from hpccd_ros.frames.welding import Welding
from hpccd_ros.middleware import joint_messages, mesh_inputs, topic_names, transform_topics
from hpccd_ros.middleware.fields import InvalidMessageError
from hpccd_ros.params import robot_parameters, scene_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.replay.recorded_setup import ReplaySetup

# Frames for which an answer waits that was written before its own; far less than the window, which must still hold
# the frames of the answers behind it.
PATIENCE = 16


class FrameSource:
    """Pushes recorded messages into a pipeline as the node has it.

    refused: what could not be used and why, counted as in the node; transforms by topic.
    """

    def __init__(self, setup: ReplaySetup, topics):
        self._setup = setup
        self.refused = {what: RefusalCounter() for what in Input}
        self._decoders = {
            name: make_completer(topics[name]) if kind in topic_names.WHOLE else make_decoder(topics[name])
            for name, (_, kind) in setup.roles.items()
            if name in topics
        }
        self._watches = {name: SequenceWatch() for name in setup.roles}
        self._weldings = {name: Welding() for name in setup.roles}
        # Messages of several topics may have reached the recorder in another order than the node.
        pending = 4 * setup.settings["pending_frames"]
        by_joints = robot_parameters.followers(setup.settings, setup.robots, pending)
        self._pipeline = scene_parameters.frame_pipeline(
            setup.settings, setup.meshes, pending, setup.robots, by_joints.values()
        )
        self._by_joints = {
            topic: [by_joints[robot] for robot in robots]
            for topic, robots in robot_parameters.joint_topics(setup.settings[ROBOT]).items()
        }
        for mesh, (topology, positions) in setup.files.items():
            self._pipeline.load(mesh, topology, positions)

    @property
    def topics(self) -> list[str]:
        return list(self._decoders)

    def push(self, message) -> list[SceneFrame]:
        """Frames that this recorded message completes."""
        mesh, kind = self._setup.roles[message.topic]
        decoded = self._decoders[message.topic](message)
        if kind in transform_topics.ALL:
            topic = transform_topics.ALL[kind]
            outcome = self._retried(transform_topics.fill(self._pipeline.transforms, decoded, topic))
        elif not mesh and kind in self._by_joints:
            outcome = self._retried(joint_messages.fill(self._by_joints[kind], decoded, kind))
        else:
            outcome = self._push_mesh(mesh, kind, decoded, message)
        for refusal in outcome.refusals:
            self.refused[refusal.what].count(refusal)
        return outcome.frames

    def _push_mesh(self, mesh, kind, decoded, message) -> Outcome:
        watch = self._watches[message.topic]
        # Sequence 0: the recorder was not told the publisher's numbers.
        new_publisher = bool(message.sequence) and watch.next(message.sequence)[1]
        try:
            checked = mesh_inputs.read(
                kind, decoded, self._setup.settings, sent=message.publish_time, welding=self._weldings[message.topic]
            )
        except InvalidMessageError as error:
            return Outcome(refusals=[error.refusal(mesh, mesh_inputs.INPUTS[kind])])
        if kind != "topology":
            new_publisher = watch.notice()
        return self._pipeline.push(mesh, checked, new_publisher)

    def _retried(self, refusals) -> Outcome:
        outcome = Outcome(refusals=refusals)
        for part in self._pipeline.retry():
            outcome += part
        return outcome


class FrameWindow:
    """The last frames, by stamp: answers name the two frames between which they were found."""

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
