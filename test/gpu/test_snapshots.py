# SPDX-License-Identifier: Apache-2.0
"""Queries of one snapshot: the results of the GPU are bit-identical to those of the CPU."""

import numpy as np
import pytest
import scenes

import hpccd_core as hc

TIERS = ("fast", "balanced", "conservative", "exact")


def detectors(scene, **options):
    return hc.Detector(scene, backend="cpu", **options), hc.Detector(scene, backend="gpu", **options)


def assert_on_gpu(detector):
    assert detector.stats["gpu_fallbacks"] == 0, detector.last_gpu_error
    assert detector.backend == "gpu"


def assert_near_same(cpu, gpu, vertices, distance):
    expected = cpu.proximity(vertices, distance)
    for _ in range(2):  # with a new tree, and with a refitted one
        found = gpu.proximity(vertices, distance)
        assert_on_gpu(gpu)
        for name in ("vf", "vf_distance", "ee", "ee_distance", *expected.outputs):
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
        assert found.hash == expected.hash
    return expected


def assert_hits_same(cpu, gpu, vertices):
    expected = cpu.intersections(vertices)
    for _ in range(2):
        found = gpu.intersections(vertices)
        assert_on_gpu(gpu)
        assert found == expected  # the outputs too
    return expected


def assert_gaps_same(cpu, gpu, vertices):
    all_expected = cpu.distances(vertices)
    for _ in range(2):  # without a bound from the last frame, and with one
        for found, expected in zip(gpu.distances(vertices), all_expected, strict=True):
            assert (found.distance, found.kind, found.features) == (expected.distance, expected.kind, expected.features)
            assert found.inside == expected.inside
            for name in ("points", "vertices", "weights", "normal"):
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)


@pytest.mark.parametrize("accuracy", TIERS)
@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed))
def test_random_scenes(make, dtype, accuracy):
    scene, vertices, _ = scenes.join([make(np.random.default_rng(1), 24)])
    vertices = vertices.astype(dtype)
    cpu, gpu = detectors(scene, accuracy=accuracy)
    sizes = [len(assert_near_same(cpu, gpu, vertices, distance)) for distance in (0, 1e-6, 0.1, 1.0)]
    assert sizes == sorted(sizes) and sizes[-1] > 0
    assert_hits_same(cpu, gpu, vertices)
    assert_gaps_same(cpu, gpu, vertices)
    assert_on_gpu(gpu)


@pytest.mark.parametrize("make", (scenes.crumpled, scenes.lattice, scenes.soup, scenes.fringed))
def test_intersections_of_tangled_scenes(make):
    scene, _, vertices = scenes.join([make(np.random.default_rng(2), 24)])
    assert len(assert_hits_same(*detectors(scene, outputs=("points", "directions")), vertices)) > 0


def test_curves_are_on_the_host_only():
    scene, vertices, _ = scenes.join([scenes.crumpled(np.random.default_rng(2), 24)])
    found = hc.Detector(scene, results="device", outputs=("points", "directions")).intersections(vertices)
    for name in ("points", "edge_parameters", "weights", "incidences", "directions", "contours", "regions"):
        with pytest.raises(hc.OutputNotComputed, match=rf"{name}: not computed in a GPU's memory; .*results='host'"):
            getattr(found, name)
    assert not hasattr(found, "points") and not hasattr(found, "anything")


@pytest.mark.parametrize("scale, offset", ((1e-150, 0.0), (1e-20, 0.0), (1e148, 0.0), (1e290, 0.0), (1.0, 2.0**30)))
def test_scales_and_offsets(scale, offset):
    scene, _, vertices = scenes.join([scenes.lattice(np.random.default_rng(3), 9)])
    vertices = scale * (vertices + offset)
    cpu, gpu = detectors(scene)
    assert len(assert_near_same(cpu, gpu, vertices, scale)) > 0
    assert len(assert_hits_same(cpu, gpu, vertices)) > 0


def test_intersections_are_counted_under_the_same_names():
    """What the GPU has beside them is named after it."""
    scene, _, vertices = scenes.join([scenes.lattice(np.random.default_rng(13), 14)])
    cpu, gpu = detectors(scene)
    assert_hits_same(cpu, gpu, vertices)
    names = [{name for name in d.stats if not name.startswith("gpu_")} for d in (cpu, gpu)]
    assert names[0] == names[1]
    assert cpu.stats["ef_candidates"] > 0 and not any(name.startswith(("vf_", "ee_")) for name in names[0])


