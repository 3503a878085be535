# SPDX-License-Identifier: Apache-2.0
import numpy as np
import rclpy
from hpccd.action import Detect
from rclpy.action import ActionClient

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("patient")
action = ActionClient(node, Detect, "hpccd/detect")
assert action.wait_for_server(10.0)


def done(future):
    rclpy.spin_until_future_complete(node, future)
    return future.result()


def on_feedback(message):
    now = message.feedback
    print(f"{now.stage}, {now.ahead} ahead, {now.seconds:.1f} of {now.time_limit:g} s")


triangle = client.topology_message(np.array([[0, 1, 2]]), n_vertices=3)
hand = np.array([[0, 0, 1.0], [1, 0, 1], [0, 1, 1]])
table = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])
goal = Detect.Goal(mesh_names=["hand", "table"], topologies=[triangle, triangle], time_limit=600.0)
goal.start = [client.vertices_message(x, stamp_ns=0) for x in (hand, table)]
goal.end = [client.vertices_message(x, stamp_ns=1) for x in (hand - [0, 0, 2], table)]
handle = done(action.send_goal_async(goal, feedback_callback=on_feedback))
ended = done(handle.get_result_async())  # to cancel instead: done(handle.cancel_goal_async())
print(ended.result.success, ended.result.message)
