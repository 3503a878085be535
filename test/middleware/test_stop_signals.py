# SPDX-License-Identifier: Apache-2.0
"""The main loop of the node: it ends when told, and holds nothing of the turns it has made."""

import gc
import signal
import sys
import threading
import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future

from hpccd_ros.middleware import environment, stop_signals


@pytest.fixture
def executor():
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = SingleThreadedExecutor(context=context)
    yield executor
    executor.shutdown()
    rclpy.shutdown(context=context)


def test_turns_leave_nothing_behind(executor):
    stop, turns, blocks = Future(), 0, []

    def turn():
        nonlocal turns
        turns += 1
        if turns in (1000, 3000):
            gc.collect()
            blocks.append(sys.getallocatedblocks())
        if turns < 3000:
            executor.create_task(turn)
        else:
            stop.set_result(None)

    executor.create_task(turn)
    stop_signals.spin(executor, stop)
    assert turns == 3000
    assert blocks[1] - blocks[0] < 1000, "spin_until_future_complete leaves at least two for each of the 2000 turns"


def test_a_signal_within_a_block_is_answered_behind_it():
    done = []
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt):
        with stop_signals.later():
            signal.raise_signal(signal.SIGTERM)
            done.append("the rest of the block")
        done.append("what is behind it")
    assert done == ["the rest of the block"] and signal.getsignal(signal.SIGTERM) is before


def test_another_thread_ends_an_idle_loop(executor):
    stop = Future()
    timer = threading.Timer(0.2, lambda: stop.set_result(None))
    timer.start()
    stop_signals.spin(executor, stop)
    assert stop.done()


def test_the_loop_ends_after_the_thread_that_ended_it_has_left_the_executor(executor):
    stop, left = Future(), []
    create_task = executor.create_task

    def slow(task):
        create_task(task)
        time.sleep(0.2)
        left.append(True)

    executor.create_task(threading.Thread(target=stop.set_result, args=(None,)).start)
    executor.create_task = slow
    stop_signals.spin(executor, stop)
    assert left


def test_a_loop_that_was_ended_before_returns_at_once(executor):
    stop = Future()
    stop.set_result(None)
    stop_signals.spin(executor, stop)


def test_signals_within_a_block_are_collected_and_then_as_before():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    with pytest.raises(RuntimeError, match="of the block"):
        with stop_signals.collected() as came:
            assert not came
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)
            raise RuntimeError("of the block")
    assert came == [signal.SIGTERM, signal.SIGINT]
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == before