def test_faces_that_are_segments():
    rng = np.random.default_rng(4)
    scene = hc.Scene()
    faces, sheet, _ = scenes.crumpled(rng, 10)
    scene.add_mesh("sheet", faces, n_vertices=100)
    scene.add_mesh("rope", np.stack([np.arange(40), np.arange(1, 41), np.arange(1, 41)], axis=1), n_vertices=41)
    rope = np.stack([np.linspace(0, 9, 41), np.linspace(1, 8, 41), np.sin(np.arange(41.0))], axis=1)
    vertices = np.concatenate([sheet, rope])
    cpu, gpu = detectors(scene, outputs=("closest",))
    assert len(assert_near_same(cpu, gpu, vertices, 0.3)) > 0
    assert (assert_hits_same(cpu, gpu, vertices).ef[:, 0] >= 100).any()


def test_rules_between_meshes():
    rng = np.random.default_rng(5)
    scene, _, vertices = scenes.join(
        [scenes.crumpled(rng, 12) for _ in range(4)],
        no_self=(1,),
        ignored=((0, 2),),
        accuracy=((0, 1, "balanced"), (2, 3, "fast")),
    )
    cpu, gpu = detectors(scene)
    near = assert_near_same(cpu, gpu, vertices, 0.2)
    mesh = np.repeat(np.arange(4), 144)
    meshes = {tuple(sorted(m)) for m in mesh[near.ee[:, [0, 2]]]}
    assert (1, 1) not in meshes and (0, 2) not in meshes and (0, 1) in meshes
    assert_hits_same(cpu, gpu, vertices)


def test_nearest_points():
    scene, vertices, _ = scenes.join([scenes.lattice(np.random.default_rng(6), 14)])
    near = assert_near_same(*detectors(scene, outputs=("closest", "points", "normals", "weights")), vertices, 1.0)
    assert near.closest.shape == (len(near), 2, 3)


def test_queries_in_turn():
    """One detector, one tree: no query leaves anything behind that another one sees."""
    rng = np.random.default_rng(7)
    scene, v, _ = scenes.join([scenes.crumpled(rng, 16), scenes.soup(rng, 20)])
    cpu, gpu = detectors(scene)
    for turn in range(8):
        w = v + rng.normal(0, 0.5, v.shape)
        gpu.set_separation(0, 1, 0.1 * (turn % 3))
        cpu.set_separation(0, 1, 0.1 * (turn % 3))
        assert gpu.detect(v, w).hash == cpu.detect(v, w).hash
        assert_hits_same(cpu, gpu, w)
        assert gpu.detect(v, w).hash == cpu.detect(v, w).hash
        assert_near_same(cpu, gpu, w, 0.05 * (turn % 4))
        assert_gaps_same(cpu, gpu, w)
        v = w
    assert gpu.stats["gpu_fallbacks"] == 0, gpu.last_gpu_error


def test_a_tree_wears_out_whatever_the_distances():
    """Each frame asks for a little more than the last one; from the second on, neighbours in the tree lie anywhere."""
    rng = np.random.default_rng(14)
    scene, v, _ = scenes.join([scenes.crumpled(rng, 32)])
    w = rng.permutation(v)
    gpu, built = hc.Detector(scene, backend="gpu"), []
    for frame in range(5):
        gpu.proximity(w if frame else v, 0.1 + 1e-6 * frame)
        assert_on_gpu(gpu)
        built.append(gpu.profile.get("build", 0) > 0)
    assert built == [True, False, True, False, False]  # the device reports a frame when the next one begins


def test_the_hybrid_leaves_them_to_the_cpu():
    scene, vertices, _ = scenes.join([scenes.crumpled(np.random.default_rng(8), 12)])
    cpu, hybrid = hc.Detector(scene, backend="cpu"), hc.Detector(scene, backend="hybrid")
    assert hybrid.proximity(vertices, 0.1).hash == cpu.proximity(vertices, 0.1).hash
    assert hybrid.intersections(vertices).hash == cpu.intersections(vertices).hash
    assert hybrid.backend == "cpu"


