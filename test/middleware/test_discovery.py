# SPDX-License-Identifier: Apache-2.0
"""Which processes can discover ours over a network: the other machine is a namespace with a cable to this one."""

import os
import subprocess
import sys
import uuid

import pytest

PEER = """
import sys, time
from hpccd_ros.middleware.environment import prepare
prepare()
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node(sys.argv[1])
node.create_subscription(String, "words", lambda message: None, 1)
publisher = node.create_publisher(String, "words", 1)
print("ready", flush=True)
if sys.argv[2] == "stay":
    sys.stdin.read()
else:
    deadline = time.monotonic() + float(sys.argv[2])
    while publisher.get_subscription_count() < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    print("met" if publisher.get_subscription_count() > 1 else "alone", flush=True)
rclpy.shutdown()
"""
# Peers that can meet do so within 0.5 s here; those that must not are given several times that.
LONG, SHORT = "200", "3"


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True)


@pytest.fixture(scope="module")
def other_machine():
    """(its name as a network namespace, our address on the cable between)."""
    name = f"hp{uuid.uuid4().hex[:6]}"
    here, there = f"{name}a", f"{name}b"
    try:
        run("ip", "netns", "add", name)
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no network namespaces for this user here: {getattr(error, 'stderr', error)}")
    try:
        run("ip", "link", "add", here, "type", "veth", "peer", "name", there)
        run("ip", "link", "set", there, "netns", name)
        run("ip", "addr", "add", "198.51.100.1/24", "dev", here)  # TEST-NET-2: documentation addresses, never routed
        run("ip", "link", "set", here, "up")
        run("ip", "-n", name, "addr", "add", "198.51.100.2/24", "dev", there)
        run("ip", "-n", name, "link", "set", there, "up")
        run("ip", "-n", name, "link", "set", "lo", "up")
        run("ip", "-n", name, "route", "add", "default", "via", "198.51.100.1")  # multicast needs a way out
        yield name, "198.51.100.1"
    finally:
        run("ip", "netns", "del", name)  # its end of the cable goes with it, and so does ours


def meets(other_machine, ours: dict[str, str], theirs: dict[str, str], patience: str) -> bool:
    """Does a process on the other machine meet one of ours, each with these variables?"""
    name, _ = other_machine
    unset = ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "FASTRTPS_DEFAULT_PROFILES_FILE")
    clean = {key: value for key, value in os.environ.items() if key not in unset}
    peer = [sys.executable, "-c", PEER]
    # Another machine has no shared memory with us.
    alone = ["unshare", "-m", "sh", "-c", 'mount -t tmpfs tmpfs /dev/shm && exec "$@"', "-"]
    elsewhere = ["ip", "netns", "exec", name, *alone]
    us = subprocess.Popen(
        [*peer, "ours", "stay"], env=clean | ours, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert us.stdout.readline() == "ready\n"
        them = subprocess.run(
            [*elsewhere, *peer, "theirs", patience], env=clean | theirs, capture_output=True, text=True, timeout=500
        )
        assert them.returncode == 0, them.stderr
        return them.stdout.split()[-1] == "met"
    finally:
        us.stdin.close()
        us.wait(timeout=300)


SUBNET = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}


def test_open_to_the_network_where_asked_for(other_machine):
    assert meets(other_machine, SUBNET, SUBNET, LONG)


def test_closed_by_default_even_to_a_peer_that_names_us(other_machine):
    assert not meets(other_machine, {}, SUBNET, SHORT)
    assert not meets(other_machine, {}, {"ROS_STATIC_PEERS": other_machine[1]}, SHORT)
