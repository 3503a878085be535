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
    """N pairs within the separation, at their time of impact, as in hpccd_core.Contacts."""

    vertices: np.ndarray  # (N,4)
    weights: np.ndarray  # (N,4)
    normals: np.ndarray  # (N,3)


class Queries:
    """The four questions. Positions are (V,3) float32, the cloth's vertices first, then those of the obstacles.

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

    def free_motion(self, start: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(positions, factors): the end of a motion that is certainly free, with the setup's clearance kept, and how
        much of its own motion each vertex keeps; the same for all of the ball."""
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

    def __init__(self, setup: Setup, threads: int = 0):
        import hpccd_core

        super().__init__()
        scene, meshes = hpccd_core.Scene(), setup.meshes()
        for mesh in meshes:
            scene.add_mesh(mesh.name, mesh.faces, n_vertices=mesh.n_vertices, self_collision=mesh.self_collision)
        for pair in setup.ignored_pairs:
            scene.ignore_pair(*pair)
        # -1: each vertex of the cloth has its own factor. Another number: all vertices of that mesh share one.
        self._groups = np.repeat(np.arange(-1, len(meshes) - 1), [mesh.n_vertices for mesh in meshes])
        self._reaching = hpccd_core.Detector(
            scene, minimum_separation=setup.reach, outputs=("normals", "weights"), threads=threads
        )
        self._guarding = hpccd_core.Detector(scene, minimum_separation=setup.clearance, threads=threads)

    def near(self, start, end):
        with self._timed():
            return self._reaching.detect(start, end)

    def free_part(self, start, end):
        with self._timed():
            return self._guarding.collision_free_step(start, end)

    def free_motion(self, start, end):
        with self._timed():
            motion = self._guarding.collision_free_motion(start, end, self._groups)
        return motion.vertices, motion.factors

    def intersections(self, positions):
        with self._timed():
            return len(self._guarding.intersections(positions))
