# SPDX-License-Identifier: Apache-2.0
"""Recordings of a node that receives messages in another order than its recorder, made without DDS."""

import dataclasses
from pathlib import Path
from typing import Any

from hpccd.msg import ContactArray, DistanceArray
from rclpy.serialization import serialize_message

from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.detect.step_detector import Detection, StepDetector
from hpccd_ros.frames.taken_inputs import TakenInputs
from hpccd_ros.middleware import contact_messages, fields, result_fields, snapshot_messages
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.frames import FrameSource

BEGAN, BETWEEN = 10**18, 10**6  # ns
RESTART = "restart"  # the node is configured again, or its process begins again


@dataclasses.dataclass
class Recorded:
    """topic: relative. log_time, sent: ns."""

    topic: str
    message: Any
    log_time: int
    sent: int


def run(
    path: Path,
    parameters: dict,
    heard: list[tuple[str, Any]],
    taken: list[int | str | tuple[str, int]],
    early: bool = False,
) -> list[Recorded]:
    """The content of a recording of the node. heard: topic and message, in the order of the recorder. taken: indices
    into ``heard`` in the order of the node, or events. early: the recorder receives results before their last
    inputs."""
    found = [
        Recorded(topic, message, BEGAN + BETWEEN * k + 7, BEGAN + BETWEEN * k)
        for k, (topic, message) in enumerate(heard)
    ]
    write(path, parameters, found)
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        by_time = {message.publish_time: message for message in recording.messages()}
        source, inputs, results = FrameSource(setup, recording.topics, ordered=True), TakenInputs(), []
        options = dataclasses.replace(setup.options("", "cpu", 1), distances=parameters.get("distances", False))
        detector = StepDetector(setup.builder, options)
        source.restart(all_known=False)
        last, latest = None, 0
        for one in taken:
            if one == RESTART:
                source.restart(all_known=False)
                inputs.restart()
                last = None
                continue
            if isinstance(one, int):
                inputs.add(found[one].topic, found[one].sent)
                frames, latest = source.push(by_time[found[one].sent], flags=0), max(latest, one)
            else:
                event, value = (one, 0) if isinstance(one, str) else one
                inputs.add(event, value)
                frames = source.happen(event, value)
            for frame in frames:
                frame = frame.after_inputs(inputs.count)
                if last is not None and last.same_scene(frame) and frame.stamp > last.stamp:
                    at = found[latest].log_time + (-3 if early else 3)
                    sent = found[latest].sent + 1000 + len(results)
                    results += _results(detector.detect(last, frame), inputs, at, sent)
                last = frame
    return found + results


def _results(found: Detection, inputs: TakenInputs, at: int, sent: int) -> list[Recorded]:
    message = ContactArray(step=found.end.step, accuracy=found.options.accuracy, backend=found.backend)
    message.header.stamp, message.header.frame_id = fields.ns_to_stamp(found.end.stamp), found.end.frame_id
    message.start = fields.ns_to_stamp(found.start.stamp)
    contact_messages.fill_contacts(message, found.contacts, found.layout, max_contacts=0, outputs=())
    result_fields.fill_separation(message, found.options.separation)
    result_fields.fill_features(message, found.options.features)
    result_fields.fill_bounds(message, found.bounds)
    end = found.end.inputs
    result_fields.fill_inputs(message, inputs.pop_until(end), start=found.start.inputs, end=end)
    result_fields.fill_report(message, found.options.report)
    results = [Recorded("contacts", message, at, sent)]
    if found.gaps is not None:
        beside = DistanceArray(header=message.header, step=found.end.step, accuracy=found.options.accuracy)
        snapshot_messages.fill_distances(beside, found.gaps, found.layout)
        results.append(Recorded("distances", beside, at + 1, sent + 1))
    return results


def write(path: Path, parameters: dict, messages: list[Recorded]) -> Path:
    """Write it as a recording of the node with these parameters."""
    path.unlink(missing_ok=True)
    kinds = {
        one.topic: f"{type(one.message).__module__.split('.')[0]}/msg/{type(one.message).__name__}" for one in messages
    }
    info = {
        "format": 1,
        "hpccd": "0",
        "node": "/hpccd",
        "parameters": parameters,
        "topics": {f"/{topic}": topic for topic in kinds},
    }
    bag = BagWriter(path, info=info)
    for topic, kind in kinds.items():
        bag.add_topic(Topic(f"/{topic}", kind, []))
    for number, one in enumerate(sorted(messages, key=lambda one: one.log_time), start=1):
        bag.write(f"/{one.topic}", serialize_message(one.message), one.log_time, one.sent, number)
    bag.close()
    return path
