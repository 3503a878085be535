# SPDX-License-Identifier: Apache-2.0
"""Queries of ~/detect: contacts with a separation, what is near, intersects or is nearest in one snapshot."""

import math

import numpy as np
import pytest
from cloth_and_net import FACES, MESHES, N, frame, positions
from hpccd.msg import ContactArray, DistanceArray
from hpccd.srv import Detect
from node_process import NodeProcess, assert_same_contacts
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core.options import OUTPUTS
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros import client
from hpccd_ros.middleware import mesh_messages


def request(*, start=True, **fields):
    out = Detect.Request(mesh_names=list(MESHES), **fields)
    out.topologies = [mesh_messages.topology_message(FACES, N * N, version=4) for _ in MESHES]
    for k, target in enumerate((out.start, out.end)):
        if start or k:
            for part in positions(k):
                message = mesh_messages.vertices_message(part, 5 + k, step=k, frame_id="lab", topology_version=4)
                target.append(message)
    return out


def snapshot(query, **fields):
    return request(start=False, query=query, **fields)


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    given = {"minimum_separation": 1e-3, "pair_separation": ["cloth:net:0.004", "wall:cloth:0.5"]}
    node = NodeProcess(
        tmp_path_factory.mktemp("queries"),
        {"meshes": [*MESHES, "wall"], "outputs": list(OUTPUTS[1:]), "max_contacts": 0, **given},
    )
    yield node
    node.close()


def ask(node, asked):
    client = node.peer.client()
    future = client.call_async(asked)
    node.wait_until(future.done, "response")
    node.peer.node.destroy_client(client)
    return future.result()


def separated(*pairs):
    scene = scene_of(cloth=FACES, net=FACES)
    for pair in pairs:
        scene.set_separation(*pair)
    return scene


@pytest.mark.parametrize("query", ["", "contacts"])
def test_contacts_with_the_separation_of_the_node(node, query):
    """Of its pairs only those whose meshes are asked for."""
    response = ask(node, request(query=query))
    assert response.success and response.message.endswith("contacts"), response.message
    scene = separated(("cloth", "net", 0.004))
    assert_same_contacts(response.contacts, frame(0), frame(1), scene, minimum_separation=1e-3, outputs=OUTPUTS[1:])
    told = client.contacts_from_message(response.contacts)
    assert (told.minimum_separation, told.pair_separation) == (1e-3, {("cloth", "net"): 0.004})
    assert told.closest.shape == (len(told), 2, 3) and len(told.points) == 0
    assert told.weights.shape == (len(told), 4) and np.isfinite(told.toc_gradients()).any()
    assert len(response.distances.distance) == 0


@pytest.mark.parametrize("distance", [0.0, 0.002])
def test_contacts_with_the_separation_of_the_request(node, distance):
    response = ask(node, request(minimum_separation=[distance]))
    assert_same_contacts(response.contacts, frame(0), frame(1), separated(), minimum_separation=distance)
    told = client.contacts_from_message(response.contacts)
    assert (told.minimum_separation, told.pair_separation) == (distance, {})


def of_snapshot(message):
    """Header, start and step are those of the snapshot."""
    assert (message.header.frame_id, message.header.stamp.nanosec, message.step) == ("lab", 6, 1)
    assert list(message.mesh_names) == list(MESHES) and list(message.topology_versions) == [4, 4]
    assert message.accuracy == "exact" and message.backend
    if hasattr(message, "start"):
        assert message.start == message.header.stamp and math.isinf(message.first_toc) and len(message.toc) == 0


def layout():
    topology = client.topology_from_message(client.topology_message(FACES, N * N, version=4))
    return client.Layout.of(MESHES, (topology, topology))


@pytest.mark.parametrize("distance", [0.0, 0.004])
def test_near_pairs(node, distance):
    response = ask(node, snapshot("proximity", distance=[distance]))
    assert response.success, response.message
    of_snapshot(response.contacts)
    expected = hc.Detector(separated(), outputs=OUTPUTS[1:]).proximity(frame(1), distance)
    got = client.scene_contacts(response.contacts, layout())
    for name in ("vf", "vf_distance", "ee", "ee_distance", "normals", "closest", "vertices", "weights"):
        assert np.array_equal(getattr(got, name), getattr(expected, name)), name
    assert len(got.points) == len(got.approach) == 0
    if distance:
        with pytest.raises(ValueError, match="toc_gradients: a snapshot has no times"):
            client.contacts_from_message(response.contacts).toc_gradients()
    assert response.contacts.hash == expected.hash and response.contacts.total == len(expected)
    assert response.message == f"{len(expected)} pairs within {distance:g}"
    assert len(expected) > 10 or distance == 0


def test_edges_in_faces(node):
    response = ask(node, snapshot("intersections"))
    assert response.success and response.message.endswith("edges in faces"), response.message
    of_snapshot(response.contacts)
    expected = hc.Detector(separated()).intersections(frame(1))
    got = client.scene_contacts(response.contacts, layout())
    assert np.array_equal(got.ef, expected.ef) and len(got.vf) == len(got.ee) == 0
    assert response.contacts.hash == expected.hash and len(expected) > 0
    assert set(response.contacts.kind) == {ContactArray.EDGE_FACE}
    assert not any(len(getattr(response.contacts, name)) for name in OUTPUT_ARRAYS)


