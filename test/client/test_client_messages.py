# SPDX-License-Identifier: Apache-2.0
"""Arrays to messages and back, and what is rejected before it is sent."""

import math

import numpy as np
import pytest
from hpccd.msg import ContactArray, DistanceArray

from hpccd_ros import client

FACES = np.array([[0, 1, 2], [3, 4, 5]])
VERTICES = np.arange(18.0).reshape(6, 3)


def test_a_topology_comes_back():
    message = client.topology_message(FACES.tolist(), 7, edges=[(5, 6)], version=3, stamp_ns=5_000_000_007)
    topology = client.topology_from_message(message)
    assert (topology.version, topology.n_vertices) == (3, 7)
    assert topology.faces.dtype == np.uint32 and np.array_equal(topology.faces, FACES)
    assert topology.edges.dtype == np.uint32 and topology.edges.tolist() == [[5, 6]]
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (5, 7)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_vertices_come_back_in_their_precision(dtype):
    message = client.vertices_message(
        VERTICES.astype(dtype), 5_000_000_007, step=2**40, topology_version=3, frame_id="world"
    )
    back = client.vertices_from_message(message)
    assert back.dtype == dtype and np.array_equal(back, VERTICES.astype(dtype))
    assert (message.step, message.topology_version, message.header.frame_id) == (2**40, 3, "world")
    back[0, 0] = 42
    assert (message.vertices_f32 or message.vertices_f64)[0] == 42, "a view"


@pytest.mark.parametrize(
    "arguments, error, text",
    [
        (dict(faces=[[0, 1]]), ValueError, "faces: expected shape"),
        (dict(faces=[[0.0, 1.0, 2.0]]), TypeError, "faces: expected integers"),
        (dict(faces=[[0, 1, -1]]), ValueError, r"faces\[0, 2\] is -1"),
        (dict(n_vertices=5), ValueError, "faces: face 1 names vertex 5, n_vertices is 5"),
        (dict(edges=[[0, 1, 2]]), ValueError, r"edges: expected shape \(E, 2\)"),
        (dict(edges=[[0, 1], [6, 2]]), ValueError, "edges: edge 1 names vertex 6, n_vertices is 6"),
        (dict(n_vertices=2.5), TypeError, "n_vertices: expected an integer"),
        (dict(version=2**32), ValueError, "version: must lie in"),
        (dict(stamp_ns=-1), ValueError, "stamp_ns: must lie in"),
    ],
)
def test_a_topology_that_is_rejected(arguments, error, text):
    with pytest.raises(error, match=text):
        client.topology_message(**{"faces": FACES, "n_vertices": 6, **arguments})


@pytest.mark.parametrize(
    "arguments, error, text",
    [
        (dict(vertices=VERTICES.tolist()), TypeError, "vertices: expected an array of float32 or float64, got list"),
        (dict(vertices=VERTICES.astype(int)), TypeError, "got dtype int64"),
        (dict(vertices=VERTICES.ravel()), ValueError, r"vertices: expected shape \(n, 3\).*got \(18,\)"),
        (dict(vertices=VERTICES[:0]), ValueError, "at least one"),
        (dict(vertices=np.ma.masked_less(VERTICES, 1)), TypeError, "vertices: some elements are masked"),
        (dict(vertices=VERTICES * np.nan), ValueError, "vertices: vertex 0 is .* must be finite"),
        (dict(vertices=VERTICES * 1e150), ValueError, "vertices: .* must lie in"),
        (dict(stamp_ns=2**31 * 10**9), ValueError, "stamp_ns: must lie in"),
        (dict(stamp_ns=0.5), TypeError, "stamp_ns: expected an integer"),
        (dict(step=-1), ValueError, "step: must lie in"),
        (dict(topology_version="1"), TypeError, "topology_version: expected an integer"),
        (dict(frame_id=None), TypeError, "frame_id: expected a string"),
        (dict(frame_id="\udcff"), ValueError, "frame_id: .* has no UTF-8 encoding"),
    ],
)
def test_vertices_that_are_rejected(arguments, error, text):
    with pytest.raises(error, match=text):
        client.vertices_message(**{"vertices": VERTICES, "stamp_ns": 0, **arguments})


def test_the_last_values_that_fit():
    message = client.vertices_message(VERTICES, 2**31 * 10**9 - 1, step=2**64 - 1, topology_version=2**32 - 1)
    assert message.header.stamp.sec == 2**31 - 1


