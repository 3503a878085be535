# SPDX-License-Identifier: Apache-2.0
"""The distance queries of the CPU peer, ipctk: of detection with a separation, of proximity, of intersections."""

from __future__ import annotations

import time
from collections.abc import Callable

from bench.core.distance_queries import Question
from bench.core.measure import Sample
from bench.core.peer_ipctk import PeerRunner

NOTE = (
    "ipctk, all with its fastest broad phase (LBVH): separation is Candidates.build and the earliest time only "
    "(compute_collision_free_stepsize); proximity is NormalCollisions.build, which lists pairs and merges those with "
    "the same nearest vertex or edge; intersections is has_intersections, yes or no, which may stop at the first; same "
    "d, same frames, same number of threads, all triangles as one mesh for both; conversion to float64 and making its "
    "CollisionMesh not timed"
)
QUERIES = ("separation", "proximity", "intersections")


class DistancePeer(PeerRunner):
    """Asks ipctk one question of each step."""

    def __init__(self, question: Question, threads: int):
        super().__init__(threads)
        self.name = f"ipctk {question.name}"
        self._distance = question.distance
        self._ask = getattr(self, f"_{question.query}")

    def _separation(self) -> Sample:
        return self._earliest(self._distance)

    def _proximity(self) -> Sample:
        collisions = self._ipctk.NormalCollisions()
        return _timed(
            lambda: collisions.build(self._mesh, self._end, self._distance, 0.0, self._ipctk.LBVH()),
            lambda built: len(collisions),
        )

    def _intersections(self) -> Sample:
        return _timed(lambda: self._ipctk.has_intersections(self._mesh, self._end, self._ipctk.LBVH()), int)


def _timed(ask: Callable[[], object], count: Callable[[object], int]) -> Sample:
    began = time.perf_counter()
    answer = ask()
    ms = 1e3 * (time.perf_counter() - began)
    return Sample(ms, None, count(answer), {}, {})
