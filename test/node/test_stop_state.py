# SPDX-License-Identifier: Apache-2.0
"""What is known of the steps, and how old it is, to a stop that is true or not. No ROS."""

import threading
import time

import pytest

from hpccd_ros.node.stop_state import IN_TIME, Cause, StopState

LONG = 1000.0


@pytest.fixture
def state():
    made = StopState(0.25, LONG)
    made.begin()
    return made


def clear(state, **changes):
    state.answered(**{"near": False, "distance": 0.25, "received": time.monotonic(), **changes})


def cause(state):
    why = state.why()
    return None if why is None else why.cause


def test_false_only_after_an_answer(state):
    assert cause(state) is Cause.UNANSWERED
    clear(state)
    assert cause(state) is None
    clear(state, near=True)
    assert cause(state) is Cause.NEAR
    clear(state)
    state.first()
    assert cause(state) is Cause.UNANSWERED


def test_an_answer_from_before_what_was_refused_or_failed_does_not_count(state):
    for tell, expected in ((state.refused, Cause.REFUSED), (state.failed, Cause.FAILED)):
        before = time.monotonic()
        tell("why")
        clear(state, received=before)
        assert cause(state) is expected
        clear(state)
        assert cause(state) is None


def test_an_answer_for_a_smaller_distance_does_not_count(state):
    clear(state)
    state.changed(0.5)
    clear(state)
    assert cause(state) is Cause.UNANSWERED
    clear(state, distance=0.5)
    assert cause(state) is None
    state.changed(0.1)
    assert cause(state) is None


def test_nothing_counts_while_inactive():
    state = StopState(0.25, LONG)
    clear(state)
    state.refused("why")
    assert cause(state) is Cause.INACTIVE
    state.begin()
    clear(state)
    state.end()
    clear(state)
    assert cause(state) is Cause.INACTIVE


def test_an_answer_holds_for_the_time_out_from_the_arrival_of_its_frame_on():
    state = StopState(0.25, 10.0, busy=lambda: True)
    state.begin()
    clear(state, received=time.monotonic() - 9.0)
    assert cause(state) is None
    clear(state, received=time.monotonic() - 10.0)
    why = state.why()
    assert why.cause is Cause.SILENT and "a later one is worked on" in why.text


def test_each_rise_is_said_however_short(state):
    later = time.monotonic() + LONG
    assert state.next(0.0).cause is Cause.UNANSWERED
    clear(state)
    assert state.next(later) is None
    clear(state, near=True)
    clear(state)
    assert state.next(later).cause is Cause.NEAR
    assert state.next(later) is None
    assert state.rises == {Cause.UNANSWERED: 1, Cause.NEAR: 1}


def test_it_wakes_by_itself_when_the_time_is_over():
    state = StopState(0.25, 0.3)
    state.begin()
    received = time.monotonic()
    clear(state, received=received)
    assert state.next(0.0) is None
    assert state.next(received + LONG).cause is Cause.SILENT
    assert time.monotonic() >= received + 0.3 * IN_TIME
    began = time.monotonic()
    assert state.next(began + 0.1).cause is Cause.SILENT and time.monotonic() >= began + 0.1, "a repetition"


def test_no_other_clock_is_looked_at(state, monkeypatch):
    """Whatever the system's time is."""

    def never(*_):
        raise AssertionError("system time")

    for name in ("time", "time_ns", "perf_counter"):
        monkeypatch.setattr(time, name, never)
    clear(state)
    assert cause(state) is None and state.next(0.0) is None
    state.refused("why")
    assert state.next(0.0).cause is Cause.REFUSED


def test_who_waits_is_woken_and_the_last_word_is_a_reason(state):
    said = []
    clear(state)
    state.next(0.0)
    state.next(0.0)
    waiting = threading.Thread(target=lambda: said.append(state.next(time.monotonic() + LONG)))
    waiting.start()
    state.close()
    waiting.join(60)
    assert said[0].cause is Cause.INACTIVE and "ended" in said[0].text and state.closed
    state.begin()
    clear(state)
    assert state.closed
