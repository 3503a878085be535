# SPDX-License-Identifier: Apache-2.0
"""Parameter contacts_durability: who gets which results that were sent before it listened."""

import time

import pytest
from hpccd.msg import ContactArray
from lifecycle_msgs.msg import Transition
from node_calls import N, change_state, set_parameter, stream
from rclpy.qos import DurabilityPolicy
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros import client
from hpccd_ros.middleware import qos

LATCHED = {"contacts_durability": "transient_local"}


def with_results(node, results):
    node.peer.topology("cloth", sheet_faces(N), N * N)
    stream(node, range(results + 1))
    return node


def late(node, profile, wanted):
    """Latched messages for a late subscriber: waits for this number, and a moment for more."""
    heard = []
    subscription = node.peer.node.create_subscription(ContactArray, "contacts", heard.append, profile)
    node.wait_until(lambda: subscription.get_publisher_count(), "the publisher of contacts")
    node.wait_until(lambda: len(heard) >= wanted, f"{wanted} results")
    until = time.monotonic() + 0.5
    node.wait_until(lambda: time.monotonic() > until, "the moment to pass")
    node.peer.node.destroy_subscription(subscription)
    return [message.header.stamp.nanosec for message in heard]


def test_the_last_results_are_kept_for_those_who_ask(start_node):
    node = with_results(start_node({"meshes": ["cloth"], **LATCHED}), 12)
    assert late(node, client.LATCHED_CONTACTS_QOS, 10) == list(range(3, 13))
    assert late(node, qos.keep_last(100, latched=True), 10) == list(range(3, 13))
    assert late(node, client.CONTACTS_QOS, 0) == []


def test_volatile_is_the_default_and_a_clean_up_takes_what_is_set(start_node):
    node = with_results(start_node({"meshes": ["cloth"]}), 2)
    assert late(node, client.CONTACTS_QOS, 0) == []
    rejected = set_parameter(node, "contacts_durability", "transient_local")
    assert not rejected.successful and "read-only while the node is configured" in rejected.reason
    assert change_state(node, Transition.TRANSITION_DEACTIVATE) and change_state(node, Transition.TRANSITION_CLEANUP)
    rejected = set_parameter(node, "contacts_durability", "persistent")
    assert (
        not rejected.successful and "'persistent' is not valid; use one of volatile, transient_local" in rejected.reason
    )
    assert set_parameter(node, "contacts_durability", "transient_local").successful
    assert change_state(node, Transition.TRANSITION_CONFIGURE) and change_state(node, Transition.TRANSITION_ACTIVATE)
    name = f"{node.namespace}/contacts"

    def offered():
        infos = node.peer.node.get_publishers_info_by_topic(name)
        return [info.qos_profile.durability for info in infos] == [DurabilityPolicy.TRANSIENT_LOCAL]

    node.wait_until(offered, "latched contacts")


@pytest.mark.parametrize(
    "policy, profile, expected",
    [
        ({"depth": 1}, qos.keep_last(100, latched=True), [3]),
        ({"reliability": "best_effort"}, qos.keep_last(100, reliable=False, latched=True), []),
    ],
)
def test_beside_overrides(start_node, policy, profile, expected):
    given = {"meshes": ["cloth"], **LATCHED, "qos_overrides": {"NAMESPACE/contacts": {"publisher": policy}}}
    node = start_node(given)
    node.peer.topology("cloth", sheet_faces(N), N * N)
    for k in range(4):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        node.frames_status(processed=k + 1)
    assert late(node, profile, len(expected)) == expected
