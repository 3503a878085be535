# SPDX-License-Identifier: Apache-2.0
"""Tested features: streamed, changed while the node runs, requested from ~/detect, recorded and computed again."""

import dataclasses

import cloth_and_net_stream
import numpy as np
import pytest
from cloth_and_net import FACES, MESHES, N, frame, positions
from hpccd.srv import Detect
from lifecycle_msgs.msg import Transition
from node_calls import change_state, set_parameter
from node_process import NodeProcess, assert_same_contacts
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_core.options import FEATURES
from hpccd_ros import client
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import mesh_messages
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

FACES_ONLY, EDGES_ONLY = ("vertex_face",), ("edge_edge",)


class Stream(cloth_and_net_stream.Stream):
    """pairs: (mesh, mesh, features) of the node."""

    def __init__(self, node, pairs=()):
        self.pairs = pairs
        super().__init__(node)

    def expect(self, features):
        """Send a frame; its result is that of the core, and reports what was tested."""
        scene = scene_of(cloth=FACES, net=FACES)
        for pair in self.pairs:
            scene.set_features(*pair)
        response = self.send()
        assert assert_same_contacts(response, frame(self.sent - 2), frame(self.sent - 1), scene, features=features) > 0
        told = client.contacts_from_message(response)
        assert told.features == features
        if not self.pairs:
            assert (told.n_vertex_face > 0) == ("vertex_face" in features)
            assert (told.n_edge_edge > 0) == ("edge_edge" in features)
        return response

    def set(self, name, value):
        return set_parameter(self.node, name, value)


