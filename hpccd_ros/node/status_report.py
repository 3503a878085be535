# SPDX-License-Identifier: Apache-2.0
"""What the node tells of itself on /diagnostics: measurements are collected here and turned into messages."""

import resource
import threading
import time
from collections import deque
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from hpccd_ros.frames.drops import DropCounter

# Percentiles are taken over the last answers: p99 needs some hundreds.
WINDOW = 1000


class Metrics:
    """Counts and times of one node, written by the executor and the detection thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.received: dict[str, int] = {}
        self.answered = 0
        self.detections = 0
        self.first_frames = 0
        self.failures = 0
        self.last_failure = ""
        self._failing = False
        self.last: dict[str, str] = {}
        self._latency_ms: deque[float] = deque(maxlen=WINDOW)
        self._detect_ms: deque[float] = deque(maxlen=WINDOW)
        self._transport_ms: deque[float] = deque(maxlen=WINDOW)
        self._stages: dict[str, deque[float]] = {}

    def frame_received(self, mesh: str, transport_ms: float | None, messages: int = 1) -> None:
        """Vertex messages came. transport_ms: since the publisher wrote one, None where unknown."""
        with self._lock:
            self.received[mesh] = self.received.get(mesh, 0) + messages
            if transport_ms is not None:
                self._transport_ms.append(transport_ms)

    def first_frame(self, messages: int) -> None:
        """A frame of ``messages`` vertex messages was only the start of the next step."""
        with self._lock:
            self.first_frames += 1
            self.answered += messages

    def detected(
        self,
        messages: int,
        latency_ms: float,
        detect_ms: float,
        profile: Mapping[str, float],
        last: Mapping[str, object],
    ) -> None:
        """One step was answered. latency_ms: from the arrival of its last message to its contacts sent."""
        with self._lock:
            self.detections += 1
            self.answered += messages
            self._failing = False
            self._latency_ms.append(latency_ms)
            self._detect_ms.append(detect_ms)
            for stage, ms in profile.items():
                self._stages.setdefault(stage, deque(maxlen=WINDOW)).append(ms)
            self.last = {key: str(value) for key, value in last.items()}

    def failed(self, text: str) -> None:
        """One step could not be answered (its messages are counted as dropped)."""
        with self._lock:
            self.failures += 1
            self.last_failure = text
            self._failing = True

    def snapshot(self) -> dict:
        """A consistent copy of all of it."""
        with self._lock:
            return {
                "received": dict(self.received),
                "answered": self.answered,
                "detections": self.detections,
                "first_frames": self.first_frames,
                "failures": self.failures,
                "failing": self._failing,
                "last_failure": self.last_failure,
                "last": dict(self.last),
                "latency_ms": list(self._latency_ms),
                "detect_ms": list(self._detect_ms),
                "transport_ms": list(self._transport_ms),
                "stages": {stage: float(np.mean(values)) for stage, values in self._stages.items()},
            }


def percentiles(values: list[float]) -> dict[str, str]:
    """p50, p95, p99 and max as text; empty for no values."""
    if not values:
        return {}
    p50, p95, p99 = np.percentile(values, [50, 95, 99])
    return {"p50": f"{p50:.2f}", "p95": f"{p95:.2f}", "p99": f"{p99:.2f}", "max": f"{max(values):.2f}"}


class Reporter:
    """Makes a DiagnosticArray of the state of the node; rates are those since the report before.

    drops: of vertex messages. refused: of topologies. links: free counters of the middleware (name -> count).
    """

    def __init__(self, node_name: str, metrics: Metrics, drops: DropCounter, refused: DropCounter) -> None:
        self._node_name = node_name
        self._metrics = metrics
        self._drops = drops
        self._refused = refused
        self._time = time.monotonic()
        self._received: dict[str, int] = {}
        self._detections = 0
        self._dropped = 0
        self._topologies_refused = 0
        self._failures = 0

    def report(
        self,
        stamp: Time,
        *,
        state: str,
        waiting: int,
        restarts: int,
        static_taken: int,
        last_refusal: str,
        links: Mapping[str, int],
        warnings: list[str],
        service: Mapping[str, int],
        errors: tuple[int, str] = (0, ""),
        recording: tuple[bytes, str, Mapping[str, object]] | None = None,
        coordinate_frame: tuple[str, str] = ("", ""),
    ) -> DiagnosticArray:
        """static_taken: accepted messages of static meshes, which count as answered.
        coordinate_frame: that of the scene, and what determined it.
        errors: how many exceptions nothing expected, and the last one.
        recording: level, message and values of the node's own recording, where there is one.

        Message of the statuses frames, detection, service, process, errors, and recording where there is one."""
        now = time.monotonic()
        period, self._time = max(now - self._time, 1e-9), now
        data = self._metrics.snapshot()
        data["answered"] += static_taken
        out = DiagnosticArray()
        out.header.stamp = stamp
        out.status = [
            self._frames(data, period, waiting, restarts, last_refusal, links, warnings, coordinate_frame),
            self._detection(data, period, state),
            self._status("service", DiagnosticStatus.OK, "~/detect", service),
            self._status("process", DiagnosticStatus.OK, state, {"state": state, **_memory()}),
            self._errors(*errors),
            *([self._status("recording", *recording)] if recording is not None else []),
        ]
        return out

    def _frames(
        self,
        data: dict,
        period: float,
        waiting: int,
        restarts: int,
        last_refusal: str,
        links: Mapping[str, int],
        warnings: list[str],
        coordinate_frame: tuple[str, str],
    ) -> DiagnosticStatus:
        dropped, topologies_refused = self._drops.total, self._refused.total
        new = dropped - self._dropped
        new_topologies = topologies_refused - self._topologies_refused
        values: dict[str, object] = {}
        for mesh, count in sorted(data["received"].items()):
            values[f"received.{mesh}"] = count
            values[f"rate_hz.{mesh}"] = f"{(count - self._received.get(mesh, 0)) / period:.2f}"
        came = sum(data["received"].values()) - sum(self._received.values())
        values |= {
            "received": sum(data["received"].values()),
            "answered": data["answered"],
            "waiting": waiting,
            "dropped": dropped,
            "restarts": restarts,
            "topologies_refused": topologies_refused,
            "frame_id": coordinate_frame[0],
            "frame_id_by": coordinate_frame[1],
        }
        for reason, count in sorted(self._drops.by_reason().items()):
            values[f"dropped.{reason}"] = count
        for (mesh, reason), count in sorted(self._drops.by_mesh_and_reason().items()):
            values[f"dropped.{mesh}.{reason}"] = count
        for (mesh, reason), count in sorted(self._refused.by_mesh_and_reason().items()):
            values[f"topologies_refused.{mesh}.{reason}"] = count
        values |= dict(links)
        for stage, text in percentiles(data["transport_ms"]).items():
            values[f"transport_ms.{stage}"] = text
        values["last_refusal"] = last_refusal
        self._received, self._dropped, self._topologies_refused = (
            data["received"],
            dropped,
            topologies_refused,
        )
        notes = list(warnings)
        if new:
            notes.insert(0, f"{new} frames dropped")
        if new_topologies:
            notes.insert(0, f"{new_topologies} topologies refused")
        if notes:
            return self._status("frames", DiagnosticStatus.WARN, "; ".join(notes), values)
        if not came:
            return self._status("frames", DiagnosticStatus.STALE, f"no frames in the last {period:.1f} s", values)
        return self._status("frames", DiagnosticStatus.OK, f"{came / period:.1f} frames a second", values)

    def _detection(self, data: dict, period: float, state: str) -> DiagnosticStatus:
        rate = (data["detections"] - self._detections) / period
        self._detections = data["detections"]
        values: dict[str, object] = {
            "rate_hz": f"{rate:.2f}",
            "detections": data["detections"],
            "first_frames": data["first_frames"],
            "failures": data["failures"],
        }
        for kind in ("latency_ms", "detect_ms"):
            for name, text in percentiles(data[kind]).items():
                values[f"{kind}.{name}"] = text
        for stage, mean in data["stages"].items():
            values[f"stage_ms.{stage}"] = f"{mean:.3f}"
        values |= data["last"]
        values["last_failure"] = data["last_failure"]
        if data["failing"]:
            return self._status("detection", DiagnosticStatus.ERROR, f"failed: {data['last_failure']}", values)
        return self._status("detection", DiagnosticStatus.OK, f"{rate:.1f} detections a second ({state})", values)

    def _errors(self, count: int, last: str) -> DiagnosticStatus:
        # For good: what else went wrong with it nobody knows.
        level = DiagnosticStatus.ERROR if count else DiagnosticStatus.OK
        text = f"{count} unexpected errors, the last: {last}" if count else "none"
        return self._status("errors", level, text, {"errors": count, "last_error": last})

    def _status(self, part: str, level: bytes, message: str, values: Mapping[str, object]) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=level,
            name=f"{self._node_name}: {part}",
            message=message,
            hardware_id="hpccd",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )


def _memory() -> dict[str, str]:
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # KiB on Linux
    pages = Path("/proc/self/statm")
    values = {"memory_peak_mb": f"{peak_mb:.1f}"}
    if pages.exists():
        resident = int(pages.read_text().split()[1]) * resource.getpagesize()
        values["memory_mb"] = f"{resident / 2**20:.1f}"
    return values
