# SPDX-License-Identifier: Apache-2.0
"""The action ~/detect over DDS: the service's responses, feedback, cancelling, and what other clients may do to it."""

import resource
import signal
import time
from pathlib import Path

import pytest
from action_msgs.msg import GoalInfo, GoalStatus
from action_msgs.srv import CancelGoal
from detect_requests import BAD, BAD_IDS, LARGE, request
from goals import ABORTED, CANCELED, SUCCEEDED, Goals
from hpccd.action import Detect as DetectAction
from hpccd.srv import Detect
from lifecycle_msgs.msg import Transition
from long_step import MESHES, long_request, step_needs_more_than
from node_calls import call, change_state
from node_process import MODULE, PATIENCE, Peer

from hpccd_core.options import OUTPUTS
from hpccd_ros import client

ROOT = Path(__file__).resolve().parents[2]
ONE_AT_A_TIME = {"meshes": ["cloth"], "detect_jobs": 1, "threads": 1}


def endless():
    """Under way until it is ended."""
    return long_request((*MESHES, "c", "d"))


def fields_of(definition, place):
    """Fields and constants in a part of a definition, in the order in which they are written."""
    part = definition.read_text().split("\n---\n")[place]
    return [line for line in part.splitlines() if line and not line.startswith("#")]


def test_the_action_asks_and_responses_what_the_service_does():
    for part in (0, 1):
        assert fields_of(ROOT / "action/Detect.action", part) == fields_of(ROOT / "srv/Detect.srv", part)


def service_status(node, **expected):
    wanted = {name: str(value) for name, value in expected.items()}

    def matches():
        return wanted.items() <= node.peer.statuses["service"][2].items()

    node.wait_until(matches, f"service status with {wanted}")


def of_service(node, asked):
    future = node.peer.client().call_async(asked)
    node.wait_until(future.done, "response of the service")
    return future.result()


def assert_equal(result, response):
    """Bit for bit: repr writes floats in full, and NaN as itself."""
    for name in Detect.Response.get_fields_and_field_types():
        assert repr(getattr(result, name)) == repr(getattr(response, name)), name


def snapshot(query, **fields):
    asked = request(names=("left", "right"), query=query, **fields)
    asked.start = []
    return asked


@pytest.fixture
def node(start_node):
    return start_node({"meshes": ["cloth"], "detect_jobs": 2, "outputs": list(OUTPUTS)})


@pytest.mark.parametrize(
    "asked",
    [
        request(),
        request(names=("left", "right"), accuracy="balanced", report="first"),
        request(names=("left", "right"), minimum_separation=[0.01]),
        request(query="collision_free_step"),
        snapshot("proximity", distance=[0.01]),
        snapshot("intersections"),
        snapshot("distances"),
    ],
    ids="contacts first separation step proximity intersections distances".split(),
)
def test_the_result_is_the_response_of_the_service(node, asked):
    response = of_service(node, asked)
    assert response.success, response.message
    status, result = Goals(node).send(asked).ended()
    assert status == SUCCEEDED
    assert_equal(result, response)


def test_feedback_tells_stage_place_and_time(start_node):
    node = start_node({**ONE_AT_A_TIME, "detect_time_limit": 500.0})
    goals = Goals(node)
    running, *queued = goals.send_all([endless() for _ in range(3)])
    node.wait_until(lambda: running.stages.count("detecting") >= 3, "feedback of the goal that is computed")
    node.wait_until(lambda: all(len(goal.feedback) >= 3 for goal in queued), "feedback of those that wait")
    order = [stage for k, stage in enumerate(running.stages) if stage not in running.stages[:k]]
    known = ["waiting", "reading", "building", "detecting"]
    assert order == [stage for stage in known if stage in order], "each stage once, in its order"
    seconds = [feedback.seconds for feedback in running.feedback]
    assert seconds == sorted(seconds) and 0 <= seconds[0] < seconds[-1]
    assert {feedback.time_limit for feedback in running.feedback} == {500.0}
    assert {feedback.ahead for feedback in running.feedback} == {0}
    for place, goal in enumerate(queued):
        assert set(goal.stages) == {"waiting"} and goal.feedback[-1].ahead == place
    running.cancel()
    node.wait_until(lambda: queued[0].stages[-1] == "detecting", "the turn of the second goal")
    node.wait_until(lambda: queued[1].feedback[-1].ahead == 0, "the third is next")
    for goal in queued:
        goal.cancel()
        assert goal.ended()[0] == CANCELED


