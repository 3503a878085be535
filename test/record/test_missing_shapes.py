# SPDX-License-Identifier: Apache-2.0
"""A recorder says what it waits for, and that its recording began after a shape was sent, with the remedy."""

import os
import signal

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from live import PATIENCE, WAIT

from hpccd_ros import client
from hpccd_ros.record.recorded_topics import missing_shapes

TOPOLOGY, VERTICES, POSE = (f"meshes/box/{kind}" for kind in ("topology", "vertices", "pose"))
EITHER = [TOPOLOGY, VERTICES]


@pytest.mark.parametrize(
    "given, came, missing",
    [
        ({"input": "pose"}, [POSE], EITHER),
        ({"input": "pose"}, [POSE, TOPOLOGY], [VERTICES]),
        ({"input": "pose"}, [POSE, VERTICES], [TOPOLOGY]),
        ({"input": "pose"}, [POSE, *EITHER], []),
        ({"input": "pose"}, [], []),
        ({"input": "pose", "file": "box.obj"}, [POSE], []),
        ({"input": "tf"}, ["/tf", TOPOLOGY], [VERTICES]),
        ({"input": "tf"}, ["transforms"], EITHER),
        ({"input": "tf"}, [], []),
        ({"static": True}, ["contacts"], EITHER),
        ({"static": True, "input": "points"}, ["contacts", TOPOLOGY], ["meshes/box/points"]),
        ({"static": True}, [], []),
        ({}, [VERTICES], [TOPOLOGY]),
        ({}, [VERTICES, TOPOLOGY], []),
        ({"input": "marker"}, ["meshes/box/marker", "contacts"], []),
    ],
)
def test_what_a_replay_needs_and_is_not_there(given, came, missing):
    parameters = {"meshes": ["cloth", "box"], **{f"mesh.box.{key}": value for key, value in given.items()}}
    texts = missing_shapes(
        parameters, lambda name: f"/ns/{name.lstrip('/')}", {f"/ns/{n.lstrip('/')}": 3 for n in came}
    )
    if not missing:
        assert texts == []
        return
    (text,) = texts
    assert text.startswith(f"the shape of mesh box is not in the recording (nothing came on {' and '.join(missing)})")
    assert text.endswith("give the node mesh.box.file")


def test_a_cloud_of_a_mesh_of_points_needs_no_topology():
    parameters = {"meshes": ["box"], "mesh.box.input": "points", "points": ["box"]}
    came = {"meshes/box/points": 3}
    assert missing_shapes(parameters, str, came) == []
    assert len(missing_shapes(parameters | {"points": []}, str, came)) == 1


def test_a_recorder_that_came_late_says_it_at_once_and_at_the_end(start_node, children, tmp_path):
    node = start_node({"meshes": ["box"], "mesh.box.input": "pose"})
    node.peer.topology("box", np.array([[0, 1, 2]]), 3)
    node.peer.vertices("box", np.eye(3, dtype=np.float32), stamp=0)
    node.frames_status(processed=1)
    recorder = children.start(
        "recorder",
        "hpccd_ros.cli",
        "record",
        "-o",
        str(tmp_path / "late.mcap"),
        "--node",
        f"{node.namespace}/hpccd",
        "--wait",
        WAIT,
    )
    children.wait(lambda: recorder.has_printed("recording "), "the recorder did not hear the node", PATIENCE)
    node.peer.readers = 2  # the recorder as well: the only pose must not overtake it
    publisher = node.peer.publisher(PoseStamped, client.pose_topic("box"))
    pose = PoseStamped()
    pose.pose.orientation.w = 1.0
    pose.header.stamp.sec = 1
    publisher.publish(pose)
    text = "the shape of mesh box is not in the recording (nothing came on meshes/box/vertices), so no replay can"
    children.wait(lambda: recorder.has_printed(f"so far {text}"), "the recorder did not miss the shape", PATIENCE)
    recorder.process.send_signal(signal.SIGINT)
    children.wait(lambda: not recorder.running, "the recorder did not end", PATIENCE)
    assert recorder.has_printed(f"  {text}") and recorder.process.returncode == 0


def test_a_recorder_says_what_it_waits_for(start_node, children, hpccd, tmp_path):
    node = start_node({"meshes": ["box"], "autostart": False}, wait=False)
    name = f"{node.namespace}/hpccd"
    words = ("hpccd_ros.cli", "record", "--wait", WAIT, "-o")
    early = children.start("early", *words, str(tmp_path / "early.mcap"), "--node", "/nobody/hpccd")
    text = f"waiting for node /nobody/hpccd on ROS_DOMAIN_ID {os.environ['ROS_DOMAIN_ID']}, 240 s at most (--wait); "
    children.wait(lambda: early.has_printed(text), "the recorder did not say that it waits", PATIENCE)
    recorder = children.start("recorder", *words, str(tmp_path / "run.mcap"), "--node", name)
    text = f"{node.namespace}/contacts: no publisher yet; configure {name} (hpccd lifecycle), or "
    children.wait(lambda: recorder.has_printed(text), "the recorder did not say that it waits", PATIENCE)
    assert not recorder.has_printed("recording ")
    assert hpccd("lifecycle", "configure", "--node", name, "--wait", WAIT).returncode == 0
    children.wait(lambda: recorder.has_printed(f"recording {name} into "), "the recorder did not begin", PATIENCE)
