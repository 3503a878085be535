# SPDX-License-Identifier: Apache-2.0
"""A mesh publisher for tests that kill it: the hand high above the table, a frame every 50 ms. Argument: namespace."""

import itertools
import sys
import time

import rclpy
from hand_and_table import FACES, MESHES, TABLE, hand
from hpccd.msg import MeshTopology, MeshVertices

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("source", namespace=sys.argv[1])
topologies = [node.create_publisher(MeshTopology, client.topology_topic(name), client.TOPOLOGY_QOS) for name in MESHES]
vertices = [node.create_publisher(MeshVertices, client.vertices_topic(name), client.VERTICES_QOS) for name in MESHES]
for publisher in topologies:
    publisher.publish(client.topology_message(FACES, 3))
for _ in itertools.count():
    now = time.time_ns()
    for publisher, positions in zip(vertices, (hand(2.0), TABLE), strict=True):
        publisher.publish(client.vertices_message(positions, stamp_ns=now))
    time.sleep(0.05)
