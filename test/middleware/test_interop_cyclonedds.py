# SPDX-License-Identifier: Apache-2.0
"""An independent DDS implementation, in a process without ROS, streams to the node and reads its contacts."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from hpccd.msg import ContactArray, MeshVertices
from node_process import PATIENCE, assert_same_contacts
from sources import SUPPORT
from std_msgs.msg import Header
from waving_sheet import scene_of, sheet_faces, sheet_positions

from hpccd_ros.middleware import mesh_messages

pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed: pip install 'hpccd[interop]'")

# The node listens on the loopback interface only, where multicast is off: the peer has to name it.
LOOPBACK = """
<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>
"""


def play(node, folder, faces, frames):
    """Let the peer stream ``frames``; the results as messages."""
    source, target = folder / "frames.npz", folder / "results.json"
    np.savez(source, faces=faces, frames=frames)
    peer = subprocess.run(
        [sys.executable, str(SUPPORT / "cyclone_peer.py"), node.namespace, str(source), str(target)],
        env={**os.environ, "CYCLONEDDS_URI": LOOPBACK},
        capture_output=True,
        text=True,
        timeout=4 * PATIENCE,
    )
    assert peer.returncode == 0, peer.stdout + peer.stderr + node.output()
    return [message_of(fields) for fields in json.loads(target.read_text())]


def message_of(fields):
    """A ContactArray of the same values."""
    header = Header(stamp=Time(**fields["header"]["stamp"]), frame_id=fields["header"]["frame_id"])
    return ContactArray(**{**fields, "header": header, "start": Time(**fields["start"])})


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_peer_gets_the_contacts_of_the_core(start_node, tmp_path, dtype):
    n, outputs, apart = 16, ("points", "normals", "weights"), 1e-5
    node = start_node({"meshes": ["cloth"], "outputs": list(outputs), "pair_separation": [f"cloth:cloth:{apart}"]})
    frames = np.stack([sheet_positions(n, k, dtype=dtype) for k in range(6)])
    results = play(node, tmp_path, sheet_faces(n), frames)
    assert_all_but_one(results, frames, sheet_faces(n), outputs=outputs, minimum_separation=apart)
    assert results[0].step == 1, "results that fit one datagram are not lost"
    for result in results:
        assert len(result.points) == len(result.normals) == 3 * result.total
        assert (result.header.frame_id, list(result.mesh_names)) == ("lab", ["cloth"])
        assert list(result.topology_versions) == [3]
        assert (result.minimum_separation, list(result.separations)) == (0.0, [apart])
    node.frames_status(received=6, processed=6, dropped=0)


def test_large_messages_cross_over_udp(start_node, tmp_path):
    """A hundred thousand contacts: several megabytes in fragments, between two implementations."""
    n, tier = 100, "balanced"  # nearly every contact is degenerate: exact takes seconds, and this is not about it
    node = start_node({"meshes": ["cloth"], "max_contacts": 0, "accuracy": tier})
    frames = np.stack([sheet_positions(n, k) for k in (2, 3, 4)])
    results = play(node, tmp_path, sheet_faces(n), frames)
    assert_all_but_one(results, frames, sheet_faces(n), accuracy=tier)
    assert results[-1].total > 100_000


OTHER_VENDOR = """
import os
import sys
import cyclone_types as types
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
participant = DomainParticipant(int(os.environ["ROS_DOMAIN_ID"]))
writer = DataWriter(participant, Topic(participant, sys.argv[1], types.MeshVertices))
sys.stdin.read()
"""


def test_a_topic_that_ros_could_not_name_is_passed_over(start_node):
    node = start_node({"meshes": ["cloth"]})
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK, "PYTHONPATH": str(SUPPORT)}
    command = [sys.executable, "-c", OTHER_VENDOR, f"rt{node.namespace}/meshes/9/vertices"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, env=environment) as other:
        there = (f"{node.namespace}/meshes/9/vertices", ["hpccd/msg/MeshVertices"])
        node.wait_until(lambda: there in node.peer.node.get_topic_names_and_types(), "topic of the other vendor")
        misspelt = node.peer.publisher(MeshVertices, "meshes/clot/vertices")  # waits until the node listens
        misspelt.publish(mesh_messages.vertices_message(sheet_positions(8, 0), 1))
        node.frames_status(dropped__clot__unknown_mesh=1)
        other.stdin.close()


def assert_all_but_one(results, frames, faces, **options):
    """Every result equals the core's, and at most one is missing.

    Cyclone's reader takes what was written before the first heartbeat that it hears for older than itself. Fast DDS
    sends the first one among the fragments of the first result that has more than one: that result is passed over.
    """
    assert len({result.step for result in results}) == len(results) >= len(frames) - 2
    for result in results:
        end = result.step
        assert (result.start.nanosec, result.header.stamp.nanosec) == (end, end + 1)
        assert assert_same_contacts(result, frames[end - 1], frames[end], scene_of(cloth=faces), **options) > 100
