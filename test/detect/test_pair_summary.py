# SPDX-License-Identifier: Apache-2.0
"""A step in brief: which pairs are tested, and what each of them has, counted one contact at a time."""

import math

import numpy as np
import pytest
from waving_sheet import sheet_faces, sheet_positions

from hpccd_core import shapes
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.pair_summary import summarise
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

N = 6
NAMES = ("a", "b", "room", "wall")
MESHES = tuple(MeshSettings(name, static=name in ("room", "wall"), self_collision=name != "b") for name in NAMES)
# One topology each: a scene compares them by identity.
TOPOLOGIES = tuple(Topology(0, N * N, sheet_faces(N).astype(np.uint32)) for _ in NAMES)


def frame(k):
    away = np.array([100.0, 0, 0])
    parts = [sheet_positions(N, k), sheet_positions(N, k + 2, offset=0.02), sheet_positions(N, 9, offset=0.004)]
    vertices = tuple(part.astype(np.float64) for part in (*parts, parts[0] + away))
    return SceneFrame(k, k, "", TOPOLOGIES, vertices, NAMES, 0.0)


def detection(builder, **options):
    return StepDetector(builder, Options(**options)).detect(frame(0), frame(1))


@pytest.mark.parametrize("ignored", [(), (("room", "a"), ("a", "b"))])
def test_the_pairs_that_are_tested_are_those_of_the_core(ignored):
    builder = SceneBuilder(MESHES, ignored)
    gaps = detection(builder, distances=True).gaps
    assert [{a, b} for a, b in builder.tested_pairs] == [{gap.mesh_a, gap.mesh_b} for gap in gaps]
    order = [NAMES.index(a) * len(NAMES) + NAMES.index(b) for a, b in builder.tested_pairs]
    assert order == sorted(order)


def test_counts_and_times_are_those_of_the_contacts():
    builder = SceneBuilder(MESHES)
    found = detection(builder, distances=True)
    counts, first = {}, {}
    vertices, faces = found.layout.vertex_offsets, found.layout.face_offsets
    sides = [(v, f, faces, t) for (v, f), t in zip(found.contacts.vf, found.contacts.vf_toc, strict=True)]
    sides += [(e[0], e[2], vertices, t) for e, t in zip(found.contacts.ee, found.contacts.ee_toc, strict=True)]
    for one, other, offsets, toc in sides:
        a = max(k for k in range(len(NAMES)) if vertices[k] <= one)
        b = max(k for k in range(len(NAMES)) if offsets[k] <= other)
        pair = tuple(NAMES[k] for k in sorted((a, b)))
        counts[pair] = counts.get(pair, 0) + 1
        first[pair] = min(first.get(pair, math.inf), toc)
    summaries = summarise(found)
    assert sum(one.count for one in summaries) == len(found.contacts) > 0
    gaps = {frozenset((gap.mesh_a, gap.mesh_b)): gap.distance for gap in found.gaps}
    for one in summaries:
        pair = one.mesh_a, one.mesh_b
        assert (one.count, one.first_toc) == (counts.pop(pair, 0), first.get(pair, math.inf))
        assert one.distance == gaps[frozenset(pair)]
    assert not counts and {one.count for one in summaries if "wall" in (one.mesh_a, one.mesh_b)} == {0}


def test_a_distance_that_nobody_computed_is_unknown():
    builder = SceneBuilder(MESHES)
    assert all(math.isnan(one.distance) for one in summarise(detection(builder)))


def test_a_result_of_the_scene_before_has_the_pairs_of_its_own():
    """Another description of a robot may make another scene before the last result is told."""
    found = detection(SceneBuilder(MESHES, (("a", "b"),)))
    told = {(one.mesh_a, one.mesh_b) for one in summarise(found)}
    assert ("a", "a") in told and ("a", "room") in told and ("a", "b") not in told


def test_which_mesh_lies_inside():
    """In the order of the scene, and unknown without distances."""
    ball, faces = shapes.icosphere(1)
    for radii, inside in (((1.0, 2.0), 1), ((2.0, 1.0), 2), ((1.0, 1.0), 0)):
        frames = [
            SceneFrame(k, k, "", (Topology(0, len(ball), faces),) * 2, tuple(r * ball for r in radii), ("a", "b"), 0.0)
            for k in range(2)
        ]
        builder = SceneBuilder(tuple(map(MeshSettings, "ab")))
        for distances in (True, False):
            found = StepDetector(builder, Options(distances=distances)).detect(*frames)
            assert [one.inside for one in summarise(found) if one.mesh_a != one.mesh_b] == [inside * distances]
