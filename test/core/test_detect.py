# SPDX-License-Identifier: Apache-2.0
"""Whole scenes against brute force with the exact tests, and what must not change a result."""

import threading

import hypothesis.strategies as st
import numpy as np
import pytest
import random_scenes
from hypothesis import given, settings
from hypothesis.extra.numpy import arrays

import hpccd_core as hc

SCENES = pytest.mark.parametrize("make", random_scenes.ALL)


def rows(array):
    return {tuple(row) for row in array.tolist()}


def assert_same(a, b):
    for name in ("vf", "vf_toc", "ee", "ee_toc"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    assert a.hash == b.hash
    assert a.first_toc == b.first_toc


def assert_exact(contacts, truth):
    np.testing.assert_array_equal(contacts.vf, truth.vf)
    np.testing.assert_array_equal(contacts.ee, truth.ee)
    np.testing.assert_allclose(contacts.vf_toc, truth.vf_toc, rtol=0, atol=1e-12)
    np.testing.assert_allclose(contacts.ee_toc, truth.ee_toc, rtol=0, atol=1e-12)
    assert contacts.first_toc == min([*contacts.vf_toc, *contacts.ee_toc], default=np.inf)


def assert_conservative(contacts, truth):
    for pairs, tocs, true_pairs, true_tocs in (
        (contacts.vf, contacts.vf_toc, truth.vf, truth.vf_toc),
        (contacts.ee, contacts.ee_toc, truth.ee, truth.ee_toc),
    ):
        found = dict(zip(map(tuple, pairs.tolist()), tocs, strict=True))
        assert rows(true_pairs) <= found.keys()
        assert all(found[tuple(p)] <= t for p, t in zip(true_pairs.tolist(), true_tocs, strict=True))


@SCENES
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_exact_equals_brute_force(make, seed):
    meshes = make(np.random.default_rng(seed))
    truth = meshes.truth()
    assert len(truth.vf) and len(truth.ee)
    contacts = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert_exact(contacts, truth)
    assert len(contacts) == len(truth.vf) + len(truth.ee)


@SCENES
def test_conservative_misses_none_and_is_never_late(make):
    meshes = make(np.random.default_rng(10))
    detector = hc.Detector(meshes.scene(), accuracy="conservative")
    assert_conservative(detector.detect(meshes.vertices_t0, meshes.vertices_t1), meshes.truth())


@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
def test_tiers_without_promise_find_what_is_not_degenerate(accuracy):
    meshes = random_scenes.single_mesh(np.random.default_rng(11))
    truth = meshes.truth()
    contacts = hc.Detector(meshes.scene(), accuracy=accuracy).detect(meshes.vertices_t0, meshes.vertices_t1)
    wrong = len(rows(truth.vf) ^ rows(contacts.vf)) + len(rows(truth.ee) ^ rows(contacts.ee))
    assert wrong <= (0.01 if accuracy == "fast" else 0) * (len(truth.vf) + len(truth.ee))


@st.composite
def tiny_scenes(draw):
    """One to three meshes of a few triangles on a lattice of few points."""
    coordinates = st.integers(-2, 2).map(float)
    meshes = []
    for _ in range(draw(st.integers(1, 3))):
        n_vertices = draw(st.integers(3, 6))
        n_faces = draw(st.integers(1, 4))
        faces = draw(arrays(np.int64, (n_faces, 3), elements=st.integers(0, n_vertices - 1)))
        start, end = (draw(arrays(np.float64, (n_vertices, 3), elements=coordinates)) for _ in range(2))
        meshes.append((faces, start, end))
    return random_scenes.combine(*meshes)


@settings(max_examples=300)
@given(meshes=tiny_scenes(), threads=st.integers(1, 3))
def test_any_tiny_scene(meshes, threads):
    truth = meshes.truth(threads=1)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    assert_exact(hc.Detector(meshes.scene(), threads=threads).detect(v0, v1), truth)
    assert_conservative(hc.Detector(meshes.scene(), accuracy="conservative", threads=threads).detect(v0, v1), truth)


OPTIONS = [
    {"no_self_collision": [0]},
    {"no_self_collision": [0, 1, 4]},
    {"ignored_pairs": [(0, 1)]},
    {"ignored_pairs": [(3, 2), (0, 4), (0, 0)]},
    {"no_self_collision": [1], "ignored_pairs": [(0, 1), (1, 4)]},
    {"static": [1]},
    {"static": [0, 1, 2]},
    {"static": [1, 4], "no_self_collision": [0], "ignored_pairs": [(0, 1)]},
    {"static": [0, 1, 2, 3, 4]},
]


@pytest.mark.parametrize("options", OPTIONS)
def test_only_what_matters_is_tested(options):
    meshes = random_scenes.many_meshes(np.random.default_rng(20))
    offsets = np.concatenate([[0], np.cumsum(meshes.n_vertices)])
    for mesh in options.get("static", []):
        own = slice(offsets[mesh], offsets[mesh + 1])
        meshes.vertices_t1[own] = meshes.vertices_t0[own]
    detector = hc.Detector(meshes.scene(**options))
    assert_exact(detector.detect(meshes.vertices_t0, meshes.vertices_t1), meshes.truth(**options))


def test_pairs_are_ignored_by_name_and_by_number():
    meshes = random_scenes.many_meshes(np.random.default_rng(21))
    by_name, by_number = meshes.scene(), meshes.scene()
    by_name.ignore_pair("mesh1", "mesh0")
    by_number.ignore_pair(0, 1)
    a, b = (hc.Detector(s).detect(meshes.vertices_t0, meshes.vertices_t1) for s in (by_name, by_number))
    assert_same(a, b)
    assert_exact(a, meshes.truth(ignored_pairs=[(0, 1)]))


def test_accuracy_of_a_pair_of_meshes():
    meshes = random_scenes.many_meshes(np.random.default_rng(22))
    scene = meshes.scene()
    for a in range(len(meshes.faces)):
        for b in range(a + 1):
            scene.set_accuracy(a, b, "exact")
    contacts = hc.Detector(scene, accuracy="fast").detect(meshes.vertices_t0, meshes.vertices_t1)
    assert_same(contacts, hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1))


