# SPDX-License-Identifier: Apache-2.0
"""`stop` is false only when its promise allows it, in random sequences of events that are compared with a model."""

import os

import numpy as np
import pytest
import rclpy
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from stop_world import PARAMETERS, World

from hpccd_ros.middleware import environment
from hpccd_ros.node.configuration import Configuration

EVENTS_OF_A_WORLD = 60


@pytest.fixture(params=["exact", "nearest"])
def configured(request):
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    given = PARAMETERS | {"stamp_match": request.param}
    overrides = [Parameter(name, value=value) for name, value in given.items()]
    node = rclpy.create_node(
        "stop_model", namespace=f"/model{os.getpid()}", parameter_overrides=overrides, start_parameter_services=False
    )
    yield node, Configuration(node)
    node.destroy_node()
    rclpy.try_shutdown()


def walk(configured, worlds, seed=0):
    """Counts of looks at which stop was false, at which it might have been, and at which the listener read false."""
    false = allowed = read = 0
    for number in range(worlds):
        world = World(*configured, np.random.default_rng([seed, number]))
        events = []
        try:
            for _ in range(EVENTS_OF_A_WORLD):
                events.append(world.step())
        except AssertionError as error:
            raise AssertionError(f"world {number}: {error}; after {', '.join(events[-8:])}") from error
        finally:
            world.close()
        false, allowed, read = false + world.false, allowed + world.allowed, read + world.read
    print(f"{worlds * EVENTS_OF_A_WORLD} events: false {false} times, allowed {allowed} times, read {read} times")
    return false, allowed, read


def test_never_wrongly_false(configured):
    false, allowed, read = walk(configured, worlds=5)
    assert false >= allowed / 3 and min(allowed, read) > 50


@pytest.mark.long
@pytest.mark.parametrize("seed", range(1, 7))
def test_never_wrongly_false_in_ten_thousand_events(configured, seed):
    """Ten thousand in all. Each test has a time limit, and beside the busy processes of other tests a world is slow."""
    false, allowed, read = walk(configured, worlds=14, seed=seed)
    assert false >= allowed / 3 and min(allowed, read) > 150
