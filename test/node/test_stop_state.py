# SPDX-License-Identifier: Apache-2.0
"""From the known steps and their age to the value of stop. No ROS."""

import threading
import time

import pytest

from hpccd_ros.base.clocks import Clocks
from hpccd_ros.detect.approach import Slowdown
from hpccd_ros.frames.drops import Aspect, Input, Reason, Rejection
from hpccd_ros.frames.types import ALWAYS, OUTDATED, UNKNOWN_TIME, Origin
from hpccd_ros.node.stop_doubts import WatchedScene
from hpccd_ros.node.stop_state import IN_TIME, Cause, StopState

TIMEOUT = 10.0
SECOND = 10**9
PAIR = ("hand", "table")
SCENE = WatchedScene(
    ("hand", "table", "arm/tip"), (True, False, True), {"joint_states": ("arm/tip",)}, by_transforms=("hand",)
)


class Times:
    """Clocks that the test moves on. ``now``: system time, ns."""

    def __init__(self):
        self.steady, self.now = 100.0, 10**18
        self.clocks = Clocks(lambda: self.steady, lambda: self.now)

    def pass_by(self, seconds):
        self.steady += seconds
        self.now += round(seconds * SECOND)


@pytest.fixture
def times():
    return Times()


@pytest.fixture
def state(times):
    made = StopState(0.25, TIMEOUT, clock_error=0.02, clocks=times.clocks)
    made.begin(SCENE)
    made.next(0.0)
    made.times = times
    return made


def clear(state, near=None, distance=0.25, hand=None, table=1, tip=None, scaled=(), **origin):
    """A step whose last messages were sent at these times; None: now. scaled: arguments of StopState.answered."""
    now = state.times.now
    places = (now if hand is None else hand, table, now if tip is None else tip)
    state.answered(near, distance, [Origin(place, **origin) for place in places], *scaled)


def cause(state):
    """As the thread that publishes sees it."""
    why = state.next(0.0)
    assert (why is None) == (state.why() is None)
    return None if why is None else why.cause


def test_false_only_after_an_answer(state):
    assert cause(state) is Cause.UNANSWERED
    clear(state)
    assert cause(state) is None
    clear(state, near=PAIR)
    assert cause(state) is Cause.NEAR
    clear(state)
    assert cause(state) is None
    state.first()
    assert cause(state) is Cause.UNANSWERED


@pytest.mark.parametrize("found", [{"near": PAIR}, {"inside": PAIR}], ids=["near", "inside"])
def test_the_cause_is_silence_once_the_last_result_is_old(state, found):
    known = next(iter(found))
    now = [Origin(state.times.now)] * 3
    state.answered(found.get("near"), 0.25, now, inside=found.get("inside"))
    assert cause(state) == known
    state.times.pass_by(TIMEOUT - 1)
    assert cause(state) == known
    state.times.pass_by(2)
    assert cause(state) == "silent"
    text = state.why().text
    assert "11 s ago" in text and "the last result: hand" in text and "table" in text
    state.answered(found.get("near"), 0.25, [Origin(state.times.now)] * 3, inside=found.get("inside"))
    assert cause(state) == known


def test_an_answer_for_a_smaller_distance_does_not_count(state):
    clear(state)
    state.changed(0.5)
    clear(state)
    assert cause(state) is Cause.UNANSWERED
    clear(state, distance=0.5)
    assert cause(state) is None
    state.changed(0.1)
    assert cause(state) is None


def scale(state):
    """As the thread that publishes sees it."""
    state.next(0.0)
    return state.slowdown().scale


