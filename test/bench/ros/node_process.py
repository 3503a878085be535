# SPDX-License-Identifier: Apache-2.0
"""A node as a process of its own, and what it tells of itself on /diagnostics."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import yaml
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from hpccd_ros.demo.children import Child, Children
from hpccd_ros.middleware import qos


def start(
    children: Children, folder: Path, namespace: str, parameters: dict[str, Any], module: str = "hpccd_ros.node"
) -> Child:
    """Start `module` (the node, or one that is built on it) in `namespace`, its diagnostics too."""
    file = folder / "node.yaml"
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}), encoding="utf-8")
    return children.start(
        "node",
        module,
        "--ros-args",
        "--params-file",
        str(file),
        "-r",
        f"__ns:={namespace}",
        "-r",
        f"/diagnostics:={namespace}/diagnostics",
    )


class NodeStatus:
    """The last diagnostics of the node in `namespace`, heard by `node`."""

    def __init__(self, node: Node, namespace: str):
        self.values: dict[str, dict[str, str]] = {}
        self.texts: dict[str, str] = {}
        self.heard = 0.0
        node.create_subscription(DiagnosticArray, f"{namespace}/diagnostics", self._take, qos.DIAGNOSTICS)

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
        """Of vertex messages: received, middleware (lost on the way), answered, dropped, waiting."""
        counts = {key: self.count(key) for key in ("received", "answered", "dropped", "waiting")}
        return {**counts, "middleware": self.count("dropped.middleware")}

    def unaccounted(self) -> int:
        """Messages that the counters do not explain: received + lost on the way - answered - dropped - waiting."""
        c = self.counts()
        return c["received"] + c["middleware"] - c["answered"] - c["dropped"] - c["waiting"]


def resident_mb(pid: int) -> float:
    """Resident memory of a process in MB (10^6 bytes)."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024 / 1e6
    raise RuntimeError(f"process {pid} has ended: it has no resident memory")
