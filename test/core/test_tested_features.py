# SPDX-License-Identifier: Apache-2.0
"""Option features: the full result with the other kind left out, bit for bit, from every way to find it."""

import itertools
import math

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc
from hpccd_core.options import FEATURES

METHODS = ("default", "published", "naive", "front")
SELECTIONS = (("vertex_face",), ("edge_edge",), FEATURES)
SIMD = tuple(hc._core.simd_levels())


def mesh_of(meshes):
    """The mesh of each vertex, and of each face."""
    numbers = range(len(meshes.faces))
    return np.repeat(numbers, meshes.n_vertices), np.repeat(numbers, [len(faces) for faces in meshes.faces])


def kept(result, tested, meshes, time="toc"):
    """What of a full result is tested. tested(a, b): the features between two meshes."""
    of_vertex, of_face = mesh_of(meshes)
    vf = [i for i, (v, f) in enumerate(result.vf) if "vertex_face" in tested(of_vertex[v], of_face[f])]
    ee = [i for i, (a, _, b, _) in enumerate(result.ee) if "edge_edge" in tested(of_vertex[a], of_vertex[b])]
    values = {f"vf_{time}": getattr(result, f"vf_{time}")[vf], f"ee_{time}": getattr(result, f"ee_{time}")[ee]}
    return {"vf": result.vf[vf], "ee": result.ee[ee], **values}


def assert_holds(found, expected):
    for name, values in expected.items():
        np.testing.assert_array_equal(getattr(found, name), values, name)


@pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)
@pytest.mark.parametrize("accuracy", ["fast", "balanced", "conservative", "exact"])
def test_the_full_result_with_the_other_kind_left_out(make, accuracy):
    meshes = make(np.random.default_rng(91))
    scene, motion = meshes.scene(), (meshes.vertices_t0, meshes.vertices_t1)
    for separation in (0.0, 0.0625):
        full = hc.Detector(scene, accuracy=accuracy, minimum_separation=separation, backend="cpu").detect(*motion)
        for features in SELECTIONS:
            expected = kept(full, lambda a, b: features, meshes)  # noqa: B023
            hashes = set()
            for (m, method), (s, simd) in itertools.product(enumerate(METHODS), enumerate(SIMD)):
                detector = hc.Detector(
                    scene,
                    accuracy=accuracy,
                    minimum_separation=separation,
                    backend="cpu",
                    method=method,
                    simd=simd,
                    threads=1 + 2 * ((m + s) % 2),  # each number of threads with each method and with each set
                    features=features,
                )
                found = detector.detect(*motion)
                assert_holds(found, expected)
                hashes.add(found.hash)
                for kind, name in (("vf", "vertex_face"), ("ee", "edge_edge")):
                    assert name in features or detector.stats[f"{kind}_candidates"] == 0
            assert len(hashes) == 1
            assert (hashes == {full.hash}) == (len(found) == len(full))


def some_pairs(rng, meshes):
    """What is tested between pairs of meshes, for a part of them."""
    pairs = itertools.combinations_with_replacement(range(len(meshes.faces)), 2)
    return {pair: SELECTIONS[rng.integers(3)] for pair in pairs if rng.random() < 0.6}


def with_pairs(meshes, pairs, **options):
    scene = meshes.scene(**options)
    for (a, b), features in pairs.items():
        scene.set_features(b, a, features)
    return scene


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(4))
def test_by_pair_of_meshes(method, seed):
    rng = np.random.default_rng([92, seed])
    meshes = random_scenes.many_meshes(rng)
    motion = meshes.vertices_t0, meshes.vertices_t1
    # A static mesh rests, and is where the others end.
    motion[0][: meshes.n_vertices[0]] = motion[1][: meshes.n_vertices[0]]
    rules = {"static": (0,), "no_self_collision": (2,), "ignored_pairs": [(1, 3)]}
    full = hc.Detector(meshes.scene(**rules), backend="cpu").detect(*motion)
    for features in SELECTIONS:
        pairs = some_pairs(rng, meshes)
        detector = hc.Detector(
            with_pairs(meshes, pairs, **rules), features=features, method=method, backend="cpu", threads=2
        )

        def tested(a, b, pairs=pairs, features=features):
            return pairs.get((min(a, b), max(a, b)), features)

        expected = kept(full, tested, meshes)
        for _ in range(2):
            assert_holds(detector.detect(*motion), expected)
            detector.detect(motion[1], motion[1])
        detector.step(motion[0])
        assert_holds(detector.step(motion[1]), expected)


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("seed", range(3))
def test_how_far_a_step_may_go(threads, seed):
    """From starts that come again, with other queries between: what is kept of a start is of what is tested."""
    rng = np.random.default_rng([93, seed])
    meshes = random_scenes.free_at_first(rng)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    ends = [v0 + part * (v1 - v0) for part in (1.0, 0.5, 2.0, 1e-3, 0.25)]
    full = hc.Detector(meshes.scene(), backend="cpu")
    for features in SELECTIONS:
        pairs = some_pairs(rng, meshes) if seed else {}
        detector = hc.Detector(with_pairs(meshes, pairs), features=features, backend="cpu", threads=threads)

        def tested(a, b, pairs=pairs, features=features):
            return pairs.get((min(a, b), max(a, b)), features)

        for number in rng.permutation(np.tile(np.arange(len(ends)), 5)):
            held = kept(full.detect(v0, ends[number]), tested, meshes)
            first = min([*held["vf_toc"], *held["ee_toc"]], default=math.inf)
            step = detector.collision_free_step(v0, ends[number])
            assert min(first, 1.0) - 1e-9 <= step <= min(first, 1.0)
            between = rng.integers(4)
            if between == 0:
                assert_holds(detector.detect(v0, ends[number]), held)
            elif between == 1:
                gaps = [(g.mesh_a, g.mesh_b, g.distance, g.kind) for g in detector.distances(ends[number])]
                assert gaps == [(g.mesh_a, g.mesh_b, g.distance, g.kind) for g in full.distances(ends[number])]


@pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)
def test_first_any_and_points(make):
    meshes = make(np.random.default_rng(94))
    scene, motion = meshes.scene(), (meshes.vertices_t0, meshes.vertices_t1)
    outputs = ("points", "normals")
    full = hc.Detector(scene, backend="cpu", outputs=outputs).detect(*motion)
    for features in SELECTIONS[:2]:
        found = hc.Detector(scene, backend="cpu", features=features, outputs=outputs).detect(*motion)
        n_vf = len(full.vf)
        rows = slice(0, n_vf) if features == ("vertex_face",) else slice(n_vf, None)
        np.testing.assert_array_equal(found.points, full.points[rows])
        np.testing.assert_array_equal(found.normals, full.normals[rows])
        first = hc.Detector(scene, backend="cpu", features=features, report="first").detect(*motion)
        tocs = np.concatenate([found.vf_toc, found.ee_toc])
        assert first.first_toc == found.first_toc == min(tocs, default=math.inf)
        assert len(first) == np.count_nonzero(tocs == first.first_toc)
        one = hc.Detector(scene, backend="cpu", features=features, report="any").detect(*motion)
        assert len(one) == min(len(found), 1)
        assert {tuple(pair) for pair in one.vf} <= {tuple(pair) for pair in found.vf}
        assert {tuple(pair) for pair in one.ee} <= {tuple(pair) for pair in found.ee}


@pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)
def test_proximity_is_filtered_and_whole_surfaces_are_not(make):
    rng = np.random.default_rng(95)
    meshes = make(rng)
    pairs = some_pairs(rng, meshes)
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    full = hc.Detector(meshes.scene(), backend="cpu")
    near, gaps, hits = full.proximity(v1, 0.25), full.distances(v1), full.intersections(v1)
    for features in SELECTIONS:
        detector = hc.Detector(with_pairs(meshes, pairs), features=features, backend="cpu")

        def tested(a, b, features=features):
            return pairs.get((min(a, b), max(a, b)), features)

        expected = kept(near, tested, meshes, "distance")
        for query in rng.permutation(12) % 4:  # boxes of edges may be older than those of the rest
            if query == 0:
                assert_holds(detector.proximity(v1, 0.25), expected)
            elif query == 1:
                assert detector.intersections(v1).hash == hits.hash
            elif query == 2:
                for gap, other in zip(detector.distances(v1), gaps, strict=True):
                    assert (gap.distance, gap.kind, gap.features) == (other.distance, other.kind, other.features)
            else:
                detector.detect(v0, v1)


def test_names_in_any_form():
    scene = hc.Scene()
    scene.add_mesh("a", [[0, 1, 2]])
    assert hc.Detector(scene).features == FEATURES
    assert hc.Detector(scene, features="edge_edge").features == ("edge_edge",)
    assert hc.Detector(scene, features=["edge_edge", "vertex_face", "edge_edge"]).features == FEATURES
    scene.set_features("a", 0, "vertex_face")
    scene.set_features("a", "a", ("vertex_face", "edge_edge"))


@pytest.mark.parametrize(
    "features, error, text",
    [
        ((), ValueError, "features: empty.*use vertex_face or edge_edge, or both.*scene.ignore_pair"),
        ("vertex-face", ValueError, "features: 'vertex-face' is not known; use one of vertex_face, edge_edge"),
        ("", ValueError, "features: '' is not known"),
        (3, TypeError, "features: expected one or several of vertex_face, edge_edge, got int"),
        (b"vertex_face", TypeError, "features: expected one or several of vertex_face, edge_edge, got bytes"),
        ((3,), TypeError, "features: expected a string, got int"),
        (None, TypeError, "features: expected one or several of vertex_face, edge_edge, got NoneType"),
    ],
)
def test_errors_name_the_remedy(features, error, text):
    scene = hc.Scene()
    scene.add_mesh("a", [[0, 1, 2]])
    with pytest.raises(error, match=text):
        hc.Detector(scene, features=features)
    with pytest.raises(error, match=text):
        scene.set_features("a", "a", features)
    with pytest.raises(ValueError, match="mesh_b: no mesh is named 'b'"):
        scene.set_features("a", "b", "edge_edge")


@pytest.mark.parametrize("name", ["cloth-funnel", "cloth-ball"])
def test_published_scenes(data_folder, name):
    with np.load(data_folder / f"{name}.npz") as truth:
        scene = hc.Scene()
        scene.add_mesh("scene", truth["faces"], n_vertices=len(truth["vertices_t0"]))
        step = truth["vertices_t0"], truth["vertices_t1"]
    full = hc.Detector(scene, backend="cpu").detect(*step)
    faces = hc.Detector(scene, backend="cpu", features="vertex_face").detect(*step)
    edges = hc.Detector(scene, backend="cpu", features="edge_edge").detect(*step)
    assert_holds(faces, {"vf": full.vf, "vf_toc": full.vf_toc, "ee": full.ee[:0], "ee_toc": full.ee_toc[:0]})
    assert_holds(edges, {"vf": full.vf[:0], "vf_toc": full.vf_toc[:0], "ee": full.ee, "ee_toc": full.ee_toc})
