# SPDX-License-Identifier: Apache-2.0
"""Shared by the subjects over DDS: a node in this process, the measured node as a process, and its reports.

`python -m bench.dds --ros-args ...` runs the node and notes the times at which each frame passes. At its end it writes
FILE (variable HPCCD_BENCH_TIMES): for each step [step, received, detected, published, detect_ms, core_ms], times in s
of CLOCK_MONOTONIC, which all processes of a machine share.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from hpccd_ros.base.errors import UserError
from hpccd_ros.demo.children import Child, Children
from hpccd_ros.middleware import environment, qos, stop_signals

PATIENCE = 300.0  # s, for what takes less than one on a machine that is not busy
PERCENTILES = {"median": 50, "p95": 95, "p99": 99}
TIMES = "HPCCD_BENCH_TIMES"


def percentiles(who: str, ms, of: dict[str, int] = PERCENTILES) -> dict[str, float]:
    """{"WHO_median_ms", ...}; NaN where there are no times."""
    return {f"{who}{key}_ms": float(np.percentile(ms if len(ms) else [np.nan], q)) for key, q in of.items()}


def columns(**heads: str) -> dict[str, str]:
    """Columns of a table of `percentiles`: by head what they are of."""
    return {f"{head} {key}": f"{of}_{key}_ms" for head, of in heads.items() for key in PERCENTILES}


@dataclasses.dataclass
class Session:
    """A node of this process in a namespace, and child processes."""

    node: Node
    namespace: str
    executor: SingleThreadedExecutor
    children: Children
    folder: Path

    def start_node(self, parameters: dict[str, Any], module: str = "hpccd_ros.node") -> Child:
        """The node as a process; with module="bench.dds" it writes `times()` at its end."""
        file = self.folder / "node.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}), encoding="utf-8")
        os.environ[TIMES] = str(self.folder / "times.json")
        names = (f"__ns:={self.namespace}", f"/diagnostics:={self.namespace}/diagnostics")
        renamed = (word for name in names for word in ("-r", name))
        return self.children.start("node", module, "--ros-args", "--params-file", str(file), *renamed)

    def times(self) -> dict[int, list[float]]:
        written = json.loads((self.folder / "times.json").read_text(encoding="utf-8"))
        return {entry[0]: entry[1:] for entry in written}

    def spin_until(self, ready: Callable[[], bool], what: str) -> None:
        """Spin until `ready()`; UserError if that takes too long or a child fails."""
        deadline = time.monotonic() + PATIENCE
        while not ready():
            self.children.check()
            if time.monotonic() > deadline:
                raise UserError(f"{what} not within {PATIENCE:.0f} s")
            self.executor.spin_once(timeout_sec=0.02)

    def spin(self, seconds: float) -> None:
        """Spin for `seconds`."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            self.executor.spin_once(timeout_sec=left)


@contextlib.contextmanager
def session(name: str, namespace: str) -> Iterator[Session]:
    # A domain of its own, unless the user names one: other nodes would take part of the machine, and be counted.
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(name, namespace=namespace, start_parameter_services=False)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        with tempfile.TemporaryDirectory(prefix="hpccd-bench-") as folder, Children(Path(folder)) as children:
            yield Session(node, namespace, executor, children, Path(folder))
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown()


class NodeStatus:
    """The last diagnostics of the measured node."""

    def __init__(self, of: Session):
        self.values: dict[str, dict[str, str]] = {}
        self.texts: dict[str, str] = {}
        self.heard = 0.0
        of.node.create_subscription(DiagnosticArray, f"{of.namespace}/diagnostics", self._take, qos.DIAGNOSTICS)

    def _take(self, message: DiagnosticArray) -> None:
        self.heard = time.monotonic()
        for status in message.status:
            part = status.name.rpartition(": ")[2]
            self.values[part] = {v.key: v.value for v in status.values}
            self.texts[part] = status.message

    def count(self, key: str, part: str = "frames") -> int:
        """A counter; 0 where the node has not told it."""
        return int(self.values.get(part, {}).get(key, 0))

    def counts(self) -> dict[str, int]:
        """Counts of vertex messages: received, middleware (lost on the way), answered (the kept results call
        the processed ones so), dropped, waiting."""
        counts = {key: self.count(key) for key in ("received", "dropped", "waiting")}
        return {**counts, "answered": self.count("processed"), "middleware": self.count("dropped.middleware")}

    def unaccounted(self) -> int:
        """Messages that the counters do not explain: received + lost on the way - processed - dropped - waiting."""
        c = self.counts()
        return c["received"] + c["middleware"] - c["answered"] - c["dropped"] - c["waiting"]


def resident_mb(pid: int) -> float:
    """Resident memory of a process in MB (10^6 bytes)."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise RuntimeError(f"process {pid} has ended: it has no resident memory")


@contextlib.contextmanager
def helper(name: str, namespace: str, on_stop: Callable[[], None]) -> Iterator[Node]:
    """A node in a process that a subject starts; on_stop: called at SIGINT or SIGTERM."""
    stop_signals.watch(on_stop)
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node(name, namespace=namespace, start_parameter_services=False)
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def main() -> int:
    from hpccd_ros.node import node, run

    class TimedNode(node.HpccdNode):
        """Beside the node itself: two looks at the clock and one append a frame."""

        def __init__(self):
            super().__init__()
            self.times = []

        def _publish(self, found):
            detected = time.monotonic()
            super()._publish(found)
            ms = found.detect_ms, found.profile.get("total", found.detect_ms)
            self.times.append((found.end.step, found.end.received, detected, time.monotonic(), *ms))

        def destroy_node(self):
            Path(os.environ[TIMES]).write_text(json.dumps(self.times), encoding="utf-8")
            super().destroy_node()

    return run.main(node_type=TimedNode)


if __name__ == "__main__":
    sys.exit(main())
