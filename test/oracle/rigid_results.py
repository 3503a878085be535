# SPDX-License-Identifier: Apache-2.0
"""Results of the detector for random queries through hpccd_core.rigid, compared with the truth."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

import hpccd_core as hc
from hpccd_core.rigid.cuts import Margin, bound, fewest_parts, grown
from oracle.rigid_queries import Queries
from oracle.rigid_truth import BEYOND, OPEN, WITHIN, comes_within

MOST_PARTS = 16
# Times are within 1e-12 of the step (exact tier).
_TOC_ERROR = 1e-12


@dataclass(frozen=True, eq=False)
class Results:
    """(Q,) each. ``hit``, ``toc``: what was found; ``bound``: B_a + B_b + rho; ``parts``: of the step."""

    hit: np.ndarray
    toc: np.ndarray
    bound: np.ndarray
    deviation: np.ndarray
    parts: np.ndarray
    seconds: float


def ask(queries: Queries) -> Results:
    test = hc.test_vertex_face if queries.pairs.kind == "vf" else hc.test_edge_edge
    n = len(queries.distance)
    hit, toc = np.zeros(n, bool), np.full(n, np.inf)
    bounds, deviations, parts = np.empty(n), np.empty(n), np.empty(n, int)
    began = time.perf_counter()
    for k in range(n):
        motions = queries.motions(k)
        cut = fewest_parts(motions, float(queries.tolerance[k]), MOST_PARTS)
        margins = [Margin.of(motion, cut.parts) for motion in motions]
        frames = np.stack([np.concatenate([m.vertices(j, cut.parts) for m in motions]) for j in range(cut.parts + 1)])
        steps = np.concatenate([frames[:-1], frames[1:]], axis=1)
        hits, tocs = test(steps, minimum_separation=grown(float(queries.distance[k]), *margins))
        bounds[k], deviations[k], parts[k] = bound(margins), sum(m.deviation for m in margins), cut.parts
        if hits.any():
            first = int(hits.argmax())
            hit[k], toc[k] = True, (first + tocs[first]) / cut.parts
    return Results(hit, toc, bounds, deviations, parts, time.perf_counter() - began)


@dataclass(frozen=True)
class Verdict:
    """Counts of queries.

    ``missed``: false negatives, proven to come within the distance. ``late``: reported too late.
    ``beyond``: at the reported time, farther apart than the distance plus twice the bound.
    ``open``: reported free, or in time, and not proven either way.
    ``excess``: false positives, proven not to come within the distance.
    ``worst_excess``: the largest distance at the reported time minus the requested one, divided by the bound.
    """

    queries: int
    touching: int
    apart: int
    reported: int
    missed: int
    late: int
    beyond: int
    open: int
    excess: int
    worst_excess: float

    @property
    def right(self) -> bool:
        return not (self.missed or self.late or self.beyond or self.open)


def judge(queries: Queries, results: Results) -> Verdict:
    """A contact at distance 0 cannot be proven by distances, nor need it be: what is proven is that nothing touches."""
    pairs, d = queries.pairs, queries.distance
    free, found = np.flatnonzero(~results.hit), np.flatnonzero(results.hit)
    asked = np.flatnonzero(~results.hit | (d > 0))
    truth = np.full(len(d), OPEN)
    truth[asked] = comes_within(pairs, d[asked], rows=asked)
    limit = d[found] + 2 * results.bound[found]
    # At the reported time the distance is the reported one, except for the error of the time.
    apart = pairs.near(found, results.toc[found])[0]
    speed = _speed(pairs, found, results.toc[found])
    late_by = _TOC_ERROR * speed + 64 * np.finfo(float).eps * pairs.size()[found]
    timed = np.flatnonzero(results.hit & (d > 0) & (results.toc > _TOC_ERROR))
    before = comes_within(pairs, d[timed], until=results.toc[timed] - _TOC_ERROR, rows=timed)
    excess = (apart - d[found]) / np.maximum(results.bound[found], 1e-300)
    measurable = results.bound[found] > 1e3 * late_by
    return Verdict(
        queries=len(d),
        touching=int((truth == WITHIN).sum()),
        apart=int((truth == BEYOND).sum()),
        reported=len(found),
        missed=int((truth[free] == WITHIN).sum()),
        late=int((before == WITHIN).sum()),
        beyond=int((apart > limit + late_by).sum()),
        open=int((truth[free] == OPEN).sum() + (before == OPEN).sum()),
        excess=int((truth[found] == BEYOND).sum()),
        worst_excess=float(excess[measurable].max(initial=0.0)),
    )


def _speed(pairs, rows, t):
    (_, va), (_, vb) = pairs.a.at(rows, t, np.float64), pairs.b.at(rows, t, np.float64)
    return np.linalg.norm(va, axis=2).max(axis=1) + np.linalg.norm(vb, axis=2).max(axis=1)
