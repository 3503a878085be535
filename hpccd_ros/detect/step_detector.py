# SPDX-License-Identifier: Apache-2.0
"""Computes the contacts of a step from its two frames. No ROS, no threads."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

import hpccd_core as hc
from hpccd_ros.detect import approach
from hpccd_ros.detect.core import Cancellation, Options, make_detector
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.rest_shapes import RestShapes
from hpccd_ros.detect.rigid_step import RigidStep, motions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import (
    NO_BOUNDS,
    MotionBounds,
    change_separation,
    change_thickness,
    count_near,
)
from hpccd_ros.frames.types import SceneFrame


@dataclass(frozen=True, eq=False)
class Detection:
    """The contacts of one step and how they were found.

    ``backend``, ``threads``: those used. ``detect_ms``: wall time of the core's call. ``gaps``: the smallest distance
    of each pair of meshes at the end, if the options request it; ``gaps_backend``: the backend that computed them,
    which may differ; ``gaps_before``: those at the start, if they were requested then; ``gaps_approached``: of
    `approach.approached`. ``bounds``: of motions by poses
    or joints. ``tested_pairs``: of the scene, as in SceneBuilder. ``rest``, ``rest_stamps``: as in
    RestShapes.
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
    gaps: list[hc.Gap] | None = None
    gaps_backend: str = ""
    gaps_before: list[hc.Gap] | None = None
    gaps_approached: np.ndarray | None = None
    bounds: MotionBounds = NO_BOUNDS
    tested_pairs: Sequence[tuple[str, str]] = ()
    rest: Sequence[np.ndarray | None] = ()
    rest_stamps: tuple[int, ...] = ()

    @property
    def near(self) -> int:
        """Number of contacts of meshes with a separation."""
        return count_near(self.contacts, self.layout, self.options.separation, self.options.thickness)


