# SPDX-License-Identifier: Apache-2.0
"""The smallest distance of each pair of meshes against the exact oracle."""

import numpy as np
import oracle
import pytest
import random_scenes
from fuzz.snapshots import EDGE_FACE_POINTS
from scene_pairs import rows, size_of
from test_small_scenes import small_scene

import hpccd_core as hc

SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)
KINDS = ("vertex-face", "edge-edge", "edge-face")


def told(gaps):
    return [(g.mesh_a, g.mesh_b, g.distance, g.kind, tuple(g.features), np.asarray(g.points).tolist()) for g in gaps]


def truth_of(meshes, vertices, **rules):
    gaps = oracle.smallest_distances(vertices, meshes.faces, **meshes.beside_faces, **rules)
    return {(gap.mesh_a, gap.mesh_b): gap for gap in gaps}


def numbered(gaps):
    """By numbers of the meshes, whose names are mesh0, mesh1, ..."""
    named = {}
    for gap in gaps:
        a, b = (int(str(mesh).removeprefix("mesh")) for mesh in (gap.mesh_a, gap.mesh_b))
        named[a, b] = gap
    assert len(named) == len(gaps), "each pair once"
    return named


def faces_of(meshes):
    offsets = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
    return np.concatenate([f + o for f, o in zip(meshes.faces, offsets, strict=False)])


def assert_gaps(gaps, meshes, vertices, rules, size):
    found, truth = numbered(gaps), truth_of(meshes, vertices, **rules)
    assert set(found) == set(truth)
    faces = faces_of(meshes)
    for pair, gap in found.items():
        true = truth[pair]
        assert gap.distance == true.distance or abs(gap.distance - true.distance) <= 1e-12 * size
        assert (gap.distance == 0) == (true.distance == 0)
        if gap.distance == np.inf:
            continue
        assert gap.kind in KINDS and (gap.kind == "edge-face") == true.intersect
        features = [int(x) for x in gap.features]
        points = np.asarray(gap.points)
        assert points.shape == (2, 3)
        if gap.kind == "edge-face":
            a0, a1, f = features
            assert oracle.edge_face_intersect(vertices[[a0, a1, *faces[f]]][None])[0]
            first, second = [a0, a1, a1], faces[f]
        elif gap.kind == "vertex-face":
            v, f = features
            assert v not in faces[f]
            assert abs(oracle.distance_vertex_face(vertices[[v, *faces[f]]][None])[0] - true.distance) <= 1e-12 * size
            first, second = [v, v, v], faces[f]
        else:
            a0, a1, b0, b1 = features
            assert abs(oracle.distance_edge_edge(vertices[[features]])[0] - true.distance) <= 1e-12 * size
            first, second = [a0, a1, a1], [b0, b1, b1]
        mesh = np.repeat(np.arange(len(meshes.faces)), meshes.n_vertices)
        assert sorted((mesh[first[0]], mesh[second[0]])) == list(pair)
        assert abs(np.linalg.norm(points[0] - points[1]) - gap.distance) <= 1e-11 * size
        for point, corners in zip(points, (first, second), strict=True):
            assert oracle.distance_vertex_face(np.array([[point, *vertices[corners]]]))[0] <= 1e-11 * size


@SCENES
@pytest.mark.parametrize(
    "accuracy",
    ["exact", "fast", *(pytest.param(tier, marks=pytest.mark.long) for tier in ("conservative", "balanced"))],
)
def test_scenes(generate, accuracy):
    meshes = generate(np.random.default_rng(81))
    for vertices in (meshes.vertices_t1, meshes.vertices_t0):
        results = []
        for threads, simd in ((1, "auto"), (3, "auto"), (2, "scalar")):
            detector = hc.Detector(meshes.scene(), accuracy=accuracy, threads=threads, simd=simd, backend="cpu")
            for _ in range(2):
                gaps = detector.distances(vertices)
                results.append(told(gaps))
        assert_gaps(gaps, meshes, vertices, {}, size_of(vertices))
        assert all(result == results[0] for result in results)


def apart(rng, n_bodies=4):
    """Bodies a few sizes apart, some flat, one a lone vertex."""
    bodies = []
    for i in range(n_bodies):
        faces, start, end = random_scenes.tetrahedron(rng) if i % 2 else random_scenes.crumpled_sheet(rng, 3)
        shift = rng.normal(0, 6, 3)
        bodies.append((faces, start + shift, end + shift))
    lone = np.empty((0, 3), int), *rng.normal(0, 6, (2, 1, 3))
    return random_scenes.combine(*bodies, lone)


@pytest.mark.parametrize(
    ("scale", "offset"), [(1.0, 0.0), (2.0**300, 0.0), (2.0**490, 0.0), (2.0**-300, 0.0), (1.0, 2.0**20)]
)
def test_bodies_apart(scale, offset):
    seen = set()
    for seed in range(12):
        meshes = apart(np.random.default_rng(seed))
        vertices = (meshes.vertices_t1 + offset) * scale
        gaps = hc.Detector(meshes.scene(), backend="cpu").distances(vertices)
        assert_gaps(gaps, meshes, vertices, {}, size_of(vertices))
        seen |= {gap.kind for gap in gaps if 0 < gap.distance < np.inf}
    assert seen == {"vertex-face", "edge-edge"}


