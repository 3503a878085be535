# SPDX-License-Identifier: Apache-2.0
"""Query collision_free_step of ~/detect: the core's number bit for bit, for whichever scene, start and options."""

import math

import numpy as np
import pytest
from hpccd.srv import Detect
from node_calls import set_parameter
from node_process import NodeProcess
from rclpy.serialization import deserialize_message, serialize_message
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros import client

N = 12
FACES = sheet_faces(N)
TOPOLOGY = client.topology_message(FACES, N * N, version=3)
ACCURACIES = ("fast", "balanced", "conservative", "exact")


def towards(gap, reach, dtype=np.float64):
    """Two wavy grids, the upper one `gap` above the lower, which comes down by `reach`: (start, end) by mesh."""
    x, y = np.meshgrid(np.linspace(0, 1, N), np.linspace(0, 1, N), indexing="ij")
    lower, upper = 0.03 * np.sin(7 * x + 3 * y), 0.02 * np.cos(5 * x - 4 * y)
    ends = []
    for height in (gap, gap - reach):
        grids = {"lower": (x, y, lower), "upper": (x + 0.01, y + 0.02, upper + height)}
        ends.append({name: np.stack(grid, -1).reshape(-1, 3).astype(dtype) for name, grid in grids.items()})
    return ends


def core_step(start, end, *, faces=FACES, separations=(), **options):
    scene = hc.Scene()
    for mesh in start:
        scene.add_mesh(mesh, faces, n_vertices=N * N)
    for separation in separations:
        scene.set_separation(*separation)
    whole = [np.concatenate(list(positions.values())) for positions in (start, end)]
    return hc.Detector(scene, **options).collision_free_step(*whole)


def request(start, end, **options):
    return client.collision_free_step_request(start, end, topologies=dict.fromkeys(start, TOPOLOGY), **options)


@pytest.fixture(scope="module")
def node(tmp_path_factory):
    node = NodeProcess(tmp_path_factory.mktemp("steps"), {"meshes": ["lower", "upper"], "detect_jobs": 2})
    yield node
    node.close()


def ask(node, asked):
    service = node.peer.client()
    future = service.call_async(asked)
    node.wait_until(future.done, "response")
    node.peer.node.destroy_client(service)
    return future.result()


def step_of(node, asked):
    response = ask(node, asked)
    step = client.collision_free_step_from_response(response)
    assert response.message == f"{step!r} of the motion is free of contacts"
    assert len(response.contacts.kind) == response.contacts.total == len(response.distances.distance) == 0
    return step


@pytest.mark.parametrize("accuracy", ["", *ACCURACIES])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_step_of_two_meshes_is_that_of_the_core(node, dtype, accuracy):
    motion = towards(0.3, 0.7, dtype)
    expected = core_step(*motion, accuracy=accuracy or "exact")
    assert 0.1 < expected < 0.9
    assert step_of(node, request(*motion, accuracy=accuracy)) == expected


def test_one_mesh_in_single_and_one_in_double_precision(node):
    single, double = towards(0.3, 0.7, np.float32), towards(0.3, 0.7)
    motion = [{"lower": a["lower"], "upper": b["upper"]} for a, b in zip(single, double, strict=True)]
    assert step_of(node, request(*motion)) == core_step(*motion) != core_step(*double)


def test_a_mesh_with_itself(node):
    motion = [{"cloth": sheet_positions(N, step)} for step in (0, 1)]
    expected = core_step(*motion)
    assert step_of(node, request(*motion)) == expected < 1.0


def test_nothing_touches_and_something_does_at_once(node):
    assert step_of(node, request(*towards(0.3, 0.0))) == 1.0
    start, end = towards(0.3, 0.7)
    start["upper"] = start["lower"]
    assert step_of(node, request(start, end)) == core_step(start, end) == 0.0


@pytest.mark.parametrize("distance", [0.0, 0.01, 0.5])
def test_separation_of_the_request(node, distance):
    motion = towards(0.3, 0.7)
    given = step_of(node, request(*motion, minimum_separation=distance))
    assert given == core_step(*motion, minimum_separation=distance)
    plain = core_step(*motion)
    assert given == plain if distance == 0 else given < plain


def test_separation_of_the_node(start_node):
    """Also as it changes: what the node keeps of an earlier request must not stand in for it."""
    node = start_node({"meshes": ["lower", "upper"], "pair_separation": ["lower:upper:0.1"]})
    motion = towards(0.3, 0.7)
    pairs = [("lower", "upper", 0.1)]
    assert step_of(node, request(*motion)) == core_step(*motion, separations=pairs) < core_step(*motion)
    assert set_parameter(node, "pair_separation", ["lower:upper:0.2"]).successful
    pairs = [("lower", "upper", 0.2)]
    assert step_of(node, request(*motion)) == core_step(*motion, separations=pairs)
    assert step_of(node, request(*motion, minimum_separation=0.0)) == core_step(*motion)


