# SPDX-License-Identifier: Apache-2.0
"""Record the topics of a node into MCAP: raw subscriptions, so that a file holds the very bytes that were sent."""

import signal
import sys
import time
from datetime import datetime
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions

from hpccd_ros import _env, mcap_qos, node_parameters, recorded_topics
from hpccd_ros.errors import UserError
from hpccd_ros.mcap_bag import BagWriter, Topic
from hpccd_ros.mcap_decode import message_class
from hpccd_ros.mesh_attachment import attachment_name
from hpccd_ros.recorded_topics import Wanted
from hpccd_ros.version import package_version


class Recorder:
    """Subscribes to the wanted topics through `node` and writes every message to `bag` until told to stop.

    received: messages so far, by resolved topic name. lost: messages that did not get here, by topic, found by gaps
    in the numbers that a topic's publisher counts (known where it has one publisher only).
    """

    def __init__(self, node, bag: BagWriter, wanted: list[Wanted], depth: int):
        self._node = node
        self._bag = bag
        self.received: dict[str, int] = {}
        self.lost: dict[str, int] = {}
        self.taken = 0  # messages handed over by the middleware, those after the end too
        self._end: int | None = None
        self._sequence: dict[str, int] = {}
        self._subscriptions = {}
        for topic in wanted:
            name = node.resolve_topic_name(topic.name)
            qos = recorded_topics.subscription_qos(node, name, topic.latched, depth)
            self.received[name] = 0
            self._subscriptions[name] = node.create_subscription(
                message_class(topic.type_name), name, self._receiver(name, topic), qos, raw=True
            )

    @property
    def topics(self) -> list[str]:
        return list(self._subscriptions)

    def publishers(self, topic: str) -> int:
        """Publishers that this recorder is connected to on `topic` (resolved name)."""
        return self._subscriptions[topic].get_publisher_count()

    def end(self) -> None:
        """From now on take only what had arrived before: it belongs to the recording, what comes later does not."""
        self._end = time.time_ns()

    def _receiver(self, name, topic):
        def receive(data, info):
            self.taken += 1
            if self._end is not None and info["received_timestamp"] > self._end:
                return
            if self.received[name] == 0:
                self._bag.add_topic(Topic(name, topic.type_name, self._offered_qos(name), topic.latched))
            self.received[name] += 1
            self._watch_for_loss(name, info["publication_sequence_number"])
            self._bag.write(
                name, data, info["received_timestamp"], info["source_timestamp"], info["publication_sequence_number"]
            )

        return receive

    def _offered_qos(self, name):
        offers = [p.qos_profile for p in self._node.get_publishers_info_by_topic(name)]
        # A publisher that sent and left at once is not listed any more: what was asked of it, it offered.
        return mcap_qos.offered_qos(offers or [self._subscriptions[name].qos_profile])

    def _watch_for_loss(self, name, sequence):
        last = self._sequence.get(name)
        self._sequence[name] = sequence
        if last is not None and sequence > last + 1 and self.publishers(name) == 1:
            self.lost[name] = self.lost.get(name, 0) + sequence - last - 1