def test_the_scale_of_the_last_step_counts_while_stop_is_false(state):
    """0 before the first result, and whatever makes stop true."""
    assert scale(state) == 0
    clear(state, scaled=(Slowdown(0.5, PAIR), 1.0))
    assert scale(state) == 0.5 and state.slowdown().pair == PAIR
    clear(state, near=PAIR, scaled=(Slowdown(0.5), 1.0))
    assert scale(state) == 0
    clear(state, scaled=(Slowdown(0.75), 1.0))
    assert scale(state) == 0.75
    state.rejected(Rejection("hand", Reason.NOT_FINITE))
    assert scale(state) == 0
    state.times.pass_by(1.0)
    clear(state, scaled=(Slowdown(0.75), 1.0))
    assert scale(state) == 0.75
    state.times.pass_by(IN_TIME * TIMEOUT)
    assert scale(state) == 0, "silence"
    clear(state, scaled=(Slowdown(), 1.0))
    assert scale(state) == 1
    for failing in (state.first, lambda: state.failed("of memory"), state.end):
        failing()
        assert scale(state) == 0


def test_a_scale_for_a_shorter_time_does_not_count(state):
    state.changed(0.25, 1.0)
    clear(state, scaled=(Slowdown(0.5), 1.0))
    state.changed(0.25, 2.0)
    assert (cause(state), scale(state)) == (None, 0)
    clear(state, scaled=(Slowdown(0.5), 1.0))
    assert (cause(state), scale(state)) == (None, 0)
    clear(state, scaled=(Slowdown(0.25), 2.0))
    assert scale(state) == 0.25
    state.changed(0.25, 1.0)
    assert scale(state) == 0.25
    state.changed(0.5, 1.0)
    assert (cause(state), scale(state)) == (Cause.UNANSWERED, 0)


def test_a_changed_scale_is_published_at_once(state):
    clear(state, scaled=(Slowdown(0.5), 1.0))
    state.next(0.0)
    clear(state, scaled=(Slowdown(0.25), 1.0))
    until = state.times.steady + 3600.0
    assert state.next(until) is None and state.slowdown().scale == 0.25


def test_nothing_counts_while_inactive(times):
    state = StopState(0.25, TIMEOUT, clocks=times.clocks)
    state.times = times
    state.rejected(Rejection("hand", Reason.NOT_FINITE))
    assert cause(state) is Cause.INACTIVE
    state.begin(SCENE)
    clear(state)
    assert cause(state) is None
    state.end()
    clear(state)
    assert cause(state) is Cause.INACTIVE


@pytest.mark.parametrize("old", ["hand", "tip"])
def test_the_oldest_message_of_a_step_tells_its_age(state, old):
    """Whichever message was received last, and whenever it was taken."""
    clear(state, **{old: state.times.now - 9 * SECOND})
    assert cause(state) is None
    state.times.pass_by(0.6)
    assert cause(state) is Cause.SILENT
    assert (
        f"mesh {'arm/tip' if old == 'tip' else 'hand'}: the last result is based on a message sent 9.6 s ago"
        in state.why().text
    )


def test_what_has_no_age_and_what_tells_none(state):
    clear(state, hand=ALWAYS, tip=ALWAYS)
    state.times.pass_by(0.9 * TIMEOUT)
    state.next(0.0)
    state.times.pass_by(0.9 * TIMEOUT)
    assert cause(state) is None, "placed by static transforms alone"
    clear(state, hand=UNKNOWN_TIME)
    assert cause(state) is Cause.SILENT and "does not provide source timestamps" in state.why().text
    clear(state, table=UNKNOWN_TIME)
    assert cause(state) is None, "a file: static meshes have no age"
    clear(state, table=OUTDATED)
    assert cause(state) is Cause.REJECTED and "newer message about the position of mesh table" in state.why().text


