# SPDX-License-Identifier: Apache-2.0
"""Memory of large messages is kept between them, for whatever comes next: fresh pages cost more than the copy of a
message. But no queue keeps for itself what once waited in it, and in the long run the node gives back what is free."""

import ctypes
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml
from hpccd.msg import MeshVertices
from rclpy.duration import Duration
from rclpy.signals import SignalHandlerOptions

import hpccd_ros
from hpccd_ros.middleware import environment, mesh_messages, qos

ROOT = Path(hpccd_ros.__file__).resolve().parents[1]
MEGABYTES, ROUNDS = 8, 50
FAULTS = f"""
import resource
from hpccd_ros.middleware import environment
environment.prepare()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
bytearray({MEGABYTES} << 20)
before = faults()
for _ in range({ROUNDS}):
    bytearray({MEGABYTES} << 20)
print((faults() - before) / {ROUNDS})
"""

DEPTH = 20
# A queue is filled with megabytes that nobody takes, then emptied; printed: megabytes allocated before, when it is
# full, and at the end.
QUEUE = f"""
import ctypes, gc, os, sys, time
from hpccd_ros.middleware import environment, qos
environment.prepare()
import rclpy
from rclpy.duration import Duration
from std_msgs.msg import UInt8MultiArray
class Info(ctypes.Structure):
    names = "arena ordblks smblks hblks hblkhd usmblks fsmblks uordblks fordblks keepcost"
    _fields_ = [(name, ctypes.c_size_t) for name in names.split()]
libc = ctypes.CDLL(None)
libc.mallinfo2.restype = Info
def allocated():
    gc.collect()
    info = libc.mallinfo2()
    return (info.uordblks + info.hblkhd) / 1e6
rclpy.init()
node = rclpy.create_node("queue", namespace=f"/queue{{os.getpid()}}", start_parameter_services=False)
taken = []
profile = qos.vertices("reliable", {DEPTH})
node.create_subscription(UInt8MultiArray, "large", lambda data: taken.append(len(data)), profile, raw=True)
publisher = node.create_publisher(UInt8MultiArray, "large", profile)
while not publisher.get_subscription_count():
    time.sleep(0.05)
# CDR: no dimensions, offset 0, number of bytes.
data = bytes([0, 1, 0, 0]) + bytes(8) + (10**6).to_bytes(4, "little") + bytes(10**6)
before = allocated()
for _ in range({DEPTH}):
    publisher.publish(data)
publisher.wait_for_all_acked(Duration(seconds=60))
full = allocated()
while len(taken) < {DEPTH}:
    rclpy.spin_once(node, timeout_sec=10)
print(before, full, allocated())
"""


def faults_per_message(**variables):
    """Page faults of a buffer of 8 MB that is taken and given back."""
    env = {key: value for key, value in os.environ.items() if not key.startswith("MALLOC_")}
    command = [sys.executable, "-c", FAULTS]
    done = subprocess.run(command, env=env | variables, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def test_freed_memory_is_kept():
    assert faults_per_message() < 100, "2048 pages of 4 KB in each message"


def test_a_threshold_of_the_user_wins():
    own = {"MALLOC_MMAP_THRESHOLD_": "131072", "MALLOC_TRIM_THRESHOLD_": "131072", "MALLOC_TOP_PAD_": "0"}
    assert faults_per_message(**own) > 1000


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "mallinfo2"), reason="only glibc since 2.33 tells what is allocated")
def test_an_emptied_queue_keeps_nothing():
    command = [sys.executable, "-c", QUEUE]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    before, full, after = map(float, done.stdout.split())
    assert full > before + 0.9 * DEPTH, "the queue was not full: nothing is shown"
    assert after < before + 3, f"{before:.1f} MB, {full:.1f} MB when full, {after:.1f} MB when empty again"


NODE = """
import sys
from hpccd_ros.node import node, run
node.GIVE_BACK_EVERY = float(sys.argv.pop(1))
sys.exit(run.main())
"""
# Longer than a message takes to come, shorter than the test has patience.
SOON, PATIENCE = 5.0, 240.0


def own_mb(pid):
    """Resident memory without that shared with other processes, through which messages come: it fills by and by."""
    status = dict(line.split(":") for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(status["RssAnon"].split()[0]) / 1024


def test_the_node_shrinks_again_after_a_large_message(tmp_path):
    """20 MB that it rejects: in the middleware, in Python, and as an array. One of these may stay, in the arena of the
    thread that received it."""
    namespace = f"/shrinks{os.getpid()}"
    parameters = tmp_path / "node.yaml"
    parameters.write_text(yaml.safe_dump({"/**": {"ros__parameters": {"meshes": ["cloth"], "max_vertices": 1000}}}))
    rules = ["--ros-args", "--params-file", parameters, "-r", f"__ns:={namespace}", "-r", "/diagnostics:=diagnostics"]
    node = subprocess.Popen([sys.executable, "-c", NODE, str(SOON), *rules], cwd=ROOT)
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    peer = rclpy.create_node("large", namespace=namespace, start_parameter_services=False)
    try:
        publisher = peer.create_publisher(MeshVertices, "meshes/cloth/vertices", qos.vertices("reliable", 1))
        deadline = time.monotonic() + PATIENCE

        def until(ready, what):
            while not ready():
                assert node.poll() is None and time.monotonic() < deadline, what
                time.sleep(0.02)

        until(publisher.get_subscription_count, "the node does not listen")
        publisher.publish(mesh_messages.vertices_message(np.zeros((10, 3), np.float32), 1))
        assert publisher.wait_for_all_acked(Duration(seconds=PATIENCE))
        before = own_mb(node.pid)
        large = np.zeros((1_700_000, 3), np.float32)
        once = large.nbytes / 2**20
        publisher.publish(mesh_messages.vertices_message(large, 2))
        until(lambda: own_mb(node.pid) > before + 2 * once, "the message did not come")
        until(lambda: own_mb(node.pid) < before + once + 8, "the node keeps what it had for one message")
    finally:
        node.terminate()
        peer.destroy_node()
        rclpy.try_shutdown()
        assert node.wait(PATIENCE) == 0
