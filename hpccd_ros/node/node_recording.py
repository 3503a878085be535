# SPDX-License-Identifier: Apache-2.0
"""The node's own recording (parameter `record`): inputs and results, in files like those of `hpccd record`."""

import dataclasses
import functools
import os
import threading
import time
from pathlib import Path
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import ReliabilityPolicy

from hpccd_ros.bag import writer
from hpccd_ros.bag.writer import BagWriter
from hpccd_ros.base.quoting import counted
from hpccd_ros.middleware.executors import Errors, GuardedExecutor
from hpccd_ros.params import node_parameters
from hpccd_ros.record import attachments, recorded_topics
from hpccd_ros.record.recorded_topics import missing_shapes, recording_info
from hpccd_ros.record.topic_recorder import DescribedRobots, Recorder

# Queue of each topic; further messages are lost and counted. Bounds the memory.
DEPTH = 50
# Made for a recording; more is a mistake, and Python's own way to make them fails at a thousand.
MOST_NEW_FOLDERS = 100
# The longest that is put behind the name of a recording.
NUMBER = "_1000000.mcap.part"


class NodeRecording:
    """Starts and ends recordings of `node` according to its parameter `record`; an error never stops the node.

    It has raw subscriptions in its own node and thread, so the disk delays neither messages nor detection, and the
    files contain the bytes as they were sent.
    """

    def __init__(self, node: Node, settings: dict[str, Any], errors: Errors) -> None:
        self._node = node
        self._settings = settings
        self._errors = errors
        self._wanted = ""  # what the parameter was when a recording was last begun
        self._running: _Running | None = None
        self._last: _Running | None = None
        self._failure = ""

    def follow(self, active: bool) -> None:
        """Begin, end or change the recording so that it agrees with the parameter. active: the node is."""
        wanted = self._settings["record"] if active else ""
        if wanted == self._wanted:
            return
        self.end()
        self._wanted = wanted
        if not wanted:
            return
        try:
            self._running = self._last = _Running(self._node, self._settings, self._errors)
            self._node.get_logger().info(f"recording into {self._running.bag.path}")
        except Exception as error:  # of the disk mostly; the middleware may have no place for another node either
            self._failure = f"cannot record into {wanted}: {error}"
            self._node.get_logger().error(f"{self._failure}; the node goes on without a recording")

    def end(self) -> None:
        """Write what has arrived, finish the file. Needs no valid context."""
        self._wanted = self._failure = ""
        if self._running is not None:
            self._running.end()
            self._node.get_logger().info(self._running.summary())
            self._running = None

    def status(self) -> tuple[bytes, str, dict[str, object]] | None:
        """(level, message, values) for the diagnostics, or None if nothing was ever recorded."""
        if self._failure:
            return DiagnosticStatus.ERROR, self._failure, {}
        return self._last.status(self._running is not None) if self._last is not None else None


def unrecordable(settings: dict[str, Any]) -> str | None:
    """Why nothing can be recorded with these settings, or None; a disk may still reject later."""
    if not settings["record"]:
        return None
    try:
        target = _expand(settings["record"])
        if why := writer.unusable_options(target, settings["record_compression"], *_limits(settings)):
            return f"record: {why}"
        if why := _no_place(target):
            return f"record: {_shortened(target)}: {why}"
    # RuntimeError: ~nobody; ValueError: a character that no path can have; OSError: what the system says of it.
    except (OSError, RuntimeError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        return f"record: {_shortened(settings['record'])}: {why}"
    return None


def _no_place(target: Path) -> str | None:
    """Why no file or folder can be made there, or None. Raises OSError."""
    if target.name in ("", ".."):
        return "give the name of a file ending in .mcap, or of a folder that is to be made"
    path = target.absolute()
    missing = 0
    while not (existing := path.parents[missing]).exists():
        missing += 1
    if not (existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)):
        return f"the folder {existing} is not writable"
    if missing > MOST_NEW_FOLDERS:
        return f"{counted(missing, 'missing folder')} on the way to it, at most {MOST_NEW_FOLDERS} are made"
    longest, whole = (os.pathconf(existing, limit) for limit in ("PC_NAME_MAX", "PC_PATH_MAX"))
    names = [*path.parts[-missing - 1 : -1], target.name + NUMBER]
    if any(len(os.fsencode(name)) > longest for name in names):
        return f"a name in it has more than the {longest} bytes of this file system (with {len(NUMBER)} for a number)"
    if len(os.fsencode(path / names[-1])) > whole:
        return f"has more than the {whole} bytes of a path"
    return None


