# SPDX-License-Identifier: Apache-2.0
"""Penetration: convex pairs against the oracle of all normals, and that every result is free by other queries."""

import numpy as np
import oracle
import pytest
from fuzz.solid_scenes import TRANSLATION_SCENES, TRANSLATIONS

import hpccd_core as hc

TETRAHEDRON = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def detector_of(*meshes, threads=1):
    scene = hc.Scene()
    for name, (vertices, faces) in zip("abcdefgh", meshes, strict=False):
        scene.add_mesh(name, faces, n_vertices=len(vertices))
    return hc.Detector(scene, backend="cpu", threads=threads)


def penetration(a, b, **more):
    detector = detector_of(a, b)
    return detector.penetration(np.concatenate([a[0], b[0]]), "a", "b", **more)


def is_free(a, b, translation):
    """By intersections and winding numbers of all vertices."""
    moved = a[0].astype(np.float64) + translation
    detector, vertices = detector_of((moved, a[1]), b), np.concatenate([moved, b[0]])
    hits = detector.intersections(vertices)
    if (hits.mesh_a != hits.mesh_b).any():
        return False
    return not any(
        hc.closed(faces) and detector.winding_numbers(vertices, points, name)[0].any()
        for name, faces, points in (("a", a[1], b[0]), ("b", b[1], moved))
    )


def random_turn(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def convex(rng):
    """A stretched and turned icosphere, box or tetrahedron: affine images of convex meshes."""
    vertices, faces = (
        hc.shapes.icosphere(rng.integers(1, 3)),
        hc.shapes.box(),
        (rng.normal(size=(4, 3)), TETRAHEDRON),
    )[rng.integers(3)]
    if len(vertices) == 4 and np.linalg.det(vertices[1:] - vertices[0]) < 0:
        faces = faces[:, ::-1]
    return vertices @ np.diag(rng.uniform(0.3, 1.5, 3)) @ random_turn(rng) + rng.normal(size=3) * 0.4, faces


def torus(n, m, radius=1.0, tube=0.35):
    u, v = (2 * np.pi * np.arange(k) / k for k in (n, m))
    u, v = (x.ravel() for x in np.meshgrid(u, v, indexing="ij"))
    ring = radius + tube * np.cos(v)
    vertices = np.stack([ring * np.cos(u), ring * np.sin(u), tube * np.sin(v)], axis=1)
    i, k = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b = i * m + k, (i + 1) % n * m + k
    c, d = (i + 1) % n * m + (k + 1) % m, i * m + (k + 1) % m
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)


def bumpy(frequency, rng):
    vertices, faces = hc.shapes.icosphere(frequency)
    k = rng.normal(size=(3, 3)) * 4
    return vertices * (1 + 0.15 * np.sin(vertices @ k).sum(axis=1, keepdims=True) / 2), faces


def test_convex_pairs():
    rng = np.random.default_rng(12)
    pairs = [(convex(rng), convex(rng)) for _ in range(250)]
    expected = oracle.convex_depths(pairs)
    ratios = []
    for (a, b), true in zip(pairs, expected, strict=True):
        p = penetration(a, b)
        assert is_free(a, b, p.translation)
        assert p.depth == pytest.approx(np.linalg.norm(p.translation), rel=1e-14)
        assert p.lower_bound <= p.depth
        if true == 0:
            assert p.depth == 0
            continue
        assert p.lower_bound <= true
        assert p.depth >= true * (1 - 1e-12)
        ratios.append(p.depth / true)
    assert len(ratios) > 150
    assert np.mean(np.array(ratios) <= 1.001) >= 0.99, np.sort(ratios)[-10:]


@pytest.mark.parametrize("seed", range(4))
def test_meshes_that_are_not_convex(seed):
    rng = np.random.default_rng(seed)
    for a, b in ((torus(24, 12), torus(24, 12)), (bumpy(6, rng), bumpy(5, rng)), (torus(16, 8), bumpy(4, rng))):
        a = (a[0] @ random_turn(rng) + 0.4 * rng.normal(size=3), a[1])
        p, q = penetration(a, b), penetration(b, a)
        for (x, y), r in (((a, b), p), ((b, a), q), ((a, b), hc.Penetration(-q.translation, q.depth, 0, "", ()))):
            assert is_free(x, y, r.translation * (1 + (1e-12 if r.kind == "" else 0)))
            assert r.lower_bound <= r.depth
        assert p.lower_bound == pytest.approx(q.lower_bound, rel=1e-9)
        near = penetration(a, b, start=p.translation)
        assert is_free(a, b, near.translation)
        assert near.depth <= p.depth * 1.001


def depth_of_vertices(detector, vertices, first):
    """Of the deepest vertex of either mesh inside the other one, by signed distances of all."""
    a, b = np.split(vertices, [first])
    return max(0.0, *(-detector.signed_distances(vertices, x, m).distance.min() for x, m in ((a, "b"), (b, "a"))))


