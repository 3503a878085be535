# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import rclpy
from geometry_msgs.msg import Point
from visualization_msgs.msg import Marker

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("drawing")
publisher = node.create_publisher(Marker, client.marker_topic("cloth"), client.VERTICES_QOS)
while not publisher.get_subscription_count():
    time.sleep(0.05)
corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)  # two triangles
marker = Marker(type=Marker.TRIANGLE_LIST)
marker.header.frame_id = "world"
marker.scale.x = marker.scale.y = marker.scale.z = 1.0
for step in range(100):
    corners[4, :2] = 1 - 0.01 * step  # this corner of the second triangle crosses the shared edge
    marker.points = [Point(x=x, y=y, z=z) for x, y, z in corners.tolist()]
    marker.header.stamp = node.get_clock().now().to_msg()
    publisher.publish(marker)
    time.sleep(0.05)
topology, vertices = client.mesh_from_marker(marker)
print(topology.n_vertices, topology.faces.tolist())