@pytest.mark.parametrize(
    "rejection, settled_by",
    [
        (Rejection("hand", Reason.NOT_FINITE), dict(hand=1)),
        (Rejection("table", Reason.NOT_FINITE), dict(table=1)),
        (Rejection("hand", Reason.OUT_OF_RANGE, aspect=Aspect.SHAPE), dict(shape=1)),
        (Rejection("table", Reason.TOPOLOGY_CONFLICT, what=Input.TOPOLOGY, aspect=Aspect.TOPOLOGY), dict(topology=1)),
        (Rejection("joint_states", Reason.MALFORMED, what=Input.JOINT_STATE), dict(tip=1)),
        (Rejection("joint_states", Reason.CONTRADICTED, what=Input.JOINT_STATE), dict(tip=1)),
        (Rejection("tf", Reason.MALFORMED, what=Input.TRANSFORM), dict(hand=1)),
        (Rejection("hand", Reason.RATE), dict(hand=1)),
    ],
)
def test_a_mesh_is_unknown_until_something_valid_of_it_comes(state, rejection, settled_by):
    """Frames of other meshes, and of other aspects of it, do not settle it."""
    before = state.times.now
    fixed = dict(hand=before, table=before, tip=before, shape=before, topology=before)
    clear(state, **fixed)
    assert cause(state) is None
    state.times.pass_by(1)
    state.rejected(rejection)
    state.times.pass_by(1)
    assert cause(state) is Cause.REJECTED
    (name,) = settled_by
    clear(state, **dict.fromkeys(fixed, state.times.now) | {name: before})
    assert cause(state) is Cause.REJECTED
    clear(state, **fixed | {name: state.times.now})
    assert cause(state) is None


def test_what_was_rejected_is_older_than_what_is_in_use(state):
    """If a queue is read late, a valid message that was sent after the rejected one settles the doubt."""
    clear(state)
    state.times.pass_by(1)
    sent = state.times.now
    state.times.pass_by(1)
    state.rejected(Rejection("hand", Reason.NOT_FINITE, sent=sent))
    clear(state, hand=sent)
    assert cause(state) is Cause.REJECTED
    clear(state, hand=sent + 1)
    assert cause(state) is None
    for given in (
        Rejection("hand", Reason.OVERLOAD),
        Rejection("hand", Reason.INCOMPLETE),
        Rejection("other", Reason.NOT_FINITE),
        Rejection("tf", Reason.MALFORMED, what=Input.TRANSFORM, aspect=Aspect.NOTHING),
        Rejection("other_states", Reason.MALFORMED, what=Input.JOINT_STATE),
    ):
        state.rejected(given)
        assert cause(state) is None, "it gave way, or concerns nothing in the scene"


def test_doubts_outlive_a_scene_that_is_made_anew(state):
    state.rejected(Rejection("table", Reason.NOT_FINITE))
    state.rejected(Rejection("arm/tip", Reason.OUT_OF_RANGE))
    state.end()
    state.begin(WatchedScene(("hand", "table"), (True, False)))
    now = state.times.now
    state.answered(None, 0.25, [Origin(now), Origin(1)])
    assert cause(state) is Cause.REJECTED and "table" in state.why().text
    state.answered(None, 0.25, [Origin(now), Origin(now + 1)])
    assert cause(state) is None, "the link is no more in the scene"


@pytest.mark.parametrize("links", [(), ("arm/tip",), ("arm/tip", "arm/more"), ("arm/other",)])
def test_doubts_of_what_moves_a_robot_outlive_other_links(state, links):
    """Whichever links a new description has, the positions of their joints are unknown."""
    robot = ("arm/base", "arm/tip")
    state.begin(WatchedScene(("hand", *robot), (True,) * 3, {"joint_states": robot}))
    sent = state.times.now
    state.rejected(Rejection("joint_states", Reason.NOT_FINITE, what=Input.JOINT_STATE, sent=sent))
    state.times.pass_by(1)
    for scene in ((), links):
        state.begin(WatchedScene(("hand", *scene), (True,) * (1 + len(scene)), {"joint_states": scene}))
        for _ in range(2):
            state.answered(None, 0.25, [Origin(state.times.now), *[Origin(sent)] * len(scene)])
            state.next(0.0)
        assert cause(state) is (Cause.REJECTED if scene else None)
    if links:
        state.answered(None, 0.25, [Origin(state.times.now)] * (1 + len(links)))
        assert cause(state) is None


