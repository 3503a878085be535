# SPDX-License-Identifier: Apache-2.0
"""Parameters of another node over its services."""

import subprocess
import sys
import threading
import time

import pytest
import rclpy
from node_process import PATIENCE
from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.executors import SingleThreadedExecutor

from hpccd_ros.middleware import environment

ASKING = """
import sys
from hpccd_ros.middleware import environment
environment.prepare()
import rclpy
from rcl_interfaces.srv import GetParameters, ListParameters
from hpccd_ros.params import node_parameters
rclpy.init()
node = rclpy.create_node("asking")
wait, discovery = (float(argument) for argument in sys.argv[1:])
for kind, name in ((ListParameters, "list_parameters"), (GetParameters, "get_parameters")):
    assert node.create_client(kind, f"/served/{name}").wait_for_service(discovery), name
print(node_parameters.fetch(node, "/served", wait)["number"])
"""


@pytest.fixture
def served():
    """A node with the parameter `number` that responds in a thread of its own."""
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("served", context=context)
    node.declare_parameter("number", 7)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin)
    thread.start()
    yield node
    executor.shutdown()
    thread.join()
    node.destroy_node()
    rclpy.shutdown(context=context)


def ask(wait):
    """`wait` begins once the node is discovered, which takes a busy machine longer than 2 s."""
    command = [sys.executable, "-c", ASKING, str(wait), str(PATIENCE)]
    return subprocess.run(command, capture_output=True, text=True, timeout=2 * PATIENCE)


def test_a_lost_response_is_asked_for_again(served):
    """DDS loses it if the node discovers the client only after it has responded."""
    (service,) = (one for one in served.services if one.srv_type is GetParameters)
    send, lost = service.send_response, []
    service.send_response = lambda *response: send(*response) if lost else lost.append(response)
    done = ask(PATIENCE)
    assert (done.returncode, done.stdout, len(lost)) == (0, "7\n", 1), done.stderr


def test_a_slow_node_has_its_time_for_each_request(served):
    """It responds to the copies of one request, sent after 1 s, before the next, for which it has 2 s at least."""
    for service in served.services:
        if service.srv_type in (GetParameters, ListParameters):
            service.callback = delayed(service.callback)
    done = ask(2.0)
    assert (done.returncode, done.stdout) == (0, "7\n"), done.stderr


def delayed(callback):
    def respond(request, response):
        time.sleep(1.1)
        return callback(request, response)

    return respond
