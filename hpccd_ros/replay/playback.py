# SPDX-License-Identifier: Apache-2.0
"""Publishes recorded messages over DDS: the recorded bytes, with the recorded QoS, at the recorded pace.

A topic that was recorded with another definition of its type is rejected: readers would misread its bytes.
"""

import itertools
import sys
import tempfile
from collections import deque
from pathlib import Path

import rclpy
import yaml
from rclpy.exceptions import NameValidationException
from rclpy.qos import DurabilityPolicy, QoSProfile

from hpccd_ros.bag.decode import checked_type
from hpccd_ros.bag.reader import RecordedTopic, Recording, RecordingError
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted, listed
from hpccd_ros.base.yaml_text import loaded
from hpccd_ros.middleware import environment, message_types, qos, ros_start, stop_signals, topic_names, transform_topics
from hpccd_ros.middleware.listeners import await_acknowledged, await_subscribers
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.pacing import Pace, next_wanted

# Reliable readers that are late must still receive what they missed.
DEPTH = 20
# Characters of YAML: rosbag2 writes 400 per publisher.
MOST_QOS = 100_000
# Seconds that the last messages may take to arrive.
LAST = 2.0
# A listener would take their recorded messages for present ones.
_OF_STOP = {topic_names.STOP: message_types.STOP, topic_names.SPEED_SCALE: message_types.SPEED_SCALE}
# Seconds of waiting after which the reason is shown.
TOLD_AFTER = 1.0


def main(args) -> int:
    """Play as the options of `hpccd replay --publish` say."""
    with stop_signals.collected() as stop, Recording(args.file) as recording, tempfile.TemporaryDirectory() as folder:
        topics = _topics(recording, args)
        for note in recording.notes:
            _print_status(note)
        environment.prepare()
        environment.shorten_heartbeats(Path(folder))  # each topic begins when its first message has arrived
        ros_start.init(["--ros-args", *args.ros_args])
        node = rclpy.create_node("hpccd_replay", start_parameter_services=False)
        try:
            publishers = {topic.name: _publisher(node, topic) for topic in topics}
            lacking = _await_subscribers(publishers, args, stop)
            if lacking and not stop:
                raise UserError(_too_few(lacking, args.subscribers))
            count = _play(recording, publishers, args, stop)
            await_acknowledged(publishers.values(), LAST)
        finally:
            node.destroy_node()
            rclpy.try_shutdown()
        what = f"{counted(count, 'message')} on {counted(len(topics), 'topic')}"
        print(f"published {what}{' until told to stop' if stop else ''}", flush=True)
    return 0


def _topics(recording, args) -> list[RecordedTopic]:
    if args.all:
        stop = _stop_topics(recording)
        for name in stop:
            _print_status(f"{name} is not published: a listener would take a recorded message for a present one")
        return [topic for name, topic in recording.topics.items() if name not in stop]
    setup = recorded_setup.of_recording(recording, args.params)
    inputs = {*setup.roles, *setup.described_on}
    return [topic for name, topic in recording.topics.items() if name in inputs]


def _stop_topics(recording) -> list[str]:
    """Those that the recorder stored as the node's topics stop and speed_scale; from another recorder, those with
    their types and names."""
    stored = (recording.info or {}).get("topics")
    roles = stored if isinstance(stored, dict) else {}
    return [
        name
        for name, topic in recording.topics.items()
        if any(
            topic.type_name == type_name and own in (roles.get(name), name.rpartition("/")[2])
            for own, type_name in _OF_STOP.items()
        )
    ]


def _publisher(node, topic):
    try:
        return node.create_publisher(checked_type(topic), topic.name, _qos(topic))
    # ValueError: no topic name. RuntimeError, such as RCLError: once resolved, the name of another one.
    except (LookupError, NameValidationException, ValueError, RuntimeError) as error:
        raise RecordingError(f"topic {topic.name} cannot be played: {error}") from error