def test_what_came_before_settles_nothing(state):
    """Neither a message without a known send time, nor one of a clock that is ahead and that is not in use yet."""
    before = state.times.now
    clear(state, table=before)
    assert cause(state) is None
    state.times.pass_by(1)
    for unknown in (None, UNKNOWN_TIME):
        state.rejected(Rejection("table", Reason.MALFORMED, sent=unknown))
        clear(state, table=before)
        assert cause(state) is Cause.REJECTED
        clear(state, table=state.times.now + 1)
        assert cause(state) is None
        state.times.pass_by(1)
    ahead = state.times.now + 5 * SECOND
    state.received("positions", "table", dict(source_timestamp=ahead, received_timestamp=0))
    state.rejected(Rejection("table", Reason.NOT_FINITE, sent=state.times.now))
    for _ in range(30):
        clear(state, table=ahead)
        assert cause(state) in (Cause.REJECTED, Cause.CLOCKS)
        state.times.pass_by(TIMEOUT / 10)
    clear(state, table=state.times.now)
    assert cause(state) is None


def test_a_failure_is_settled_by_later_messages(state):
    clear(state)
    state.times.pass_by(1)
    state.rejected(Rejection("hand", Reason.DETECTION_FAILED))
    clear(state, hand=state.times.now - 1)
    assert cause(state) is Cause.FAILED
    state.times.pass_by(1)
    clear(state)
    assert cause(state) is None


def test_robots_whose_description_is_not_in_use(state):
    clear(state)
    assert cause(state) is None
    state.robots({"arm": "its description was rejected: no root"})
    clear(state)
    assert cause(state) is Cause.REJECTED and "robot arm: its description was rejected" in state.why().text
    state.robots({})
    assert cause(state) is None


@pytest.mark.parametrize("jump", [0.03, -0.03, 3600.0, -3600.0])
def test_a_jump_of_the_system_clock(state, jump):
    """Unknown until both clocks have agreed for one time-out; messages sent before a clock was set back are not in the
    future forever."""
    clear(state)
    assert cause(state) is None
    state.times.now += round(jump * SECOND)
    clear(state)
    assert cause(state) is Cause.CLOCKS and "jumped by" in state.why().text
    for _ in range(21 if jump < -1 else 11):  # set back by far: longer by ten seconds
        assert cause(state) is Cause.CLOCKS
        state.times.pass_by(TIMEOUT / 10.4)
        clear(state)
    assert cause(state) is None


def test_a_message_before_two_jumps_never_seems_young(state):
    """It seems younger by both: found by the search of test_stop_in_every_order.py."""
    clear(state)
    assert cause(state) is None
    sent = state.times.now
    for _ in range(2):
        state.times.now -= 7 * SECOND
        assert cause(state) == "clocks"
    for _ in range(19):
        state.times.pass_by(TIMEOUT / 10)
        assert cause(state) == "clocks"
    clear(state, hand=sent, tip=sent)
    assert cause(state) == "clocks"


def test_what_was_sent_before_a_clock_was_set_back_never_seems_young(state):
    """Nothing is sent any more: messages in use seem younger than they are, by as much as the clock was set back."""
    for jump in (0.4, 5.0, 30.0):
        clear(state)
        while cause(state) is not None:
            state.times.pass_by(TIMEOUT / 10)
            clear(state)
        last = state.times.now
        state.times.now -= round(jump * SECOND)
        for step in range(50):
            if step == 3:
                clear(state, hand=last, tip=last)  # a step that was processed late
            assert cause(state) is not None
            state.times.pass_by(TIMEOUT / 10)


@pytest.mark.parametrize("jump", [5, 3600])
def test_doubts_and_a_clock_that_is_set_back(state, jump):
    """Inputs without an age are in doubt until sent again once the clock has caught up; frames settle theirs before."""
    clear(state, table=state.times.now)
    state.rejected(Rejection("table", Reason.NOT_FINITE))
    state.rejected(Rejection("hand", Reason.NOT_FINITE))
    placed = state.times.now
    state.times.now -= jump * SECOND
    for _ in range(21):
        clear(state, table=placed)
        assert state.next(0.0) is not None
        state.times.pass_by(TIMEOUT / 10)
    clear(state, table=placed)
    assert cause(state) is Cause.REJECTED and "table" in state.why().text, "and not the hand"
    while state.times.now <= placed:
        state.times.pass_by(TIMEOUT / 2)
        clear(state, table=placed)
        assert cause(state) is Cause.REJECTED
    clear(state, table=state.times.now)
    assert cause(state) is None
    state.rejected(Rejection("table", Reason.NOT_FINITE, sent=1))
    clear(state, table=state.times.now)
    state.next(0.0)
    assert cause(state) is Cause.REJECTED, "newer than what is in use, whatever its time"