def test_meshes_at_poses():
    """The search of the device, and what is left to the CPU: other queries, and scenes with planes."""
    (ball, ball_faces), (box, box_faces), rng = hc.shapes.icosphere(12), hc.shapes.box(), np.random.default_rng(16)
    scene = hc.Scene()
    scene.add_mesh("ball", ball_faces, shape=ball)
    scene.add_mesh("box", box_faces, shape=0.2 * box)
    scene.add_mesh("still", ball_faces, shape=ball + [2.2, 0, 0], static=True)
    cpu, gpu = detectors(scene)
    for reach in (0.3, 0.3, 3, 1, 0.1):
        turns = rng.normal(size=(2, 4))
        poses = np.hstack([reach * rng.normal(size=(2, 3)), turns / np.linalg.norm(turns, axis=1)[:, None]])
        for _ in range(2):
            assert gpu.distances(poses=poses) == cpu.distances(poses=poses) == cpu.distances(cpu.positions_at(poses))
            assert_on_gpu(gpu)
            assert "node_pairs" not in gpu.stats  # which a search of positions counts
        assert gpu.intersections(poses=poses).hash == cpu.intersections(poses=poses).hash
        assert gpu.distances(cpu.positions_at(poses)) == cpu.distances(poses=poses)
        assert_on_gpu(gpu)
    scene.add_plane("floor", offset=-3)
    cpu, gpu = detectors(scene)
    assert gpu.distances(poses=poses) == cpu.distances(poses=poses)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("library", ("cupy", "torch"))
def test_device_arrays(library, dtype):
    module = pytest.importorskip(library)
    scene, vertices, _ = scenes.join([scenes.lattice(np.random.default_rng(9), 20)])
    vertices = vertices.astype(dtype)
    there = module.asarray(vertices) if library == "cupy" else module.from_numpy(vertices).cuda()
    cpu, gpu = detectors(scene, outputs=("closest",))
    for _ in range(2):
        assert gpu.proximity(there, 0.5).hash == cpu.proximity(vertices, 0.5).hash
        np.testing.assert_array_equal(gpu.proximity(there, 0.5).closest, cpu.proximity(vertices, 0.5).closest)
        assert gpu.intersections(there).hash == cpu.intersections(vertices).hash
        assert_on_gpu(gpu)
    for found, expected in zip(gpu.distances(there), cpu.distances(vertices), strict=True):
        assert (found.distance, found.features) == (expected.distance, expected.features)


@pytest.mark.parametrize("dtype", (np.float32, np.float64))
@pytest.mark.parametrize("library", ("cupy", "torch"))
@pytest.mark.parametrize("query", ("proximity", "intersections", "distances"))
def test_device_arrays_in_the_first_call(query, library, dtype):
    """Before the detector has anything on the device."""
    module = pytest.importorskip(library)
    scene, _, vertices = scenes.join([scenes.crumpled(np.random.default_rng(12), 12) for _ in range(2)])
    vertices = vertices.astype(dtype)
    there = module.asarray(vertices) if library == "cupy" else module.from_numpy(vertices).cuda()
    more = (0.5,) if query == "proximity" else ()
    found, expected = (
        getattr(detector, query)(where, *more)
        for detector, where in zip(detectors(scene)[::-1], (there, vertices), strict=True)
    )
    if query == "distances":
        assert [(g.distance, g.features) for g in found] == [(g.distance, g.features) for g in expected]
    else:
        assert found.hash == expected.hash


def test_nothing_and_little():
    for faces, n in ((np.empty((0, 3), int), 0), (np.empty((0, 3), int), 2), ([[0, 1, 2]], 3), ([[0, 1, 2]], 5)):
        scene = hc.Scene()
        scene.add_mesh("few", faces, n_vertices=n)
        cpu, gpu = detectors(scene)
        vertices = np.random.default_rng(10).normal(size=(n, 3))
        assert_near_same(cpu, gpu, vertices, 10.0)
        assert_hits_same(cpu, gpu, vertices)


def test_bad_coordinates_are_named():
    scene, vertices, _ = scenes.join([scenes.crumpled(np.random.default_rng(11), 8)])
    cpu, gpu = detectors(scene)
    bad = vertices.copy()
    bad[3, 1] = np.nan
    for _ in range(2):
        with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is NaN"):
            gpu.proximity(bad, 0.1)
        with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is NaN"):
            gpu.intersections(bad)
        with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is NaN"):
            gpu.distances(bad)
        assert_near_same(cpu, gpu, vertices, 0.1)