def _qos(topic) -> QoSProfile:
    """The recorded reliability and durability if all publishers agreed, else reliable and volatile."""
    offers = _offers(topic)
    # rosbag2 before version 9 wrote the numbers of the enumeration: 1 reliable, 2 best effort; 1 transient local.
    best_effort = offers and all(offer.get("reliability") in ("best_effort", 2) for offer in offers)
    latched = offers and all(offer.get("durability") in ("transient_local", 1) for offer in offers)
    return qos.keep_last(_in_force(topic) if latched else DEPTH, reliable=not best_effort, latched=bool(latched))


def _offers(topic) -> list[dict]:
    try:
        if len(topic.offered_qos) > MOST_QOS:
            raise ValueError("too long")
        offers = loaded(topic.offered_qos) or []
    except (yaml.YAMLError, ValueError):
        offers = None
    if not isinstance(offers, list) or not all(isinstance(offer, dict) for offer in offers):
        why = "its quality of service is not stored as rosbag2 does"
        raise RecordingError(f"topic {topic.name} cannot be played: {why}")
    return offers


def _in_force(topic) -> int:
    """Number of the last messages of a latched topic that are in force: static transforms accumulate."""
    return qos.TRANSFORMS_STATIC.depth if topic.type_name in transform_topics.TYPES else 1


def _too_few(lacking: dict[str, int], wanted: int) -> str:
    names = ", ".join(lacking)
    if not any(lacking.values()):
        return f"nobody subscribes to {names}: start a node for these meshes first, or --wait"
    return f"fewer than {wanted} subscribe to {names}: start them first, --wait longer, or ask for fewer --subscribers"


def _await_subscribers(publishers, args, stop) -> dict[str, int]:
    at_once = min(args.wait, TOLD_AFTER)
    lacking = await_subscribers(publishers, args.subscribers, at_once, stop)
    if not lacking or stop or args.wait == at_once:
        return lacking
    _print_status(f"waiting for subscribers of {listed(lacking)}, {args.wait:g} s at most (--wait)")
    return await_subscribers(publishers, args.subscribers, args.wait - at_once, stop)


def _await_arrival(publishers, topics, args, stop) -> float:
    """Wait until the last messages of these topics have arrived; returns the time that it took, s."""
    awaited, at_once = [publishers[topic] for topic in topics], min(args.wait, TOLD_AFTER)
    waited = await_acknowledged(awaited, at_once, stop)
    if waited < at_once or stop or args.wait == at_once:
        return waited
    _print_status(f"waiting until all subscribers have the first of {listed(topics)}, {args.wait:g} s at most (--wait)")
    return waited + await_acknowledged(awaited, args.wait - at_once, stop)


def _print_status(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _play(recording, publishers, args, stop) -> int:
    count, first, last_frame = 0, None, None
    pace = Pace(1.0 if args.rate is None else args.rate, stop)
    latched, begun = {}, set()
    for message in recording.messages(list(publishers)):
        first = message.log_time if first is None else first
        at = (message.log_time - first) * 1e-9
        if at < args.begin:
            # Latched messages (topologies, static transforms) are in force at the beginning, whenever they were sent.
            if publishers[message.topic].qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                depth = publishers[message.topic].qos_profile.depth
                latched.setdefault(message.topic, deque(maxlen=depth)).append(message)
            continue
        if stop or at > args.end:
            break
        for earlier in itertools.chain.from_iterable(latched.values()):
            publishers[earlier.topic].publish(earlier.data)
            count += 1
        if latched:
            _await_arrival(publishers, latched, args, stop)
        latched.clear()
        if args.step:
            # One frame: all messages published at about the same time, such as the meshes of a step.
            if last_frame is None or message.log_time - last_frame > 2_000_000:
                if not next_wanted(f"{at:.3f} s"):
                    break
            last_frame = message.log_time
        else:
            pace.wait(at)
        publishers[message.topic].publish(message.data)
        count += 1
        if message.topic not in begun:
            begun.add(message.topic)
            pace.delay(_await_arrival(publishers, [message.topic], args, stop))
    return count
