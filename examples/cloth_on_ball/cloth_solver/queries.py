# SPDX-License-Identifier: Apache-2.0
"""The queries of the solver, and the collision detector of this process that computes them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

import numpy as np

from cloth_solver.setup import Setup


class Near(Protocol):
    """Pairs within the separation: as hpccd_core.Contacts names them, with normals and closest points at their toc."""

    vf: np.ndarray
    vf_toc: np.ndarray
    ee: np.ndarray
    ee_toc: np.ndarray
    normals: np.ndarray
    closest: np.ndarray


class Queries:
    """The three questions. Positions are (V,3) float32, the cloth's vertices first, then the ball's.

    seconds: spent in queries so far, with transport.
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    def near(self, start: np.ndarray, end: np.ndarray) -> Near:
        """Pairs that come within the reach of the setup on the way."""
        raise NotImplementedError

    def free_part(self, start: np.ndarray, end: np.ndarray) -> float:
        """How much of the way is certainly free, with the setup's clearance kept; 1.0 for all of it."""
        raise NotImplementedError

    def intersections(self, positions: np.ndarray) -> int:
        """Edges that intersect or touch a face."""
        raise NotImplementedError

    def made(self, positions: np.ndarray) -> None:
        """Told of each frame: for who listens."""

    @contextmanager
    def _timed(self) -> Iterator[None]:
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds += time.perf_counter() - begin


class InProcess(Queries):
    """hpccd_core in this process. Two detectors, since each keeps boxes that fit its separation."""

    def __init__(self, setup: Setup, cloth_faces: np.ndarray, ball_faces: np.ndarray, n_ball: int, threads: int = 0):
        import hpccd_core

        super().__init__()
        scene = hpccd_core.Scene()
        scene.add_mesh("cloth", cloth_faces)
        scene.add_mesh("ball", ball_faces, self_collision=False, n_vertices=n_ball)
        self._reaching = hpccd_core.Detector(
            scene, minimum_separation=setup.reach, outputs=("normals", "closest"), threads=threads
        )
        self._guarding = hpccd_core.Detector(scene, minimum_separation=setup.clearance, threads=threads)

    def near(self, start, end):
        with self._timed():
            return self._reaching.detect(start, end)

    def free_part(self, start, end):
        with self._timed():
            return self._guarding.collision_free_step(start, end)

    def intersections(self, positions):
        with self._timed():
            return len(self._guarding.intersections(positions))
