# SPDX-License-Identifier: Apache-2.0
"""`hpccd record`: record the topics of a running node into MCAP until told to stop."""

import sys
import time
from datetime import datetime
from pathlib import Path

import rclpy
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor

from hpccd_core.whole_file import no_folder
from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.base.errors import UserError, require_utf8
from hpccd_ros.base.quoting import counted, listed
from hpccd_ros.middleware import environment, graph, ros_start, stop_signals, topic_names
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.params import node_parameters
from hpccd_ros.record import attachments, recorded_topics
from hpccd_ros.record.recorded_topics import Wanted, missing_shapes, recording_info
from hpccd_ros.record.topic_recorder import DescribedRobots, Recorder

# Seconds: long enough for a shape that is sent with the first pose, and early enough to start again.
LOOK_EVERY = 5.0
# Seconds without the node, or its results, until the recorder says that it waits.
NOTICE = 2.0


def main(args) -> int:
    """Record as the options of `hpccd record` say; returns the exit status."""
    target = Path(args.output or datetime.now().strftime("hpccd-%Y%m%d-%H%M%S.mcap"))
    if why := no_folder(target):
        raise UserError(f"-o {target}: {why}")
    with stop_signals.collected() as stop:
        return _record_until(stop, target, args)


def _record_until(stop, target, args) -> int:
    require_utf8(args.node, *args.topic)
    environment.prepare()
    ros_start.init(["--ros-args", *args.ros_args])
    namespace, _, name = args.node.rpartition("/")
    if not name or not args.node.startswith("/"):
        raise UserError(f"--node {args.node}: give the full name with its namespace, for example /hpccd")
    # In the namespace of the recorded node, so that relative names and remappings mean the same.
    try:
        node = rclpy.create_node(f"{name}_recorder", namespace=namespace or "/", start_parameter_services=False)
    except NameValidationException as error:
        raise UserError(f"--node {args.node}: not the name of a node; write it as /hpccd or /arm/hpccd") from error
    try:
        return _record(node, target, args, stop)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


def _record(node, target, args, stop) -> int:
    _await(node, args, stop)
    parameters = node_parameters.fetch(node, args.node, args.wait, stop)
    if not parameters.get("meshes") and not parameters.get("robots"):
        raise UserError(f"--node {args.node}: it has neither meshes nor robots; name an hpccd node that has some")
    wanted = recorded_topics.of_node(parameters)
    known = {node.resolve_topic_name(topic.name) for topic in wanted}
    wanted += [topic for topic in map(_extra, args.topic) if node.resolve_topic_name(topic.name) not in known]
    files, missing = attachments.files(parameters)
    for text in missing:
        _warn(text)
    info = recording_info(args.node, parameters, wanted, node.resolve_topic_name)
    try:
        bag = BagWriter(
            target,
            info=info,
            attachments=files,
            compression=args.compression,
            flush_interval=args.flush,
            sync=args.sync,
            max_bytes=int(args.split_size * 1e6),
            max_seconds=args.split_time,
        )
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    try:
        DescribedRobots(node, bag, parameters, node.resolve_topic_name, _warn)
        recorder = Recorder(node, bag, wanted, args.depth)
        contacts = node.resolve_topic_name(topic_names.CONTACTS)
        missing = lambda: missing_shapes(parameters, node.resolve_topic_name, recorder.received)  # noqa: E731
        _spin(node, recorder, bag, contacts, args, stop, missing)
    finally:
        bag.close()
    _report(bag, recorder, missing())
    return 1 if bag.write_errors else 0


def _await(node, args, stop) -> None:
    """Say that the node is not there, unless it appears at once."""
    deadline = time.monotonic() + NOTICE
    while args.wait > NOTICE and args.node not in graph.other_nodes(node) and not stop:
        if time.monotonic() > deadline:
            _warn(f"waiting for node {args.node} on {graph.domain()}, {args.wait:g} s at most (--wait); Ctrl-C ends")
            return
        rclpy.spin_once(node, timeout_sec=0.05)


