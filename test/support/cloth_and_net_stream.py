# SPDX-License-Identifier: Apache-2.0
"""Streams the two waving sheets of cloth_and_net through a node, frame by frame."""

from cloth_and_net import FACES, MESHES, N, frame, positions
from node_calls import set_parameter
from node_process import assert_same_contacts
from waving_sheet import scene_of

from hpccd_ros import client


class Stream:
    """Frames of both meshes, each processed before the next is sent."""

    def __init__(self, node):
        self.node, self.sent = node, 0
        for name in MESHES:
            node.peer.topology(name, FACES, N * N)
        self.send()

    def send(self):
        """The response to the step, or None to the first frame."""
        for name, part in zip(MESHES, positions(self.sent), strict=True):
            self.node.peer.vertices(name, part, stamp=self.sent, frame_id="world")
        self.sent += 1
        self.node.frames_status(processed=2 * self.sent)
        return self.node.contacts(self.sent - 1)[-1] if self.sent > 1 else None

    def expect(self, minimum=0.0, **pairs):
        """Send a frame; its result is that of the core with these separations, and reports them."""
        scene = scene_of(cloth=FACES, net=FACES)
        for pair, distance in pairs.items():
            scene.set_separation(*pair.split("_"), distance)
        response = self.send()
        frames = frame(self.sent - 2), frame(self.sent - 1)
        assert_same_contacts(response, *frames, scene, minimum_separation=minimum)
        told = client.contacts_from_message(response)
        assert told.minimum_separation == minimum
        assert told.pair_separation == {tuple(pair.split("_")): distance for pair, distance in pairs.items()}
        return response

    def set(self, name, value):
        return set_parameter(self.node, name, value)


def detection_values(stream, **expected):
    """Wait until the status `detection` holds these values; all of them."""
    wanted = {key: str(value) for key, value in expected.items()}

    def matches():
        values = stream.node.peer.statuses["detection"][2]
        return values if wanted.items() <= values.items() else None

    return stream.node.wait_until(matches, f"detection status with {wanted}")


def listen(node, kind, topic, profile):
    """What is published there from now on; there is a publisher."""
    heard = []
    node.peer.node.create_subscription(kind, topic, heard.append, profile)
    node.wait_until(lambda: node.peer.node.count_publishers(topic), f"publisher of {topic}")
    return heard
