# SPDX-License-Identifier: Apache-2.0
import numpy as np
import rclpy
from hpccd.srv import Detect

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("asking")
service = node.create_client(Detect, "hpccd/detect")
assert service.wait_for_service(10.0)
triangle = client.topology_message(np.array([[0, 1, 2]]), n_vertices=3)
hand = np.array([[0, 0, 0.2], [1, 0, 1], [0, 1, 1]])
table = np.array([[-5.0, -5, 0], [5, -5, 0], [0, 5, 0]])
request = Detect.Request(
    mesh_names=["hand", "table"],
    topologies=[triangle, triangle],
    end=[client.vertices_message(x, stamp_ns=0) for x in (hand, table)],
    query="proximity",
    distance=[0.3],
)
future = service.call_async(request)
rclpy.spin_until_future_complete(node, future)
response = future.result()
print(response.success, response.message)
near = client.contacts_from_message(response.contacts)
print(near.distance, near.features_a, near.features_b)  # vertex 0 of the hand, face 0 of the table
