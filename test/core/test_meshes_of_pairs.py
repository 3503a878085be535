# SPDX-License-Identifier: Apache-2.0
"""Which mesh a scene-wide index belongs to; positions by mesh; scenes that are copied."""

import copy
import pickle

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc

NO_INDEX = 2**32 - 1


@pytest.fixture(scope="module")
def meshes():
    return random_scenes.many_meshes(np.random.default_rng(7))


def positions_by_mesh(scene, vertices):
    """In another order than that of the scene."""
    ends = [scene.vertex_offset(name) for name in scene.mesh_names[1:]] + [scene.n_vertices]
    of_meshes = zip(scene.mesh_names, np.split(vertices, ends[:-1]), strict=True)
    return dict(reversed(list(of_meshes)))


def test_locate(meshes):
    scene = meshes.scene()
    for vertex in range(scene.n_vertices):
        name, index = scene.locate(vertex)
        assert scene.vertex_offset(name) + index == vertex and index >= 0
    for face in (0, np.uint32(scene.n_faces - 1)):
        name, index = scene.locate(face=face)
        assert scene.face_offset(name) + index == face
    numbers, indices = scene.locate(np.arange(scene.n_vertices, dtype=np.uint32))
    located = [(scene.mesh_names[number], index) for number, index in zip(numbers, indices, strict=True)]
    assert located == [scene.locate(vertex) for vertex in range(scene.n_vertices)]
    before = scene.n_vertices
    scene.add_mesh("later", [[0, 1, 2]])
    assert scene.locate(before) == ("later", 0)


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda s: s.locate(), TypeError, "locate: give either vertex or face"),
        (lambda s: s.locate(0, face=0), TypeError, "locate: give either vertex or face"),
        (lambda s: s.locate(-1), ValueError, r"vertex: must lie in \[0,"),
        (lambda s: s.locate(1.0), TypeError, "vertex: expected an integer"),
        (lambda s: s.locate(np.array([0, 10**6])), ValueError, "vertex: indices must lie in .* got 0 to 1000000"),
        (lambda s: s.locate(face=np.array([0.5])), TypeError, "face: expected integers, got dtype float64"),
        (lambda s: s.locate(np.ma.array([1, 2], mask=[0, 1])), TypeError, "vertex: some elements are masked"),
        (lambda s: s.locate([1, True]), TypeError, "vertex: expected numbers, got True or False"),
        (lambda s: s.locate([1, None]), TypeError, "vertex: expected integers, got dtype object"),
        (lambda s: s.locate([1, [2]]), ValueError, "vertex: not a rectangular array"),
        (lambda s: s.locate([0, 2**70]), ValueError, "vertex: indices must lie in .* got 0 to 1e21"),
        (lambda s: hc.Scene().locate([1, [2]]), ValueError, "vertex: not a rectangular array"),
    ],
)
def test_indices_that_no_mesh_has(meshes, call, error, words):
    with pytest.raises(error, match=words):
        call(meshes.scene())


def located(scene, mesh, local, kind):
    """Scene-wide indices of one side."""
    offset = scene.vertex_offset if kind == "vertex" else scene.face_offset
    return [int(index) + offset(int(number)) for number, index in zip(mesh, local, strict=True)]


@pytest.mark.parametrize("worlds", [None, 2])
def test_both_sides_of_each_row(meshes, worlds):
    scene = meshes.scene()
    start, end = meshes.vertices_t0, meshes.vertices_t1
    if worlds:
        start, end = np.stack([start, end]), np.stack([end, start])
    detector = hc.Detector(scene, worlds=worlds)
    contacts, near, hits = detector.detect(start, end), detector.proximity(start, 0.1), detector.intersections(start)
    for found in (contacts, near, contacts.world(0), pickle.loads(pickle.dumps(contacts))):
        n = len(found.vf)
        assert n > 0 and len(found.ee) > 0 and len(found.mesh_a) == len(found)
        assert located(scene, found.mesh_a[:n], found.local_a[:n, 0], "vertex") == found.vf[:, 0].tolist()
        assert located(scene, found.mesh_b[:n], found.local_b[:n, 0], "face") == found.vf[:, 1].tolist()
        assert (found.local_a[:n, 1] == NO_INDEX).all() and (found.local_b[:n, 1] == NO_INDEX).all()
        for side, mesh, local in ((0, found.mesh_a, found.local_a), (2, found.mesh_b, found.local_b)):
            for k in (0, 1):
                assert located(scene, mesh[n:], local[n:, k], "vertex") == found.ee[:, side + k].tolist()
    assert len(hits) > 0 and (hits.local_b[:, 1] == NO_INDEX).all()
    assert located(scene, hits.mesh_a, hits.local_a[:, 1], "vertex") == hits.ef[:, 1].tolist()
    assert located(scene, hits.mesh_b, hits.local_b[:, 0], "face") == hits.ef[:, 2].tolist()


