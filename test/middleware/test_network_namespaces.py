# SPDX-License-Identifier: Apache-2.0
"""Node and simulator on two networks that a cable joins: reachable where discovery was opened, and only there.

Network namespaces stand for the machines. Each process has a shared memory of its own: what passes, passes by UDP.
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from network_peer import N
from node_process import PATIENCE
from sources import SUPPORT
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
import hpccd_ros

HERE, THERE = "10.213.77.1", "10.213.77.2"
# The open network responds within a second or two: what has not responded after this is closed.
CLOSED = 5.0  # s
SWITCH = "ROS_AUTOMATIC_DISCOVERY_RANGE"


@pytest.fixture(scope="module")
def networks():
    """Names of two network namespaces with a cable between them."""
    names = [f"hpccd-{side}-{os.getpid()}" for side in ("here", "there")]
    cables = [f"hpccd{i}-{os.getpid() % 100000}" for i in (0, 1)]
    commands = [f"ip netns add {name}" for name in names]
    commands.append(f"ip link add {cables[0]} type veth peer name {cables[1]}")
    for name, cable, address in zip(names, cables, (HERE, THERE), strict=True):
        commands += [
            f"ip link set {cable} netns {name}",
            f"ip -n {name} addr add {address}/24 dev {cable}",
            f"ip -n {name} link set {cable} up",
            f"ip -n {name} link set lo up",
        ]
    # Multicast has to find its way out where there is no default route.
    commands += [f"ip -n {n} route add 224.0.0.0/4 dev {c}" for n, c in zip(names, cables, strict=True)]
    if shutil.which("ip") is None:
        pytest.skip("network namespaces: there is no command `ip` (package iproute2)")
    try:
        for command in commands:
            made = subprocess.run(command.split(), capture_output=True, text=True)
            if made.returncode != 0:
                pytest.skip(f"network namespaces: `{command}` failed (root is needed): {made.stderr.strip()}")
        yield names
    finally:
        for name in names:
            subprocess.run(["ip", "netns", "delete", name], capture_output=True)


def start(network, arguments, **environment):
    """A Python process in ``network`` with a shared memory of its own, or in those of a process; "" takes a variable
    away."""
    env = {**os.environ, **environment}
    env = {key: value for key, value in env.items() if value}
    root = Path(hpccd_ros.__file__).resolve().parents[1]
    env["PYTHONPATH"] = os.pathsep.join([str(root), *filter(None, [env.get("PYTHONPATH")])])
    if isinstance(network, subprocess.Popen):
        command = ["nsenter", f"--target={network.pid}", "--mount", "--net"]
    else:
        command = ["ip", "netns", "exec", network, "sh", "-c", 'mount -t tmpfs none /dev/shm && exec "$@"', "sh"]
    return subprocess.Popen(
        [*command, sys.executable, *arguments],
        env=env,
        cwd=root,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def ask(network, namespace, seconds, **environment):
    """What the simulator in ``network`` got."""
    peer = start(network, [str(SUPPORT / "network_peer.py"), namespace, str(seconds)], **environment)
    output, _ = peer.communicate(timeout=4 * PATIENCE)
    assert peer.returncode == 0, output
    return json.loads(output.splitlines()[-1])


@pytest.fixture
def node_in(networks, tmp_path):
    """Starts a node in the first network; waits until it says that it is active."""
    nodes = []

    def start_one(namespace, **environment):
        arguments = ["-m", "hpccd_ros.node", "--ros-args", "-r", f"__ns:={namespace}", "-p", "meshes:=[cloth]"]
        node = start(networks[0], arguments, PYTHONUNBUFFERED="1", **environment)
        nodes.append(node)
        said = ""
        deadline = time.monotonic() + PATIENCE
        while "active: meshes cloth" not in said:
            line = node.stdout.readline()
            assert line and time.monotonic() < deadline, f"the node did not come up:\n{said}"
            said += line
        return node

    yield start_one
    for node in nodes:
        node.send_signal(signal.SIGINT)
        node.communicate(timeout=PATIENCE)


def assert_contacts_of_the_core(response):
    # Frames before the two were known to each other are lost, and a busy machine may pass over others.
    assert response["start"] < response["step"]
    expected = hc.Detector(scene_of(cloth=sheet_faces(N))).detect(
        *(sheet_positions(N, response[end]) for end in ("start", "step"))
    )
    assert response["hash"] == expected.hash and response["total"] == len(expected) > 100


def test_open_discovery_reaches_the_node_over_udp(networks, node_in):
    node_in("/open", **{SWITCH: "SUBNET"})
    got = ask(networks[1], "/open", PATIENCE, **{SWITCH: "SUBNET"})
    assert got["response"] is not None, got
    assert_contacts_of_the_core(got["response"])


def test_default_is_closed_to_the_network_and_open_to_its_host(networks, node_in):
    node = node_in("/closed", **{SWITCH: ""})
    # Even one who knows the address of the node, and names it, finds nobody.
    got = ask(networks[1], "/closed", CLOSED, **{SWITCH: "SUBNET", "ROS_STATIC_PEERS": HERE})
    assert got == {"response": None, "listeners": 0}
    got = ask(node, "/closed", PATIENCE, **{SWITCH: ""})
    assert got["response"] is not None, got
    assert_contacts_of_the_core(got["response"])