@pytest.mark.parametrize("seed", range(6))
def test_lower_bound_is_the_depth_of_the_deepest_vertex(seed):
    """Of meshes with several components, that intersect themselves and contain one another, turned inside out too."""
    rng = np.random.default_rng(seed)

    def parts(n):
        meshes = [(torus(16, 8), bumpy(6, rng), convex(rng))[rng.integers(3)] for _ in range(n)]
        turned = [v @ random_turn(rng) * rng.uniform(0.2, 1.5) + 0.5 * rng.normal(size=3) for v, _ in meshes]
        firsts = np.cumsum([0] + [len(v) for v in turned[:-1]])
        faces = np.concatenate([f + first for (_, f), first in zip(meshes, firsts, strict=True)])
        return np.concatenate(turned), faces[:, ::-1] if rng.integers(4) == 0 else faces

    for _ in range(8):
        a, b = parts(rng.integers(1, 4)), parts(rng.integers(1, 4))
        detector, vertices = detector_of(a, b), np.concatenate([a[0], b[0]])
        p, expected = detector.penetration(vertices, "a", "b"), depth_of_vertices(detector, vertices, len(a[0]))
        assert p.lower_bound == pytest.approx(expected, rel=1e-11, abs=1e-12) and p.lower_bound <= expected


def test_free_meshes_and_touching_ones():
    box = hc.shapes.box()
    far = (box[0] + [3, 0, 0], box[1])
    p = penetration(box, far)
    assert (p.depth, p.lower_bound, p.kind, p.features, p.translation.tolist()) == (0, 0, "", (), [0, 0, 0])
    touching = (box[0] + [1, 0, 0], box[1])
    p = penetration(box, touching)
    assert 0 < p.depth < 1e-9 and is_free(box, touching, p.translation) and p.lower_bound == 0


def test_contained_meshes_and_open_ones():
    inner, outer = hc.shapes.box((1, 1, 1)), hc.shapes.box((4, 6, 8))
    p = penetration(inner, outer)
    assert p.depth == pytest.approx(2.5) and p.lower_bound == pytest.approx(2 - 0.5)
    assert is_free(inner, outer, p.translation)
    lid = outer[0], outer[1][1:]
    assert penetration(inner, lid).depth == 0
    through = (inner[0] + [2, 0, 0], inner[1])
    p = penetration(through, lid)
    assert p.lower_bound < p.depth <= 0.5 + 1e-9 and is_free(through, lid, p.translation)


@pytest.mark.parametrize("at", [(0, 0, 0), (1, 2, 3), (9e299, 0, -9e299), (5e-324, 0, 0)])
def test_faces_without_extent(at):
    """No direction has an interval in which they meet: a short shift is tried, then longer ones."""
    point = np.tile(np.array(at, dtype=float), (3, 1)), np.array([[0, 1, 2]])
    p = penetration(point, point)
    assert is_free(point, point, p.translation) and (p.kind, p.features, p.lower_bound) == ("", (), 0)
    assert 0 < p.depth <= max(4e-15 * (np.abs(at).max() or 1), 1e-300)
    segment = point[0] + np.array([(0, 0, 0), (1, 1, 0), (2, 2, 0)]), point[1]
    if max(at) < 1e100:
        assert is_free(segment, point, penetration(segment, point).translation)


def test_features_carry_the_depth():
    box = hc.shapes.box()
    p = penetration((np.array([[0.1, 0.05, 0.4], [1, 0, 2], [-1, 1, 2], [-1, -1, 2]]), TETRAHEDRON), box)
    assert p.kind == "vertex-face" and p.features[0] == 0 and p.depth == pytest.approx(0.1)
    assert (np.concatenate([box[0]])[box[1][p.features[1] - 4], 2] == 0.5).all()


@pytest.mark.parametrize("scale", [1e-290, 1e-3, 1e290])
def test_scales_and_float32(scale):
    a, b = hc.shapes.icosphere(2), hc.shapes.box()
    b = (b[0] + 0.3, b[1])
    expected = penetration(a, b)
    p = penetration((scale * a[0], a[1]), (scale * b[0], b[1]))
    assert p.depth == pytest.approx(scale * expected.depth, rel=1e-6)
    single = [(x.astype(np.float32), f) for x, f in (a, b)]
    assert is_free(*single, penetration(*single).translation)


def test_meshes_that_only_touch_are_separated_by_almost_nothing():
    """A tetrahedron stands on an open box that is inside a larger box of the same mesh."""
    box, faces = hc.shapes.box()
    feet = np.array([[0.5, 0.25, 1.0], [0.75, 0.25, 1.0], [0.5, 0.5, 1.0], [0.5, 0.25, 1.25]])
    outer = np.concatenate([4 * box + [0.5, 1, 0], 4 * box + [0.5, 0.25, -1]])
    open_mesh = np.concatenate([faces[1:], faces + len(box)])
    p = penetration((feet, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]), (outer, open_mesh))
    assert 0 < p.depth < 1e-14 and p.translation[2] > 0


