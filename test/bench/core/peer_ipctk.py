# SPDX-License-Identifier: Apache-2.0
"""The CPU peer, ipctk (the Python module of ipc-toolkit): broad phase, then the earliest time of contact.

It does less than listing every contact: its narrow phase (Tight-Inclusion) stops early on later contacts.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
import time

import numpy as np

from bench.core.measure import Sample
from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.sources import Step

NOTE = (
    "ipctk: swept-box broad phase with its fastest method (LBVH) plus the narrow phase for the earliest time only; "
    "conversion to float64 and making its CollisionMesh not timed, its log off; same steps and number of threads, all "
    "triangles as one mesh for both"
)


def load():
    """The module. Raises UserError with the remedy where it is not installed."""
    try:
        return importlib.import_module("ipctk")
    except ImportError as error:
        raise UserError(f"--peer ipctk: cannot be imported ({error}); pip install 'hpccd[bench]', or ipctk") from error


class PeerRunner:
    """Runs ipctk along a sequence of steps. A sample's stages are "broad" and "narrow"."""

    name = "ipctk"
    carries_state = False

    def __init__(self, threads: int):
        self._ipctk = load()
        self._ipctk.set_logger_level(self._ipctk.LoggerLevel.off)
        self._threads = threads
        self._step: Step | None = None

    def run(self, step: Step) -> Sample:
        if self._step is not step:
            faces = step.faces().astype(np.int32)
            self._start = step.vertices_t0.astype(np.float64)
            self._end = step.vertices_t1.astype(np.float64)
            self._mesh = self._ipctk.CollisionMesh(self._start, self._ipctk.edges(faces), faces)
            self._step = step
        # The number of threads is a setting of the whole process.
        self._ipctk.set_num_threads(self._threads)
        with silent_stdout():
            return self._ask()

    def _ask(self) -> Sample:
        return self._earliest(0.0)

    def _earliest(self, distance: float) -> Sample:
        """The earliest time at which two features are within a distance (0: touch)."""
        candidates = self._ipctk.Candidates()
        began = time.perf_counter()
        candidates.build(self._mesh, self._start, self._end, distance, self._ipctk.LBVH())
        between = time.perf_counter()
        step_size = candidates.compute_collision_free_stepsize(self._mesh, self._start, self._end, distance)
        end = time.perf_counter()
        found = {
            "vf_candidates": len(candidates.fv_candidates),
            "ee_candidates": len(candidates.ee_candidates),
            "step_size": step_size,
        }
        stages = {"broad": 1e3 * (between - began), "narrow": 1e3 * (end - between)}
        return Sample(1e3 * (end - began), None, None, stages, found)


@contextlib.contextmanager
def silent_stdout():
    """Its log goes to file descriptor 1 past Python, thousands of lines where features touch at t=0."""
    sys.stdout.flush()
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
