# SPDX-License-Identifier: Apache-2.0
"""Pairs of meshes as blocks of parameters: given to a node, changed while it runs, recorded and computed again."""

import numpy as np
import pytest
from cloth_and_net import FACES, MESHES, N, frame, positions
from node_calls import call, set_parameter
from node_process import assert_same_contacts
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from waving_sheet import scene_of

from hpccd_ros import client


def send(node, k):
    """Frame k of both meshes; the response, from the second frame on."""
    for name, part in zip(MESHES, positions(k), strict=True):
        node.peer.vertices(name, part, stamp=k)
    node.frames_status(processed=2 * (k + 1))
    return node.contacts(k)[-1] if k else None


def scene(separation=None):
    found = scene_of(cloth=FACES, net=FACES)
    found.set_features("cloth", "net", ("vertex_face",))
    found.set_features("cloth", "cloth", ("edge_edge",))
    if separation is not None:
        found.set_separation("cloth", "net", separation)
    return found


def test_given_changed_and_replayed(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    pairs = {
        "between": {"meshes": ["net", "cloth"], "features": ["vertex_face"]},
        "within": {"meshes": ["cloth", "cloth"]},
    }
    node = start_node(
        {"meshes": list(MESHES), "pairs": pairs, "pair_features": ["cloth:cloth:edge_edge"], "record": str(path)}
    )
    for name in MESHES:
        node.peer.topology(name, FACES, N * N)
    send(node, 0)
    response = send(node, 1)
    assert assert_same_contacts(response, frame(0), frame(1), scene()) > 0
    kinds = np.frombuffer(response.kind, np.uint8)
    of_two = np.frombuffer(response.mesh_a, np.uint32) != np.frombuffer(response.mesh_b, np.uint32)
    assert 0 < np.count_nonzero(of_two) and not np.any(kinds[of_two]), "vertices against faces only"
    assert set_parameter(node, "pairs.between.separation", 5e-3).successful  # which was not given at the start
    assert_same_contacts(send(node, 2), frame(1), frame(2), scene(5e-3))
    assert client.contacts_from_message(node.peer.received[-1]).pair_separation == {("cloth", "net"): 5e-3}
    # Equal settings move from one way of writing to the other at once.
    moved = [Parameter("pair_separation", value=["cloth:net:0.002"]), Parameter("pairs.between.separation", value=2e-3)]
    request = SetParametersAtomically.Request(parameters=[parameter.to_parameter_msg() for parameter in moved])
    assert call(node, SetParametersAtomically, "set_parameters_atomically", request).result.successful
    assert_same_contacts(send(node, 3), frame(2), frame(3), scene(2e-3))
    for name, value, reason in (
        ("pair_separation", ["cloth:net:0.1"], "'0.002' contradicts pair_separation: 'cloth:net:0.1'; leave one out"),
        ("pairs.between.separation", -1.0, "range"),
        ("pairs.between.separation", "wide", "expected float"),
        ("pairs.between.accuracy", "fast", "pairs.between.accuracy: read-only while the node is configured"),
        ("pairs.between.meshes", ["cloth"], "pairs.between.meshes: read-only while the node is configured"),
        ("pairs.new.separation", 1e-3, "start it with pairs.new.meshes, or name both meshes in pair_separation"),
        ("pairs.new.meshes", ["cloth", "net"], "pairs.new.meshes: the node has no pair of this name"),
        ("pairs.between.acuracy", "fast", "pairs.between.acuracy: no parameter of a pair of meshes; there are"),
        (
            "mesh.nte.frame",
            "hand",
            "mesh.nte.frame: the node has no such parameter; docs/parameters.md lists all; did you mean mesh.net.fr",
        ),
    ):
        rejected = set_parameter(node, name, value)
        assert not rejected.successful and reason in rejected.reason, rejected.reason
    assert_same_contacts(send(node, 4), frame(3), frame(4), scene(2e-3))
    assert node.stop() == 0
    done = hpccd("replay", path)
    assert done.returncode == 0 and "VERIFIED: 4 results are equal" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize(
    "pairs, text",
    [
        ({"a": {"meshes": ["cloth", "wall"]}}, "pairs.a.meshes: ['cloth', 'wall'] must be two names out of cloth, net"),
        ({"a": {"meshes": ["cloth", "net"], "acuracy": "fast"}}, "pairs.a.acuracy: no parameter of a pair of meshes"),
        ({"a": {"meshes": ["cloth", "net"], "separation": "wide"}}, "pairs.a.separation: "),
        ({"a": {"meshes": ["cloth", "net"], "separation": 0.2}}, "contradicts pair_separation: 'net:cloth:0.1'"),
    ],
)
def test_a_start_that_cannot_be(start_node, pairs, text):
    given = {"meshes": list(MESHES), "pairs": pairs, "pair_separation": ["net:cloth:0.1"]}
    node = start_node(given, wait=False)
    assert node.process.wait(timeout=60) == 2
    assert text in node.output(), node.output()
