# SPDX-License-Identifier: Apache-2.0
"""Requests as goals of the action, and the numbers in their results."""

import numpy as np
import pytest
from hpccd.action import Detect as DetectAction
from hpccd.srv import Detect

from hpccd_ros import client

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def test_a_goal_has_all_that_the_request_has():
    request = client.collision_free_step_request(
        {"a": TRIANGLE},
        {"a": TRIANGLE + 1},
        topologies={"a": client.topology_message([[0, 1, 2]], 3)},
        accuracy="exact",
        minimum_separation=0.5,
        features="vertex_face",
        time_limit=7.0,
    )
    goal = client.goal_from_request(request)
    names = request.get_fields_and_field_types()
    assert goal.get_fields_and_field_types() == names
    for name in names:
        assert getattr(goal, name) == getattr(request, name), name


@pytest.mark.parametrize("other", [None, Detect.Response(), DetectAction.Goal()], ids=["None", "response", "goal"])
def test_only_requests_become_goals(other):
    with pytest.raises(TypeError, match=r"request: expected hpccd\.srv\.Detect\.Request, got "):
        client.goal_from_request(other)


def test_the_step_in_a_result():
    assert client.collision_free_step_from_response(DetectAction.Result(success=True, collision_free_step=0.25)) == 0.25
    aborted = DetectAction.Result(success=False, message="busy: try again later", collision_free_step=1.0)
    with pytest.raises(RuntimeError, match="the node computed nothing: busy"):
        client.collision_free_step_from_response(aborted)
