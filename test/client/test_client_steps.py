# SPDX-License-Identifier: Apache-2.0
"""The request that asks how far a motion may go, and its response: what is rejected before it is sent or used."""

import math

import numpy as np
import pytest
from hpccd.srv import Detect

from hpccd_ros import client

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
START = {"a": TRIANGLE, "b": (TRIANGLE + [0, 0, 1]).astype(np.float32)}
END = {"b": START["b"], "a": TRIANGLE + [0, 0, 2]}
TOPOLOGIES = {name: client.topology_message([[0, 1, 2]], 3, version=k) for k, name in enumerate("ab", start=4)}


def test_what_is_asked():
    request = client.collision_free_step_request(
        START, END, topologies=TOPOLOGIES, accuracy="conservative", minimum_separation=0.5, time_limit=2
    )
    assert (request.query, request.report, list(request.distance)) == ("collision_free_step", "", [])
    assert (request.accuracy, list(request.minimum_separation), request.time_limit) == ("conservative", [0.5], 2.0)
    assert request.mesh_names == ["a", "b"] and request.topologies == [TOPOLOGIES["a"], TOPOLOGIES["b"]]
    for positions, messages in ((START, request.start), (END, request.end)):
        for name, version, message in zip("ab", (4, 5), messages, strict=True):
            back = client.vertices_from_message(message)
            assert back.dtype == positions[name].dtype and np.array_equal(back, positions[name])
            assert message.topology_version == version


def test_what_the_node_knows_is_left_out():
    request = client.collision_free_step_request(START, END, topology_versions={"b": 7})
    assert (request.topologies, list(request.minimum_separation), request.accuracy) == ([], [], "")
    assert request.time_limit == 0.0 and [message.topology_version for message in request.end] == [0, 7]
    assert list(client.collision_free_step_request(START, END, minimum_separation=0.0).minimum_separation) == [0.0]


@pytest.mark.parametrize(
    "arguments, error, text",
    [
        (dict(start={}), ValueError, "start: no meshes"),
        (dict(end={"a": TRIANGLE}), ValueError, "end: of meshes a, start is of a, b; give the same ones"),
        (dict(end={}), ValueError, "end: of meshes none, start is of a, b"),
        (dict(start={"a": TRIANGLE, "b": [[0.0]]}), TypeError, r"start\['b'\]: vertices: expected an array"),
        (dict(end={"a": TRIANGLE * math.nan, "b": TRIANGLE}), ValueError, r"end\['a'\]: vertices: vertex 0 is"),
        (dict(topologies={"a": TOPOLOGIES["a"]}), ValueError, "topologies: of meshes a, start is of a, b"),
        (dict(topologies=TOPOLOGIES, topology_versions={"a": 1}), ValueError, "topology_versions: the topologies have"),
        (dict(topology_versions={"c": 1}), ValueError, "topology_versions: start has no mesh c"),
        (dict(topology_versions={"a": -1}), ValueError, r"start\['a'\]: topology_version: must lie in"),
        (dict(accuracy="sloppy"), ValueError, "accuracy: 'sloppy' is not known; use one of fast"),
        (dict(minimum_separation=-0.5), ValueError, "minimum_separation: "),
        (dict(minimum_separation="1"), TypeError, "minimum_separation: expected a number, got str"),
        (dict(time_limit=math.inf), ValueError, "time_limit: "),
        (dict(time_limit=-1.0), ValueError, "time_limit: "),
    ],
)
def test_what_is_rejected_before_it_is_sent(arguments, error, text):
    with pytest.raises(error, match=text):
        client.collision_free_step_request(**{"start": START, "end": END, **arguments})


@pytest.mark.parametrize("step", [0.0, 0.25, 1.0])
def test_the_step_in_a_response(step):
    assert client.collision_free_step_from_response(Detect.Response(success=True, collision_free_step=step)) == step


@pytest.mark.parametrize("step", [0.0, 1.0, math.nan])
def test_no_step_where_the_node_computed_none(step):
    rejected = Detect.Response(success=False, message="busy: try again later", collision_free_step=step)
    with pytest.raises(RuntimeError, match="the node computed nothing: busy: try again later"):
        client.collision_free_step_from_response(rejected)


@pytest.mark.parametrize("step", [math.nan, -0.1, 1.1, math.inf])
def test_no_step_where_something_else_was_asked_for(step):
    with pytest.raises(ValueError, match="it is the result of query collision_free_step only"):
        client.collision_free_step_from_response(Detect.Response(success=True, collision_free_step=step))
