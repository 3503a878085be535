# SPDX-License-Identifier: Apache-2.0
"""Filters below the mesh: the full result without the ignored pairs, bit for bit, in every query."""

import copy
import itertools
import math
import pickle
import threading
import time

import filtered
import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

BACKENDS = [b for b in hc.backends() if b != "auto"]
METHODS = ("default", "published", "naive", "front")
SIMD = tuple(hc._core.simd_levels())
MAKES = pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)


def same(found, expected):
    for name, values in expected.items():
        np.testing.assert_array_equal(getattr(found, name), values, name)


def of(make, seed):
    """A random scene, its motion, and random filters, some of them of single pairs."""
    rng = np.random.default_rng(seed)
    meshes = make(rng)
    motion = meshes.vertices_t0, meshes.vertices_t1
    full = hc.Detector(meshes.scene(), backend="cpu", minimum_separation=0.5).detect(*motion)
    touching = hc.Detector(meshes.scene(), backend="cpu").intersections(motion[0])
    filters = filtered.random_filters(rng, meshes, {"vf": full.vf, "ee": full.ee, "ef": touching.ef})
    return meshes, motion, filters


@MAKES
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_contacts(make, accuracy):
    meshes, motion, filters = of(make, 5)
    scene = filters.apply(meshes.scene())
    for separation in (0.0, 0.5):
        options = {"accuracy": accuracy, "minimum_separation": separation, "backend": "cpu"}
        expected = filtered.kept(hc.Detector(meshes.scene(), **options).detect(*motion), filters)
        hashes = set()
        for (m, method), (s, simd) in itertools.product(enumerate(METHODS), enumerate(SIMD)):
            detector = hc.Detector(scene, method=method, simd=simd, threads=1 + 2 * ((m + s) % 2), **options)
            found = detector.detect(*motion)
            same(found, expected)
            hashes.add(found.hash)
            assert detector.stats["vf_ignored"] + detector.stats["ee_ignored"] > 0
        assert len(hashes) == 1


@MAKES
def test_on_every_backend(make):
    meshes, motion, filters = of(make, 6)
    scene = filters.apply(meshes.scene())
    for backend, separation in itertools.product(BACKENDS, (0.0, 0.5)):
        plain, with_filters = (
            hc.Detector(s, backend=backend, minimum_separation=separation) for s in (meshes.scene(), scene)
        )
        same(with_filters.detect(*motion), filtered.kept(plain.detect(*motion), filters))
        same(
            with_filters.proximity(motion[0], 0.5),
            filtered.kept(plain.proximity(motion[0], 0.5), filters, value="distance"),
        )
        same(
            with_filters.intersections(motion[0]),
            filtered.kept(plain.intersections(motion[0]), filters, names=("ef",), value=""),
        )
        truth = with_filters.detect(*motion)
        first = hc.Detector(scene, backend=backend, minimum_separation=separation, report="first")
        for _ in range(3):  # by a search, by hints, by a list of near pairs
            earliest = first.detect(*motion)
            assert earliest.first_toc == truth.first_toc
            same(earliest, {name: getattr(truth, name)[getattr(truth, f"{name}_toc") == truth.first_toc]
                            for name in ("vf", "ee")})  # fmt: skip
            step = first.collision_free_step(*motion)
            assert min(truth.first_toc, 1) - 1e-9 <= step <= truth.first_toc
        found = hc.Detector(scene, backend=backend, minimum_separation=separation, report="any").detect(*motion)
        assert len(found.vf) + len(found.ee) == (truth.first_toc < math.inf)
        for name in ("vf", "ee"):
            assert set(map(tuple, getattr(found, name).tolist())) <= set(map(tuple, getattr(truth, name).tolist()))


@MAKES
@pytest.mark.parametrize("seed", range(2))
def test_shortened_motions(make, seed):
    meshes, motion, filters = of(make, 20 + seed)
    scene = filters.apply(meshes.scene())
    detector = hc.Detector(scene, backend="cpu")
    shortened = detector.collision_free_motion(*motion)
    found = detector.detect(motion[0], shortened.vertices)
    assert (found.vf_toc == 0).all() and (found.ee_toc == 0).all()
    assert set(found.ee.ravel()) <= set(shortened.stuck) and set(found.vf[:, 0]) <= set(shortened.stuck)
    at_start = detector.detect(motion[0], motion[0])
    assert set(at_start.ee.ravel()) | set(at_start.vf[:, 0]) <= set(shortened.stuck)
    assert (shortened.factors >= 0.9 * detector.collision_free_step(*motion)).all() or len(shortened.stuck)