def two_contacts(**changes):
    """A vertex of mesh a on a face of b, and two edges."""
    fields = dict(
        mesh_names=["a", "b"],
        kind=[0, 1],
        mesh_a=[0, 0],
        mesh_b=[1, 1],
        features_a=[2, ContactArray.NONE, 0, 1],
        features_b=[0, ContactArray.NONE, 1, 2],
        toc=[0.25, 0.5],
        topology_versions=[0, 0],
    )
    return ContactArray(**{**fields, **changes})


def layout(*names):
    topology = client.topology_from_message(client.topology_message([[0, 1, 2]], 3))
    return client.Layout.of(names, (topology,) * len(names))


def test_contacts_of_meshes_and_of_the_scene():
    contacts = client.contacts_from_message(two_contacts())
    assert (len(contacts), contacts.n_vertex_face, contacts.mesh_names) == (2, 1, ("a", "b"))
    assert contacts.features_a.tolist() == [[2, ContactArray.NONE], [0, 1]]
    assert contacts.points.shape == contacts.normals.shape == (0, 3)
    scene = client.scene_contacts(two_contacts(), layout("a", "b"))
    assert scene.vf.tolist() == [[2, 1]] and scene.ee.tolist() == [[0, 1, 4, 5]]
    assert (scene.vf_toc.tolist(), scene.ee_toc.tolist()) == ([0.25], [0.5])


def test_no_contacts():
    contacts = client.contacts_from_message(ContactArray(mesh_names=["a"]))
    assert len(contacts) == 0 and contacts.features_a.shape == (0, 2)


def test_contacts_with_a_separation():
    message = two_contacts(
        minimum_separation=0.1,
        separation_mesh_a=[1, 0],
        separation_mesh_b=[0, 0],
        separations=[0.2, 0.0],
        closest=[float(k) for k in range(12)],
    )
    contacts = client.contacts_from_message(message)
    assert contacts.minimum_separation == 0.1
    assert contacts.pair_separation == {("a", "b"): 0.2, ("a", "a"): 0.0}, "names in the order of the scene"
    assert contacts.closest.tolist() == [[[0, 1, 2], [3, 4, 5]], [[6, 7, 8], [9, 10, 11]]]
    assert client.scene_contacts(message, layout("a", "b")).closest.shape == (2, 2, 3)
    plain = client.contacts_from_message(two_contacts())
    assert (plain.minimum_separation, plain.pair_separation, plain.closest.shape) == (0.0, {}, (0, 2, 3))


def with_weights(**changes):
    """Of both contacts; the edges only graze each other."""
    fields = dict(
        normals=[0.0, 0.0, 1.0, 0.0, 1.0, 0.0],
        vertices=[2, 0, 1, 2, 0, 1, 1, 2],
        weights=[1.0, -0.25, -0.25, -0.5, -0.75, -0.25, 0.5, 0.5],
        approach=[-2.0, 0.0],
    )
    return two_contacts(**{**fields, **changes})


def test_weights_and_gradients():
    contacts = client.contacts_from_message(with_weights())
    assert contacts.vertices.tolist() == [[2, 0, 1, 2], [0, 1, 1, 2]] and contacts.vertices.dtype == np.uint32
    assert contacts.weights.tolist() == [[1.0, -0.25, -0.25, -0.5], [-0.75, -0.25, 0.5, 0.5]]
    assert contacts.approach.tolist() == [-2.0, 0.0]
    scene = client.scene_contacts(with_weights(), layout("a", "b"))
    assert scene.vertices.tolist() == [[2, 3, 4, 5], [0, 1, 4, 5]] and scene.vertices.dtype == np.uint32
    assert np.array_equal(scene.weights, contacts.weights) and np.array_equal(scene.approach, contacts.approach)
    g0, g1 = contacts.toc_gradients()
    assert g0.shape == g1.shape == (2, 4, 3) and np.isnan([g0[1], g1[1]]).all()
    assert g0[0].tolist() == [[0, 0, weight * 0.375] for weight in contacts.weights[0]]
    assert g1[0].tolist() == [[0, 0, weight * 0.125] for weight in contacts.weights[0]]
    plain = client.contacts_from_message(two_contacts())
    assert plain.vertices.shape == plain.weights.shape == (0, 4) and plain.approach.shape == (0,)
    assert client.scene_contacts(two_contacts(), layout("a", "b")).vertices.shape == (0, 4)


@pytest.mark.parametrize(
    "changes, text",
    [
        (dict(normals=[]), r"the message has no normals; set the node's parameter outputs to \[normals, weights\]"),
        (dict(vertices=[], weights=[], approach=[]), "the message has no weights"),
        (dict(toc=[], distance=[0.5, 0.25], approach=[]), "a snapshot has no times; send the query contacts"),
        (dict(parts=2, motion_bounds=[0.0, 0.0]), "the step was computed in 2 parts; with rigid_parts: 1 it has"),
    ],
)
def test_messages_without_gradients(changes, text):
    with pytest.raises(ValueError, match=f"toc_gradients: {text}"):
        client.contacts_from_message(with_weights(**changes)).toc_gradients()