def test_changed_from_step_to_step_recorded_and_verified(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    stream = Stream(start_node({"meshes": list(MESHES), "record": str(path)}))
    told = [FEATURES, FACES_ONLY, EDGES_ONLY, FEATURES]
    stream.expect(told[0])
    for features in told[1:]:
        assert stream.set("features", list(features)[::-1]).successful
        stream.expect(features)
    status = stream.node.peer.statuses["detection"][2]
    assert status["features"] == "vertex_face, edge_edge"
    for bad, reason in (([""], "features: empty"), (["faces"], "use one of vertex_face, edge_edge"), ("x", "expected")):
        response = stream.set("features", bad)
        assert not response.successful and reason in response.reason, response.reason
    response = stream.set("pair_features", ["cloth:net:vertex_face"])
    assert not response.successful and "pair_features: read-only while the node is configured" in response.reason
    stream.expect(FEATURES)
    assert stream.node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert (replay.verified, replay.diverged, replay.unverified) == (5, 0, 0)
    assert [step.features for step in steps] == [*told, FEATURES]
    done = hpccd("replay", path, "--csv", "steps.csv")
    only = "only edge_edge; only vertex_face"
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"VERIFIED: 5 results are equal in every contact, time and hash (accuracy exact; {only})" in done.stdout
    done = hpccd("replay", path, "--features", "vertex_face")
    assert done.returncode == 1 and "DIVERGED: 4 of 5 results differ" in done.stdout, done.stdout
    done = hpccd("replay", path, "--features", "vertex_face,faces")
    assert done.returncode == 2 and "features: 'faces' is not known; use one of vertex_face" in done.stderr, done.stderr


def test_by_pair_of_meshes_and_only_vertices_against_faces(start_node, tmp_path, hpccd):
    """From the parameters alone: a recording carries these."""
    path = tmp_path / "pairs.mcap"
    given = {"features": ["vertex_face"], "pair_features": ["net:cloth:edge_edge", "net:net:vertex_face"]}
    pairs = [("cloth", "net", EDGES_ONLY), ("net", "net", FACES_ONLY)]
    node = start_node({"meshes": list(MESHES), "record": str(path), **given})
    stream = Stream(node, pairs)
    response = stream.expect(FACES_ONLY)
    kind = np.frombuffer(response.kind, np.uint8)
    between = np.frombuffer(response.mesh_a, np.uint32) != np.frombuffer(response.mesh_b, np.uint32)
    assert between.any() and set(kind[between]) == {response.EDGE_EDGE}
    assert (kind[~between] == response.VERTEX_FACE).all()
    stream.expect(FACES_ONLY)
    assert node.stop() == 0
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        replay = Replay(recording, setup)
        list(replay.steps())
    assert (replay.verified, replay.diverged, replay.unverified) == (2, 0, 0)
    assert setup.builder.pair_features == tuple(
        ("net", name, kinds) for name, kinds in (("cloth", EDGES_ONLY), ("net", FACES_ONLY))
    )
    full = dataclasses.replace(setup, settings=setup.settings | {"pair_features": []})
    with Recording(path) as recording:
        other = Replay(recording, full)
        list(other.steps())
    assert other.diverged == 2


def test_pairs_may_change_while_nothing_is_configured(start_node):
    node = start_node({"meshes": list(MESHES)})
    stream = Stream(node)
    stream.expect(FEATURES)
    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    assert change_state(node, Transition.TRANSITION_CLEANUP)
    response = stream.set("pair_features", ["cloth:wall:vertex_face"])
    assert not response.successful and "'cloth:wall:vertex_face' must be NAME:NAME:KIND" in response.reason
    assert stream.set("pair_features", ["cloth:net:vertex_face"]).successful


def request(query="", **fields):
    out = Detect.Request(mesh_names=list(MESHES), query=query, **fields)
    out.topologies = [mesh_messages.topology_message(FACES, N * N) for _ in MESHES]
    for k, target in enumerate((out.start, out.end)):
        target += [mesh_messages.vertices_message(part, 5 + k, step=k) for part in positions(k)]
    return out


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    given = {"features": ["edge_edge"], "pair_features": ["cloth:net:vertex_face"], "max_contacts": 0}
    node = NodeProcess(tmp_path_factory.mktemp("features"), {"meshes": list(MESHES), **given})
    yield node
    node.close()


def ask(node, asked):
    client = node.peer.client()
    future = client.call_async(asked)
    node.wait_until(future.done, "response")
    node.peer.node.destroy_client(client)
    return future.result()


def scene_of_node():
    scene = scene_of(cloth=FACES, net=FACES)
    scene.set_features("cloth", "net", "vertex_face")
    return scene


@pytest.mark.parametrize("given", [(), FACES_ONLY, EDGES_ONLY, FEATURES], ids=" ".join)
def test_queries_of_features(node, given):
    """What the request says, or the node's parameter; what the node's pairs say holds in any case."""
    tested = given or EDGES_ONLY
    response = ask(node, request(features=list(given)))
    assert response.success, response.message
    assert_same_contacts(response.contacts, frame(0), frame(1), scene_of_node(), features=tested)
    assert client.contacts_from_message(response.contacts).features == tested
    core = hc.Detector(scene_of_node(), features=tested)
    near = ask(node, request("proximity", distance=[0.004], features=list(given)))
    assert near.success and near.contacts.hash == core.proximity(frame(1), 0.004).hash, near.message
    assert client.contacts_from_message(near.contacts).features == tested
    for _ in range(2):  # the second is computed by the detector that the first one left
        step = ask(node, request("collision_free_step", features=list(given)))
        assert step.success and step.collision_free_step == core.collision_free_step(frame(0), frame(1))


def test_the_client_asks_for_them(node):
    ends = [dict(zip(MESHES, positions(k), strict=True)) for k in (0, 1)]
    topologies = dict.fromkeys(MESHES, client.topology_message(FACES, N * N))
    asked = client.collision_free_step_request(*ends, topologies=topologies, features="vertex_face")
    step = client.collision_free_step_from_response(ask(node, asked))
    assert step == hc.Detector(scene_of_node(), features="vertex_face").collision_free_step(frame(0), frame(1))
    with pytest.raises(ValueError, match="features: 'faces' is not known; use one of vertex_face, edge_edge"):
        client.collision_free_step_request(*ends, topologies=topologies, features=["faces"])


@pytest.mark.parametrize("query", ["intersections", "distances"])
def test_whole_surfaces_have_none(node, query):
    response = ask(node, request(query))
    core = hc.Detector(scene_of(cloth=FACES, net=FACES))
    assert response.success, response.message
    if query == "intersections":
        assert response.contacts.hash == core.intersections(frame(1)).hash
    else:
        got = client.distances_from_message(response.distances)
        for gap in core.distances(frame(1)):
            assert got.between(gap.mesh_a, gap.mesh_b) == gap.distance
    rejected = ask(node, request(query, features=["edge_edge"]))
    said = f"features: only queries contacts, collision_free_step, proximity have some, leave them empty for {query}"
    assert not rejected.success and said in rejected.message


@pytest.mark.parametrize("features", [["faces"], [""], ["vertex_face", "x" * 1_000_000]], ids=["word", "empty", "1MB"])
def test_bad_names_are_rejected(node, features):
    response = ask(node, request(features=features))
    assert not response.success and "is not known; use one of vertex_face, edge_edge" in response.message
    assert len(response.message) < 1200
    assert ask(node, request()).success, "the node goes on"
