# SPDX-License-Identifier: Apache-2.0
"""Depths of balls and boxes, whose shortest translations are known, and thinned polylines."""

import itertools

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import shapes
from hpccd_core.picture.lines import polylines
from hpccd_ros.detect.core import Cancellation
from hpccd_ros.detect.interpenetration import InterpenetrationDetector
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import MeshSettings, Topology

BALL, BALL_FACES = shapes.icosphere(4)
BOX, BOX_FACES = shapes.box()
NO_FACES = np.empty((0, 3), np.uint32)


def found(meshes, ignored=(), **static):
    """(contours, depths) of meshes {name: (vertices, topology)}."""
    settings = tuple(MeshSettings(name, static.get(name, False)) for name in meshes)
    detector = InterpenetrationDetector(SceneBuilder(settings, ignored))
    vertices, topologies = zip(*meshes.values(), strict=True)
    hits = detector.intersections(topologies, vertices)
    return hits.contours(), detector.depths(topologies, vertices, hits)


def ball(radius, centre):
    return radius * BALL + centre, Topology(0, len(BALL), BALL_FACES)


def box(size=1.0, centre=(0, 0, 0)):
    return BOX * size + np.asarray(centre, float), Topology(0, len(BOX), BOX_FACES)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("static", [False, True])
def test_a_ball_in_the_side_of_a_box(static, dtype):
    (vertices, topology), other = ball(0.25, [0.4, 0, 0]), box()
    meshes = {"ball": (vertices.astype(dtype), topology), "box": other}
    ((contour,), (depth,)) = found(meshes, ball=static)
    assert contour.closed and {contour.mesh_a, contour.mesh_b} == {"ball", "box"}
    if static:
        assert (depth.mesh_a, depth.mesh_b) == ("box", "ball"), "the one that can move"
        # Its side goes to where the deepest vertex of the ball is.
        assert np.allclose(depth.start, [0.5, 0, 0], atol=1e-6) and np.allclose(depth.end, [0.15, 0, 0], atol=1e-6)
    else:
        assert (depth.mesh_a, depth.mesh_b) == ("ball", "box")
        assert np.allclose(depth.start, [0.15, 0, 0], atol=1e-6) and np.allclose(depth.end, [0.5, 0, 0], atol=1e-6)
    assert depth.length == pytest.approx(0.35, abs=1e-6)


def test_edges_that_touch():
    """A bar across another one, turned by 45 degrees around its axis: edge meets edge."""
    half = np.sqrt(0.5)
    turned = BOX @ np.array([[1, 0, 0], [0, half, half], [0, -half, half]])
    upper = turned @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])
    shift = np.array([0.01, 0.02, 2 * half - 0.1])
    bar = Topology(0, len(BOX), BOX_FACES)
    _, (depth,) = found({"upper": (upper * [1, 9, 1] + shift, bar), "lower": (turned * [9, 1, 1], bar)})
    assert np.allclose(depth.translation, [0, 0, 0.1], atol=1e-6)
    assert np.allclose(depth.start, [0.01, 0, half - 0.1], atol=1e-6), "where both edges cross, seen from above"


def test_a_mesh_inside_another_meets_no_surface():
    contours, (depth,) = found({"ball": ball(0.25, [0.1, 0, 0]), "box": box()})
    assert contours == []
    assert np.allclose(depth.end, [0.5, 0, 0], atol=1e-6) and depth.length == pytest.approx(0.65, abs=1e-6)
    vertices, _ = box()
    open_box = vertices, Topology(0, len(vertices), BOX_FACES[1:])
    assert found({"ball": ball(0.25, [0.1, 0, 0]), "box": open_box}) == ([], []), "an open one contains nothing"


def test_pairs_without_a_depth():
    apart = {"ball": ball(0.25, [3, 0, 0]), "box": box()}
    meeting = {"ball": ball(0.25, [0.4, 0, 0]), "box": box()}
    assert found(apart) == ([], [])
    for ignored in ((("ball", "box"),), (("box", "ball"),)):
        assert found(meeting, ignored) == ([], [])
    # A rope has no faces: it meets the box, and no translation is searched.
    rope = np.array([[-2, 0.1, 0.2], [2, 0.1, 0.2]]), Topology(0, 2, NO_FACES, np.array([[0, 1]], np.uint32))
    contours, depths = found({"rope": rope, "box": box()})
    assert len(contours) == 2 and depths == []
    assert found({"empty": (np.empty((0, 3)), Topology(0, 0, NO_FACES)), "box": box()}) == ([], [])


def test_curves_within_a_mesh_count():
    both = (
        np.concatenate([BALL, BALL + [1.0, 0.1, 0.2]]),
        Topology(0, 2 * len(BALL), np.concatenate([BALL_FACES, BALL_FACES + np.uint32(len(BALL))])),
    )
    (contour,), depths = found({"both": both})
    assert (contour.mesh_a, contour.mesh_b) == ("both", "both") and depths == []


def test_each_pair_has_its_depth_and_topologies_may_change():
    meshes = {name: ball(1.0, [1.5 * k, 0.01 * k, 0]) for k, name in enumerate("abc")}
    _, depths = found(meshes)
    assert [(depth.mesh_a, depth.mesh_b) for depth in depths] == [("a", "b"), ("b", "c")]
    detector = InterpenetrationDetector(SceneBuilder((MeshSettings("one"), MeshSettings("two"))))
    for (one, first), (two, second) in itertools.pairwise([ball(1.0, [0, 0, 0]), box(1.0, [0.9, 0, 0]), box()]):
        hits = detector.intersections((first, second), (one, two))
        (depth,) = detector.depths((first, second), (one, two), hits)
        assert 0 < depth.length < 1.1


def test_a_cancelled_search_ends():
    cancellation = Cancellation()
    cancellation.cancel()
    detector = InterpenetrationDetector(SceneBuilder((MeshSettings("box"),)), cancellation=cancellation)
    vertices, topology = box()
    with pytest.raises(hc.Cancelled):
        detector.intersections((topology,), (vertices,))


def contour_of(points, closed=False):
    return hc.Contour(np.arange(len(points), dtype=np.uint32), np.asarray(points, float), closed, "a", "b")


@pytest.mark.parametrize("most", [4, 5, 10, 37, 200])
def test_polylines_keep_their_ends_and_stay_below_the_limit(most):
    random = np.random.default_rng(most)
    contours = [contour_of(random.normal(size=(n, 3)), closed=n % 2 == 0) for n in (1, 2, 3, 40, 61)]
    whole = polylines(contours, 10**6)
    assert [len(line) for line in whole] == [3, 3, 41, 61], "closed ones return; a point is no line"
    kept = polylines(contours, most)
    assert sum(map(len, kept)) <= most and kept
    for line in kept:
        (of,) = (one for one in whole if np.array_equal(one[0], line[0]) and np.array_equal(one[-1], line[-1]))
        rows = [int(np.flatnonzero((of == point).all(axis=1))[-1]) for point in line[1:]]
        assert rows == sorted(rows), "in order"
    assert polylines([], most) == []