class _Running:
    """One recording, from construction until `end`. Raises OSError or ValueError if it cannot begin."""

    def __init__(self, node: Node, settings: dict[str, Any], errors: Errors) -> None:
        parameters = node_parameters.of(node)
        files, missing = attachments.files(parameters)
        for text in missing:
            node.get_logger().warning(text)
        wanted = recorded_topics.of_node(parameters)
        max_bytes, max_seconds = _limits(settings)
        self.bag = BagWriter(
            writer.free_path(_expand(settings["record"])),
            info=recording_info(node.get_fully_qualified_name(), parameters, wanted, node.resolve_topic_name),
            attachments=files,
            compression=settings["record_compression"],
            flush_interval=settings["record_flush"],
            sync=settings["record_sync"],
            max_bytes=max_bytes,
            max_seconds=max_seconds,
        )
        # Names are resolved by the recorded node: remappings given for it alone would not reach this one.
        self._node = rclpy.create_node(
            f"{node.get_name()}_recording",
            namespace=node.get_namespace(),
            context=node.context,
            use_global_arguments=False,
            start_parameter_services=False,
            enable_rosout=False,
        )
        resolved = [dataclasses.replace(topic, name=node.resolve_topic_name(topic.name)) for topic in wanted]
        reliability = ReliabilityPolicy[settings["input_reliability"].upper()]
        self._recorder = Recorder(
            self._node,
            self.bag,
            resolved,
            DEPTH,
            # As the node itself asks: whatever reaches it reaches the recording.
            functools.partial(recorded_topics.as_node_asks, recorded=node, vertices=reliability),
        )
        DescribedRobots(self._node, self.bag, parameters, node.resolve_topic_name, node.get_logger().warning)
        self._missing = functools.partial(missing_shapes, parameters, node.resolve_topic_name, self._recorder.received)
        self._errors = errors
        self._executor = GuardedExecutor(errors, context=node.context)
        self._executor.add_node(self._node)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recording", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            while not self._stop.is_set():
                self._executor.spin_once(timeout_sec=min(0.1, self.bag.until_flush))
                self.bag.poll()
            self._recorder.finish(self._executor, DEPTH)
        except ExternalShutdownException:
            pass  # the context is gone, and with it what had not been taken
        except Exception as error:
            self._errors.caught("recording", error)  # ended by it: `status` says so
        finally:
            self.bag.close()

    def end(self) -> None:
        self._stop.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()

    def summary(self) -> str:
        bag, values = self.bag, self._values()
        lost = f", {values['lost']} lost on the way" if values["lost"] else ""
        errors = f", {values['not_written']} NOT WRITTEN ({bag.last_error})" if bag.write_errors else ""
        missing = "".join(f"; {text}" for text in self._missing())
        count = counted(bag.message_count, "message")
        return f"recorded {count}, {bag.size / 1e6:.2f} MB{lost}{errors}: {bag.path}{missing}"

    def status(self, running: bool) -> tuple[bytes, str, dict[str, object]]:
        values = self._values()
        if running and not self._thread.is_alive():
            return DiagnosticStatus.ERROR, "the recording has ended by an error, see the node's output", values
        if self.bag.failing:
            return DiagnosticStatus.ERROR, f"nothing is written now: {self.bag.last_error}", values
        if values["lost"] or values["not_written"] or values["not_synced"]:
            return DiagnosticStatus.WARN, "the recording is not complete", values
        if missing := self._missing():
            return DiagnosticStatus.WARN, "; ".join(missing), values
        return DiagnosticStatus.OK, "recording" if running else "recorded", values

    def _values(self) -> dict[str, object]:
        bag = self.bag
        return {
            "path": str(bag.path),
            "files": len(bag.file_paths),
            "messages": bag.message_count,
            "flushed": bag.flushed_count,
            "bytes": bag.size,
            "lost": sum(self._recorder.lost.values()),
            "synced": bag.synced_count,
            "not_written": bag.not_written.total(),
            "not_synced": bag.not_synced,
            "write_errors": bag.write_errors,
            "last_error": bag.last_error,
        }


def _shortened(path: object) -> str:
    text = str(path)
    return text if len(text) <= 100 else f"{text[:50]}...{text[-50:]}"


def _expand(pattern: str) -> Path:
    return Path(time.strftime(pattern)).expanduser()


def _limits(settings: dict[str, Any]) -> tuple[int, float]:
    return int(settings["record_split_size"] * 1e6), settings["record_split_time"]