@pytest.mark.parametrize("seed", range(12))
def test_smallest_distances(seed):
    rng = np.random.default_rng(seed)
    sheet, rope = random_scenes.crumpled_sheet(rng, 3), random_scenes.lattice_rope(rng, 6)
    body = random_scenes.tetrahedron(rng)
    meshes = random_scenes.combine(sheet, (body[0], body[1] + [0, 0, 3 * (seed % 3)], body[2]), rope)
    filters = filtered.random_filters(rng, meshes)
    scene = filters.apply(meshes.scene())
    least = filtered.smallest_distances(meshes, filters)
    for backend in BACKENDS:
        for gap in hc.Detector(scene, backend=backend).distances(meshes.vertices_t0):
            pair = tuple(sorted((scene.mesh_names.index(gap.mesh_a), scene.mesh_names.index(gap.mesh_b))))
            assert gap.distance == pytest.approx(math.sqrt(least.get(pair, math.inf)), abs=1e-12), pair
            if gap.kind:
                name = {"vertex-face": "vf", "edge-edge": "ee", "edge-face": "ef"}[gap.kind]
                assert not filters.ignored(name, gap.features)


def test_smallest_distance_of_far_meshes_whose_nearest_faces_are_ignored():
    """The first bound comes from near vertices: these must not be ignored."""
    vertices, faces = hc.shapes.icosphere(3)
    scene = hc.Scene()
    scene.add_mesh("a", faces), scene.add_mesh("b", faces)
    near_b = np.flatnonzero((vertices[faces][:, :, 0] > 0.2).any(axis=1))
    scene.ignore_faces("a", near_b, "b")
    positions = np.concatenate([vertices, vertices + [9, 0, 0]])
    for _ in range(2):
        (gap,) = (g for g in hc.Detector(scene).distances(positions) if g.mesh_a != g.mesh_b)
        assert gap.distance > 9 - 1 - 0.2 - 1e-9
        assert gap.features[1 if gap.kind == "vertex-face" else 0] not in near_b


def cloth(n, rng):
    """A sheet of n x n squares, slightly wavy, and the length of its shorter edges."""
    vertices, faces = hc.shapes.grid(n, n)
    edge = np.ptp(vertices[:, 0]) / n
    return vertices + rng.uniform(-0.1, 0.1, vertices.shape) * edge, faces, edge


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_garment_thicker_than_its_edges_is_simulated(backend):
    """Without a filter neighbours are in contact, and no step is possible; with one, a fold is found in time."""
    rng = np.random.default_rng(3)
    vertices, faces, edge = cloth(20, rng)
    thickness = 1.5 * edge
    plain, scene = hc.Scene(), hc.Scene()
    plain.add_mesh("cloth", faces), scene.add_mesh("cloth", faces)
    scene.ignore_within("cloth", rings=2)
    folded = vertices.copy()
    half = vertices[:, 0] > np.median(vertices[:, 0])
    folded[half, 0] = 2 * np.median(vertices[:, 0]) - folded[half, 0]
    folded[half, 2] += 3 * thickness
    closing = folded - half[:, None] * [0, 0, 2.5 * thickness]
    options = {"backend": backend, "minimum_separation": thickness}
    assert hc.Detector(plain, **options).collision_free_step(vertices, vertices) == 0
    detector = hc.Detector(scene, **options)
    assert len(detector.proximity(vertices, thickness).ee) == 0
    assert detector.collision_free_step(vertices, vertices) == 1
    assert len(detector.detect(vertices, vertices).vf) == len(detector.detect(vertices, vertices).ee) == 0
    hinge = detector.detect(folded, folded)  # where the fold is steep, features beyond two rings are near
    far = np.abs(vertices[:, 0] - np.median(vertices[:, 0])) > 4 * edge
    assert not far[hinge.vf[:, 0]].any()
    assert detector.step(folded) is not None
    contacts = detector.step(closing)
    assert (contacts.vf_toc[far[contacts.vf[:, 0]]] > 0.5).all() and far[contacts.vf[:, 0]].any()
    motion = detector.collision_free_motion(folded, closing)
    left = detector.detect(folded, motion.vertices)
    assert set(left.vf[:, 0]) <= set(motion.stuck)