def main(args) -> int:
    """Record as the options of `hpccd record` say; returns the exit status."""
    target = Path(args.output or datetime.now().strftime("hpccd-%Y%m%d-%H%M%S.mcap"))
    stop = _stop_on_signals()
    _env.prepare()
    rclpy.init(args=["--ros-args", *args.ros_args] if args.ros_args else None,
               signal_handler_options=SignalHandlerOptions.NO)
    namespace, _, name = args.node.rpartition("/")
    if not name or not args.node.startswith("/"):
        raise UserError(f"--node {args.node}: give the full name with its namespace, for example /hpccd")
    # In the namespace of the recorded node, relative names and remappings mean the same as there.
    node = rclpy.create_node(f"{name}_recorder", namespace=namespace or "/", start_parameter_services=False)
    try:
        return _record(node, target, args, stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _record(node, target, args, stop) -> int:
    parameters = node_parameters.fetch(node, args.node, args.wait)
    if not parameters.get("meshes"):
        raise UserError(f"the node {args.node} has no parameter `meshes`: is it an hpccd node?")
    wanted = recorded_topics.of_node(parameters) + [_extra(text) for text in args.topic]
    info = {
        "format": 1,
        "hpccd": package_version(),
        "node": args.node,
        "parameters": parameters,
        # The role of each topic, whatever it was remapped to.
        "topics": {node.resolve_topic_name(topic.name): topic.name for topic in wanted},
    }
    try:
        bag = BagWriter(target, info=info, attachments=_mesh_files(parameters), compression=args.compression,
                        flush_interval=args.flush, max_bytes=int(args.split_size * 1e6), max_seconds=args.split_time)
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    try:
        recorder = Recorder(node, bag, wanted, args.depth)
        contacts = node.resolve_topic_name("contacts")
        _spin(node, recorder, bag, contacts, args, stop)
    finally:
        bag.close()
    _report(bag, recorder)
    return 0


def _spin(node, recorder, bag, contacts, args, stop):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    status = Status(bag, recorder, contacts)
    started = time.monotonic()
    ready = False
    while not stop:
        executor.spin_once(timeout_sec=0.1)
        bag.poll()
        if not ready and recorder.publishers(contacts):
            ready = True
            # Read by programs that start a recorder and must not publish before it listens.
            print(f"recording {args.node} into {bag.path}: {len(recorder.topics)} topics, Ctrl-C ends", flush=True)
        status.update()
        if args.duration and time.monotonic() - started >= args.duration:
            break
        if args.frames and recorder.received[contacts] >= args.frames:
            break
    status.clear()
    recorder.end()
    # At most `depth` messages of each topic can have been waiting.
    most = recorder.taken + args.depth * len(recorder.topics)
    taken = -1
    while taken != recorder.taken and recorder.taken < most:
        taken = recorder.taken
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()


class Status:
    """One line on the terminal that tells how the recording goes; nothing where the output is not a terminal."""

    PERIOD = 0.5  # s

    def __init__(self, bag, recorder, contacts):
        self._bag, self._recorder, self._contacts = bag, recorder, contacts
        self._next = time.monotonic()

    def update(self):
        if sys.stderr.isatty() and time.monotonic() >= self._next:
            self._next += self.PERIOD
            lost = sum(self._recorder.lost.values())
            print(f"\r{self._bag.message_count} messages, {self._recorder.received[self._contacts]} of contacts, "
                  f"{self._bag.size / 1e6:.1f} MB, {lost} lost   ", end="", file=sys.stderr, flush=True)

    def clear(self):
        if sys.stderr.isatty():
            print("\r" + " " * 78 + "\r", end="", file=sys.stderr, flush=True)


def _report(bag, recorder):
    for name, count in recorder.received.items():
        if count:
            lost = recorder.lost.get(name, 0)
            print(f"  {name}: {count} messages" + (f", {lost} LOST on the way here" if lost else ""))
    files = bag.file_paths
    where = str(files[0]) if len(files) == 1 else f"{len(files)} files in {bag.path}"
    print(f"recorded {bag.message_count} messages, {bag.size / 1e6:.2f} MB: {where}", flush=True)


def _mesh_files(parameters) -> list[tuple[str, bytes]]:
    """The mesh files that the node was given: without them a replay elsewhere could not rebuild its scene."""
    found = []
    for mesh in parameters["meshes"]:
        path = parameters.get(f"mesh.{mesh}.file")
        if not path:
            continue
        try:
            found.append((attachment_name(mesh, path), Path(path).expanduser().read_bytes()))
        except OSError as error:
            print(f"mesh file {path} is not in the recording ({error.strerror}): a replay will need it at that place",
                  file=sys.stderr, flush=True)
    return found


def _extra(text) -> Wanted:
    name, equals, type_name = text.partition("=")
    if not equals or type_name.count("/") != 2:
        raise UserError(f"--topic {text}: write it as NAME=PACKAGE/msg/TYPE, for example /tf=tf2_msgs/msg/TFMessage")
    try:
        message_class(type_name)
    except LookupError as error:
        raise UserError(f"--topic {text}: {error}") from error
    return Wanted(name, type_name)


def _stop_on_signals() -> list:
    """An empty list that SIGINT and SIGTERM fill: the loop ends between two messages, never within one."""
    stop = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, frame: stop.append(received))
    return stop
