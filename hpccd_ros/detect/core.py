# SPDX-License-Identifier: Apache-2.0
"""The core's detector: its options, which of them are unusable, and cancellation from another thread. No ROS."""

import threading
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import hpccd_core as hc
from hpccd_core.options import FEATURES
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import add_to
from hpccd_ros.detect.separation import NONE, Separation, Thickness, change_thickness
from hpccd_ros.frames.types import MeshSettings, Topology


class Cancellation:
    """Call `guard` with each detector before it works; `cancel` makes the guarded ones, and all later ones, raise
    hc.Cancelled."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._detectors: tuple[hc.Detector, ...] = ()
        self._cancelled = False

    def guard(self, detector: hc.Detector, *others: hc.Detector) -> hc.Detector:
        """Guard `detector`: from now on `cancel` ends it and the ``others``."""
        with self._lock:
            self._detectors = (detector, *others)
            if self._cancelled:
                self._cancel_all()
        return detector

    def cancel(self) -> None:
        """Cancel all guarded detectors, and later ones too. May be called from any thread."""
        with self._lock:
            self._cancelled = True
            self._cancel_all()

    def _cancel_all(self) -> None:
        for detector in self._detectors:
            detector.cancel()

    def release(self) -> bool:
        """Stop guarding the detector, so that it may do other work. False: it was cancelled."""
        with self._lock:
            if not self._cancelled:
                self._detectors = ()
            return not self._cancelled


# Errors of the core for invalid input, options that are not built, and lack of memory or of a device.
CORE_ERRORS = (ValueError, TypeError, RuntimeError, MemoryError)


#: (mesh, ratio of its faces) of meshes that are tested on coarse faces.
Detail = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Options:
    """Arguments of hpccd_core.Detector, and settings that may change without a new detector: the separation of pairs of
    meshes and the ``thickness`` of meshes, as (mesh, thickness); whether the smallest ``distances`` at the end of a
    step are computed too, and how steps with meshes that move by poses are cut. ``detail``: the coarse meshes, as
    (mesh, ratio of faces).
    """

    accuracy: str = "exact"
    backend: str = "auto"
    threads: int = 0
    report: str = "all"
    outputs: tuple[str, ...] = ()
    separation: Separation = NONE
    distances: bool = False
    features: tuple[str, ...] = FEATURES
    rigid: RigidOptions = RigidOptions()
    thickness: Thickness = ()
    detail: Detail = ()

    @property
    def spacing(self) -> tuple[Separation, Thickness]:
        """What is set in a detector, and not when it is made."""
        return self.separation, self.thickness

    def same_detector(self, other: "Options") -> bool:
        """Whether a detector made with one may continue with the other."""
        return replace(self, **_CHANGEABLE) == replace(other, **_CHANGEABLE)


_CHANGEABLE: dict[str, Any] = {"separation": NONE, "thickness": (), "distances": False, "rigid": RigidOptions()}


def make_detector(scene: hc.Scene, options: Options) -> hc.Detector:
    """A detector with these options. Raises the core's errors."""
    detector = hc.Detector(
        scene,
        accuracy=options.accuracy,
        backend=options.backend,
        threads=options.threads,
        report=options.report,
        outputs=options.outputs,
        minimum_separation=options.separation.minimum,
        features=options.features,
        **({"detail": dict(options.detail)} if options.detail else {}),
    )
    for mesh_a, mesh_b, distance in options.separation.pairs:
        detector.set_separation(mesh_a, mesh_b, distance)
    change_thickness(detector, (), options.thickness)
    return detector


def unusable_options(options: Options) -> str | None:
    """Why the core cannot use these options on this machine, or None."""
    scene = hc.Scene()
    names = {name for entry in options.separation.pairs for name in entry[:2]} | dict(options.thickness).keys()
    for name in sorted(names) or ["probe"]:
        scene.add_mesh(name, np.array([[0, 1, 2]], np.uint32))
    try:
        make_detector(scene, options)
    except CORE_ERRORS as error:
        return str(error)
    return None


def unusable_topology(topology: Topology, mesh: str = "mesh", points: bool = False) -> str | None:
    """Why the core cannot use this topology, or None. points: the mesh is in parameter ``points``."""
    try:
        add_to(hc.Scene(), MeshSettings(mesh, points=points), topology)
    except CORE_ERRORS as error:
        return str(error)
    return None
