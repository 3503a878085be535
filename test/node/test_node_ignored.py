# SPDX-License-Identifier: Apache-2.0
"""A node that ignores neighbours within a thick mesh: streamed, recorded, and computed again from the file."""

import pytest
from bag_tools import replayed, rewrite
from cloth_and_net import FACES, MESHES, frame, positions
from cloth_and_net_stream import Stream
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros.bag.reader import Recording
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

GIVEN = {
    "meshes": list(MESHES),
    "thickness": ["cloth:0.02", "net:0.02"],
    "distances": True,
    "mesh.cloth.ignored_rings": 2,
    "mesh.net.ignored_at_rest": 0.05,
}


class Thick(Stream):
    def expect(self, rest):
        """rest: number of the frame in which the net was at rest."""
        message = self.send()
        scene = scene_of(cloth=FACES, net=FACES)
        scene.ignore_within("cloth", rings=2)
        scene.ignore_within("net", rest_vertices=positions(rest)[1], distance=0.05)
        detector = hc.Detector(scene)
        for name in MESHES:
            detector.set_thickness(name, 0.02)
        expected = detector.detect(frame(self.sent - 2), frame(self.sent - 1))
        assert message.total == len(expected) > 0 and message.hash == expected.hash
        assert list(message.rest_stamps) == [-1, rest]
        return message


@pytest.mark.parametrize("from_the_start", [True, False])
def test_recorded_and_verified(start_node, tmp_path, from_the_start):
    path = tmp_path / "run.mcap"
    node = start_node(GIVEN | ({"record": str(path)} if from_the_start else {}))
    stream = Thick.__new__(Thick)
    Stream.__init__(stream, node)
    stream.expect(0)
    if not from_the_start:
        assert stream.set("record", str(path)).successful
        node.peer.readers = 2
        for mesh in MESHES:
            node.peer.await_readers(f"meshes/{mesh}/vertices")
    stream.expect(0)
    stream.expect(0)
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    found = replay.distances
    if from_the_start:
        assert (replay.verified, replay.diverged, replay.unverified) == (3, 0, 0), replay.first_divergence
        assert (found.verified, found.diverged) == (3, 0), found.first
    else:
        assert replay.diverged == found.diverged == 0, (replay.first_divergence, found.first)
        assert any(step.missing and "shape at rest" in step.missing for step in steps)
        # Without its start a step is not computed; its distances need the shape at rest all the same.
        changed = tmp_path / "without_start.mcap"

        def without_start(index, message, decoded):
            return None if "/vertices" in message.topic and index == 0 else decoded

        rewrite(path, changed, without_start)
        replay, steps = replayed(changed)
        assert any(step.missing and step.end_frame is not None for step in steps)
        assert replay.distances.diverged == replay.distances.verified == 0, replay.distances.first