def _warn(text) -> None:
    print(text, file=sys.stderr, flush=True)


def _spin(node, recorder, bag, contacts, args, stop, missing):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    status = Status(bag, recorder, contacts)
    started = look = time.monotonic()
    ready = warned = waits = False
    while not stop:
        executor.spin_once(timeout_sec=min(0.1, bag.until_flush))
        bag.poll()
        if not ready and recorder.publishers(contacts):
            ready = True
            # Read by programs that start a recorder and must not publish before it subscribes.
            print(
                f"recording {args.node} into {bag.path}: {counted(len(recorder.topics), 'topic')}, Ctrl-C ends",
                flush=True,
            )
        if not (ready or waits) and time.monotonic() >= started + NOTICE:
            waits = True
            _warn(
                f"{contacts}: no publisher yet; configure {args.node} (hpccd lifecycle), or give its remappings here, "
                "after --ros-args"
            )
        status.update()
        if not warned and time.monotonic() >= look + LOOK_EVERY:
            look = time.monotonic()
            for text in missing():
                warned = True
                status.clear()
                print(f"so far {text}", file=sys.stderr, flush=True)
        if args.duration and time.monotonic() - started >= args.duration:
            break
        if args.frames and recorder.received[contacts] >= args.frames:
            break
    status.clear()
    recorder.finish(executor, args.depth)
    executor.shutdown()


class Status:
    """A status line on the terminal; nothing if the output is not a terminal."""

    PERIOD = 0.5  # s

    def __init__(self, bag, recorder, contacts):
        self._bag, self._recorder, self._contacts = bag, recorder, contacts
        self._next = time.monotonic()

    def update(self):
        if sys.stderr.isatty() and time.monotonic() >= self._next:
            self._next += self.PERIOD
            lost = sum(self._recorder.lost.values())
            print(
                f"\r{counted(self._bag.message_count, 'message')}, "
                f"{self._recorder.received[self._contacts]} of contacts, {self._bag.size / 1e6:.1f} MB, {lost} lost"
                + (
                    f", {self._bag.not_written.total()} NOT WRITTEN ({self._bag.last_error})"
                    if self._bag.failing
                    else ""
                )
                + "   ",
                end="",
                file=sys.stderr,
                flush=True,
            )

    def clear(self):
        if sys.stderr.isatty():
            print("\r" + " " * 78 + "\r", end="", file=sys.stderr, flush=True)


def _report(bag, recorder, missing):
    for name, count in recorder.received.items():
        if count:
            lost = recorder.lost.get(name, 0)
            print(
                f"  {name}: {counted(count, 'message')}" + (f", {lost} LOST on the way to the recorder" if lost else "")
            )
    if silent := [name for name, count in recorder.received.items() if not count]:
        print(f"  no message: {listed(silent)}")
    for text in missing:
        print(f"  {text}")
    files = bag.file_paths
    for path in bag.torn_files:
        print(f"  {path} is not complete: `hpccd doctor {path} --recover OUT.mcap`")
    if bag.not_synced:
        print(f"  {counted(bag.not_synced, 'message')} NOT SYNCED, which a power failure may take")
    if bag.write_errors:
        print(
            f"  {counted(bag.not_written.total(), 'message')} NOT WRITTEN, {counted(bag.write_errors, 'write error')}, "
            f"the last: {bag.last_error}"
        )
    where = str(files[0]) if len(files) == 1 else f"{counted(len(files), 'file')} in {bag.path}"
    print(f"recorded {counted(bag.message_count, 'message')}, {bag.size / 1e6:.2f} MB: {where}", flush=True)


def _extra(text) -> Wanted:
    name, equals, type_name = text.partition("=")
    if not equals or type_name.count("/") != 2:
        raise UserError(f"--topic {text}: write it as NAME=PACKAGE/msg/TYPE, e.g. /joints=sensor_msgs/msg/JointState")
    try:
        message_class(type_name)
    except LookupError as error:
        raise UserError(f"--topic {text}: {error}") from error
    return Wanted(name, type_name)