def assert_canceled(goal):
    status, result = goal.ended()
    assert status == CANCELED
    assert (result.success, result.message) == (False, "canceled: as the client asked")
    assert result.contacts.total == 0 and result.collision_free_step != result.collision_free_step


def cpu_of_ended_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def cpu_seconds(process):
    ticks = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(ticks[11]) + int(ticks[12])) / 100.0


def test_cancelling_ends_the_computation(start_node):
    """In the core: its only place is free for the next goal, long before the step could be done."""
    node = start_node({**ONE_AT_A_TIME, "detect_waiting": 0, "detect_time_limit": 500.0})
    goals = Goals(node)
    before = cpu_seconds(node.process)
    goal = goals.send(long_request())
    node.wait_until(lambda: "detecting" in goal.stages, "the goal under way")
    assert goal.cancel() == 1
    assert_canceled(goal)
    service_status(node, open=0, canceled=1, succeeded=0)
    used = cpu_seconds(node.process) - before
    assert step_needs_more_than(used), f"{used:.1f} s of a core were used: it was not ended"
    assert goal.cancel() == 0, "ended goals cannot be canceled"
    status, result = goals.send(request()).ended()
    assert status == SUCCEEDED and result.success


def test_cancelling_a_goal_that_waits(start_node):
    node = start_node({**ONE_AT_A_TIME, "detect_waiting": 2, "detect_time_limit": 500.0})
    goals = Goals(node)
    running, waiting, last = goals.send_all([endless(), endless(), request()])
    node.wait_until(lambda: "detecting" in running.stages, "the first goal under way")
    assert waiting.cancel() == 1
    assert_canceled(waiting)
    service_status(node, open=2, canceled=1)
    assert "detecting" not in waiting.stages and not running.reply.done()
    running.cancel()
    assert_canceled(running)
    assert last.ended()[0] == SUCCEEDED


@pytest.mark.parametrize("bad, text", BAD, ids=BAD_IDS)
def test_bad_goals_are_aborted_with_a_reason(node, bad, text):
    rejected, good = Goals(node).send_all([bad, request()])
    status, result = rejected.ended()
    assert status == ABORTED and not result.success and text in result.message, result.message
    assert len(result.contacts.toc) == 0 and len(result.message) < 1200
    assert good.ended()[0] == SUCCEEDED, "the node goes on"
    service_status(node, open=0, succeeded=1)


def test_late_goals_are_aborted(node):
    late, good = Goals(node).send_all([request(2, n=LARGE, time_limit=0.001), request()])
    status, result = late.ended()
    assert status == ABORTED and "time limit of 0.001 s" in result.message
    assert good.ended()[0] == SUCCEEDED
    service_status(node, open=0, timed_out=1)


def test_goals_and_requests_share_the_places(start_node):
    node = start_node({**ONE_AT_A_TIME, "detect_waiting": 1, "detect_time_limit": 500.0})
    goals = Goals(node)
    running, waiting = goals.send_all([endless(), request()])
    service_status(node, open=2)
    assert of_service(node, request()).message.startswith("busy: 2 requests")
    status, result = goals.send(request()).ended()
    assert status == ABORTED and result.message.startswith("busy: 2 requests")
    running.cancel()
    assert waiting.ended()[0] == SUCCEEDED
    service_status(node, open=0, busy=2, canceled=1, succeeded=1)


def test_every_goal_of_a_burst_ends(start_node):
    node = start_node({**ONE_AT_A_TIME, "detect_waiting": 2})
    # The client's own queues hold ten responses: it sends no more at once.
    ends = []
    for _ in range(6):
        ends += [goal.ended() for goal in Goals(node).send_all([request(n=3) for _ in range(10)])]
    good = sum(status == SUCCEEDED and result.success for status, result in ends)
    busy = sum(status == ABORTED and result.message.startswith("busy: 3 requests") for status, result in ends)
    assert good >= 18 and good + busy == 60
    service_status(node, open=0, succeeded=good, busy=busy)


def test_two_clients(node):
    """In nodes of their own: each has its results and its feedback, and cancels its own goals."""
    other = Peer(node.namespace)
    try:
        mine = Goals(node).send(endless())
        theirs = Goals(node, other).send(request(2))
        status, result = theirs.ended()
        assert status == SUCCEEDED
        assert_equal(result, of_service(node, request(2)))
        assert not mine.reply.done() and mine.cancel() == 1
        assert_canceled(mine)
        assert "detecting" in mine.stages and len(theirs.stages) < len(mine.stages)
    finally:
        other.close()


