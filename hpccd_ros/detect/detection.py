# SPDX-License-Identifier: Apache-2.0
"""The thread that runs the core on frames of the scene, outside of the executor. No ROS."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

import hpccd_core as hc
from hpccd_ros.detect.cancellation import Ongoing
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.drops import DropCounter, Reason
from hpccd_ros.frames.frame_queue import FrameQueue
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

# What the core raises for bad input, options that are not built, and lack of memory or of a device.
CORE_ERRORS = (ValueError, TypeError, RuntimeError, MemoryError)


@dataclass(frozen=True)
class Options:
    """Arguments of hpccd_core.Detector."""

    accuracy: str = "exact"
    backend: str = "auto"
    threads: int = 0
    report: str = "all"
    outputs: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class SceneBuilder:
    """Makes core scenes of the same meshes with changing topologies."""

    meshes: tuple[MeshSettings, ...]
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    pair_accuracies: tuple[tuple[str, str, str], ...] = ()

    def build(self, topologies: tuple[Topology, ...]) -> hc.Scene:
        """One topology for each mesh, in order. Raises what the core raises."""
        scene = hc.Scene()
        for mesh, topology in zip(self.meshes, topologies, strict=True):
            scene.add_mesh(
                mesh.name,
                topology.faces,
                n_vertices=topology.n_vertices,
                self_collision=mesh.self_collision,
                static=mesh.static,
            )
        for a, b in self.ignored_pairs:
            scene.ignore_pair(a, b)
        for a, b, accuracy in self.pair_accuracies:
            scene.set_accuracy(a, b, accuracy)
        return scene

    def among(self, names: list[str]) -> "SceneBuilder":
        """The scene of these meshes, in this order; names that it does not have are meshes of their own."""
        known = {mesh.name: mesh for mesh in self.meshes}
        return SceneBuilder(
            tuple(known.get(name, MeshSettings(name)) for name in names),
            tuple(pair for pair in self.ignored_pairs if set(pair) <= set(names)),
            tuple(entry for entry in self.pair_accuracies if set(entry[:2]) <= set(names)),
        )

    def concatenate(self, frame: SceneFrame, static_of: SceneFrame) -> np.ndarray:
        """(V,3) positions of all meshes; those of static meshes from ``static_of``. No copy of a single mesh.

        One float64 mesh makes the whole float64, which holds the others' float32 exactly.
        """
        parts = [static_of.vertices[i] if mesh.static else frame.vertices[i] for i, mesh in enumerate(self.meshes)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


def refusal(options: Options) -> str | None:
    """Why the core cannot work with these options on this machine, in its own words, or None."""
    scene = hc.Scene()
    scene.add_mesh("probe", np.array([[0, 1, 2]], np.uint32))
    try:
        make_detector(scene, options)
    except CORE_ERRORS as error:
        return str(error)
    return None


def make_detector(scene: hc.Scene, options: Options) -> hc.Detector:
    """Detector with these options. Raises what the core raises."""
    return hc.Detector(
        scene,
        accuracy=options.accuracy,
        backend=options.backend,
        threads=options.threads,
        report=options.report,
        outputs=options.outputs,
    )


@dataclass(frozen=True, eq=False)
class Detection:
    """The contacts of one step and how they were found.

    ``backend``, ``threads``: what was used. ``detect_ms``: wall time of the core's call.
    """

    start: SceneFrame
    end: SceneFrame
    contacts: hc.Contacts
    layout: Layout
    options: Options
    backend: str
    threads: int
    detect_ms: float
    profile: dict[str, float] = field(default_factory=dict)
    stats: dict[str, float] = field(default_factory=dict)


class DetectionThread(threading.Thread):
    """Takes scene frames from ``queue``, hands detections to ``on_detection``, until it is closed.

    The motion goes from the end of the last step that was answered to the new frame, so where frames were dropped
    between them, or their detection failed, no time is left unwatched. The first frame, and the first after a change
    of topology, is only a start: ``on_first``. ``options()`` is read before each frame; a change makes a new detector.
    """

    def __init__(
        self,
        builder: SceneBuilder,
        queue: FrameQueue,
        drops: DropCounter,
        *,
        options: Callable[[], Options],
        on_detection: Callable[[Detection], None],
        on_first: Callable[[SceneFrame], None],
        on_failure: Callable[[SceneFrame, Exception], None],
    ) -> None:
        super().__init__(name="detection", daemon=True)
        self._builder = builder
        self._queue = queue
        self._drops = drops
        self._options = options
        self._on_detection = on_detection
        self._on_first = on_first
        self._on_failure = on_failure
        self._scene: hc.Scene | None = None
        self._scene_of: SceneFrame | None = None
        self._layout: Layout | None = None
        self._detector: hc.Detector | None = None
        self._detector_options: Options | None = None
        self._start: SceneFrame | None = None
        self._ongoing = Ongoing()
        self.working_on: SceneFrame | None = None

    def cancel(self) -> None:
        """Give up the frame that is worked on: counted as stopped. For the end, after the queue was closed."""
        self._ongoing.end()

    def run(self) -> None:
        while (item := self._queue.take()) is not None:
            frame = self.working_on = item.frame
            try:
                if item.first:
                    self._start = frame
                    self._on_first(frame)
                else:
                    self._on_detection(self._detect(self._start, frame))
                    self._start = frame  # only now: a step that failed is part of the next one
            except hc.Cancelled:
                for mesh in frame.fresh:
                    self._drops.count(mesh, Reason.STOPPED)
            except Exception as error:  # CORE_ERRORS; any other would end this thread, and no frame be answered again
                for mesh in frame.fresh:
                    self._drops.count(mesh, Reason.DETECTION_FAILED)
                self._on_failure(frame, error)
            self.working_on = None

    def _detect(self, start: SceneFrame, end: SceneFrame) -> Detection:
        if self._scene_of is None or not self._scene_of.same_scene(end):
            self._scene = self._builder.build(end.topologies)
            self._layout = Layout.of(tuple(m.name for m in self._builder.meshes), end.topologies)
            self._scene_of, self._detector = end, None
        options = self._options()
        if self._detector is None or options != self._detector_options:
            self._detector = self._ongoing.use(make_detector(self._scene, options))
            self._detector_options = options
        began = time.perf_counter()
        contacts = self._detector.detect(self._builder.concatenate(start, end), self._builder.concatenate(end, end))
        detect_ms = 1e3 * (time.perf_counter() - began)
        return Detection(
            start,
            end,
            contacts,
            self._layout,
            options,
            self._detector.backend,
            self._detector.threads,
            detect_ms,
            dict(self._detector.profile),
            dict(self._detector.stats),
        )