def test_deterministic():
    a, b = bumpy(6, np.random.default_rng(1)), torus(20, 10)
    vertices = np.concatenate([a[0], b[0]])
    results = [detector_of(a, b, threads=threads).penetration(vertices, "a", "b") for threads in (1, 2, 1)]
    assert results[0] == results[1] == results[2]


def test_results_do_not_depend_on_earlier_queries():
    """They would if they followed the detector's tree, which keeps its topology while the meshes move."""
    rng, ball = np.random.default_rng(5), hc.shapes.icosphere(4)
    used = detector_of(ball, ball)
    for _ in range(40):
        vertices = np.concatenate([rng.uniform(0.3, 2) * ball[0] + 0.5 * rng.normal(size=3), ball[0]])
        for start in (None, (0.1, 0.2, 0.0)):
            wanted = detector_of(ball, ball).penetration(vertices, "a", "b", start=start)
            assert used.penetration(vertices, "a", "b", start=start) == wanted
        used.distances(vertices)


@pytest.mark.parametrize("seed", range(3))
def test_large_meshes_are_not_moved_farther_than_along_an_axis(seed):
    """Also where that ends in a gap, and with any number of threads; a start takes as short a way."""
    rng = np.random.default_rng(seed)
    ring, stick = torus(60, 30), (hc.shapes.icosphere(12)[0] * [0.3, 0.3, 3], hc.shapes.icosphere(12)[1])
    pairs = [
        (bumpy(14, rng), torus(50, 30)),
        ((stick[0] + rng.uniform(-0.6, 0.6, 3), stick[1]), ring),
        ((0.4 * bumpy(12, rng)[0] + [0.2, 0.1, 0.3], bumpy(12, rng)[1]), ring),
        ((stick[0] + rng.uniform(-0.6, 0.6, 3), stick[1][1:]), (ring[0], ring[1][1:])),
    ]
    for a, b in pairs:
        assert len(a[1]) + len(b[1]) > 2000
        vertices = np.concatenate([a[0], b[0]])
        detectors = [detector_of(a, b, threads=threads) for threads in (1, 2, 3)]
        results = [detector.penetration(vertices, "a", "b") for detector in detectors]
        assert len({(r.translation.tobytes(), r.depth, r.lower_bound, r.features) for r in results}) == 1
        p = results[0]
        assert is_free(a, b, p.translation)
        axes = np.concatenate([np.eye(3), -np.eye(3)])
        assert p.depth <= min(detectors[0].separating_translation(vertices, "a", "b", d) for d in axes) * (1 + 1e-9)
        starts = [detector.penetration(vertices, "a", "b", start=p.translation) for detector in detectors]
        assert len({(r.translation.tobytes(), r.depth, r.lower_bound, r.features) for r in starts}) == 1
        assert starts[0].depth <= p.depth * (1 + 1e-9) and is_free(a, b, starts[0].translation)
        assert starts[0].lower_bound == p.lower_bound


@pytest.mark.parametrize("start", [(0, np.nan, 1), (1, 0), "z"])
def test_invalid_starts(start):
    with pytest.raises((ValueError, TypeError), match="start"):
        penetration(hc.shapes.box(), hc.shapes.box(), start=start)


@pytest.mark.parametrize("kind", TRANSLATIONS)
def test_degenerate_scenes_of_any_scale(kind):
    """Free by the oracle wherever the meshes are, and not longer than along an axis where rounding does not matter."""
    scene = TRANSLATION_SCENES[kind]
    first = len(scene.rest[0])
    scenes = [generate(np.random.default_rng(5), 40) for generate in TRANSLATIONS[kind].values()]
    detector = detector_of(*((rest, faces) for faces, rest in zip(*scene, strict=True)))
    for vertices in np.concatenate(scenes)[:, :-1]:
        p = detector.penetration(vertices, "a", "b")
        assert p.lower_bound <= p.depth
        moved = np.concatenate([vertices[:first] + p.translation, vertices[first:]])
        counts = {"n_vertices": [first, len(vertices) - first], "no_self_collision": [0, 1], "threads": 1}
        assert not len(oracle.intersections(moved, scene.faces, **counts))
        assert not oracle.contained(list(zip(np.split(moved, [first]), scene.faces, strict=True)), 1).any()
        axes = np.concatenate([np.eye(3), -np.eye(3)])
        least = min(detector.separating_translation(vertices, "a", "b", axis) for axis in axes)
        if 1e-300 < np.abs(vertices).max() < 1e6 * least:
            assert p.depth <= least * (1 + 1e-6)
