# SPDX-License-Identifier: Apache-2.0
import rclpy
from rclpy.executors import ExternalShutdownException

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("robot")
listener = client.StopListener(node, stop_timeout=0.5, on_change=lambda heard: print("stop:", heard.reason or "no"))
print("stop:", listener.reason or "no")
try:
    while True:
        rclpy.spin_once(node, timeout_sec=0.01)
        speed = 0.0 if listener.stop else 1.0  # of the robot's next command
except (KeyboardInterrupt, ExternalShutdownException):
    pass  # Ctrl-C, or kill