def test_a_line_search_over_scenes_and_starts(node):
    """One start with many ends, then another start, another topology of the same meshes, and the first again."""
    turned = np.ascontiguousarray(FACES[:, [0, 2, 1]])
    for faces in (FACES, turned, FACES[: len(FACES) // 2], FACES):
        topology = client.topology_message(faces, N * N)
        for gap in (0.3, 0.4, 0.3):
            for reach in (0.7, 0.35, 0.175, 0.7):
                motion = towards(gap, reach)
                asked = client.collision_free_step_request(*motion, topologies=dict.fromkeys(motion[0], topology))
                assert step_of(node, asked) == core_step(*motion, faces=faces), (len(faces), gap, reach)


def test_topologies_of_the_node(start_node):
    node = start_node({"meshes": ["lower", "upper"]})
    motion, versions = towards(0.3, 0.7), {"lower": 2, "upper": 5}
    asked = client.collision_free_step_request(*motion, topology_versions=versions)
    with pytest.raises(RuntimeError, match="the node computed nothing: mesh lower: the node has no topology yet"):
        client.collision_free_step_from_response(ask(node, asked))
    for name, version in versions.items():
        node.peer.topology(name, FACES, N * N, version=version)
    node.wait_until(lambda: ask(node, asked).success, "topologies")
    assert step_of(node, asked) == core_step(*motion)
    response = ask(node, client.collision_free_step_request(*motion))
    assert not response.success and "topology_version 0, the topology has version 2" in response.message


def changed(**fields):
    out = request(*towards(0.3, 0.7))
    for name, value in fields.items():
        setattr(out, name, value)
    return out


NAN_VERTEX = changed()
NAN_VERTEX.start[1].vertices_f64[4] = math.nan


@pytest.mark.parametrize(
    "asked, text",
    [
        (changed(report="first"), "report: only query contacts has one, leave it empty for collision_free_step"),
        (changed(report="any"), "report: only query contacts has one, leave it empty for collision_free_step"),
        (changed(distance=[0.1]), "distance: only query proximity has one, leave it empty for collision_free_step"),
        (changed(minimum_separation=[math.nan]), "minimum_separation: nan must be finite and not negative"),
        (changed(minimum_separation=[-1.0]), "minimum_separation: -1.0 must be finite and not negative"),
        (
            changed(query="collision_free_steps"),
            "query: 'collision_free_steps' is not valid; use one of contacts, collision_free",
        ),
        (changed(accuracy="sloppy"), "accuracy"),
        (changed(time_limit=math.inf), "time_limit: inf must be positive and finite"),
        (changed(start=[]), "start: 0 entries for 2 meshes (lower, upper)"),
        (changed(end=[]), "end: 0 entries for 2 meshes (lower, upper)"),
        (changed(mesh_names=["lower"]), "topologies: 2 entries for 1 mesh"),
        (NAN_VERTEX, "start[1] (upper): vertex 1 is"),
    ],
    ids="report any distance nan-separation separation query accuracy limit start end names nan".split(),
)
def test_wrong_requests_are_rejected_and_the_node_goes_on(node, asked, text):
    response = ask(node, asked)
    assert not response.success and text in response.message, response.message
    assert math.isnan(response.collision_free_step), "no number that a step could be taken by"
    motion = towards(0.3, 0.7)
    assert step_of(node, request(*motion)) == core_step(*motion)


@pytest.mark.parametrize("query", ["contacts", "", "proximity", "intersections", "distances"])
def test_other_queries_response_no_step(node, query):
    asked = changed(query=query, distance=[0.1] if query == "proximity" else [])
    response = ask(node, asked)
    assert response.success and math.isnan(response.collision_free_step), response.message
    with pytest.raises(ValueError, match="collision_free_step is nan; it is the result of query collision_free_step"):
        client.collision_free_step_from_response(response)


def test_time_limit(node):
    large = 150
    topology = client.topology_message(sheet_faces(large), large**2)
    motion = [{"cloth": sheet_positions(large, step)} for step in (0, 1)]
    late = client.collision_free_step_request(*motion, topologies={"cloth": topology}, time_limit=1e-4)
    response = ask(node, late)
    assert not response.success and math.isnan(response.collision_free_step)
    assert response.message == "time limit of 0.0001 s passed before the result was ready; set a longer time_limit"
    for _ in range(2):  # what was given up is not used again
        late.time_limit = 0.0
        assert ask(node, late).success


def test_requests_at_the_same_time(start_node):
    """More than the node keeps detectors for, of several scenes: each has its own response."""
    node = start_node({"meshes": ["lower", "upper"], "detect_jobs": 3, "detect_waiting": 40})
    motions = [towards(0.3 + 0.01 * k, 0.7 + 0.02 * k) for k in range(5)]
    separations = (0.0, 0.01, 0.02, 0.05)
    wanted = [(motion, separation) for _ in range(2) for motion in motions for separation in separations]
    service = node.peer.client(depth=len(wanted))
    futures = [service.call_async(request(*motion, minimum_separation=d)) for motion, d in wanted]
    node.wait_until(lambda: all(future.done() for future in futures), "all responses")
    for (motion, separation), future in zip(wanted, futures, strict=True):
        step = client.collision_free_step_from_response(future.result())
        assert step == core_step(*motion, minimum_separation=separation)
    node.wait_until(lambda: node.peer.statuses["service"][2]["succeeded"] == str(len(wanted)), "count of responses")


def test_who_knows_an_older_definition_reads_all_the_rest():
    """It is the last field, and what comes behind the fields that a reader knows is passed over."""
    assert list(Detect.Response.get_fields_and_field_types())[-1] == "collision_free_step"
    response = Detect.Response(message="text", collision_free_step=0.25)
    assert deserialize_message(serialize_message(response) + b"\1" * 8, Detect.Response) == response
