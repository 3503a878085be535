# SPDX-License-Identifier: Apache-2.0
"""More frames than the detection can take: the latest are processed, nothing is lost without being counted."""

import numpy as np
from lifecycle_msgs.srv import GetState
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.middleware import fields

N = 100  # about 50,000 to 200,000 contacts a step: tens of ms, where a frame comes every few
FACES = sheet_faces(N)
# Layers of a regular grid meet edge to edge: in doubt nearly everywhere, which exact arithmetic pays for thirtyfold.
TIER = "balanced"
FRAMES = [sheet_positions(N, k) for k in range(8)]


def flood(node, count):
    """Publish ``count`` frames as fast as it goes."""
    node.peer.topology("cloth", FACES, N * N)
    for k in range(count):
        node.peer.vertices("cloth", FRAMES[k % len(FRAMES)], stamp=k + 1, step=k)
        node.peer.executor.spin_once(timeout_sec=0)


def settled(node, sent):
    """The last frame was processed and every frame is accounted for; the frames status."""

    def done():
        values = node.peer.statuses["frames"][2]
        lost = int(values.get("dropped.middleware", 0))
        accounted = int(values["processed"]) + int(values["dropped"])
        return values if int(values["received"]) + lost == sent and accounted == sent else None

    return node.wait_until(done, f"status with {sent} frames accounted for")


def test_latest_frames_win_and_drops_are_counted_exactly(start_node):
    count = 60
    node = start_node({"accuracy": TIER, "meshes": ["cloth"], "max_contacts": 1000, "input_depth": 1000})
    flood(node, count)
    values = settled(node, count)
    dropped = int(values["dropped"])
    assert dropped > 0, "the test is made to overload the node"
    assert values["dropped.overload"] == values["dropped"], "and nothing else went wrong"
    detections = count - 1 - dropped
    messages = node.contacts(detections)
    node.wait_until(lambda: node.peer.received[-1].step == count - 1, "contacts of the last frame")
    assert len(messages) == detections
    assert messages[-1].dropped_frames == dropped
    chain = [fields.stamp_to_ns(messages[0].start)] + [fields.stamp_to_ns(m.header.stamp) for m in messages]
    assert chain[0] == 1 and chain[-1] == count
    for earlier, message in zip(chain, messages, strict=False):
        assert fields.stamp_to_ns(message.start) == earlier, "no time between two steps is left unwatched"
    scene = scene_of(cloth=FACES)
    detector = hc.Detector(scene, accuracy=TIER)
    for message in messages[:3] + messages[-3:]:
        start, end = (fields.stamp_to_ns(s) - 1 for s in (message.start, message.header.stamp))
        expected = detector.detect(FRAMES[start % 8], FRAMES[end % 8])
        assert message.hash == expected.hash and message.total == len(expected)
        assert message.truncated == (len(expected) > 1000)


def test_longer_queue_results_every_frame(start_node):
    count = 20
    queues = {"frame_queue": 100, "input_depth": 1000}
    node = start_node({"accuracy": TIER, "meshes": ["cloth"], "max_contacts": 1000, **queues})
    flood(node, count)
    settled(node, count)
    messages = node.contacts(count - 1)
    assert [m.step for m in messages] == list(range(1, count))
    assert all(m.dropped_frames == 0 for m in messages)


def test_two_meshes_count_both_messages_of_a_dropped_frame(start_node):
    count = 30
    node = start_node({"accuracy": TIER, "meshes": ["a", "b"], "max_contacts": 1000, "input_depth": 1000})
    for name in ("a", "b"):
        node.peer.topology(name, FACES, N * N)
    for k in range(count):
        for name in ("a", "b"):
            node.peer.vertices(name, FRAMES[k % 8], stamp=k, step=k)
    values = settled(node, 2 * count)
    assert int(values["dropped.a.overload"]) == int(values["dropped.b.overload"]) > 0
    lost = max(sum(int(n) for key, n in values.items() if key.startswith(f"dropped.{name}.")) for name in "ab")
    node.wait_until(lambda: node.peer.received and node.peer.received[-1].step == count - 1, "the last result")
    assert node.peer.received[-1].dropped_frames == lost, "frames of the scene, not messages"


def test_two_hundred_thousand_contacts_a_frame(start_node):
    """Each frame is processed, cut to the earliest contacts, and the rest of the node stays alive."""
    n, most = 130, 200_000
    faces, there, back = sheet_faces(n), sheet_positions(n, 2), sheet_positions(n, 3)
    frames = [there, back] * 3
    sent = {"max_contacts": most, "outputs": ["normals"]}
    node = start_node({"accuracy": TIER, "meshes": ["cloth"], "frame_queue": 10, **sent})
    node.peer.topology("cloth", faces, n * n)
    for k, vertices in enumerate(frames):
        node.peer.vertices("cloth", vertices, stamp=k)
    client, results = node.peer.node.create_client(GetState, "hpccd/get_state"), 0
    node.wait_until(client.service_is_ready, "service get_state")
    while len(node.peer.received) < len(frames) - 1:
        future = client.call_async(GetState.Request())
        node.wait_until(future.done, "result while contacts are computed and sent")
        results += 1
    assert results > len(frames), "services respond between the frames, not after them"
    node.frames_status(processed=len(frames), dropped=0)
    detector = hc.Detector(scene_of(cloth=faces), accuracy=TIER)
    both = [detector.detect(there, back), detector.detect(back, there)]
    for k, message in enumerate(node.contacts(len(frames) - 1)):
        full = both[k % 2]
        assert message.total == len(full) > most and message.truncated and message.hash == full.hash
        assert len(message.kind) == most and len(message.normals) == 3 * most
        earliest = np.sort(np.concatenate([full.vf_toc, full.ee_toc]))[:most]
        assert np.array_equal(np.sort(np.frombuffer(message.toc)), earliest)
    values = node.peer.statuses["detection"][2]
    assert (values["contacts_sent"], values["contacts"]) == (str(most), str(message.total))


def test_large_output_is_whole(start_node):
    """More than a hundred thousand contacts in one message, with points and normals."""
    node = start_node({"accuracy": TIER, "meshes": ["cloth"], "outputs": ["points", "normals"], "max_contacts": 0})
    node.peer.topology("cloth", FACES, N * N)
    for k in (2, 3):
        node.peer.vertices("cloth", FRAMES[k], stamp=k)
    message = node.contacts(1)[0]
    expected = hc.Detector(scene_of(cloth=FACES), accuracy=TIER, outputs=("points", "normals")).detect(*FRAMES[2:4])
    assert message.total == len(expected) > 100_000
    assert np.array_equal(np.frombuffer(message.points).reshape(-1, 3), expected.points)
    assert np.array_equal(np.frombuffer(message.normals).reshape(-1, 3), expected.normals)