def test_doubled_vertices_of_a_seam_are_ignored_at_rest():
    """Two halves that share no vertex: no ring joins them, but they touch at rest."""
    vertices, faces, edge = cloth(4, np.random.default_rng(0))
    left = np.array([f for f in faces if vertices[f][:, 0].mean() < 0])
    right = np.array([f for f in faces if vertices[f][:, 0].mean() > 0])
    seam = np.intersect1d(left, right)
    copies = {v: len(vertices) + i for i, v in enumerate(seam)}
    vertices = np.concatenate([vertices, vertices[seam]])
    faces = np.concatenate([left, np.vectorize(lambda v: copies.get(v, v))(right)])

    def step(**named):
        scene = hc.Scene()
        scene.add_mesh("cloth", faces, n_vertices=len(vertices))
        if named:
            scene.ignore_within("cloth", **named)
        return hc.Detector(scene).collision_free_step(vertices, vertices + [0, 0, edge])

    assert step() == step(rings=3) == 0
    assert step(rest_vertices=vertices, distance=0) == 1
    assert step(rest_vertices=vertices.astype(np.float32), distance=0.5 * edge) == 1


def test_several_calls_add_up():
    vertices, faces, edge = cloth(6, np.random.default_rng(1))
    scene = hc.Scene()
    scene.add_mesh("other", [[0, 1, 2]]), scene.add_mesh("cloth", faces)
    apart = [[5.0, 0, 0], [6, 0, 0], [5, 1, 0]]
    counts = []

    def count():
        near = hc.Detector(scene).proximity(np.concatenate([apart, vertices]), 3.5 * edge)
        counts.append(len(near.vf) + len(near.ee))

    count()
    scene.ignore_within("cloth", rings=1), count()
    scene.ignore_within("cloth", rings=0), count()
    scene.ignore_within(1, rest_vertices=vertices, distance=1.8 * edge), count()
    scene.ignore_within(1, rest_vertices=vertices * [0.5, 1, 1], distance=1.8 * edge), count()
    scene.ignore_faces("cloth", [0, 1, 2, 3], "cloth"), count()
    scene.ignore_faces("cloth", [4, 5], "cloth"), count()
    assert counts[1] == counts[2] and all(a > b for a, b in itertools.pairwise(counts[2:])) and counts[0] > counts[1]


def test_all_of_a_mesh_against_itself_and_another():
    meshes = random_scenes.many_meshes(np.random.default_rng(2))
    scene, ignoring = meshes.scene(), meshes.scene()
    for other in (0, 1):
        ignoring.ignore_pair(0, other)
        scene.ignore_faces("mesh0", range(len(meshes.faces[0])), other)
    motion = meshes.vertices_t0, meshes.vertices_t1
    assert hc.Detector(scene).detect(*motion).hash == hc.Detector(ignoring).detect(*motion).hash


def test_faces_against_a_plane():
    """Vertices of listed faces, unless they are in another face."""
    vertices, faces, edge = cloth(4, np.random.default_rng(0))
    listed = np.flatnonzero(vertices[faces][:, :, 0].max(axis=1) < 0)
    others = np.setdiff1d(faces, np.setdiff1d(faces[listed], np.delete(faces, listed, axis=0)))
    scene = hc.Scene()
    scene.add_mesh("cloth", faces), scene.add_plane("floor")
    assert sorted(hc.Detector(scene).detect(vertices, vertices - [0, 0, 2]).vp[:, 0]) == list(range(len(vertices)))
    scene.ignore_faces("cloth", listed, "floor")
    detector = hc.Detector(scene)
    assert sorted(detector.detect(vertices, vertices - [0, 0, 2]).vp[:, 0]) == others.tolist()
    assert sorted(detector.proximity(vertices, 1.0).vp[:, 0]) == others.tolist()
    (gap,) = (g for g in detector.distances(vertices) if g.mesh_a != g.mesh_b)
    assert gap.distance == vertices[others, 2].min()