def test_the_first_step_and_merged_steps_know_their_meshes(meshes):
    from hpccd_core.rigid import merged

    detector = hc.Detector(meshes.scene(), outputs=("normals",))
    first = detector.step(meshes.vertices_t0)
    assert first.normals.shape == (0, 3) and first.mesh_a.shape == (0,) and first.local_a.shape == (0, 2)
    whole = merged([first, detector.step(meshes.vertices_t1)], 2)
    assert len(whole) == len(whole.normals) == len(whole.mesh_b) > 0
    with pytest.raises(ValueError, match="Contacts: has no layout of meshes"):
        _ = hc.Contacts.none().mesh_a


@pytest.mark.parametrize("dtypes", [(np.float32, np.float32), (np.float64, np.float32)])
def test_positions_by_mesh_are_those_of_the_whole_array(meshes, dtypes):
    scene = meshes.scene()
    start, end = meshes.vertices_t0.astype(np.float32), meshes.vertices_t1.astype(np.float32)
    by_mesh = [positions_by_mesh(scene, vertices) for vertices in (start, end)]
    for vertices in by_mesh:
        vertices[scene.mesh_names[0]] = vertices[scene.mesh_names[0]].astype(dtypes[0])
    detector = hc.Detector(scene)
    assert detector.detect(*by_mesh) == detector.detect(start, end)
    assert detector.detect(by_mesh[0], end) == detector.detect(start, end)
    assert detector.collision_free_step(*by_mesh) == detector.collision_free_step(start, end)
    assert detector.proximity(by_mesh[0], 0.1) == detector.proximity(start, 0.1)
    assert detector.intersections(by_mesh[0]) == detector.intersections(start)
    assert detector.distances(by_mesh[0]) == detector.distances(start)
    detector.step(by_mesh[0])
    assert detector.step(by_mesh[1]) == detector.detect(start, end)


def test_positions_by_mesh_of_many_worlds(meshes):
    scene = meshes.scene()
    both = np.stack([meshes.vertices_t0, meshes.vertices_t1])
    ends = [scene.vertex_offset(name) for name in scene.mesh_names[1:]]
    by_mesh = dict(zip(scene.mesh_names, np.split(both, ends, axis=1), strict=True))
    detector = hc.Detector(scene, worlds=2)
    assert detector.detect(by_mesh, by_mesh) == detector.detect(both, both)


def test_a_copied_scene_has_the_same_contacts_and_rules(meshes):
    scene = meshes.scene()
    a, b = scene.mesh_names[:2]
    scene.add_mesh("rope", edges=[[0, 1]], n_vertices=3)
    scene.set_accuracy(a, a, "conservative")
    scene.set_separation(a, b, 0.05)
    scene.set_features(b, b, "edge_edge")
    scene.ignore_pair("rope", a)
    ends = [np.concatenate([v, np.eye(3)]) for v in (meshes.vertices_t0, meshes.vertices_t1)]
    expected = hc.Detector(scene).detect(*ends)
    pickled = pickle.loads(pickle.dumps(scene))
    for other in (pickled, copy.deepcopy(scene), copy.copy(scene), pickle.loads(pickle.dumps(pickled))):
        found = hc.Detector(other).detect(*ends)
        assert found == expected and found.hash == expected.hash and repr(other) == repr(scene)
    before = repr(scene)
    other.add_mesh("later", [[0, 1, 2]])
    other.ignore_pair(a, b)
    assert repr(scene) == before and hc.Detector(scene).detect(*ends) == expected, "a copy of its own"


