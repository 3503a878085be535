# SPDX-License-Identifier: Apache-2.0
"""Counts and times that the node measures. No ROS."""

import threading
from collections import deque
from collections.abc import Mapping

import numpy as np

# Percentiles are taken over the last results: p99 needs some hundreds.
WINDOW = 1000


class Metrics:
    """Counts and times of one node, written by the executor and the detection thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.received: dict[str, int] = {}
        self.last_stamps: dict[str, int] = {}  # ns, of the last message of a mesh or topic that could be read
        self.processed = 0
        self.detections = 0
        self.first_frames = 0
        self.near = 0
        self.coarse = 0
        self.last_coarse = ""
        self.failures = 0
        self.last_failure = ""
        self._failing = False
        self.last: dict[str, str] = {}
        self._latency_ms: deque[float] = deque(maxlen=WINDOW)
        self._detect_ms: deque[float] = deque(maxlen=WINDOW)
        self._transport_ms: deque[float] = deque(maxlen=WINDOW)
        self._stages: dict[str, deque[float]] = {}

    def frame_received(self, mesh: str, transport_ms: float | None, messages: int = 1) -> None:
        """Vertex messages arrived. transport_ms: since the publisher wrote one, None if unknown."""
        with self._lock:
            self.received[mesh] = self.received.get(mesh, 0) + messages
            if transport_ms is not None:
                self._transport_ms.append(transport_ms)

    def stamped(self, name: str, stamp: int) -> None:
        """A message of mesh or topic ``name`` was read."""
        with self._lock:
            self.last_stamps[name] = stamp

    def first_frame(self, messages: int) -> None:
        """A frame of ``messages`` vertex messages was only the start of the next step."""
        with self._lock:
            self.first_frames += 1
            self.processed += messages

    def detected(
        self,
        messages: int,
        latency_ms: float,
        detect_ms: float,
        profile: Mapping[str, float],
        last: Mapping[str, object],
        near: int = 0,
        coarse: str = "",
    ) -> None:
        """One step was processed. latency_ms: from the arrival of its last message to its contacts sent. near: pairs of
        features that came nearer than their meshes' separation. coarse: which mesh's motion is known less well than it
        should be, in words."""
        with self._lock:
            self.detections += 1
            self.processed += messages
            self.near += near
            if coarse:
                self.coarse += 1
                self.last_coarse = coarse
            self._failing = False
            self._latency_ms.append(latency_ms)
            self._detect_ms.append(detect_ms)
            for stage, ms in profile.items():
                self._stages.setdefault(stage, deque(maxlen=WINDOW)).append(ms)
            self.last = {key: str(value) for key, value in last.items()}

    def failed(self, text: str) -> None:
        """One step failed (its messages are counted as dropped)."""
        with self._lock:
            self.failures += 1
            self.last_failure = text
            self._failing = True

    def snapshot(self) -> dict:
        """A consistent copy of all of it."""
        with self._lock:
            return {
                "received": dict(self.received),
                "last_stamps": dict(self.last_stamps),
                "processed": self.processed,
                "detections": self.detections,
                "first_frames": self.first_frames,
                "near": self.near,
                "coarse": self.coarse,
                "last_coarse": self.last_coarse,
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
