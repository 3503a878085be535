# SPDX-License-Identifier: Apache-2.0
"""~/detect: two snapshots in, contacts out, for several clients at once."""

import gc
import os
import time
from types import SimpleNamespace

import numpy as np
import pytest
import rclpy
from detect_requests import BAD, BAD_IDS, FACES, LARGE, N, request
from hpccd.srv import Detect
from lifecycle_msgs.msg import Transition
from long_step import long_request
from node_calls import change_state
from node_process import PATIENCE, assert_same_contacts
from rclpy.executors import SingleThreadedExecutor
from waving_sheet import scene_of, sheet_positions

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.middleware import fields
from hpccd_ros.middleware.executors import Errors
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.detect_jobs import DetectJobs
from hpccd_ros.node.detect_request import NodeScene
from hpccd_ros.node.detect_service import DetectService


def ask(node, *requests):
    """Responses to requests that are all under way at the same time, each from a client of its own."""
    clients = [node.peer.client() for _ in requests]
    return gather(node, [client.call_async(r) for client, r in zip(clients, requests, strict=True)])


def gather(node, futures):
    node.wait_until(lambda: all(f.done() for f in futures), f"{len(futures)} responses")
    return [f.result() for f in futures]


def service_counts(node, **expected):
    """Wait until the status `service` holds these values; all of them."""
    wanted = {key: str(value) for key, value in expected.items()}

    def matches():
        values = node.peer.statuses["service"][2]
        return values if wanted.items() <= values.items() else None

    return node.wait_until(matches, f"service status with {wanted}")


@pytest.fixture
def node(start_node):
    return start_node({"meshes": ["cloth"], "detect_jobs": 2, "detect_waiting": 8})


def test_without_any_stream(node):
    (response,) = ask(node, request(dtype=np.float64))
    assert response.success and response.message.endswith("contacts"), response.message
    start, end = (sheet_positions(N, k, dtype=np.float64) for k in (0, 1))
    assert assert_same_contacts(response.contacts, start, end, scene_of(cloth=FACES)) > 100
    header = response.contacts.header
    assert (header.frame_id, fields.stamp_to_ns(header.stamp), response.contacts.step) == ("lab", 1, 1)
    assert fields.stamp_to_ns(response.contacts.start) == 0


def test_meshes_that_the_node_does_not_have(node):
    (response,) = ask(node, request(names=("left", "right")))
    assert response.success, response.message
    frames = [np.concatenate([sheet_positions(N, k), sheet_positions(N, k + 2, offset=0.003)]) for k in (0, 1)]
    assert assert_same_contacts(response.contacts, *frames, scene_of(left=FACES, right=FACES)) > 100
    assert list(response.contacts.mesh_names) == ["left", "right"]


def test_topology_versions_are_those_of_the_request(node):
    given = request(names=("left", "right"))
    for i, version in enumerate((7, 2**32 - 1)):
        given.topologies[i].version = given.start[i].topology_version = given.end[i].topology_version = version
    (response,) = ask(node, given)
    assert list(response.contacts.topology_versions) == [7, 2**32 - 1]


def test_topology_of_the_stream_is_used(node):
    (response,) = ask(node, request(topologies=False))
    assert not response.success and "no topology yet" in response.message
    node.peer.topology("cloth", FACES, N * N)
    (response,) = ask(node, request(topologies=False))
    if not response.success:  # the topology came after the request
        node.wait_until(lambda: ask(node, request(topologies=False))[0].success, "topology")
        (response,) = ask(node, request(topologies=False))
    assert_same_contacts(response.contacts, sheet_positions(N, 0), sheet_positions(N, 1), scene_of(cloth=FACES))


def test_several_clients_at_once(node):
    responses = ask(node, *(request(step) for step in range(6)))
    for step, response in enumerate(responses):
        assert response.success, response.message
        frames = sheet_positions(N, step), sheet_positions(N, step + 1)
        assert_same_contacts(response.contacts, *frames, scene_of(cloth=FACES))
    node.wait_until(lambda: node.peer.statuses["service"][2]["succeeded"] == "6", "count of responses")


def test_options_of_the_request(node):
    (response,) = ask(node, request(accuracy="balanced", report="first"))
    frames = sheet_positions(N, 0), sheet_positions(N, 1)
    assert_same_contacts(response.contacts, *frames, scene_of(cloth=FACES), report="first")


@pytest.mark.parametrize("bad, text", BAD, ids=BAD_IDS)
def test_bad_requests_are_rejected_with_a_reason(node, bad, text):
    rejected, good = ask(node, bad, request())
    assert not rejected.success and text in rejected.message, rejected.message
    assert len(rejected.contacts.toc) == 0 and len(rejected.message) < 1200
    assert good.success, "the node goes on"
    service_counts(node, succeeded=1, rejected=1, failed=0)


def test_busy_node_rejects_at_once(start_node):
    node = start_node({"meshes": ["cloth"], "detect_jobs": 1, "detect_waiting": 0})
    responses = ask(node, *(request(2, n=LARGE) for _ in range(4)))
    messages = [a.message for a in responses]
    assert sum(a.success for a in responses) >= 1, messages
    assert sum(m.startswith("busy: 1 requests") for m in messages) >= 1, messages
    assert all(a.success or a.message.startswith("busy") for a in responses)
    (later,) = ask(node, request())
    assert later.success, "a place is free again"