def test_contacts_tell_what_was_tested():
    assert client.contacts_from_message(two_contacts()).features == ("vertex_face", "edge_edge")
    assert client.contacts_from_message(two_contacts(tested_features=1)).features == ("vertex_face",)
    assert client.contacts_from_message(two_contacts(tested_features=2)).features == ("edge_edge",)


def test_responses_of_one_snapshot():
    near = client.contacts_from_message(two_contacts(toc=[], distance=[0.5, 0.25]))
    assert (len(near), near.n_vertex_face, near.n_edge_edge, near.n_edge_face) == (2, 1, 1, 0)
    assert near.distance.tolist() == [0.5, 0.25] and len(near.toc) == 0
    scene = client.scene_contacts(two_contacts(toc=[], distance=[0.5, 0.25]), layout("a", "b"))
    assert (scene.vf_distance.tolist(), scene.ee_distance.tolist(), len(scene.vf_toc)) == ([0.5], [0.25], 0)
    edge_in_face = two_contacts(
        toc=[], kind=[2, 2], features_a=[0, 1, 1, 2], features_b=[0, ContactArray.NONE, 0, ContactArray.NONE]
    )
    hits = client.contacts_from_message(edge_in_face)
    assert (len(hits), hits.n_edge_face, hits.features_a.tolist()) == (2, 2, [[0, 1], [1, 2]])
    assert client.scene_contacts(edge_in_face, layout("a", "b")).ef.tolist() == [[0, 1, 1], [1, 2, 1]]


def three_distances(**changes):
    none = DistanceArray.NONE
    fields = dict(
        mesh_names=["a", "b"],
        kind=[1, 0, 255],
        mesh_a=[0, 1, 1],
        mesh_b=[0, 0, 1],
        distance=[0.5, 0.25, math.inf],
        features_a=[0, 1, 2, none, none, none],
        features_b=[3, 4, 0, none, none, none],
        points=[0.0] * 18,
    )
    return DistanceArray(**{**fields, **changes})


def test_smallest_distances():
    found = client.distances_from_message(three_distances())
    assert (len(found), found.mesh_names, found.points.shape) == (3, ("a", "b"), (3, 2, 3))
    assert found.features_a[0].tolist() == [0, 1] and found.features_b[1, 0] == 0
    assert [found.between(*pair) for pair in ("aa", "ab", "ba", "bb")] == [0.5, 0.25, 0.25, math.inf]
    with pytest.raises(ValueError, match="mesh_b: no mesh is named 'c'; there are a, b"):
        found.between("a", "c")
    assert found.direction.shape == (3, 3) and not found.direction.any(), "of a message from before it had them"
    assert found.approach_speed.shape == (3,) and np.isnan(found.approach_speed).all()
    told = three_distances(direction=[0.0, 0.6, 0.8] * 3, approach_speed=[1.0, -2.0, math.nan])
    told = client.distances_from_message(told)
    assert told.direction[1].tolist() == [0, 0.6, 0.8] and told.approach_speed[:2].tolist() == [1, -2]
    assert np.isnan(told.time_to_contact).all() and told.inside.tolist() == [0, 0, 0] and told.nearest is None
    told = client.distances_from_message(
        three_distances(time_to_contact=[math.inf, 0.5, math.nan], inside=[0, 2, 0], nearest=1)
    )
    assert told.time_to_contact[1] == 0.5 and told.inside[told.nearest] == DistanceArray.INSIDE_B
    nothing = client.distances_from_message(DistanceArray(mesh_names=["a", "b"]))
    assert len(nothing) == 0 and nothing.between("a", "b") == math.inf, "not tested against each other"


@pytest.mark.parametrize(
    "changes, text",
    [
        (dict(distance=[0.5]), r"kind has 3 values, 1 were expected for shape \(1,\)"),
        (dict(points=[0.0] * 6), r"points has 6 values, 18 were expected for shape \(3, 2, 3\)"),
        (dict(mesh_a=[0, 1, 2]), "mesh_a names a mesh beyond the 2 of mesh_names"),
        (dict(direction=[0.0] * 9), r"approach_speed has 0 values, 3 were expected for shape \(3,\)"),
        (dict(inside=[0] * 3), r"time_to_contact has 0 values, 3 were expected for shape \(3,\)"),
        (dict(approach_speed=[0.0] * 3), r"direction has 0 values, 9 were expected for shape \(3, 3\)"),
    ],
)
def test_distances_whose_arrays_do_not_fit_together(changes, text):
    with pytest.raises(ValueError, match=text):
        client.distances_from_message(three_distances(**changes))