@pytest.mark.parametrize(
    "transitions",
    [
        (Transition.TRANSITION_DEACTIVATE,),
        (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP),
        (Transition.TRANSITION_ACTIVE_SHUTDOWN,),
    ],
    ids=["deactivate", "clean-up", "shutdown"],
)
def test_transitions_end_open_goals(start_node, transitions):
    """One that is computed, one that waits."""
    node = start_node({**ONE_AT_A_TIME, "detect_time_limit": 500.0})
    opened = Goals(node).send_all([endless() for _ in range(2)])
    service_status(node, open=2)
    assert all(change_state(node, transition) for transition in transitions)
    for goal in opened:
        status, result = goal.ended()
        assert status == ABORTED and result.message.startswith("stopped: "), result.message
    if Transition.TRANSITION_CLEANUP in transitions:
        assert change_state(node, Transition.TRANSITION_CONFIGURE)
    elif transitions == (Transition.TRANSITION_DEACTIVATE,):
        status, result = Goals(node).send(request()).ended()
        assert status == ABORTED and "the node is inactive; activate it first" in result.message
    if Transition.TRANSITION_DEACTIVATE in transitions:
        assert change_state(node, Transition.TRANSITION_ACTIVATE)
        assert Goals(node).send(request()).ended()[0] == SUCCEEDED
    assert node.stop() == 0 and "Traceback" not in node.output()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_signals_end_open_goals(start_node, number):
    parameters = {"meshes": list(MESHES), "threads": 1, "accuracy": "exact", "detect_time_limit": 500.0}
    node = start_node(parameters, program=MODULE)  # a child of this process: its time is counted
    goal = Goals(node).send(long_request())
    node.wait_until(lambda: "detecting" in goal.stages, "the goal under way")
    begun, before = cpu_seconds(node.process), cpu_of_ended_children()
    assert node.stop(number) == 0, node.output()
    used = cpu_of_ended_children() - before - begun
    assert "Traceback" not in node.output()
    deadline = time.monotonic() + PATIENCE
    while not goal.reply.done() and time.monotonic() < deadline:
        node.peer.executor.spin_once(timeout_sec=0.05)
    assert goal.reply.result().status == ABORTED
    assert goal.reply.result().result.message.startswith("stopped: "), "told before the node was gone"
    assert step_needs_more_than(used), f"it took {used:.1f} s of a core: it did not wait for the result"


def test_stray_requests_to_the_action(start_node):
    """Goals that nobody sent, one sent twice, and the wish to cancel whatever there is."""
    node = start_node({**ONE_AT_A_TIME, "detect_time_limit": 500.0})
    impl = DetectAction.Impl
    stranger = impl.GetResultService.Request()
    stranger.goal_id.uuid = list(range(16))
    assert call(node, impl.GetResultService, "detect/_action/get_result", stranger).status == GoalStatus.STATUS_UNKNOWN
    unknown = CancelGoal.Request(goal_info=GoalInfo(goal_id=stranger.goal_id))
    response = call(node, CancelGoal, "detect/_action/cancel_goal", unknown)
    assert (response.return_code, response.goals_canceling) == (CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID, [])
    sent = impl.SendGoalService.Request(goal=client.goal_from_request(endless()), goal_id=stranger.goal_id)
    accepted = [call(node, impl.SendGoalService, "detect/_action/send_goal", sent).accepted for _ in range(2)]
    assert accepted == [True, False]
    assert len(call(node, CancelGoal, "detect/_action/cancel_goal", CancelGoal.Request()).goals_canceling) == 1
    response = call(node, impl.GetResultService, "detect/_action/get_result", stranger)
    assert response.status == CANCELED and response.result.message.startswith("canceled")
    service_status(node, open=0, canceled=1)
    assert node.peer.statuses["errors"][2]["errors"] == "0"


def test_results_are_kept_for_a_while(start_node):
    """In the time of the system, though simulated time stands still."""
    node = start_node({**ONE_AT_A_TIME, "use_sim_time": True})
    goal = Goals(node).send(request())
    assert goal.ended()[0] == SUCCEEDED
    asked = DetectAction.Impl.GetResultService.Request(goal_id=goal.handle.goal_id)

    def again():
        return call(node, DetectAction.Impl.GetResultService, "detect/_action/get_result", asked)

    assert_equal(again().result, goal.ended()[1])
    node.wait_until(lambda: again().status == GoalStatus.STATUS_UNKNOWN, "the end of the result")