def counts_of(node):
    values = node.peer.statuses["service"][2]
    return values["open"], values["timed_out"]


def test_time_limit(node):
    late, good = ask(node, request(2, n=LARGE, time_limit=0.001), request())
    assert not late.success and "time limit of 0.001 s" in late.message
    assert good.success
    node.wait_until(lambda: counts_of(node) == ("0", "1"), "end of the late computation, counted")


@pytest.mark.parametrize("limit", [1e10, 1e300, 1e-300], ids=str)
def test_time_limit_of_any_size(node, limit):
    (extreme,) = ask(node, request(time_limit=limit))
    assert extreme.success or f"time limit of {limit:g} s" in extreme.message, extreme.message
    (good,) = ask(node, request())
    assert good.success, "the node goes on"


@pytest.mark.parametrize("many", [60, 300])
def test_every_request_of_a_burst_gets_a_response(start_node, many):
    """However many come at once: those that find no place are told so, and counted."""
    node = start_node({"meshes": ["cloth"], "detect_jobs": 1, "detect_waiting": 2})
    client = node.peer.client(depth=many)
    small = request(n=3)
    responses = gather(node, [client.call_async(small) for _ in range(many)])
    good = sum(response.success for response in responses)
    busy = sum(response.message.startswith("busy: 3 requests") for response in responses)
    assert good >= 3 and good + busy == many
    service_counts(node, open=0, succeeded=good, busy=busy)


@pytest.mark.parametrize(
    "transitions",
    [
        (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP),
        (Transition.TRANSITION_ACTIVE_SHUTDOWN,),
    ],
    ids=["clean-up", "shutdown"],
)
def test_open_requests_get_a_response_before_the_service_ends(start_node, transitions):
    """One that is computed, one that waits for its turn."""
    node = start_node({"meshes": ["cloth"], "detect_jobs": 1, "threads": 1})
    long = long_request(("a", "b", "c"))  # still open when a busy machine has told of it
    replies = [node.peer.client().call_async(long) for _ in range(2)]
    service_counts(node, open=2)
    assert all(change_state(node, transition) for transition in transitions)
    for response in gather(node, replies):
        assert not response.success and response.message.startswith("stopped: "), response.message
    if Transition.TRANSITION_CLEANUP in transitions:
        assert change_state(node, Transition.TRANSITION_CONFIGURE)
        assert change_state(node, Transition.TRANSITION_ACTIVATE)
        (response,) = ask(node, request())
        assert response.success, response.message
    assert node.stop() == 0 and "Traceback" not in node.output()


def test_stream_goes_on_while_requests_are_computed(node):
    node.peer.topology("cloth", FACES, N * N)
    clients = [node.peer.client() for _ in range(2)]
    futures = [client.call_async(request(2, n=LARGE)) for client in clients]
    under_way = []
    for k in range(5):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        node.contacts(k)
        under_way.append(k > 0 and not all(f.done() for f in futures))
    assert any(under_way), "the steps of the stream waited for the requests"
    node.wait_until(lambda: all(f.done() for f in futures), "responses")
    assert all(f.result().success for f in futures)
    for k, message in enumerate(node.contacts(4), start=1):
        assert_same_contacts(message, sheet_positions(N, k - 1), sheet_positions(N, k), scene_of(cloth=FACES))


def test_outputs_of_the_node_are_sent(start_node):
    node = start_node({"meshes": ["cloth"], "outputs": ["points"], "max_contacts": 50})
    (response,) = ask(node, request())
    full = hc.Detector(scene_of(cloth=FACES)).detect(sheet_positions(N, 0), sheet_positions(N, 1))
    assert response.contacts.truncated and response.contacts.total == len(full)
    assert len(response.contacts.points) == 150 and len(response.contacts.normals) == 0


@pytest.fixture
def service():
    """The service alone, in this process, and a function that asks it."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("service", namespace=f"/kept{os.getpid()}", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    settings = {
        "detect_jobs": 1,
        "detect_waiting": 1,
        "detect_time_limit": PATIENCE,
        "max_meshes": 4,
        "max_vertices": 1000,
        "max_faces": 1000,
        "max_edges": 1000,
        "max_contacts": 0,
        "service_introspection": "off",
    }
    errors = node.errors = Errors(lambda text: None)
    configuration = SimpleNamespace(settings=settings, options=Options())
    jobs = DetectJobs(node, configuration, lambda: NodeScene(SceneBuilder(()), {}), Accounts(print))
    service = DetectService(node, jobs, settings)
    client = node.create_client(Detect, "service/detect")
    assert client.wait_for_service(PATIENCE)

    def ask_once(what):
        response = client.call_async(what)
        deadline = time.monotonic() + PATIENCE
        # Not spin_until_future_complete, which leaves a task of its own for each turn.
        while not response.done() and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.1)
        return response.result()

    yield ask_once
    assert errors.count == 0, errors.last
    jobs.close()
    service.close()
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_nothing_is_kept_of_a_request(service):
    def objects_after(requests):
        for _ in range(requests):
            assert service(request()).success
        gc.collect()
        return len(gc.get_objects())

    few, many = objects_after(20), objects_after(60)
    assert many - few < 30, f"{many - few} objects are left of 60 requests"
