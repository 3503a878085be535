# SPDX-License-Identifier: Apache-2.0
import numpy as np
import rclpy
from hpccd.srv import Detect

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("solver")
service = node.create_client(Detect, "hpccd/detect")
assert service.wait_for_service(10.0)
triangle = client.topology_message(np.array([[0, 1, 2]]), n_vertices=3)
table = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])


def free_step(start, end):
    """The collision-free part of the motion from start to end, 0 .. 1."""
    positions = [{"hand": hand, "table": table} for hand in (start, end)]
    request = client.collision_free_step_request(*positions, topologies={"hand": triangle, "table": triangle})
    future = service.call_async(request)
    rclpy.spin_until_future_complete(node, future)
    return client.collision_free_step_from_response(future.result())


def energy(hand):
    """Energy of springs that pull each corner to a height of -0.5, below the table."""
    return ((hand[:, 2] + 0.5) ** 2).sum()


hand = np.array([[0, 0, 0.2], [1, 0, 0.5], [0, 1, 0.5]])
direction = np.array([0, 0, -0.8])
step = 0.9 * free_step(hand, hand + direction)  # stop before the contact
while energy(hand + step * direction) > energy(hand):  # a shorter step is collision-free too
    step /= 2
print(f"{step:.6f}")
