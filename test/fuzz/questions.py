# SPDX-License-Identifier: Apache-2.0
"""Queries to the core and the oracle: contact, separation, proximity and intersections of single pairs; distances,
containment, collision-free steps, collision-free motions, winding numbers, separating translations and penetration of
small scenes; all results of small scenes with planes, points, thickness and filters."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import oracle

import hpccd_core as hc

from .containment import CONTAINMENT_KINDS, CONTAINMENT_POINTS, core_containment, true_containment
from .disturbances import disturb, disturb_near
from .gaps import GAP_POINTS, TOPOLOGIES, core_gaps, true_gaps
from .generators import EDGE_EDGE, GENERATORS, VERTEX_FACE
from .mixed import core_first, true_first
from .mixed_scenes import MIXED_SCENES
from .motions import FREE_MOTIONS, core_motions
from .near_generators import NEAR_GENERATORS
from .snapshots import EDGE_FACE, EDGE_FACE_POINTS, SNAPSHOTS
from .solid_scenes import DEPTHS, TRANSLATIONS, WINDING_POINTS
from .solids import (
    core_depths,
    core_points,
    core_signed_distances,
    core_translations,
    core_windings,
    true_depths,
    true_points,
    true_signed_distances,
    true_translations,
    true_windings,
)
from .steps import STEP_MOTIONS, core_steps, true_steps

CONTACT, SEPARATION, PROXIMITY, INTERSECTIONS = "contact", "separation", "proximity", "intersections"
DISTANCES, STEP, MOTION = "distances", "step", "motion"
CONTAINMENT, WINDING, SIGNED = "containment", "winding", "signed-distance"
TRANSLATION, DEPTH, POINTS, MIXED = "translation", "depth", "points", "mixed"
# By question, their kinds.
OF_SCENES = {
    DISTANCES: TOPOLOGIES,
    CONTAINMENT: CONTAINMENT_KINDS,
    STEP: STEP_MOTIONS,
    MOTION: FREE_MOTIONS,
    TRANSLATION: TRANSLATIONS,
    DEPTH: DEPTHS,
    MIXED: MIXED_SCENES,
}
PAIRS_OF_A_SCENE = 10  # a batch has a tenth as many scenes as single pairs: each scene has dozens of pairs

OF_SOLIDS = {
    CONTAINMENT: (true_containment, core_containment),
    WINDING: (true_windings, core_windings),
    SIGNED: (true_signed_distances, core_signed_distances),
    TRANSLATION: (true_translations, core_translations),
    DEPTH: (true_depths, core_depths),
}

# hit (Q,) bool; value (Q,) float64: time, distance, or 0. Distances (Q,N): several results for each scene.
Results = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Batch:
    """Queries of one kind from one generator, (Q,N,3). distances: (Q,); zero where the question has none."""

    question: str
    kind: str
    generator: str
    queries: np.ndarray
    distances: np.ndarray

    def part(self, chosen: np.ndarray) -> Batch:
        return Batch(self.question, self.kind, self.generator, self.queries[chosen], self.distances[chosen])


def kinds_of(question: str) -> tuple[str, ...]:
    if question in OF_SCENES:
        return tuple(OF_SCENES[question])
    if question in (WINDING, SIGNED):
        return tuple(WINDING_POINTS)
    return (EDGE_FACE,) if question in (INTERSECTIONS, POINTS) else (VERTEX_FACE, EDGE_EDGE)


def generators_of(question: str, kind: str) -> dict[str, Callable]:
    return {
        CONTACT: GENERATORS,
        SEPARATION: NEAR_GENERATORS,
        PROXIMITY: SNAPSHOTS,
        INTERSECTIONS: {EDGE_FACE: EDGE_FACE_POINTS},
        DISTANCES: dict.fromkeys(TOPOLOGIES, GAP_POINTS),
        STEP: STEP_MOTIONS,
        MOTION: FREE_MOTIONS,
        CONTAINMENT: CONTAINMENT_POINTS,
        WINDING: WINDING_POINTS,
        SIGNED: WINDING_POINTS,
        TRANSLATION: TRANSLATIONS,
        DEPTH: DEPTHS,
        MIXED: MIXED_SCENES,
        POINTS: {EDGE_FACE: EDGE_FACE_POINTS},
    }[question][kind]


def generated(question: str, kind: str, generator: str, rng: np.random.Generator, size: int) -> Batch:
    if question in OF_SCENES and kind not in GENERATORS:
        size = max(1, size // PAIRS_OF_A_SCENE)
    made = generators_of(question, kind)[generator](rng, size)
    if question == CONTACT:
        made = disturb(rng, made, kind)
    elif question == SEPARATION:
        made = disturb_near(rng, *made, kind)
    queries, distances = made if isinstance(made, tuple) else (made, np.zeros(size))
    return Batch(question, kind, generator, queries, distances)


def truth(batch: Batch, threads: int = 0) -> Results:
    """The oracle's results, on `threads` threads."""
    if batch.question == DISTANCES:
        return true_gaps(batch.kind, batch.queries)
    if batch.question in (STEP, MOTION):
        return true_steps(batch.kind, batch.queries, batch.distances, threads)
    if batch.question == MIXED:
        return true_first(batch.kind, batch.queries)
    if batch.question == POINTS:
        return true_points(batch.queries, threads)
    if batch.question in OF_SOLIDS:
        return OF_SOLIDS[batch.question][0](batch.kind, batch.queries, threads)
    vertex_face = batch.kind == VERTEX_FACE
    if batch.question == CONTACT:
        return (oracle.vertex_face if vertex_face else oracle.edge_edge)(batch.queries, threads)
    if batch.question == SEPARATION:
        separation = oracle.separation_vertex_face if vertex_face else oracle.separation_edge_edge
        return separation(batch.queries, batch.distances, threads)
    if batch.question == PROXIMITY:
        within = oracle.within_vertex_face if vertex_face else oracle.within_edge_edge
        distance = oracle.distance_vertex_face if vertex_face else oracle.distance_edge_edge
        return within(batch.queries, batch.distances, threads), distance(batch.queries, threads)
    return oracle.edge_face_intersect(batch.queries, threads), np.zeros(len(batch.queries))