@pytest.mark.parametrize("backend", BACKENDS)
def test_thickness_greater_than_the_edges(backend):
    """The same as a separation of the same sum."""
    vertices, faces, edge = cloth(12, np.random.default_rng(4))
    hashes = []
    for thickness, separation in ((0.75 * edge, 0.0), (0.0, 1.5 * edge)):
        scene = hc.Scene()
        scene.add_mesh("cloth", faces, thickness=thickness)
        scene.ignore_within("cloth", rings=2)
        detector = hc.Detector(scene, backend=backend, minimum_separation=separation)
        assert detector.collision_free_step(vertices, vertices + edge) == 1
        crumpled = vertices * [1, 1, 1] + np.random.default_rng(5).uniform(-2, 2, vertices.shape) * edge
        hashes.append(detector.detect(vertices, crumpled).hash)
        assert len(detector.detect(vertices, crumpled).ee) > 100
    assert hashes[0] == hashes[1]


def test_worlds():
    meshes, motion, filters = of(random_scenes.ropes, 9)
    scene = filters.apply(meshes.scene())
    alone = hc.Detector(scene, backend="cpu").detect(*motion)
    many = hc.Detector(scene, backend="cpu", worlds=3).detect(*(np.stack([x] * 3) for x in motion))
    assert [many.world(k).hash for k in range(3)] == [alone.hash] * 3


@pytest.mark.parametrize("threads", [1, 2])
def test_more_rings_than_the_mesh_has(threads):
    n = 3000
    scene = hc.Scene()
    scene.add_mesh("rope", edges=np.stack([np.arange(n - 1), np.arange(1, n)], axis=1))
    scene.add_points("single", 1)
    scene.ignore_within("rope", rings=10**9)
    scene.ignore_within("single", rings=10**9)
    start = time.process_time()
    detector = hc.Detector(scene, threads=threads)
    assert time.process_time() - start < 5  # 18 s as long as each ring was merged with those before
    assert len(detector.proximity(np.zeros((n + 1, 3)), 1.0)) == n - 1  # of the point and the rope


def test_too_many_rings_are_rejected_at_once():
    n = 100_000
    scene = hc.Scene()
    scene.add_mesh("rope", edges=np.stack([np.arange(n - 1), np.arange(1, n)], axis=1))
    scene.ignore_within("rope", rings=10**9)
    with pytest.raises(ValueError, match=r"rings: ignores 2\^32 pairs or more; give fewer rings"):
        hc.Detector(scene, threads=1)


def test_other_threads_run_while_filters_are_found():
    vertices, faces = hc.shapes.grid(150, 150)
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    scene.ignore_within("cloth", rest_vertices=vertices, distance=0.04)  # takes a second
    ready, made, turns = threading.Event(), threading.Event(), 0

    def make():
        ready.wait()
        hc.Detector(scene, threads=1)
        made.set()

    thread = threading.Thread(target=make)
    thread.start()
    ready.set()
    while not made.wait(0.01):
        turns += 1
    thread.join()
    assert turns > 5  # 0 or 1 if the interpreter is locked meanwhile


def test_points_are_edges_of_one_vertex():
    scene = hc.Scene()
    scene.add_points("grains", 3)
    scene.add_points("rod", 2, edges=[[0, 1]])
    vertices = np.zeros((5, 3))
    assert hc.Detector(scene).proximity(vertices, 0.0).vv.tolist() == [[0, 1], [0, 2], [1, 2]]
    scene.ignore_features(ee=[[2, 2, 0, 0], [4, 3, 1, 1]])
    near = hc.Detector(scene).proximity(vertices, 0.0)
    assert near.vv.tolist() == [[0, 1], [1, 2]] and near.ve.tolist() == [[0, 3, 4], [2, 3, 4]]


