# SPDX-License-Identifier: Apache-2.0
"""Where edges and faces meet: points, edge parameters and weights against rational arithmetic."""

from fractions import Fraction

import many_worlds
import numpy as np
import pytest
import random_scenes
from exact_intersections import place, rational
from fuzz.snapshots import EDGE_FACE_POINTS

import hpccd_core as hc

LEAST = Fraction(np.nextafter(0.0, 1.0))  # of which coordinates are multiples
ARRAYS = ("points", "edge_parameters", "weights", "incidences", "directions")


def incidence_of(s, weights):
    return (s == 0) + 2 * (s == 1) + sum(4 << i for i in range(3) if weights[i] == 0)


def assert_places(found, vertices, faces, most=None):
    """Against rational arithmetic; of at most `most` rows."""
    assert len(found.points) == len(found.edge_parameters) == len(found.weights) == len(found)
    assert (found.weights >= 0).all() and (found.weights <= 1).all()
    assert (found.edge_parameters >= 0).all() and (found.edge_parameters <= 1).all()
    step = 1 if most is None else max(1, len(found) // most)
    for i in range(0, len(found), step):
        a0, a1, face = found.ef[i]
        edge, corners = rational(vertices[[a0, a1]]), rational(vertices[faces[face]])
        truth = place(edge, corners)
        assert truth is not None
        s, weights = truth
        error = abs(Fraction(float(found.edge_parameters[i])) - s)
        assert error <= Fraction(1, 10**12), (i, float(error))
        exact = [x + s * (y - x) for x, y in zip(*edge, strict=True)]
        size = max(abs(x) for p in edge for x in p)
        errors = [abs(Fraction(float(x)) - y) for x, y in zip(found.points[i], exact, strict=True)]
        assert max(errors) <= size / 10**12 + 2 * LEAST
        given = [Fraction(float(x)) for x in found.weights[i]]
        assert abs(sum(given) - 1) <= Fraction(2, 10**12)
        scale = max(abs(x) for p in corners for x in p)
        on_face = [sum(w * x for w, x in zip(given, xs, strict=True)) for xs in zip(*corners, strict=True)]
        assert all(abs(x - y) <= max(size, scale) * Fraction(4, 10**12) for x, y in zip(on_face, exact, strict=True))
        u, v = ([y - x for x, y in zip(corners[0], p, strict=True)] for p in corners[1:])
        flat = all(u[k] * v[k - 1] == u[k - 1] * v[k] for k in range(3))
        if not flat:  # otherwise several weights give the point
            assert all(abs(x - y) <= Fraction(1, 10**12) for x, y in zip(given, weights, strict=True))
            assert found.incidences[i] & 31 == incidence_of(s, weights)


@pytest.mark.parametrize("generate", random_scenes.ALL)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_scenes(generate, dtype):
    meshes = generate(np.random.default_rng(71))
    vertices = meshes.vertices_t1.astype(dtype)
    if not np.isfinite(vertices).all():
        pytest.skip("not in the range of float32")
    scene = meshes.scene()
    found = hc.Detector(scene, outputs=("points",), backend="cpu").intersections(vertices)
    assert len(found)
    assert_places(found, vertices, found.faces, most=60)
    assert found.hash == hc.Detector(scene, backend="cpu").intersections(vertices).hash


@pytest.mark.parametrize("name", EDGE_FACE_POINTS)
def test_single_pairs(name):
    """An edge and a face at all scales, up to 1e300; slivers, coplanar and collinear ones among them."""
    scene = hc.Scene()
    scene.add_mesh("edge", edges=[[0, 1]])
    scene.add_mesh("face", [[0, 1, 2]])
    detector = hc.Detector(scene, outputs=("points",), backend="cpu", threads=1)
    n = 0
    for vertices in EDGE_FACE_POINTS[name](np.random.default_rng(72), 300):
        found = detector.intersections(vertices)
        n += len(found)
        assert_places(found, vertices, found.faces)
    assert n


def test_slivers():
    """Needles with angles down to 1e-12, crossed at slopes down to 1e-9."""
    rng = np.random.default_rng(5)
    scene = hc.Scene()
    scene.add_mesh("edge", edges=[[0, 1]])
    scene.add_mesh("face", [[0, 1, 2]])
    detector = hc.Detector(scene, outputs=("points",), backend="cpu", threads=1)
    n = 0
    for _ in range(200):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        thin, flat = 10.0 ** rng.uniform(-12, 0), 10.0 ** rng.uniform(-9, 0)
        face = np.array([[0, 0, 0], [1, 0, 0], [rng.uniform(), thin, 0]])
        middle = rng.dirichlet([1, 1, 1]) @ face
        along = np.array([rng.normal(), rng.normal(), flat])
        vertices = np.concatenate([[middle - rng.uniform() * along, middle + rng.uniform() * along], face]) @ turn.T
        found = detector.intersections(vertices)
        n += len(found)
        assert_places(found, vertices, found.faces)
    assert n > 100


def test_an_overlap_begins_nearer_to_the_first_vertex_of_the_edge():
    scene = hc.Scene()
    scene.add_mesh("edge", edges=[[0, 1]])
    scene.add_mesh("face", [[0, 1, 2]])
    vertices = np.array([[-1, 1, 0], [3, 1, 0], [0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    found = hc.Detector(scene, outputs=("points",)).intersections(vertices)
    assert found.points.tolist() == [[0, 1, 0]] and found.edge_parameters.tolist() == [0.25]
    assert found.weights.tolist() == [[0.75, 0, 0.25]] and found.incidences.tolist() == [8 + 32]
    vertices[[0, 1]] = vertices[[1, 0]]
    found = hc.Detector(scene, outputs=("points",)).intersections(vertices)
    assert found.points.tolist() == [[3, 1, 0]] and found.edge_parameters.tolist() == [0]


def test_threads_and_backends_agree():
    meshes = random_scenes.single_mesh(np.random.default_rng(3))
    options = [{"threads": 1}, {"threads": 4}, {"threads": 2, "simd": "scalar"}]
    options += [{"backend": backend} for backend in hc.backends()]
    outputs = ("points", "directions")
    found = [hc.Detector(meshes.scene(), outputs=outputs, **o).intersections(meshes.vertices_t1) for o in options]
    assert all(other == found[0] for other in found[1:])
    assert sorted(found[0].outputs) == sorted(ARRAYS)


def test_worlds():
    worlds = many_worlds.crumpled(4)
    scene, ends = worlds.scene, worlds.end
    outputs = ("points", "directions")
    found = hc.Detector(scene, worlds=4, outputs=outputs).intersections(ends)
    for k in range(4):
        alone = hc.Detector(scene, outputs=outputs).intersections(ends[k])
        assert found.world(k) == alone and len(alone)
    rows = np.concatenate([c.rows for c in found.contours()])
    assert sorted(rows.tolist()) == list(range(len(found)))
    assert [c.points.tolist() for c in found.contours()] == [
        c.points.tolist() for k in range(4) for c in found.world(k).contours()
    ]
    assert len(found.regions()) == len(found.contours())


def test_outputs_that_were_not_asked_for():
    meshes = random_scenes.single_mesh(np.random.default_rng(3))
    found = hc.Detector(meshes.scene(), outputs=("normals",)).intersections(meshes.vertices_t1)
    for name in ("points", "edge_parameters", "weights", "incidences"):
        with pytest.raises(hc.OutputNotComputed, match=rf"{name}: not computed; .*outputs=\('points',\)"):
            getattr(found, name)
    with pytest.raises(hc.OutputNotComputed, match=r"outputs=\('directions',\)"):
        found.directions  # noqa: B018
    for ask in (found.contours, found.regions):
        with pytest.raises(hc.OutputNotComputed, match="points"):
            ask()
    found = hc.Detector(meshes.scene(), outputs=("directions",)).intersections(meshes.vertices_t1)
    assert found.directions.shape == (len(found), 3) and not hasattr(found, "points")
