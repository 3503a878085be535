# SPDX-License-Identifier: Apache-2.0
import rclpy
from rclpy.executors import ExternalShutdownException

from hpccd_ros import client

client.prepare_environment()
rclpy.init()
node = rclpy.create_node("robot")
listener = client.SpeedScaleListener(node, stop_timeout=0.5)
print("speed scale:", listener.speed_scale, listener.reason)
try:
    while True:
        rclpy.spin_once(node, timeout_sec=0.01)
        speed = 0.3 * listener.speed_scale  # of the robot's next command, in m/s
except (KeyboardInterrupt, ExternalShutdownException):
    pass  # Ctrl-C, or kill
