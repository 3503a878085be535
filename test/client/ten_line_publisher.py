# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import rclpy
from hpccd.msg import MeshTopology, MeshVertices

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("simulation")
topology = node.create_publisher(MeshTopology, client.topology_topic("cloth"), client.TOPOLOGY_QOS)
vertices = node.create_publisher(MeshVertices, client.vertices_topic("cloth"), client.VERTICES_QOS)
topology.publish(client.topology_message(np.array([[0, 1, 2], [3, 4, 5]]), n_vertices=6))
x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0.5], [1.2, 0.2, 0.5], [0.2, 1.2, 0.5]], np.float32)
for step in range(100):
    x[3:, 2] = 0.5 * np.cos(0.3 * step)  # the second triangle goes up and down through the first
    vertices.publish(client.vertices_message(x, node.get_clock().now(), step=step))
    time.sleep(0.05)