class StepDetector:
    """Keeps the core's scene and detector from step to step while topologies and ``options`` stay the same.

    ``options`` may be set at any time, from any thread, and apply to the next step. rest: shapes at rest, if they are
    shared with other detectors of these meshes.
    """

    def __init__(self, builder: SceneBuilder, options: Options, rest: RestShapes | None = None) -> None:
        self.options = options
        self.rest = rest or RestShapes(builder.rest_of_frames)
        self._builder = builder
        self._names = builder.names
        self._scene: hc.Scene | None = None
        self._scene_of: SceneFrame | None = None
        self._layout: Layout | None = None
        self._rest_stamps: tuple[int, ...] = ()
        self._detector: hc.Detector | None = None
        self._detector_options: Options | None = None
        self._rigid_step: RigidStep | None = None  # if meshes move by poses; then the detector computes distances only
        self._cancellation = Cancellation()
        self._last_gaps: tuple[SceneFrame, list[hc.Gap]] | None = None

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """In the order of the scene, planes last."""
        return self._names

    @property
    def plane_names(self) -> tuple[str, ...]:
        return self._builder.plane_names

    def layout_of(self, frame: SceneFrame) -> Layout:
        """Of the scene with the topologies of ``frame``."""
        return self._builder.layout(frame.topologies)

    def cancel(self) -> None:
        """Permanently: the current detection, and all later ones, raise hc.Cancelled. May be called from any thread."""
        self._cancellation.cancel()

    def prepare_scene(self, frame: SceneFrame, first: SceneFrame | None = None) -> None:
        """Make the scene for the topologies of ``frame``. first: the frame at the start of a step to ``frame``, which
        may give meshes their shape at rest. Raises the core's errors."""
        new = self.rest.look_at(first or frame)
        if self._scene_of is None or new or not self._scene_of.same_scene(frame):
            self._scene = self._builder.build(frame.topologies, self.rest.of(frame.topologies))
            self._layout = self._builder.layout(frame.topologies)
            self._scene_of, self._detector = frame, None
            self._rest_stamps = self.rest.stamps(frame.topologies)

    def prepare_detector(self) -> None:
        """Make the detector of the scene with the current options. Raises the core's errors."""
        options = self.options
        if self._detector is None or not options.same_detector(self._detector_options):
            detector = make_detector(self._scene, options)
            self._rigid_step = self._made_rigid_step(options)
            others = self._rigid_step.detectors if self._rigid_step is not None else ()
            self._detector = self._cancellation.guard(detector, *others)
        elif options.spacing != (before := self._detector_options).spacing:
            detector, self._detector = self._detector, None  # none if only a part of the change is made
            of_step = self._rigid_step.detectors if self._rigid_step is not None else ()
            for each in (detector, *of_step):
                change_thickness(each, before.thickness, options.thickness)
            # Those of bent motions are set in each step.
            for each in (detector, *of_step[1:]):
                change_separation(each, self._names, before.separation, options.separation)
            self._detector = detector
        self._detector_options = options

    def _made_rigid_step(self, options: Options) -> RigidStep | None:
        builder, topologies = self._builder, self._scene_of.topologies
        if not any(builder.rigid):
            return None
        bent, others = builder.of_rigid_pairs(), builder.of_other_pairs()
        return RigidStep(
            self._names,
            make_detector(bent.build(topologies), options),
            make_detector(others.build(topologies, self.rest.of(topologies)), options) if others is not None else None,
        )

    def distances(self, frame: SceneFrame) -> list[hc.Gap]:
        """The smallest distance of each pair of meshes in ``frame``. Raises the core's errors."""
        self.prepare_scene(frame)
        self.prepare_detector()
        return self._detector.distances(self._builder.concatenate(frame, frame))

    def approached(self, start: SceneFrame, end: SceneFrame, gaps: Sequence[hc.Gap]) -> np.ndarray:
        """(P,): by how much the nearest features of these ``gaps`` at the end approach in the step."""
        moving = self._builder.concatenate(start, end), self._builder.concatenate(end, end)
        return approach.approached(gaps, *moving)

    def intersect(self, frame: SceneFrame) -> hc.Intersections:
        """The edges that intersect or touch faces in ``frame``. Raises the core's errors."""
        self.prepare_scene(frame)
        self.prepare_detector()
        return self._detector.intersections(self._builder.concatenate(frame, frame))

    def detect(self, start: SceneFrame, end: SceneFrame) -> Detection:
        """The contacts of the motion from ``start`` to ``end``, of the same scene. Raises the core's errors."""
        self.prepare_scene(end, start)
        self.prepare_detector()
        found = self._detect(start, end) if self._rigid_step is None else self._detect_rigid(start, end)
        if not found.options.distances:
            return found
        # Only now: backend, profile and stats are of the last call.
        gaps, last = self._detector.distances(self._builder.concatenate(end, end)), self._last_gaps
        self._last_gaps = end, gaps
        before = last[1] if last is not None and last[0] is start else None
        return replace(
            found,
            gaps=gaps,
            gaps_backend=self._detector.backend,
            gaps_before=before,
            gaps_approached=self.approached(start, end, gaps),
        )

    def _detect(self, start: SceneFrame, end: SceneFrame) -> Detection:
        detector = self._detector
        t0, t1 = self._builder.concatenate(start, end), self._builder.concatenate(end, end)
        began = time.perf_counter()
        contacts = detector.detect(t0, t1)
        return self._detection(start, end, contacts, began, detector, detector.profile, detector.stats)

    def _detect_rigid(self, start: SceneFrame, end: SceneFrame) -> Detection:
        step, options = self._rigid_step, self._detector_options
        began = time.perf_counter()
        moving = motions((self._builder.parts(start, end), self._builder.parts(end, end)), start, end)
        contacts, bounds = step.detect(moving, options.separation, options.rigid, options.report)
        return self._detection(start, end, contacts, began, step.bent, step.profile, step.stats, bounds)

    def _detection(self, start, end, contacts, began, detector, profile, stats, bounds=NO_BOUNDS) -> Detection:
        """detector: the one whose backend and threads are reported."""
        detect_ms = 1e3 * (time.perf_counter() - began)
        return Detection(
            start,
            end,
            contacts,
            self._layout,
            self._detector_options,
            detector.backend,
            detector.threads,
            detect_ms,
            dict(profile),
            dict(stats),
            bounds=bounds,
            tested_pairs=self._builder.tested_pairs,
            rest=self.rest.of(self._scene_of.topologies),
            rest_stamps=self._rest_stamps,
        )
