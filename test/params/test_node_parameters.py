# SPDX-License-Identifier: Apache-2.0
"""Parameters of another node over its services."""

import subprocess
import sys
import threading

import rclpy
from node_process import PATIENCE
from rcl_interfaces.srv import GetParameters
from rclpy.executors import SingleThreadedExecutor

from hpccd_ros.middleware import environment

ASKING = """
import sys
from hpccd_ros.middleware import environment
environment.prepare()
import rclpy
from hpccd_ros.params import node_parameters
rclpy.init()
node = rclpy.create_node("asking")
print(node_parameters.fetch(node, "/served", float(sys.argv[1]))["number"])
"""


def test_a_lost_response_is_asked_for_again():
    """DDS loses it if the node discovers the client only after it has answered."""
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("served", context=context)
    node.declare_parameter("number", 7)
    (service,) = (one for one in node.services if one.srv_type is GetParameters)
    send, lost = service.send_response, []
    service.send_response = lambda *response: send(*response) if lost else lost.append(response)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    try:
        asking = [sys.executable, "-c", ASKING, str(PATIENCE)]
        done = subprocess.run(asking, capture_output=True, text=True, timeout=2 * PATIENCE)
        assert (done.returncode, done.stdout, len(lost)) == (0, "7\n", 1), done.stderr
    finally:
        executor.shutdown()
        thread.join()
        node.destroy_node()
        rclpy.shutdown(context=context)
