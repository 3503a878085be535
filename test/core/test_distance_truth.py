# SPDX-License-Identifier: Apache-2.0
"""Distance queries on scenes and queries with exact ground truth: separation, proximity, intersections."""

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from scene_pairs import assert_pairs, rows, size_of

import hpccd_core as hc

SMALL, LARGE = ("two-cubes", "thick-cloth"), ("cloth-ball", "cloth-funnel")
PROMISES = ("exact", "conservative")
SCENES = pytest.mark.parametrize(("name", "accuracy"), list(itertools.product(SMALL + LARGE, PROMISES)))
KINDS = (("vf", hc.test_vertex_face), ("ee", hc.test_edge_edge))


@pytest.fixture
def scene_file(data_folder, name):
    """The truth, keys as in the README of the folder, and its motion, which may have a file of its own."""
    folder = data_folder / "distance"
    if name in SMALL:
        file = dict(np.load(folder / f"{name}.npz"))
        return SimpleNamespace(truth=file, motion=file)
    return SimpleNamespace(
        truth=dict(np.load(folder / f"{name}-distance.npz")), motion=dict(np.load(data_folder / f"{name}.npz"))
    )


def detector_of(motion, accuracy, **options):
    scene = hc.Scene()
    scene.add_mesh("scene", motion["faces"], n_vertices=len(motion["vertices_t0"]))
    return hc.Detector(scene, accuracy=accuracy, backend="cpu", **options)


def truth_of(truth, key, value):
    names = ("vf", "ee", f"vf_{value}", f"ee_{value}")
    return SimpleNamespace(**{name: truth[f"{key}_{name}"] for name in names})


@SCENES
def test_separation(scene_file, name, accuracy):
    truth, motion = scene_file.truth, scene_file.motion
    keys = [key for key in ("s", "s2", "s3") if f"{key}_d" in truth]
    assert keys
    for key in keys:
        detector = detector_of(motion, accuracy, minimum_separation=float(truth[f"{key}_d"]))
        found = detector.detect(motion["vertices_t0"], motion["vertices_t1"])
        assert_pairs(found, truth_of(truth, key, "toc"), "toc", accuracy)


@SCENES
def test_proximity(scene_file, name, accuracy):
    truth, motion = scene_file.truth, scene_file.motion
    detector, size = detector_of(motion, accuracy), size_of(motion["vertices_t0"], motion["vertices_t1"])
    keys = [key for key in ("p", "p2") if f"{key}_d" in truth]
    assert keys
    for key in keys:
        found = detector.proximity(motion["vertices_t1"], float(truth[f"{key}_d"]))
        assert_pairs(found, truth_of(truth, key, "distance"), "distance", accuracy, size)


@SCENES
def test_intersections(scene_file, name, accuracy):
    found = detector_of(scene_file.motion, accuracy).intersections(scene_file.motion["vertices_t1"])
    pairs, true = rows(found.ef), set(rows(scene_file.truth["x_ef"]))
    assert pairs == sorted(set(pairs)) and true <= set(pairs)
    if accuracy == "exact":
        assert len(pairs) == len(true) > 0


@pytest.mark.parametrize("name", SMALL + LARGE)
def test_hashes_are_the_same_on_any_number_of_threads(scene_file, name):
    motion, truth = scene_file.motion, scene_file.truth
    hashes = set()
    for threads in (1, 2, 5):
        detector = detector_of(motion, "exact", threads=threads, minimum_separation=float(truth["s_d"]))
        contacts = detector.detect(motion["vertices_t0"], motion["vertices_t1"])
        near = detector.proximity(motion["vertices_t1"], float(truth["p_d"]))
        hashes.add((contacts.hash, near.hash, detector.intersections(motion["vertices_t1"]).hash))
    assert len(hashes) == 1


@pytest.mark.parametrize("accuracy", PROMISES)
@pytest.mark.parametrize(("kind", "test"), KINDS)
def test_queries_of_separation(data_folder, accuracy, kind, test):
    with np.load(data_folder / "distance" / "queries.npz") as file:
        columns = [file[f"{kind}_{name}"] for name in ("q", "d", "hit", "toc", "tag")]
    for query, d, true_hit, true_toc, tag in zip(*columns, strict=True):
        (hit,), (toc,) = test(query[None], accuracy=accuracy, minimum_separation=float(d))
        assert hit or not true_hit, f"{tag}: missed"
        if true_hit:
            assert toc <= true_toc + (1e-15 if accuracy == "conservative" else 1e-12), f"{tag}: late"
        if accuracy == "exact":
            assert hit == true_hit, f"{tag}: invented"
            assert not hit or abs(toc - true_toc) <= 1e-12, tag


@pytest.mark.parametrize("accuracy", PROMISES)
@pytest.mark.parametrize("kind", ["vf", "ee"])
def test_queries_of_proximity(data_folder, accuracy, kind):
    faces = [[1, 2, 3]] if kind == "vf" else [[0, 1, 1], [2, 3, 3]]  # a face that names a vertex twice is an edge
    scene = hc.Scene()
    scene.add_mesh("pair", faces, n_vertices=4)
    detector = hc.Detector(scene, accuracy=accuracy, threads=1, backend="cpu")
    pair = (0, 0) if kind == "vf" else (0, 1, 2, 3)
    with np.load(data_folder / "distance" / "queries.npz") as file:
        columns = [file[f"p_{kind}_{name}"] for name in ("q", "d", "hit", "distance", "tag")]
    for query, d, true_hit, true_distance, tag in zip(*columns, strict=True):
        near = detector.proximity(query, float(d))
        values = dict(zip(rows(getattr(near, kind)), getattr(near, f"{kind}_distance"), strict=True))
        assert pair in values or not true_hit, f"{tag}: missed"
        if accuracy == "exact":
            assert (pair in values) == true_hit, f"{tag}: invented"
            assert not true_hit or abs(values[pair] - true_distance) <= 1e-12 * size_of(query), tag


@pytest.mark.parametrize("accuracy", PROMISES)
def test_queries_of_intersections(data_folder, accuracy):
    scene = hc.Scene()
    scene.add_mesh("edge", [[0, 1, 1]])
    scene.add_mesh("face", [[0, 1, 2]])
    detector = hc.Detector(scene, accuracy=accuracy, threads=1, backend="cpu")
    with np.load(data_folder / "distance" / "queries.npz") as file:
        columns = [file[f"x_{name}"] for name in ("q", "hit", "tag")]
    for query, true_hit, tag in zip(*columns, strict=True):
        hit = (0, 1, 1) in rows(detector.intersections(query).ef)
        assert hit or not true_hit, f"{tag}: missed"
        assert accuracy == "conservative" or hit == true_hit, f"{tag}: invented"
