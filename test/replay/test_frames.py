# SPDX-License-Identifier: Apache-2.0
"""The node's subscriptions and a replay make the same frames of the same messages."""

import os

import numpy as np
import pytest
import rclpy
from bag_tools import rewrite
from rclpy.signals import SignalHandlerOptions

from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording
from hpccd_ros.frames.drops import Input
from hpccd_ros.middleware import environment
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.mesh_subscriptions import MeshSubscriptions, Reception
from hpccd_ros.params import scene_parameters
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.frames import FrameSource


@pytest.fixture
def ros_node():
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("frames", namespace=f"/frames{os.getpid()}", start_parameter_services=False)
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


def of_replay(recording, setup):
    source = FrameSource(setup, recording.topics)
    return [frame for message in recording.messages(source.topics) for frame in source.push(message)], source.rejected


def of_node(node, recording, setup):
    """Each message as the executor hands it to the node's callbacks."""
    accounts = Accounts(lambda text: None)
    pipeline = scene_parameters.frame_pipeline(setup.settings, setup.meshes, setup.settings["pending_frames"])
    for mesh, loaded in setup.files.items():
        pipeline.load(mesh, *loaded)
    queue = pipeline.start(1000)
    streams = {
        mesh: MeshSubscriptions(Reception(node, mesh, setup.settings, pipeline, accounts), row)
        for mesh, row in setup.meshes.items()
    }
    for message in recording.messages(list(setup.roles)):
        mesh, kind = setup.roles[message.topic]
        (topic,) = (topic for topic in streams[mesh].topics if topic.kind == kind)
        info = {"received_timestamp": 2, "source_timestamp": 1, "publication_sequence_number": message.sequence}
        topic.receive(make_decoder(recording.topics[message.topic])(message), info)
    for subscriptions in streams.values():
        subscriptions.close()
    return queue.frames(), {Input.VERTICES: accounts.dropped, Input.TOPOLOGY: accounts.topologies_rejected}


def spoil(index, message, decoded):
    """Now and then what is rejected: stamps that are no time or go back, positions that are no numbers or too few."""
    if message.topic.endswith("/vertices"):
        index += 3 * message.topic.startswith("/meshes/ball")  # not the same frames of both meshes
        if index % 20 == 7:
            decoded.header.stamp.nanosec = 2**31
        elif index % 20 == 11:
            object.__setattr__(decoded, "vertices_f32", np.full_like(decoded.vertices_f32, np.nan))
        elif index % 20 == 13:
            object.__setattr__(decoded, "vertices_f32", decoded.vertices_f32[3:])
        elif index % 20 == 17:
            decoded.header.stamp.sec = 0
    return decoded


@pytest.mark.parametrize("spoilt", [False, True])
def test_the_same_frames_and_rejections(ros_node, small_bag, tmp_path, spoilt):
    if spoilt:
        rewrite(small_bag, tmp_path / "spoilt.mcap", spoil)
    with Recording(tmp_path / "spoilt.mcap" if spoilt else small_bag) as recording:
        setup = recorded_setup.of_recording(recording)
        node_frames, node_rejected = of_node(ros_node, recording, setup)
        replay_frames, replay_rejected = of_replay(recording, setup)
    assert len(node_frames) == len(replay_frames) and 40 < len(node_frames) <= 90
    for a, b in zip(node_frames, replay_frames, strict=True):
        assert (a.stamp, a.step, a.frame_id, a.fresh) == (b.stamp, b.step, b.frame_id, b.fresh)
        assert [t.version for t in a.topologies] == [t.version for t in b.topologies]
        assert all(np.array_equal(x, y) and x.dtype == y.dtype for x, y in zip(a.vertices, b.vertices, strict=True))
    for what, counter in node_rejected.items():
        assert counter.by_mesh_and_reason() == replay_rejected[what].by_mesh_and_reason()
    reasons = set(node_rejected[Input.VERTICES].by_reason())
    of_spoilt = {"malformed", "not_finite", "wrong_vertex_count", "stamp_backward", "incomplete"}
    assert reasons == (of_spoilt if spoilt else set())
