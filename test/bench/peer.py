# SPDX-License-Identifier: Apache-2.0
"""The same steps by hpccd and by ipctk (the Python module of ipc-toolkit, pip install ipctk), alternating.

  python -m bench peer                           the files of HPCCD_DATA
  python -m bench peer run.mcap --steps 8

ipctk computes the earliest time only; its narrow phase (Tight-Inclusion) stops early on later contacts. Both take all
triangles as one mesh.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import sys
import time

import numpy as np

from bench import lab
from hpccd_ros.bench.measure import Runner, Sample
from hpccd_ros.bench.sources import Step

NOTE = (
    "ipctk: its fastest broad phase (LBVH) plus the narrow phase for the earliest time; proximity is "
    "NormalCollisions.build, which merges pairs with the same nearest vertex or edge; intersections is yes or no; "
    "conversion to float64 and making its CollisionMesh not timed, its log off; same steps and number of threads"
)
COLUMNS = {
    "scene": "scene",
    "variant": "variant",
    "triangles": "triangles",
    "contacts": lab.whole("contacts"),
    "median ms": "median_ms",
    "x ipctk": "times_faster_than_ipctk",
}


def configure(parser):
    lab.configure(parser, ("data",), steps=12)
    lab.tier_option(parser)


def run(args) -> lab.Report:
    result, sources = lab.begin(args)
    result.note(NOTE)
    threads = args.threads or lab.cores()
    for source in sources:
        options = {"accuracy": args.accuracy, "threads": threads, "backend": "cpu"}
        runners = [Runner(f"cpu {r}", {**options, "report": r}, change=Step.as_one_mesh) for r in ("all", "first")]
        runners.append(PeerRunner(threads))
        asked = {r.name: {"variant": r.name, "threads": threads} for r in runners}
        rows = lab.compare(result, args, source, runners, "cpu all", asked, check=False)
        for row in rows[:2]:
            row["times_faster_than_ipctk"] = rows[2]["step_ms"] / row["step_ms"]
    lab.show(f"beside ipctk, {args.accuracy}, {threads} threads", COLUMNS, result.rows)
    return result


class PeerRunner:
    """Asks ipctk one query of each step: the earliest time within a distance, or of the end "proximity" or
    "intersections"."""

    carries_state = False

    def __init__(self, threads: int, query: str = "earliest", distance: float = 0.0, name: str = "ipctk"):
        try:
            self._ipctk = importlib.import_module("ipctk")
        except ImportError as error:
            raise lab.UserError(f"ipctk: cannot be imported ({error}); pip install 'hpccd[bench]', or ipctk") from error
        self._ipctk.set_logger_level(self._ipctk.LoggerLevel.off)
        self.name, self._threads, self._query, self._distance = name, threads, query, distance
        self._step: Step | None = None

    def run(self, step: Step) -> Sample:
        if self._step is not step:
            faces = step.faces().astype(np.int32)
            self._start, self._end = step.vertices_t0.astype(np.float64), step.vertices_t1.astype(np.float64)
            self._mesh = self._ipctk.CollisionMesh(self._start, self._ipctk.edges(faces), faces)
            self._step = step
        self._ipctk.set_num_threads(self._threads)  # a setting of the whole process
        with silent_stdout():
            began = time.perf_counter()
            count = self._ask()
            return Sample(1e3 * (time.perf_counter() - began), None, count, {}, {})

    def _ask(self) -> int | None:
        kit = self._ipctk
        if self._query == "proximity":
            collisions = kit.NormalCollisions()
            collisions.build(self._mesh, self._end, self._distance, 0.0, kit.LBVH())
            return len(collisions)
        if self._query == "intersections":
            return int(kit.has_intersections(self._mesh, self._end, kit.LBVH()))
        candidates = kit.Candidates()
        candidates.build(self._mesh, self._start, self._end, self._distance, kit.LBVH())
        candidates.compute_collision_free_stepsize(self._mesh, self._start, self._end, self._distance)
        return None


@contextlib.contextmanager
def silent_stdout():
    """Its log goes to file descriptor 1 past Python, thousands of lines where features touch at t=0."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)
