# SPDX-License-Identifier: Apache-2.0
"""Minimum separation: what comes within it is reported in time, what stays beyond it is not."""

import functools

import numpy as np
import pytest
import random_scenes
from distances import distance_at
from fuzz.generators import EDGE_EDGE, GENERATORS, VERTEX_FACE

import hpccd_core as hc

CORE = {VERTEX_FACE: hc.test_vertex_face, EDGE_EDGE: hc.test_edge_edge}
KINDS = pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
TIMES = np.linspace(0, 1, 801)


@functools.cache
def _sampled(kind, generator):
    """Queries, their distances at TIMES, and how far the fastest vertex of each moves."""
    queries = GENERATORS[kind][generator](np.random.default_rng(1), 250)
    if generator == "generic":  # a multiple of 2^-20 stays exact when shifted
        queries = np.round(queries * 2**20) / 2**20
    distance = distance_at(kind, queries, TIMES[:, None] + np.zeros(len(queries)))
    return queries, distance, np.linalg.norm(queries[:, 4:] - queries[:, :4], axis=2).max(axis=1)


@KINDS
@pytest.mark.parametrize("generator", ["generic", "meeting", "lattice", "thin"])
@pytest.mark.parametrize("separation", [1e-3, 0.05])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (2.0**60, 0.0), (2.0**-60, 0.0), (1.0, 2.0**30)])
@pytest.mark.parametrize(
    "accuracy", ["fast", pytest.param("balanced", marks=pytest.mark.long), "conservative", "exact"]
)
def test_guarantee(kind, generator, separation, scale, offset, accuracy):
    queries, distance, longest_motion = _sampled(kind, generator)
    given = scale * (queries + offset)
    hit, toc = CORE[kind](given, accuracy, minimum_separation=scale * separation)

    within = distance <= separation * (1 - 1e-6)
    first = np.where(within.any(axis=0), TIMES[within.argmax(axis=0)], np.inf)
    assert hit[within.any(axis=0)].all(), "missed"
    assert (np.where(hit, toc, np.inf) <= first).all(), "late"
    # Between two samples neither feature moves further than its fastest vertex.
    between = 2 * longest_motion * (TIMES[1] - TIMES[0])
    beyond = distance.min(axis=0) - between > separation
    assert within.any() and beyond.any()
    assert not (hit & beyond).any(), "invented"


@pytest.mark.parametrize("units", (1, 2, 3, 5))
def test_separations_of_the_least_numbers_there_are(units):
    """Half of such a number may be none. A vertex above a triangle, so far that the floor of half is too little."""
    least = np.nextafter(0.0, 1.0)
    scene = hc.Scene()
    scene.add_mesh("triangle", [[0, 1, 2]], n_vertices=3)
    scene.add_mesh("point", np.empty((0, 3), int), n_vertices=1)
    vertices = least * np.array([[0, 0, 0], [40, 0, 0], [0, 40, 0], [9, 9, units]])
    for method in ("default", "published"):
        found = [
            hc.Detector(scene, backend="cpu", method=method, minimum_separation=separation).detect(vertices, vertices)
            for separation in least * np.arange(1, units + 2)
        ]
        assert [len(contacts) for contacts in found] == [0] * (units - 1) + [1, 1]


def test_separation_of_a_scene():
    """Candidates must be gathered within the separation too: compared with all pairs of a small scene."""
    meshes = random_scenes.combine(
        random_scenes.crumpled_sheet(np.random.default_rng(3), 5), random_scenes.tetrahedron(np.random.default_rng(4))
    )
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    separation = 0.2
    detector = hc.Detector(meshes.scene(), minimum_separation=separation)
    contacts = detector.detect(v0, v1)
    found = set(map(tuple, contacts.vf.tolist()))
    faces = np.concatenate([meshes.faces[0], meshes.faces[1] + meshes.n_vertices[0]])
    pairs = np.array([(v, f) for v in range(len(v0)) for f in range(len(faces)) if v not in faces[f]])
    points = np.hstack([pairs[:, :1], faces[pairs[:, 1]]])
    hit, toc = hc.test_vertex_face(np.hstack([v0[points], v1[points]]), minimum_separation=separation)
    assert found == set(map(tuple, pairs[hit].tolist()))
    np.testing.assert_array_equal(contacts.vf_toc, toc[hit])
    assert len(found) > len(hc.Detector(meshes.scene()).detect(v0, v1).vf)


@pytest.mark.parametrize(
    ("options", "error", "text"),
    [
        ({"minimum_separation": -1.0}, ValueError, "minimum_separation.*negative"),
        ({"minimum_separation": np.nan}, ValueError, "minimum_separation.*finite"),
        ({"minimum_separation": "1"}, TypeError, "minimum_separation.*number"),
    ],
)
def test_bad_separation(options, error, text):
    options = {"accuracy": "conservative"} | options
    with pytest.raises(error, match=text):
        hc.Detector(hc.Scene(), **options)
    with pytest.raises(error, match=text):
        hc.test_vertex_face(np.zeros((1, 8, 3)), **options)
