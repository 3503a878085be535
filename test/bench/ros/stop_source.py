# SPDX-License-Identifier: Apache-2.0
"""A source to be killed, with nothing near in its frames: `python -m bench.ros.stop_source NAMESPACE HZ`"""

from __future__ import annotations

import sys
import time

import numpy as np
import rclpy
import stop_scene

from bench.ros.stop_link import Sender
from hpccd_ros import client


def main(namespace: str, rate: float) -> None:
    client.prepare_environment()
    rclpy.init()
    sender = Sender(rclpy.create_node("source", namespace=namespace))
    sender.topologies()
    frame = stop_scene.trial(np.random.default_rng(0))[0]
    while True:
        sender.frame(frame, time.time_ns())
        time.sleep(1 / rate)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
