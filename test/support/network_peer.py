# SPDX-License-Identifier: Apache-2.0
"""A simulator in another network namespace: publishes a mesh until a result arrives.

`python network_peer.py NAMESPACE SECONDS`; prints JSON: {"response": {"start", "step", "hash", "total"} or null,
"listeners"}; start, step: numbers of the two frames.
"""

import json
import sys
import time

import rclpy
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import environment, fields, mesh_messages, qos

N = 16


def main(namespace: str, seconds: float) -> None:
    environment.prepare()
    rclpy.init()
    node = rclpy.create_node("simulation", namespace=namespace)
    topology = node.create_publisher(MeshTopology, "meshes/cloth/topology", qos.TOPOLOGY)
    vertices = node.create_publisher(MeshVertices, "meshes/cloth/vertices", qos.vertices("reliable", 10))
    responses: list[ContactArray] = []
    node.create_subscription(ContactArray, "contacts", responses.append, qos.CONTACTS)
    topology.publish(mesh_messages.topology_message(sheet_faces(N), N * N))
    deadline, step, listeners = time.monotonic() + seconds, 0, 0
    while not responses and time.monotonic() < deadline:
        vertices.publish(mesh_messages.vertices_message(sheet_positions(N, step), step + 1, step=step))
        listeners = max(listeners, vertices.get_subscription_count())
        step += 1
        rclpy.spin_once(node, timeout_sec=0.1)
    response = {key: getattr(responses[0], key) for key in ("step", "hash", "total")} if responses else None
    if response:
        response["start"] = fields.stamp_to_ns(responses[0].start) - 1
    print(json.dumps({"response": response, "listeners": listeners}), flush=True)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
