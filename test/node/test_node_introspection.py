# SPDX-License-Identifier: Apache-2.0
"""Parameter service_introspection: what ~/detect publishes of its requests and responses."""

import numpy as np
from hpccd.srv import Detect
from node_calls import set_parameter
from service_msgs.msg import ServiceEventInfo

from hpccd_ros import client

EVENTS = "hpccd/detect/_service_event"
TRIANGLE = client.topology_message(np.array([[0, 1, 2]]), n_vertices=3)
START = np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1]])
GROUND = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])


def ask(node, service):
    request = Detect.Request(
        mesh_names=["hand", "table"],
        topologies=[TRIANGLE, TRIANGLE],
        start=[client.vertices_message(x, stamp_ns=0) for x in (START, GROUND)],
        end=[client.vertices_message(x, stamp_ns=1) for x in (START - [0, 0, 2], GROUND)],
    )
    future = service.call_async(request)
    node.wait_until(future.done, "response")
    assert future.result().success, future.result().message
    return future.result()


def test_events_of_the_service(start_node):
    node = start_node({"meshes": ["cloth"], "service_introspection": "metadata"})
    heard = []
    peer = node.peer.node
    peer.create_subscription(Detect.Event, EVENTS, heard.append, 10)
    node.wait_until(lambda: peer.count_publishers(EVENTS), "publisher of events")
    service = node.peer.client()
    ask(node, service)
    node.wait_until(lambda: len(heard) >= 2, "both events")
    got, sent = heard
    assert [event.info.event_type for event in heard] == [
        ServiceEventInfo.REQUEST_RECEIVED,
        ServiceEventInfo.RESPONSE_SENT,
    ]
    assert got.info.sequence_number == sent.info.sequence_number
    assert np.array_equal(got.info.client_gid, sent.info.client_gid)
    assert len(got.request) == len(sent.response) == 0, "no contents"
    assert set_parameter(node, "service_introspection", "contents").successful
    response = ask(node, service)
    node.wait_until(lambda: len(heard) >= 4, "two more events")
    asked, answered = heard[2].request[0], heard[3].response[0]
    assert list(asked.mesh_names) == ["hand", "table"] and len(asked.end) == 2
    assert answered.contacts == response.contacts and answered.contacts.total > 0
    rejected = set_parameter(node, "service_introspection", "some")
    assert not rejected.successful and "'some' is not valid; use one of off, metadata, contents" in rejected.reason
    assert set_parameter(node, "service_introspection", "off").successful
    ask(node, service)
    assert set_parameter(node, "service_introspection", "metadata").successful
    ask(node, service)
    node.wait_until(lambda: len(heard) >= 6, "the last two events")
    assert [event.info.sequence_number for event in heard] == [1, 1, 2, 2, 4, 4]
    assert node.stop() == 0


def test_nothing_is_published_by_default(start_node):
    node = start_node({"meshes": ["cloth"]})
    ask(node, node.peer.client())
    assert node.peer.node.count_publishers(EVENTS) == 0