@pytest.mark.parametrize("name", EDGE_FACE_POINTS)
def test_where_an_edge_meets_a_face(name):
    """The common point lies on both, also where they are all but coplanar, and whatever their magnitude."""
    points = EDGE_FACE_POINTS[name](np.random.default_rng(1), 3000)
    scene = hc.Scene()
    scene.add_mesh("mesh0", [[0, 1, 1]], self_collision=False)
    scene.add_mesh("mesh1", [[0, 1, 2]], self_collision=False)
    detector = hc.Detector(scene, backend="cpu", threads=1)
    points = points[oracle.edge_face_intersect(points)]
    size = np.abs(points).max(axis=(1, 2))
    normal = size > 1e-290  # smaller ones have fewer bits
    assert normal.sum() > 30
    for q, s in zip(points[normal], size[normal], strict=True):
        (gap,) = detector.distances(q)
        assert (gap.kind, gap.distance, tuple(gap.features)) == ("edge-face", 0.0, (0, 1, 1))
        ends = np.array([[gap.points[0], q[0], q[1], q[1]], [gap.points[1], q[2], q[3], q[4]]])
        assert np.isfinite(ends).all() and oracle.distance_vertex_face(ends).max() <= 1e-12 * s, q.tolist()


def test_rules_of_scenes():
    rng = np.random.default_rng(82)
    for _ in range(60):
        meshes, rules = small_scene(rng)
        vertices = meshes.vertices_t1 + rng.normal(0, 0.2, meshes.vertices_t1.shape)
        gaps = hc.Detector(meshes.scene(**rules), backend="cpu").distances(vertices)
        assert_gaps(gaps, meshes, vertices, rules, size_of(vertices))


def test_enabled_pairs_are_counted_before_a_query():
    rng = np.random.default_rng(7)
    for _ in range(40):
        scene = hc.Scene()
        n = int(rng.integers(0, 6))
        for k, (own, static) in enumerate(rng.random((n, 2)) < 0.5):
            scene.add_mesh(f"mesh{k}", [[0, 1, 2]], self_collision=bool(own), static=bool(static))
        for a, b in rng.integers(0, max(n, 1), (int(rng.integers(0, 9)) if n else 0, 2)):
            scene.ignore_pair(int(a), int(b))
        detector = hc.Detector(scene, backend="cpu", threads=1)
        assert detector._n_mesh_pairs == len(detector.distances(rng.normal(size=(3 * n, 3))))


def test_a_single_triangle_has_no_pair_of_its_own():
    scene = hc.Scene()
    scene.add_mesh("mesh0", [[0, 1, 2]])
    (gap,) = hc.Detector(scene, backend="cpu").distances(np.eye(3))
    assert gap.distance == np.inf
    assert str(gap.mesh_a).removeprefix("mesh") == str(gap.mesh_b).removeprefix("mesh") == "0"


@SCENES
def test_they_agree_with_proximity_and_intersections(generate):
    """Nothing is nearer than the smallest of the distances, and something is as near."""
    meshes = generate(np.random.default_rng(83))
    detector = hc.Detector(meshes.scene(), backend="cpu")
    gaps = detector.distances(meshes.vertices_t0)
    smallest = min(gap.distance for gap in gaps)
    near = detector.proximity(meshes.vertices_t0, smallest * (1 + 1e-12))
    if any(gap.kind == "edge-face" for gap in gaps):
        assert len(detector.intersections(meshes.vertices_t0).ef)
    else:
        assert not rows(detector.intersections(meshes.vertices_t0).ef)
        assert len(near.vf) + len(near.ee) > 0
    if smallest > 0:
        below = detector.proximity(meshes.vertices_t0, smallest * (1 - 1e-12))
        assert len(below.vf) + len(below.ee) == 0


def test_bad_positions_are_rejected():
    detector = hc.Detector(random_scenes.single_mesh(np.random.default_rng(84)).scene(), backend="cpu")
    with pytest.raises(ValueError, match="vertices"):
        detector.distances(np.zeros((3, 3)))


@pytest.mark.parametrize("scale", [2.0**500, 2.0**665, 2.0**990])
def test_of_features_farther_apart_than_any_motion_may_be(scale):
    scene = hc.Scene()
    for name in ("low", "high"):
        scene.add_mesh(name, np.array([[0, 1, 2]]))
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    gaps = hc.Detector(scene).distances(scale * np.vstack([triangle, triangle + [0, 0, 1]]))
    assert [(gap.distance, gap.kind) for gap in gaps] == [(np.inf, ""), (scale, "vertex-face"), (np.inf, "")]


def test_nearly_equal_distances_are_told_apart_alike_by_any_number_of_threads():
    """The computed distance of nearly parallel edges may be 7e-13 too large: whether it is looked at more closely must
    not depend on what was found before."""
    edges = [
        [(-0.98, -0.078511770838512698, 0.029717224115102591), (0.98, 0.076687388690095559, -0.016361988652355004)],
        [
            (-0.68613416291667206, -0.055293725235369004, 0.022859892167323963),
            (0.97710321374143183, 0.076536540607882952, -0.01636096752392438),
        ],
    ]
    vertex, face = [(0.25, -0.75, -0.49999658065152497)], [(0, -1, -0.5), (1, -1, -0.5), (0, 0, -0.5)]
    scene = hc.Scene()
    scene.add_mesh("one", np.array([[0, 1, 1]]), n_vertices=3)
    scene.add_mesh("other", np.array([[0, 1, 1], [2, 3, 4]]))
    vertices = np.array([*edges[0], *vertex, *edges[1], *face], float)
    found = {
        (gap.distance, gap.kind)
        for threads in (1, 2, 4)
        for _ in range(5)
        for gap in hc.Detector(scene, threads=threads).distances(vertices)
        if gap.mesh_a != gap.mesh_b
    }
    assert found == {(3.419348225013685e-06, "edge-edge")}