def test_the_last_message_before_a_clock_was_set_back_grows_old(state):
    clear(state)
    state.times.now -= 3600 * SECOND
    for _ in range(30):
        assert cause(state) is Cause.CLOCKS
        state.times.pass_by(TIMEOUT / 5)


def test_a_clock_that_is_slewed_is_no_jump(state):
    for _ in range(1000):
        state.times.pass_by(1.0)
        state.times.now += 500_000  # 500 ppm
        clear(state)
        assert cause(state) is None


def test_a_message_from_the_future(state):
    for tell in (
        lambda ahead: state.received(
            "a pose", "hand", dict(source_timestamp=state.times.now + ahead, received_timestamp=0)
        ),
        # It waited until its time had come.
        lambda ahead: state.received(
            "a pose",
            "hand",
            dict(source_timestamp=state.times.now - SECOND, received_timestamp=state.times.now - SECOND - ahead),
        ),
        lambda ahead: clear(state, hand=state.times.now + ahead),
    ):
        clear(state)
        tell(19_000_000)
        assert cause(state) is None
        tell(21_000_000)
        assert cause(state) is Cause.CLOCKS and "in the future; synchronise the clocks" in state.why().text
        for _ in range(4):
            state.times.pass_by(0.3 * TIMEOUT)
            clear(state)
            state.next(0.0)
        assert cause(state) is None


def test_the_thread_that_publishes_was_held_up(state):
    """Earlier frames do not count, whatever their age."""
    clear(state)
    assert cause(state) is None
    state.times.pass_by(1.1 * TIMEOUT)
    before = state.times.now - 1
    assert cause(state) in (Cause.HELD_UP, Cause.SILENT)
    clear(state, hand=before, tip=before)
    assert cause(state) is Cause.HELD_UP
    state.times.pass_by(0.1)
    clear(state)
    assert cause(state) is None


def test_each_rise_is_said_however_short(state):
    later = state.times.steady + 1000
    clear(state)
    assert state.next(later) is None
    clear(state, near=PAIR)
    clear(state)
    assert state.next(later).cause is Cause.NEAR
    assert state.next(later) is None
    state.rejected(Rejection("hand", Reason.NOT_FINITE))
    state.times.pass_by(1)
    clear(state)
    assert state.next(later).cause is Cause.REJECTED
    assert state.next(later) is None
    assert state.rises == {Cause.UNANSWERED: 1, Cause.NEAR: 1, Cause.REJECTED: 1}


def test_it_wakes_by_itself_when_the_time_is_over():
    state = StopState(0.25, 0.3)
    state.begin(WatchedScene(("hand",), (True,)))
    sent, steady = time.time_ns(), time.monotonic()
    state.answered(None, 0.25, [Origin(sent)])
    assert state.next(0.0) is None
    assert state.next(steady + 1000).cause in (Cause.SILENT, Cause.HELD_UP)
    assert time.time_ns() >= sent + 0.3 * IN_TIME * SECOND
    began = time.monotonic()
    assert state.next(began + 0.1) is not None and time.monotonic() >= began + 0.1, "a repetition"


def test_who_waits_is_woken_and_the_last_word_is_a_reason(state):
    said = []
    clear(state)
    state.next(0.0)
    state.next(0.0)
    waiting = threading.Thread(target=lambda: said.append(state.next(state.times.steady + 1000)))
    waiting.start()
    state.close()
    waiting.join(60)
    assert said[0].cause is Cause.INACTIVE and "ended" in said[0].text and state.closed
    state.begin(SCENE)
    clear(state)
    assert state.closed