def results(batch: Batch, accuracy: str, simd: str) -> Results:
    """The core's results."""
    if batch.question in (CONTACT, SEPARATION):
        return _times(batch, accuracy, simd)
    if batch.question == DISTANCES:
        return core_gaps(batch.kind, batch.queries, accuracy, simd)
    if batch.question == STEP:
        return core_steps(batch.kind, batch.queries, batch.distances, accuracy, simd)
    if batch.question == MOTION:
        return core_motions(batch.kind, batch.queries, batch.distances, accuracy, simd)
    if batch.question == MIXED:
        return core_first(batch.kind, batch.queries, accuracy, simd)
    if batch.question == POINTS:
        return core_points(batch.queries, accuracy, simd)
    if batch.question in OF_SOLIDS:
        return OF_SOLIDS[batch.question][1](batch.kind, batch.queries, accuracy, simd)
    return _of_snapshots(batch, accuracy, simd)


def size_of(batch: Batch) -> np.ndarray:
    """The unit of an error: a step, or the largest coordinate."""
    if batch.question not in (PROXIMITY, DISTANCES, SIGNED, TRANSLATION, DEPTH):
        return np.ones(len(batch.queries))
    vertices = batch.queries[:, :-1] if batch.question == TRANSLATION else batch.queries
    return np.maximum(np.abs(vertices).max(axis=(1, 2)), np.finfo(float).tiny)


CORE = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}


def _times(batch: Batch, accuracy: str, simd: str) -> Results:
    test = CORE[batch.kind]
    if batch.question == CONTACT:
        return test(batch.queries, accuracy=accuracy, simd=simd)
    hit, toc = np.zeros(len(batch.queries), bool), np.full(len(batch.queries), np.inf)
    distances, which = np.unique(batch.distances, return_inverse=True)
    for rows in np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1]):
        d = float(distances[which[rows[0]]])
        hit[rows], toc[rows] = test(batch.queries[rows], accuracy=accuracy, simd=simd, minimum_separation=d)
    return hit, toc


def _of_snapshots(batch: Batch, accuracy: str, simd: str) -> Results:
    detector = detector_of_pair(batch.kind, accuracy, simd)
    hit, value = np.zeros(len(batch.queries), bool), np.full(len(batch.queries), np.inf)
    for i, (points, distance) in enumerate(zip(batch.queries, batch.distances, strict=True)):
        if batch.question == INTERSECTIONS:
            found = (detector.intersections(points).ef == (0, 1, 1)).all(axis=1)
            hit[i], value[i] = found.any(), 0.0
            continue
        near = detector.proximity(points, float(distance))
        pairs, pair = (near.vf, (0, 0)) if batch.kind == VERTEX_FACE else (near.ee, (0, 1, 2, 3))
        at = np.flatnonzero((pairs == pair).all(axis=1))
        if len(at):
            hit[i] = True
            value[i] = (near.vf_distance if batch.kind == VERTEX_FACE else near.ee_distance)[at[0]]
    return hit, value


@functools.cache
def detector_of_pair(kind: str, accuracy: str, simd: str) -> hc.Detector:
    """For the points of one pair: a vertex and a face, or two edges, in one mesh; an edge and a face in two."""
    scene = hc.Scene()
    if kind == EDGE_FACE:
        scene.add_mesh("edge", [[0, 1, 1]], n_vertices=2)
        scene.add_mesh("face", [[0, 1, 2]], n_vertices=3)
    else:
        # A face that names a vertex twice is an edge.
        scene.add_mesh("pair", [[1, 2, 3]] if kind == VERTEX_FACE else [[0, 1, 1], [2, 3, 3]], n_vertices=4)
    return hc.Detector(scene, accuracy=accuracy, simd=simd, backend="cpu", threads=1)