@SCENES
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_thread_counts_change_nothing(make, accuracy):
    meshes = make(np.random.default_rng(30))
    results = [
        hc.Detector(meshes.scene(), accuracy=accuracy, threads=threads).detect(meshes.vertices_t0, meshes.vertices_t1)
        for threads in range(1, 9)
    ]
    for result in results[1:]:
        assert_same(result, results[0])


@SCENES
@pytest.mark.parametrize("simd", ["avx2", "avx512", "neon"])
def test_instruction_sets_change_nothing(make, simd):
    meshes = make(np.random.default_rng(31))
    try:
        detector = hc.Detector(meshes.scene(), simd=simd)
    except ValueError as error:
        pytest.skip(str(error))
    scalar = hc.Detector(meshes.scene(), simd="scalar")
    a, b = (d.detect(meshes.vertices_t0, meshes.vertices_t1) for d in (detector, scalar))
    assert_same(a, b)


@SCENES
def test_float32_and_float64_change_nothing(make):
    meshes = make(np.random.default_rng(32))
    v0, v1 = meshes.vertices_t0.astype(np.float32), meshes.vertices_t1.astype(np.float32)
    detector = hc.Detector(meshes.scene())
    single = detector.detect(v0, v1)
    assert_same(single, detector.detect(v0.astype(np.float64), v1.astype(np.float64)))
    assert_same(single, detector.detect(v0, v1.astype(np.float64)))


@SCENES
def test_canonical_order(make):
    meshes = make(np.random.default_rng(33))
    c = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert c.vf.dtype == c.ee.dtype == np.uint32
    assert c.vf_toc.dtype == c.ee_toc.dtype == np.float64
    assert c.vf.shape == (len(c.vf_toc), 2) and c.ee.shape == (len(c.ee_toc), 4)
    for pairs in (c.vf, c.ee):
        assert sorted(rows(pairs)) == [tuple(r) for r in pairs.tolist()], "sorted, none twice"
    assert (c.ee[:, 0] < c.ee[:, 1]).all() and (c.ee[:, 2] < c.ee[:, 3]).all()
    assert all((a, b) < (e, f) for a, b, e, f in c.ee.tolist())
    assert all(len(set(row)) == 4 for row in c.ee.tolist())
    faces = np.concatenate([f + o for f, o in zip(meshes.faces, np.cumsum([0, *meshes.n_vertices]), strict=False)])
    assert not any(v in faces[f] for v, f in c.vf.tolist())


