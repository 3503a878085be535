# SPDX-License-Identifier: Apache-2.0
"""Topic pairs: each pair of meshes in brief, for every result, where it is asked for."""

import math

import numpy as np
import pytest
from cloth_and_net import FACES, MESHES, N, frame, positions
from hpccd.msg import PairSummaryArray
from node_calls import set_parameter
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros import client
from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording


class Stream:
    """Of both meshes and of one far away, each frame processed before the next is sent."""

    def __init__(self, node):
        self.node, self.sent, self.heard = node, 0, []
        for name in (*MESHES, "far"):
            node.peer.topology(name, FACES, N * N)
        node.peer.node.create_subscription(PairSummaryArray, client.PAIRS_TOPIC, self.heard.append, client.PAIRS_QOS)
        node.wait_until(lambda: node.peer.node.count_publishers(client.PAIRS_TOPIC), "publisher of pairs")
        self.send()

    def send(self):
        here = positions(self.sent)
        for name, part in zip((*MESHES, "far"), (*here, here[0] + np.float32(100)), strict=True):
            self.node.peer.vertices(name, part, stamp=self.sent, step=7 + self.sent, frame_id="world")
        self.sent += 1
        self.node.frames_status(processed=3 * self.sent)
        return self.node.contacts(self.sent - 1)[-1] if self.sent > 1 else None


PAIRS = [(a, b) for k, a in enumerate((*MESHES, "far")) for b in (*MESHES, "far")[k:]]


def test_every_result_in_brief(start_node, tmp_path):
    path = tmp_path / "run.mcap"
    node = start_node({"meshes": [*MESHES, "far"], "max_contacts": 1, "record": str(path)})
    stream = Stream(node)
    stream.send()
    assert set_parameter(node, "pair_summaries", True).successful
    whole = stream.send()
    assert set_parameter(node, "distances", True).successful
    stream.send()
    assert set_parameter(node, "pair_summaries", False).successful
    stream.send()
    node.wait_until(lambda: len(stream.heard) >= 2, "both summaries")
    assert len(stream.heard) == 2
    first, second = stream.heard
    assert whole.truncated and len(whole.toc) == 1 < whole.total
    assert (first.step, first.header) == (whole.step, whole.header) and second.step == first.step + 1
    for k, message in ((2, first), (3, second)):
        assert [(pair.mesh_a, pair.mesh_b) for pair in message.pairs] == PAIRS
        contacts = hc.Detector(scene_of(cloth=FACES, net=FACES)).detect(frame(k - 1), frame(k))
        mesh = [np.concatenate([contacts.vf[:, 0], contacts.ee[:, 0]]) // (N * N)]
        mesh.append(np.concatenate([contacts.vf[:, 1] // len(FACES), contacts.ee[:, 2] // (N * N)]))
        toc = np.concatenate([contacts.vf_toc, contacts.ee_toc])
        for a, b in ((0, 0), (0, 1), (1, 1)):
            of_pair = toc[(np.minimum(*mesh) == a) & (np.maximum(*mesh) == b)]
            told = client.pair_summary(message, MESHES[b], MESHES[a])
            assert (told.count, told.first_toc) == (len(of_pair), of_pair.min(initial=math.inf))
        for name in MESHES:
            assert client.pair_summary(message, "far", name).count == 0
            assert client.pair_summary(message, "far", name).first_toc == math.inf
    assert all(math.isnan(pair.distance) for pair in first.pairs)
    gaps = hc.Detector(scene_of(cloth=FACES, net=FACES)).distances(frame(3))
    for gap in gaps:
        assert client.pair_summary(second, gap.mesh_a, gap.mesh_b).distance == gap.distance
    with pytest.raises(ValueError, match="mesh_b: no mesh is named 'wall'; there are cloth, net, far"):
        client.pair_summary(first, "cloth", "wall")
    assert node.stop() == 0
    with Recording(path) as recording:
        topic = next(topic for name, topic in recording.topics.items() if name.endswith("/pairs"))
        decode = make_decoder(topic)
        kept = [decode(message) for message in recording.messages([topic.name])]
    assert [[pair.count for pair in message.pairs] for message in kept] == [
        [pair.count for pair in message.pairs] for message in stream.heard
    ]
