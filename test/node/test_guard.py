# SPDX-License-Identifier: Apache-2.0
"""No callback that raises ends the node: it goes on and reports it."""

import time

import pytest
import rclpy
from lifecycle_msgs.msg import Transition
from node_calls import call, change_state, set_parameter, state, stream
from node_process import PATIENCE
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.parameter import Parameter
from sources import SUPPORT
from std_msgs.msg import UInt32
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import environment
from hpccd_ros.middleware.executors import MOST_IN_A_ROW, Errors, GuardedExecutor

N = 8


@pytest.fixture
def place():
    """A node and its guarded executor, in a context of their own; .log holds what was logged."""
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)

    class Place:
        log: list[str] = []
        errors = Errors(log.append)
        node = Node("guarded", context=context)
        executor = GuardedExecutor(errors, context=context)

        def until(self, condition):
            deadline = time.monotonic() + PATIENCE
            while not condition():
                assert time.monotonic() < deadline, self.log
                self.executor.spin_once(timeout_sec=0.05)

    place = Place()
    place.executor.add_node(place.node)
    yield place
    place.executor.shutdown()
    place.node.destroy_node()
    rclpy.try_shutdown(context=context)


def fail(*_):
    raise LookupError("on purpose")


async def fail_later(*_):
    fail()


def test_each_kind_of_callback(place):
    """Subscription, its events, timer, guard condition, task: each raises, again and again, and the others go on."""
    node, heard = place.node, []
    events = SubscriptionEventCallbacks(matched=fail)
    node.create_subscription(UInt32, "bad", fail, 10, event_callbacks=events)
    node.create_subscription(UInt32, "bad_later", fail_later, 10)
    node.create_subscription(UInt32, "good", heard.append, 10)
    publishers = [node.create_publisher(UInt32, topic, 10) for topic in ("bad", "bad_later", "good")]
    place.until(lambda: place.errors.count == 1)  # matched
    for k in range(5):
        for publisher in publishers:
            publisher.publish(UInt32(data=k))
        place.until(lambda k=k: len(heard) == k + 1 and place.errors.count == 1 + 2 * (k + 1))
    guard = node.create_guard_condition(fail)
    guard.trigger()
    place.until(lambda: place.errors.count == 12)
    node.destroy_guard_condition(guard)
    place.executor.create_task(fail)
    place.until(lambda: place.errors.count == 13)
    timer = node.create_timer(0.001, fail)
    place.until(lambda: place.errors.count >= 23)
    node.destroy_timer(timer)
    (text,) = place.log
    assert "fail: LookupError: on purpose" in text and "Traceback" in text and "in fail" in text, "once, with its place"
    assert place.errors.last.endswith("LookupError: on purpose")


def test_a_message_that_cannot_be_taken(place):
    """A failure before the callback begins holds up neither its subscription nor others."""
    node, heard = place.node, []
    subscription = node.create_subscription(UInt32, "number", heard.append, 10)
    publisher = node.create_publisher(UInt32, "number", 10)
    kind, subscription.msg_type = subscription.msg_type, None  # what it is to be made into does not exist
    publisher.publish(UInt32(data=1))
    place.until(lambda: place.errors.count == 1)
    subscription.msg_type = kind
    publisher.publish(UInt32(data=2))
    place.until(lambda: any(message.data == 2 for message in heard))


@pytest.mark.parametrize("callback", [fail, fail_later])
@pytest.mark.parametrize("kind", [SetParameters, SetParametersAtomically, GetParameters])
def test_callers_of_a_service_get_a_response(place, kind, callback):
    place.node.create_service(kind, "bad", callback)
    client = place.node.create_client(kind, "bad")
    place.until(client.service_is_ready)
    request = kind.Request()
    if hasattr(request, "parameters"):
        request.parameters = [Parameter("a", value=1).to_parameter_msg()] * 2
    for _ in range(2):
        future = client.call_async(request)
        place.until(future.done)
        response = future.result()
        if kind is SetParameters:
            results = [(result.successful, result.reason) for result in response.results]
            assert results == [(False, "bad: LookupError: on purpose")] * 2
        if kind is SetParametersAtomically:
            assert not response.result.successful and "on purpose" in response.result.reason
    assert place.errors.count == 2 and len(place.log) == 1


def test_what_is_to_end_the_node_ends_it(place):
    def interrupt():
        raise KeyboardInterrupt

    place.executor.create_task(interrupt)
    with pytest.raises(KeyboardInterrupt):
        place.until(lambda: False)
    place.node.context.shutdown()
    with pytest.raises(ExternalShutdownException):
        for _ in range(3):
            place.executor.spin_once(timeout_sec=0.05)
    assert place.errors.count == 0


def test_an_executor_that_can_do_nothing_any_more_ends(place):
    place.executor._sigint_gc = None
    with pytest.raises(AttributeError):
        for _ in range(MOST_IN_A_ROW + 1):
            place.executor.spin_once(timeout_sec=0.05)
    assert place.errors.count == MOST_IN_A_ROW and len(place.log) == 1


def test_a_node_with_faults_goes_on(start_node):
    """In every thread, and in a transition, which leads to the state that ROS 2 says it does."""
    node = start_node({"meshes": ["cloth"]}, program=[str(SUPPORT / "failing_node.py")])

    def told(text):
        def matches():
            level, message, values = node.peer.statuses.get("errors", (b"", "", {}))
            return level == b"\2" and text in message and int(values["errors"])

        return node.wait_until(matches, f"error {text!r} on /diagnostics")

    first = told("LookupError: timer")
    node.wait_until(lambda: told("LookupError: timer") > first + 10, "more of them")
    assert node.output().count("Traceback") == 1, "the same error is logged once"

    response = call(node, SetParametersAtomically, "fail", SetParametersAtomically.Request()).result
    assert not response.successful and "LookupError: request" in response.reason
    rejected = set_parameter(node, "markers_max", 7)
    assert not rejected.successful and "LookupError: parameter" in rejected.reason

    node.peer.topology("cloth", sheet_faces(N), N * N)
    stream(node, range(2))
    node.peer.vertices("cloth", sheet_positions(N, 2), 2)
    node.frames_status(dropped__detection_failed=1, processed=2, waiting=0)
    node.wait_until(lambda: "LookupError: detection thread" in node.output(), "error of the detection thread")
    node.peer.vertices("cloth", sheet_positions(N, 3), 3)
    node.frames_status(received=4, processed=3, waiting=0)

    assert change_state(node, Transition.TRANSITION_DEACTIVATE)
    assert not change_state(node, Transition.TRANSITION_ACTIVATE)
    assert state(node) == "unconfigured" and "on_activate: LookupError: transition" in node.output()
    assert change_state(node, Transition.TRANSITION_CONFIGURE) and change_state(node, Transition.TRANSITION_ACTIVATE)
    publisher = node.peer.node.get_publishers_info_by_topic(f"{node.namespace}/contacts")
    assert len(publisher) == 1, "nothing is left of what the failed transition had made"
    assert state(node) == "active"
    assert node.stop() == 0