def test_one_detector_for_many_motions():
    """The hierarchy is refitted, not rebuilt: results must not depend on what came before."""
    rng = np.random.default_rng(40)
    meshes = random_scenes.many_meshes(rng)
    detector = hc.Detector(meshes.scene())
    motion = [meshes.vertices_t0]
    for _ in range(12):
        motion.append(motion[-1] + rng.normal(0, 0.5, motion[-1].shape))
    for v0, v1 in zip(motion, motion[1:], strict=False):
        assert_same(detector.detect(v0, v1), hc.Detector(meshes.scene()).detect(v0, v1))
    meshes.vertices_t0, meshes.vertices_t1 = motion[-2:]
    assert_exact(detector.detect(*motion[-2:]), meshes.truth())


def test_step_is_detect_from_the_last_end():
    rng = np.random.default_rng(41)
    meshes = random_scenes.single_mesh(rng)
    stream, single = hc.Detector(meshes.scene()), hc.Detector(meshes.scene())
    positions = [meshes.vertices_t0 + rng.normal(0, 0.4, meshes.vertices_t0.shape) for _ in range(5)]
    assert len(stream.step(positions[0])) == 0
    buffer = np.empty_like(positions[0])
    for before, after in zip(positions, positions[1:], strict=False):
        buffer[:] = after  # the caller's array may be overwritten between steps
        assert_same(stream.step(buffer), single.detect(before, after))
    stream.reset()
    assert len(stream.step(positions[2])) == 0
    assert_same(stream.step(positions[3]), single.detect(positions[2], positions[3]))


@SCENES
@pytest.mark.parametrize("threads", [1, 4])
def test_report_first(make, threads):
    meshes = make(np.random.default_rng(50))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    every = hc.Detector(meshes.scene()).detect(v0, v1)
    first = hc.Detector(meshes.scene(), report="first", threads=threads).detect(v0, v1)
    assert first.first_toc == every.first_toc
    np.testing.assert_array_equal(first.vf, every.vf[every.vf_toc == every.first_toc])
    np.testing.assert_array_equal(first.ee, every.ee[every.ee_toc == every.first_toc])
    assert (first.vf_toc == every.first_toc).all() and (first.ee_toc == every.first_toc).all()


@SCENES
def test_report_any(make):
    meshes = make(np.random.default_rng(51))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    every = hc.Detector(meshes.scene()).detect(v0, v1)
    one = hc.Detector(meshes.scene(), report="any").detect(v0, v1)
    assert len(one) == 1
    assert rows(one.vf) <= rows(every.vf) and rows(one.ee) <= rows(every.ee)


def test_reports_of_a_scene_without_contacts():
    faces = np.array([[0, 1, 2]])
    v = np.eye(3)
    for report in ("all", "first", "any"):
        scene = hc.Scene()
        scene.add_mesh("a", faces)
        scene.add_mesh("b", faces)
        vertices = np.concatenate([v, v + 100])
        contacts = hc.Detector(scene, report=report, outputs=("points", "normals")).detect(vertices, vertices + 1)
        assert len(contacts) == 0
        assert contacts.first_toc == np.inf
        assert contacts.vf.shape == (0, 2) and contacts.ee.shape == (0, 4) and contacts.points.shape == (0, 3)


@pytest.mark.parametrize("n_vertices", [0, 5])
def test_scene_without_faces(n_vertices):
    scene = hc.Scene()
    scene.add_mesh("particles", np.empty((0, 3), int), n_vertices=n_vertices)
    assert len(hc.Detector(scene).detect(np.zeros((n_vertices, 3)), np.ones((n_vertices, 3)))) == 0


def test_empty_scene():
    assert len(hc.Detector(hc.Scene()).detect(np.zeros((0, 3)), np.zeros((0, 3)))) == 0


@pytest.mark.parametrize("scale", [2.0**-1040, 1e-30, 1e30, 1e140])
def test_scale_of_a_scene(scale):
    meshes = random_scenes.many_meshes(np.random.default_rng(60))
    meshes.vertices_t0, meshes.vertices_t1 = meshes.vertices_t0 * scale, meshes.vertices_t1 * scale
    contacts = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert_exact(contacts, meshes.truth())