@pytest.mark.parametrize("what", ["single pairs", "meshes"])
def test_time_grows_with_the_calls_only(what):
    scene = hc.Scene()
    scene.add_mesh("cloth", hc.shapes.grid(100, 100)[1])
    n = 10_000 if what == "single pairs" else 300

    def some(begin):
        start = time.process_time()
        for k in range(begin, begin + n):
            if what == "single pairs":
                scene.ignore_features(vf=[[k % 10_000, 7 * k % 20_000]], ee=[[0, 1, 2, 3]])
            else:
                scene.add_mesh(str(k), [[0, 1, 2]])
                scene.ignore_within(str(k), rings=1)
                scene.ignore_within(str(k), rest_vertices=np.eye(3), distance=0.1)
                scene.ignore_faces(str(k), [0], "cloth")
        return time.process_time() - start

    times = [some(k * n) for k in range(7)]
    assert min(times[4:]) < 2 * max(times[:2])  # 4 times as long while each call copied the rows, or meshes, before


def test_copies_and_pickles():
    meshes, motion, filters = of(random_scenes.many_meshes, 10)
    scene = filters.apply(meshes.scene())
    expected = hc.Detector(scene).detect(*motion).hash
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert hc.Detector(other).detect(*motion).hash == expected


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s: s.ignore_within("cloth"), "give either rings, or rest_vertices and distance"),
        (lambda s: s.ignore_within("cloth", rings=1, distance=1), "give either rings"),
        (lambda s: s.ignore_within("cloth", distance=1), "give either rings"),
        (lambda s: s.ignore_within("cloth", rings=-1), "rings: must lie in"),
        (lambda s: s.ignore_within("cloth", rings=1.5), "rings: expected an integer"),
        (lambda s: s.ignore_within("clot", rings=1), "mesh: no mesh is named 'clot'.*did you mean cloth"),
        (lambda s: s.ignore_within("cloth", rest_vertices=[[0, 0, 0]], distance=1), r"rest_vertices: expected shape"),
        (lambda s: s.ignore_within("cloth", rest_vertices=np.full((9, 3), np.nan), distance=1), r"rest_vertices\[0\]"),
        (lambda s: s.ignore_within("cloth", rest_vertices=np.zeros((9, 3)), distance=-1), "distance: must be finite"),
        (lambda s: s.ignore_faces("cloth", [8], "cloth"), "faces: numbers of this mesh's faces lie below 8, got 8"),
        (lambda s: s.ignore_faces("cloth", [-1], "cloth"), "faces: numbers of this mesh's faces lie below 8, got -1"),
        (lambda s: s.ignore_faces("cloth", [[1]], "cloth"), r"faces: expected shape \(K,\)"),
        (lambda s: s.ignore_faces("cloth", [0.5], "cloth"), "faces: expected integers"),
        (lambda s: s.ignore_faces("cloth", [0], "robot"), "other: no mesh is named 'robot'"),
        (lambda s: s.ignore_features(vf=[[0, 8]]), r"vf\[0, 1\] is 8, but the scene has 8 faces"),
        (lambda s: s.ignore_features(ee=[[0, 1, 2, 9]]), r"ee\[0, 3\] is 9, but the scene has 9 vertices"),
        (lambda s: s.ignore_features(ef=[[0, 1]]), r"ef: expected shape \(N, 3\)"),
        (lambda s: (s.ignore_features(ee=[[0, 1, 0, 8]]), hc.Detector(s)), r"ee\[0\]: the vertices 0 and 8 are not"),
        (lambda s: s.ignore_features(vf=[[-1, 0]]), r"vf\[0, 0\] is -1, which is negative; give scene-wide numbers"),
        (lambda s: s.ignore_features(vf=[[0, 1, 2]]), r"vf: expected shape \(N, 2\).*give scene-wide numbers"),
        (lambda s: s.ignore_within("floor", rings=1), "mesh: 'floor' is a plane, .*; use ignore_pair"),
        (lambda s: s.ignore_within("floor", rest_vertices=np.empty((0, 3)), distance=1), "mesh: 'floor' is a plane"),
        (lambda s: s.ignore_faces("floor", [], "cloth"), "mesh: 'floor' is a plane, .*; use ignore_pair"),
        (lambda s: (s.ignore_features(ef=[[0, 8, 0]]), hc.Detector(s)), r"ef\[0\]: the vertices 0 and 8 are not"),
    ],
)
def test_invalid_arguments_are_rejected(call, message):
    scene = hc.Scene()
    scene.add_mesh("cloth", hc.shapes.grid(2, 2)[1])
    scene.add_plane("floor")
    with pytest.raises((TypeError, ValueError), match=message):
        call(scene)
