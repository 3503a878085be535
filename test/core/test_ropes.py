# SPDX-License-Identifier: Apache-2.0
"""Edges in no face: ropes and rods."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

METHODS = ("default", "published", "naive", "front")


def two_crossing_segments():
    """One falls through the other: they cross at t = 0.25, in the middle of both."""
    start = np.array([[0, 0, 0], [2, 0, 0], [1, -1, 0.5], [1, 1, 0.5]], float)
    return start, start + [[0, 0, 0], [0, 0, 0], [0, 0, -2], [0, 0, -2]]


@pytest.mark.parametrize("method", METHODS)
def test_two_segments_cross(method):
    scene = hc.Scene()
    scene.add_mesh("first", edges=[[0, 1]])
    scene.add_mesh("second", edges=[[1, 0]], n_vertices=2)
    assert scene.n_vertices == 4 and scene.n_faces == 0
    detector = hc.Detector(scene, method=method, backend="cpu", outputs=("points", "normals"))
    found = detector.detect(*two_crossing_segments())
    assert found.ee.tolist() == [[0, 1, 2, 3]] and found.ee_toc.tolist() == [0.25] and len(found.vf) == 0
    np.testing.assert_allclose(found.points, [[1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(np.abs(found.normals), [[0, 0, 1]], atol=1e-15)


def test_a_rope_is_asked_all_that_a_mesh_is():
    scene = hc.Scene()
    scene.add_mesh("rope", edges=[[0, 1], [1, 2]])
    scene.add_mesh("floor", [[0, 1, 2]], static=True)
    detector = hc.Detector(scene, backend="cpu")
    rope = np.array([[-1, 0, 2], [0, 0, 1], [1, 0, 2]], float)
    floor = np.array([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], float)
    above, below = np.concatenate([rope, floor]), np.concatenate([rope - [0, 0, 1.5], floor])
    assert detector.collision_free_step(above, below) == pytest.approx(2 / 3, abs=1e-9)
    found = detector.detect(above, below)
    assert found.vf.tolist() == [[1, 0]] and found.vf_toc[0] == pytest.approx(2 / 3, abs=1e-12)
    assert detector.intersections(below).ef.tolist() == [[0, 1, 0], [1, 2, 0]]
    assert detector.proximity(above, 1.0).vf.tolist() == [[1, 0]]
    gap = next(gap for gap in detector.distances(above) if gap.mesh_a != gap.mesh_b)
    assert (gap.distance, gap.kind, list(gap.features)) == (1.0, "vertex-face", [1, 0])


def test_vertices_in_no_edge_meet_faces_only():
    scene = hc.Scene()
    scene.add_mesh("rope and points", edges=[[0, 1]], n_vertices=4)
    rest = np.array([[0, 0, 0], [2, 0, 0], [1, 0, 0], [1, 0, 1]], float)
    detector = hc.Detector(scene, backend="cpu", minimum_separation=5.0)
    assert len(detector.detect(rest, rest)) == 0


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("generate", [random_scenes.ropes, random_scenes.lattice_ropes])
def test_edges_are_as_faces_that_name_a_vertex_twice(generate, method):
    """But for the contacts of vertices with such faces, which count behind the others."""
    rng = np.random.default_rng(3)
    for _ in range(3):
        meshes = generate(rng)
        faked, real = hc.Scene(), []
        for i, (faces, edges, n) in enumerate(zip(meshes.faces, meshes.edges, meshes.n_vertices, strict=True)):
            faked.add_mesh(f"mesh{i}", np.concatenate([faces, edges[:, [0, 1, 1]]]), n_vertices=n)
            real += [True] * len(faces) + [False] * len(edges)
        real = np.array(real)
        of_face = np.cumsum(real) - 1
        options = {"method": method, "backend": "cpu", "minimum_separation": 0.1}
        found = hc.Detector(meshes.scene(), **options).detect(meshes.vertices_t0, meshes.vertices_t1)
        other = hc.Detector(faked, **options).detect(meshes.vertices_t0, meshes.vertices_t1)
        assert len(found.ee) > 100 and np.array_equal(found.ee, other.ee)
        assert found.ee_toc.tobytes() == other.ee_toc.tobytes()
        kept = real[other.vf[:, 1]]
        vf = np.stack([other.vf[kept, 0], of_face[other.vf[kept, 1]]], axis=1)
        assert len(found.vf) > 10 and np.array_equal(found.vf, vf)
        assert found.vf_toc.tobytes() == other.vf_toc[kept].tobytes()


def test_what_is_given_is_checked():
    scene = hc.Scene()
    for edges, error, text in (
        ([[0, 1, 2]], ValueError, r"edges: expected shape \(E, 2\), got \(1, 3\)"),
        ([0, 1], ValueError, r"edges: expected shape \(E, 2\), got \(2,\)"),
        ([[0.0, 1.0]], TypeError, r"edges: expected integers.*edges\.astype"),
        ([[0, -1]], ValueError, r"edges\[0, 1\] is -1, which is negative"),
        ([[0, 1], [2**33, 0]], ValueError, r"edges\[1, 0\] is 8589934592, which is beyond"),
        ([["a", "b"]], TypeError, "edges: expected integers"),
        (None, TypeError, "edges"),
    ):
        with pytest.raises(error, match=text):
            scene.add_mesh("rope", edges=edges)
    with pytest.raises(ValueError, match=r"edges\[0, 1\] is 2, but mesh 'rope' has 2 vertices"):
        scene.add_mesh("rope", edges=[[0, 2]], n_vertices=2)
    assert scene.mesh_names == [] and scene.n_vertices == 0
    scene.add_mesh("rope", edges=np.array([[0, 2]], np.int8))
    assert scene.n_vertices == 3