@pytest.mark.parametrize("offset", [1e3, 1e8, 1e12, 1e16])
def test_far_from_the_origin(offset):
    meshes = random_scenes.many_meshes(np.random.default_rng(61))
    meshes.vertices_t0, meshes.vertices_t1 = meshes.vertices_t0 + offset, meshes.vertices_t1 - offset
    contacts = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert_exact(contacts, meshes.truth())


@SCENES
def test_still_scene(make):
    meshes = make(np.random.default_rng(62))
    meshes.vertices_t1 = meshes.vertices_t0
    contacts = hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1)
    assert_exact(contacts, meshes.truth())
    assert not contacts.vf_toc.any() and not contacts.ee_toc.any()


def test_hash_tells_contacts_apart():
    hashes = set()
    for seed in range(20):
        meshes = random_scenes.many_meshes(np.random.default_rng(seed))
        hashes.add(hc.Detector(meshes.scene()).detect(meshes.vertices_t0, meshes.vertices_t1).hash)
    assert len(hashes) == 20
    assert all(0 <= h < 2**64 for h in hashes)


def test_offsets_of_meshes():
    meshes = random_scenes.many_meshes(np.random.default_rng(63))
    scene = meshes.scene()
    assert scene.mesh_names == [f"mesh{i}" for i in range(5)]
    assert scene.n_vertices == len(meshes.vertices_t0)
    assert [scene.vertex_offset(i) for i in range(5)] == [0, *np.cumsum(meshes.n_vertices)[:-1]]
    assert [scene.face_offset(f"mesh{i}") for i in range(5)] == [0, *np.cumsum([len(f) for f in meshes.faces])[:-1]]


def test_stats_are_of_the_pairs_that_a_query_looks_at():
    meshes = random_scenes.many_meshes(np.random.default_rng(65))
    detector, vertices = hc.Detector(meshes.scene(), backend="cpu"), meshes.vertices_t0
    kinds = []
    for ask in (
        lambda: detector.detect(vertices, vertices),
        lambda: detector.proximity(vertices, 0.1),
        lambda: detector.intersections(vertices),
        lambda: detector.distances(vertices),
        lambda: detector.detect(vertices, vertices),
    ):
        ask()
        kinds.append({name.split("_")[0] for name in detector.stats if name.endswith("_candidates")})
    assert kinds == [{"vf", "ee"}, {"vf", "ee"}, {"ef"}, {"vf", "ee", "ef"}, {"vf", "ee"}]


def test_profile_and_stats():
    meshes = random_scenes.many_meshes(np.random.default_rng(64))
    detector = hc.Detector(meshes.scene())
    assert detector.stats == {}
    contacts = detector.detect(meshes.vertices_t0, meshes.vertices_t1)
    profile = detector.profile
    assert profile["total"] == pytest.approx(sum(ms for stage, ms in profile.items() if stage != "total"), abs=1e-6)
    assert detector.stats["vf_contacts"] == len(contacts.vf)
    assert detector.stats["ee_contacts"] == len(contacts.ee)
    assert detector.stats["vf_candidates"] >= len(contacts.vf)
    with pytest.raises(ValueError, match="NaN"):
        detector.detect(meshes.vertices_t0, np.full_like(meshes.vertices_t1, np.nan))
    assert detector.stats == {}


def test_added_meshes_do_not_reach_a_detector():
    meshes = random_scenes.single_mesh(np.random.default_rng(65))
    scene = meshes.scene()
    detector = hc.Detector(scene)
    scene.add_mesh("later", meshes.faces[0])
    assert_exact(detector.detect(meshes.vertices_t0, meshes.vertices_t1), meshes.truth())


def test_cancel_ends_a_call_under_way():
    # Layers of a regular grid that pass through each other: a hundred thousand exact contacts, seconds of work.
    n = 120
    y, x = np.mgrid[0:n, 0:n].astype(float)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)])
    scene = hc.Scene()
    layers = 6
    for layer in range(layers):
        scene.add_mesh(f"layer {layer}", faces)
    start = np.concatenate([np.stack([x.ravel(), y.ravel(), np.full(n * n, float(k))], 1) for k in range(layers)])
    end = start * [1, 1, -1]
    detector = hc.Detector(scene, accuracy="exact", backend="cpu", threads=2)
    timer = threading.Timer(0.3, detector.cancel)
    timer.start()
    with pytest.raises(hc.Cancelled, match="cancelled"):
        detector.detect(start, end)
    timer.join()
    with pytest.raises(hc.Cancelled):
        detector.detect(start, start)
