# SPDX-License-Identifier: Apache-2.0
"""A reader that a busy machine holds up for seconds loses nothing that a reliable topic brought meanwhile."""

import itertools
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32

from hpccd_ros.middleware import environment

PATIENCE = 240.0
HELD_UP = 2.0  # s; with the default of Fast DDS, 1 s and another process that joins lose all but the writer's history
LAST = 2**32 - 1

READER = """
from hpccd_ros.middleware import environment
environment.prepare()
import rclpy
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt32
rclpy.init()
node, numbers = rclpy.create_node("reader"), []
def hear(message):
    if not numbers:
        print("hears", flush=True)
    numbers.append(message.data)
node.create_subscription(UInt32, "held_up/numbers", hear, QoSProfile(depth=10_000))
while numbers[-1:] != [2**32 - 1]:
    rclpy.spin_once(node, timeout_sec=0.1)
print(*numbers, flush=True)
rclpy.shutdown()
"""


def reader():
    return subprocess.Popen([sys.executable, "-c", READER], stdout=subprocess.PIPE, text=True)


def unused_domain():
    """A domain without ports in shared memory: one that a killed process left keeps the limits of whoever made it."""
    left = {int(path.name.removeprefix("fastrtps_port")) for path in Path("/dev/shm").glob("fastrtps_port*[0-9]")}
    return next(d for d in range(101, 0, -1) if not any(7400 + 250 * d <= port < 7650 + 250 * d for port in left))


def test_nothing_is_lost(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(unused_domain()))
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("writer", context=context)
    publisher = node.create_publisher(UInt32, "held_up/numbers", QoSProfile(depth=10))
    processes = [reader()]
    try:
        _wait(lambda: publisher.get_subscription_count() == 1)
        sent = _send_until_heard(publisher, processes[0])
        processes[0].send_signal(signal.SIGSTOP)
        processes.append(reader())  # joins meanwhile
        end = time.monotonic() + HELD_UP
        while time.monotonic() < end:
            publisher.publish(UInt32(data=sent))
            sent += 1
            time.sleep(0.02)
        _wait(lambda: publisher.get_subscription_count() == 2)
        processes[0].send_signal(signal.SIGCONT)
        publisher.publish(UInt32(data=LAST))
        assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE))
        numbers, _ = processes[0].communicate(timeout=PATIENCE)
        heard = [int(n) for n in numbers.split()]
        assert heard == [*range(heard[0], sent), LAST]
    finally:
        for process in processes:
            process.kill()
            process.communicate()
        node.destroy_node()
        rclpy.shutdown(context=context)


def _send_until_heard(publisher, process):
    """How many were sent. Known to the writer is not yet knowing it: the first ones may go to nobody."""
    deadline = time.monotonic() + PATIENCE
    for sent in itertools.count():
        publisher.publish(UInt32(data=sent))
        if select.select([process.stdout], [], [], 0.2)[0]:
            assert process.stdout.readline() == "hears\n"
            return sent + 1
        assert time.monotonic() < deadline


def _wait(ready):
    deadline = time.monotonic() + PATIENCE
    while not ready():
        assert time.monotonic() < deadline
        time.sleep(0.02)
