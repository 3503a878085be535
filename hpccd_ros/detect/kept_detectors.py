# SPDX-License-Identifier: Apache-2.0
"""Detectors kept for the next request about the same scene. No ROS.

Solvers send many requests about one scene, and building the scene costs more than the computation.
"""

import threading
import time
from dataclasses import dataclass

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import Topology


@dataclass(frozen=True, eq=False)
class DetectorOf:
    """A detector, its scene and its options."""

    builder: SceneBuilder
    topologies: tuple[Topology, ...]
    options: Options
    detector: hc.Detector

    def fits(self, builder: SceneBuilder, topologies: tuple[Topology, ...], options: Options) -> bool:
        """Whether a detector made of these would give the same results. Topology versions do not matter."""
        return (
            self.options == options
            and self.builder == builder
            and all(a is b or a.same_content(b) for a, b in zip(self.topologies, topologies, strict=True))
        )


class KeptDetectors:
    """At most ``most`` unused detectors; the one unused for the longest time is discarded. Thread-safe."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._unused: list[tuple[float, DetectorOf]] = []  # unused since (time.monotonic()), in this order

    def take(self, builder: SceneBuilder, topologies: tuple[Topology, ...], options: Options) -> DetectorOf | None:
        """Remove and return one that fits; None if there is none."""
        with self._lock:
            for place in reversed(range(len(self._unused))):
                if self._unused[place][1].fits(builder, topologies, options):
                    return self._unused.pop(place)[1]
        return None

    def keep(self, used: DetectorOf) -> None:
        """Keep one for later requests."""
        with self._lock:
            self._unused = [*self._unused, (time.monotonic(), used)][-self._most :]

    def forget(self, unused_for: float) -> None:
        """Discard those that were unused for this number of seconds."""
        before = time.monotonic() - unused_for
        with self._lock:
            self._unused = [entry for entry in self._unused if entry[0] > before]