@pytest.mark.parametrize(
    "changes, text",
    [
        (dict(kind=[1, 0]), "kind must hold"),
        (dict(kind=[0, 6]), "kind must hold"),
        (dict(kind=[0, 2]), r"toc has 2 values, 0 were expected"),
        (dict(toc=[0.5]), r"toc has 1 values, 2 were expected for shape \(2,\)"),
        (dict(features_b=[1, 2]), r"features_b has 2 values, 4 were expected"),
        (dict(separations=[0.5]), "separation_mesh_a, separation_mesh_b and separations have 0, 0 and 1 entries"),
        (dict(minimum_separation=-1.0), "message: separation: a separation must be finite and not negative"),
        (dict(distance=[0.5, 0.25]), r"toc has 2 values, 0 were expected"),
        (dict(closest=[0.0] * 6), r"closest has 6 values, 12 were expected for shape \(2, 2, 3\)"),
        (dict(points=[0.0]), r"points has 1 values, 6 were expected for shape \(2, 3\)"),
        (dict(vertices=[0] * 7), r"vertices has 7 values, 8 were expected for shape \(2, 4\)"),
        (dict(weights=[0.0] * 4), r"weights has 4 values, 8 were expected for shape \(2, 4\)"),
        (dict(approach=[0.0] * 3), r"approach has 3 values, 2 were expected for shape \(2,\)"),
        (dict(approach=[0.0] * 2), "vertices is empty, though other arrays of the output weights are not"),
        (dict(vertices=[0] * 8, weights=[0.0] * 8), "approach is empty, though other arrays of the output weights are"),
        (dict(vertices=[0] * 8, toc=[], distance=[0.5, 0.25]), "weights is empty, though other arrays of the output"),
        (dict(mesh_b=[1, 2]), "mesh_b names a mesh beyond the 2 of mesh_names"),
    ],
)
def test_contacts_whose_arrays_do_not_fit_together(changes, text):
    with pytest.raises(ValueError, match=text):
        client.contacts_from_message(two_contacts(**changes))


@pytest.mark.parametrize(
    "changes, text",
    [
        (
            dict(vertices=[2, 0, 1, 3, 0, 1, 1, 2]),
            r"vertices of contact 0 are \[2, 0, 1, 3\], beyond those of their meshes",
        ),
        (dict(vertices=[2, 0, 1, 2, 0, 2**32 - 1, 1, 2]), r"vertices of contact 1 are \[0, 4294967295, 1, 2\]"),
        (dict(features_a=[3, ContactArray.NONE, 0, 1]), r"features_a of contact 0 are \[3, 4294967295\], in mesh a"),
        (
            dict(features_b=[0, ContactArray.NONE, 1, 2**32 - 2]),
            r"features_b of contact 1 are \[1, 4294967294\], in mesh b",
        ),
        (dict(features_b=[1, ContactArray.NONE, 1, 2]), r"features_b of contact 0 are \[1, 4294967295\], in mesh b"),
    ],
)
def test_contacts_of_features_that_do_not_exist(changes, text):
    with pytest.raises(ValueError, match=f"message: {text}"):
        client.scene_contacts(with_weights(**changes), layout("a", "b"))


def test_a_layout_needs_a_topology_for_each_mesh():
    with pytest.raises(ValueError, match="topologies: 0 of 1 meshes"):
        client.Layout.of(("cloth",), ())


def test_a_layout_of_another_scene():
    with pytest.raises(ValueError, match="layout: it is of the meshes b, a, the message of a, b"):
        client.scene_contacts(two_contacts(), layout("b", "a"))
    with pytest.raises(ValueError, match="layout: the contacts are of topology versions"):
        client.scene_contacts(two_contacts(topology_versions=[0, 1]), layout("a", "b"))


@pytest.mark.parametrize("name", ["", "a b", "1st", "a/b", "näher", "x\n"])
def test_names_that_no_mesh_can_have(name):
    for topic in (client.topology_topic, client.vertices_topic):
        with pytest.raises(ValueError, match="mesh: .* is not a valid mesh name; use letters"):
            topic(name)
        with pytest.raises(TypeError, match="mesh: expected its name, got NoneType"):
            topic(None)


def test_all_names_are_there_and_documented():
    assert len(set(client.__all__)) == len(client.__all__)
    for name in client.__all__:
        if callable(found := getattr(client, name)):
            assert found.__doc__, name
