# SPDX-License-Identifier: Apache-2.0
"""Positions that queries of one snapshot reject, by name, place and remedy; and that they work afterwards."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

QUERIES = {
    "proximity": lambda detector, vertices: detector.proximity(vertices, 0.25),
    "intersections": lambda detector, vertices: detector.intersections(vertices),
    "distances": lambda detector, vertices: detector.distances(vertices),
}
EACH = pytest.mark.parametrize("query", QUERIES)


def response_of(found):
    return [(g.distance, g.kind, g.features) for g in found] if isinstance(found, list) else found.hash


@EACH
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.0000001e300, -1.7e308])
def test_coordinates_that_are_no_places(query, dtype, bad):
    meshes = random_scenes.many_meshes(np.random.default_rng(91))
    detector = hc.Detector(meshes.scene(), backend="cpu", threads=2)
    good = meshes.vertices_t1.astype(dtype)
    before = response_of(QUERIES[query](detector, good))
    with np.errstate(over="ignore"):  # of float32 what is too large is infinite
        for row, axis in ((0, 0), (len(good) // 2, 2), (len(good) - 1, 1)):
            vertices = good.copy()
            vertices[row, axis] = bad
            with pytest.raises(ValueError, match=rf"^vertices\[{row}, {axis}\] is ") as rejected:
                QUERIES[query](detector, vertices)
            text = str(rejected.value)
            assert "must be finite" in text or "beyond 1e+300: intermediate results could overflow; scale" in text
    assert response_of(QUERIES[query](detector, good)) == before


@EACH
@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        (np.zeros((3, 3)), ValueError, r"^vertices: expected shape \(\d+, 3\)"),
        (np.zeros(3), ValueError, r"^vertices: expected shape \(\d+, 3\)"),
        (None, TypeError, "^vertices: "),
        ("points", TypeError, "^vertices: "),
    ],
)
def test_what_is_no_array_of_places(query, bad, error, text):
    detector = hc.Detector(random_scenes.single_mesh(np.random.default_rng(92)).scene(), backend="cpu")
    with pytest.raises(error, match=text):
        QUERIES[query](detector, bad)


@EACH
def test_other_numbers_are_converted_by_the_caller(query):
    meshes = random_scenes.single_mesh(np.random.default_rng(93))
    with pytest.raises(TypeError, match="^vertices: expected float32 or float64"):
        QUERIES[query](hc.Detector(meshes.scene(), backend="cpu"), meshes.vertices_t0.astype(int))


@EACH
def test_the_largest_coordinates_are_taken(query):
    """Twice as far as in detection: only differences are looked at. As at a scale at which nothing can overflow."""
    meshes = random_scenes.many_meshes(np.random.default_rng(94))
    detector = hc.Detector(meshes.scene(), backend="cpu")
    large, small = meshes.vertices_t1 * 2.0**990, meshes.vertices_t1
    assert 1e298 < np.abs(large).max() < 1e300
    if query == "distances":
        pairs = list(zip(detector.distances(small), detector.distances(large), strict=True))
        assert all(b.distance == pytest.approx(a.distance * 2.0**990, rel=1e-11) for a, b in pairs)
        assert any(0 < a.distance < np.inf for a, _ in pairs)
    elif query == "proximity":
        near, same = detector.proximity(small, 0.25), detector.proximity(large, 0.25 * 2.0**990)
        assert len(near) and np.array_equal(near.vf, same.vf) and np.array_equal(near.ee, same.ee)
    else:
        assert (
            len(detector.intersections(small))
            and detector.intersections(large).hash == detector.intersections(small).hash
        )


def test_what_a_snapshot_may_hold_a_motion_may_not_even_at_rest():
    """A static mesh that proximity has taken is rejected by detect all the same, as a new detector rejects it."""
    scene = hc.Scene()
    scene.add_mesh("moving", [[0, 1, 2]])
    scene.add_mesh("static", [[0, 1, 2]], static=True)
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    far = np.vstack([triangle, triangle + [0, 0, 1e200]])
    detector = hc.Detector(scene, backend="cpu")
    for _ in range(2):
        assert len(detector.proximity(far, 0.1)) == 0
        with pytest.raises(ValueError, match=r"vertices_t0\[3, 2\] is 1e\+200, beyond 1e\+150"):
            detector.detect(far, far)
