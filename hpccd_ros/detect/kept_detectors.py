# SPDX-License-Identifier: Apache-2.0
"""Detectors that wait for the next request about the same scene. No ROS.

Who asks how far a step may go asks again and again about one scene: to build that scene costs more than the answer.
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
    """A detector and all that it was made of."""

    builder: SceneBuilder
    topologies: tuple[Topology, ...]
    options: Options
    detector: hc.Detector

    def fits(self, builder: SceneBuilder, topologies: tuple[Topology, ...], options: Options) -> bool:
        """Whether one made of these would give the same answers. Versions of topologies are not the detector's."""
        return (
            self.options == options
            and self.builder == builder
            and all(a is b or a.same_content(b) for a, b in zip(self.topologies, topologies, strict=True))
        )


class KeptDetectors:
    """At most ``most`` that nobody uses; the one unused for the longest time gives way. For several threads."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._unused: list[tuple[float, DetectorOf]] = []  # since when (time.monotonic()), in this order

    def take(self, builder: SceneBuilder, topologies: tuple[Topology, ...], options: Options) -> DetectorOf | None:
        """One that fits, from now on the caller's alone; None where none is there."""
        with self._lock:
            for place in reversed(range(len(self._unused))):
                if self._unused[place][1].fits(builder, topologies, options):
                    return self._unused.pop(place)[1]
        return None

    def keep(self, used: DetectorOf) -> None:
        """Leave one for later requests."""
        with self._lock:
            self._unused = [*self._unused, (time.monotonic(), used)][-self._most :]

    def forget(self, unused_for: float) -> None:
        """Give back the memory of those that nobody used for so many seconds."""
        before = time.monotonic() - unused_for
        with self._lock:
            self._unused = [entry for entry in self._unused if entry[0] > before]