def test_a_copied_scene_keeps_attributes_that_were_added():
    class Named(hc.Scene):
        pass

    scene = Named()
    scene.add_mesh("cloth", [[0, 1, 2]])
    scene.unit = "m"
    assert pickle.loads(pickle.dumps(hc.Scene())).mesh_names == []
    for other in (copy.copy(scene), copy.deepcopy(scene)):
        other.add_mesh("later", [[0, 1, 2]])
        assert type(other) is Named and other.unit == "m" and scene.mesh_names == ["cloth"]


def test_a_scene_keeps_its_faces_whatever_the_caller_writes_to_them():
    faces = np.array([[0, 1, 2]], np.uint32)
    scene = hc.Scene()
    scene.add_mesh("cloth", faces, n_vertices=9)
    faces[:] = 8
    other = pickle.loads(pickle.dumps(scene))
    vertices = np.zeros((9, 3))
    assert hc.Detector(other).distances(vertices) == hc.Detector(scene).distances(vertices)


def test_outputs_that_were_not_asked_for_break_no_protocol(meshes):
    contacts = hc.Detector(meshes.scene(), outputs=("points",)).detect(meshes.vertices_t0, meshes.vertices_t1)
    with pytest.raises(hc.OutputNotComputed, match=r"make the detector with outputs=\('points', 'normals'\)"):
        _ = contacts.normals
    assert issubclass(hc.OutputNotComputed, ValueError)
    assert not hasattr(contacts, "normals") and getattr(contacts, "closest", None) is None
    assert repr(contacts).startswith("Contacts(") and pickle.loads(pickle.dumps(contacts)) == contacts
    assert copy.copy(contacts) == contacts and len(contacts.points) == len(contacts)


@pytest.mark.parametrize("seed", range(30))
def test_sides_and_dicts_in_scenes_with_empty_meshes_points_and_ropes(seed):
    """The mesh and the index of each vertex and face are listed one by one, as the meshes are added."""
    random = np.random.default_rng(seed)
    scene, vertices, faces, sizes = hc.Scene(), [], [], {}
    for k in range(random.integers(1, 8)):
        n, kind = int(random.integers(3, 7)), random.integers(5)
        mesh_faces = [random.choice(n, 3, replace=False) for _ in range(3)] if kind > 2 else []
        edges = [random.choice(n, 2, replace=False) for _ in range(2)] if kind in (2, 4) else []
        sizes[name := f"{'aé/☃ '[k % 5]}{k}"] = n = n if kind else 0
        assert scene.add_mesh(name, mesh_faces, edges=edges, n_vertices=n) == k
        vertices += [(k, i) for i in range(n)]
        faces += [(k, i) for i in range(len(mesh_faces))]
    names = list(sizes)
    assert [scene.locate(i) for i in range(scene.n_vertices)] == [(names[k], i) for k, i in vertices]
    assert [scene.locate(face=i) for i in range(scene.n_faces)] == [(names[k], i) for k, i in faces]
    start, end = random.normal(size=(2, len(vertices), 3))
    by_mesh = [
        {names[k]: x[[m == k for m, _ in vertices]] for k in random.permutation(len(names))} for x in (start, end)
    ]
    detector, copied = hc.Detector(scene), hc.Detector(pickle.loads(pickle.dumps(scene)))
    for query, more in (("detect", ()), ("proximity", (0.3,)), ("intersections", ()), ("distances", ())):
        given = (start, end) if query == "detect" else (start,)
        found = getattr(detector, query)(*given, *more)
        assert found == getattr(copied, query)(*by_mesh[: len(given)], *more)
        if query == "distances":
            continue
        vf, ee, ef = (getattr(found, kind, ()) for kind in ("vf", "ee", "ef"))
        sides = [([vertices[v]], [faces[f]]) for v, f in vf]
        sides += [([vertices[v] for v in row[:2]], [vertices[v] for v in row[2:]]) for row in ee]
        sides += [([vertices[v] for v in row[:2]], [faces[row[2]]]) for row in ef]
        for side, mesh, local in ((0, found.mesh_a, found.local_a), (1, found.mesh_b, found.local_b)):
            expected = [(pair[side][0][0], [i for _, i in pair[side]]) for pair in sides]
            assert mesh.tolist() == [k for k, _ in expected]
            assert local.tolist() == [(indices + [NO_INDEX])[:2] for _, indices in expected]