def test_smallest_distances(node):
    response = ask(node, snapshot("distances"))
    assert (response.success, response.message) == (True, "3 pairs of meshes")
    of_snapshot(response.distances)
    got = client.distances_from_message(response.distances)
    expected = hc.Detector(separated()).distances(frame(1))
    assert [got.between(gap.mesh_a, gap.mesh_b) for gap in expected] == [gap.distance for gap in expected]
    assert np.array_equal(got.points, [gap.points for gap in expected])
    assert len(response.contacts.kind) == response.contacts.total == 0


def test_meshes_that_intersect_and_meshes_far_apart(node):
    """A needle through a triangle, and another triangle above them."""
    triangle = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float64)
    needle = np.array([[0, 0, -1], [0, 0, 1], [0.01, 0, 1]])
    asked = Detect.Request(query="distances", mesh_names=["a", "b", "c"])
    for part in (triangle, needle, triangle + [0, 0, 3]):
        asked.topologies.append(mesh_messages.topology_message(np.array([[0, 1, 2]]), 3))
        asked.end.append(mesh_messages.vertices_message(part, 1))
    got = client.distances_from_message(ask(node, asked).distances)
    assert [got.between(*pair) for pair in ("ab", "ba", "ac", "bc")] == [0.0, 0.0, 3.0, 2.0]
    assert [got.between(*pair) for pair in ("aa", "bb", "cc")] == [math.inf] * 3
    rows = {tuple(sorted(pair)): row for row, pair in enumerate(zip(got.mesh_a, got.mesh_b, strict=True))}
    crossing, within = rows[0, 1], rows[0, 0]
    assert got.kind[crossing] == DistanceArray.EDGE_FACE and got.kind[within] == DistanceArray.NO_PAIR
    assert (got.mesh_a[crossing], got.features_a[crossing].tolist(), got.features_b[crossing, 0]) == (1, [0, 1], 0)
    asked.query = "intersections"
    hits = client.contacts_from_message(ask(node, asked).contacts)
    assert hits.n_edge_face == len(hits) == 2 and hits.mesh_a.tolist() == [1, 1] and len(hits.toc) == 0


@pytest.mark.parametrize(
    "asked, text",
    [
        (
            request(query="nearest"),
            "query: 'nearest' is not valid; use one of contacts, collision_free_step, proximity, inters",
        ),
        (snapshot("proximity"), "distance: empty; query proximity needs one"),
        (snapshot("proximity", distance=[-1.0]), "distance: -1.0 must be finite and not negative"),
        (snapshot("proximity", distance=[math.nan]), "distance: nan must be finite"),
        (snapshot("distances", distance=[1.0]), "distance: only query proximity has one, leave it empty for distances"),
        (request(distance=[1.0]), "distance: only query proximity has one, leave it empty for contacts"),
        (request(minimum_separation=[math.inf]), "minimum_separation: inf must be finite and not negative"),
        (request(minimum_separation=[-0.5]), "minimum_separation: -0.5 must be finite and not negative"),
        (
            snapshot("intersections", minimum_separation=[0.1]),
            "minimum_separation: only queries contacts and collision_free_step have one, leave it empty for inters",
        ),
        (snapshot("distances", report="first"), "report: only query contacts has one, leave it empty for distances"),
        (request(start=False), "start: 0 entries for 2 meshes"),
    ],
)
def test_bad_requests_are_rejected_with_a_reason(node, asked, text):
    response = ask(node, asked)
    assert not response.success and text in response.message, response.message
    assert response.contacts.total == len(response.distances.distance) == 0


@pytest.mark.parametrize(
    "query, help_",
    [
        ("contacts", "ask for less (report first), or set a longer time_limit"),
        ("proximity", "ask for a smaller distance, or set a longer time_limit"),
        ("intersections", "set a longer time_limit"),
        ("distances", "set a longer time_limit"),
    ],
)
def test_a_late_response_says_what_this_query_can_do(node, query, help_):
    large = 150
    asked = Detect.Request(query=query, mesh_names=["sheet"], time_limit=1e-4)
    asked.distance = [0.1] if query == "proximity" else []
    asked.topologies = [mesh_messages.topology_message(sheet_faces(large), large**2)]
    asked.start = [mesh_messages.vertices_message(sheet_positions(large, 0), 5)] if query == "contacts" else []
    asked.end = [mesh_messages.vertices_message(sheet_positions(large, 1), 6)]
    response = ask(node, asked)
    assert not response.success and response.message.endswith(f"before the result was ready; {help_}"), response.message


def test_only_the_nearest_of_many(start_node):
    node = start_node({"max_contacts": 7})
    response = ask(node, snapshot("proximity", distance=[0.01]))
    found = hc.Detector(separated()).proximity(frame(1), 0.01)
    got = client.contacts_from_message(response.contacts)
    nearest = np.sort(np.concatenate([found.vf_distance, found.ee_distance]))[:7]
    assert np.sort(got.distance).tolist() == nearest.tolist()
    assert (response.contacts.total, response.contacts.truncated) == (len(found), True)
