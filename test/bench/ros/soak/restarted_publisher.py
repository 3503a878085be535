# SPDX-License-Identifier: Apache-2.0
"""A publisher that the soak kills and starts again: one mesh, its positions a function of the time alone.

`python -m bench.ros.soak.restarted_publisher NAMESPACE RATE COUNTER`
COUNTER: a file that holds, as 8 bytes, how many frames all runs together have sent, so that the number outlives
SIGKILL.
"""

from __future__ import annotations

import mmap
import struct
import sys
import threading
import time
from pathlib import Path

import rclpy
from hpccd.msg import MeshTopology, MeshVertices
from rclpy.signals import SignalHandlerOptions

from hpccd_ros import scenes
from hpccd_ros.middleware import environment, mesh_cdr, qos, stop_signals, topic_names

MESH = "strip"
SIZE = 0.1  # 336 triangles: a soak wants many frames, not large ones
WAIT = 30.0  # s for the node to be there


def strip() -> scenes.Scene:
    return scenes.make("folding-strip", SIZE)


def frame_of(tick: int, scene: scenes.Scene) -> int:
    """Frame of the scene that belongs to a tick: to and fro, without a jump."""
    last = scene.n_frames - 1
    return last - abs(last - tick % (2 * last))


def stamp_of(tick: int, rate: float) -> int:
    """ns since the epoch: every process computes the same stamp for a tick."""
    return round(tick * 1e9 / rate)


def main(namespace: str, rate: float, counter: Path) -> int:
    stop = threading.Event()
    stop_signals.watch(stop.set)
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("strip", namespace=namespace, start_parameter_services=False)
    topology = node.create_publisher(MeshTopology, topic_names.topology(MESH), qos.TOPOLOGY)
    vertices = node.create_publisher(MeshVertices, topic_names.vertices(MESH), qos.vertices("reliable", 10))
    scene = strip()
    mesh = scene.meshes[0]
    deadline = time.monotonic() + WAIT
    while not (topology.get_subscription_count() and vertices.get_subscription_count()) and not stop.wait(0.05):
        if time.monotonic() > deadline:
            print(f"no node listens to {MESH} in {namespace}", file=sys.stderr)
            return 1
    topology.publish(mesh_cdr.topology(0, "world", 0, mesh.faces, mesh.n_vertices))
    with open(counter, "r+b") as file, mmap.mmap(file.fileno(), 8) as shared:
        (sent,) = struct.unpack("<Q", shared)
        tick = int(time.time() * rate) + 1
        while not stop.wait(max(0.0, tick / rate - time.time())):
            sent += 1
            shared[:] = struct.pack("<Q", sent)
            stamp = stamp_of(tick, rate)
            vertices.publish(mesh_cdr.vertices(stamp, "world", 0, tick, scene.frame(frame_of(tick, scene))[0]))
            tick += 1
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])))
