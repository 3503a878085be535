# SPDX-License-Identifier: Apache-2.0
"""A rope of edges beside a cloth: streamed, rejected, asked of ~/detect, recorded, computed again and drawn."""

import numpy as np
from hpccd.srv import Detect
from node_process import assert_same_contacts
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import mesh_messages
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N, SEGMENTS = 8, 40
FACES = sheet_faces(N)
EDGES = np.stack([np.arange(SEGMENTS), np.arange(1, SEGMENTS + 1)], axis=1).astype(np.uint32)
NO_FACES = np.empty((0, 3), np.uint32)


def rope(k):
    """A coil that goes through itself and, up and down, through the cloth."""
    t = np.linspace(0, 1, SEGMENTS + 1)
    turn = 40 * t + 0.4 * np.sin(3 * t + k)
    x, y = 0.17 + 0.1 * np.cos(turn), 0.5 + 0.3 * np.sin(turn)
    return np.stack([x, y, 0.08 * np.cos(0.9 * k) + 0.02 * np.sin(23 * t + k)], axis=1).astype(np.float32)


def frame(k):
    return np.concatenate([rope(k), sheet_positions(N, k)])


def scene():
    made = hc.Scene()
    made.add_mesh("rope", edges=EDGES)
    made.add_mesh("cloth", FACES)
    return made


def test_streamed_recorded_verified_and_drawn(start_node, tmp_path, hpccd):
    path, picture = tmp_path / "run.mcap", tmp_path / "run.png"
    node = start_node({"meshes": ["rope", "cloth"], "record": str(path)})
    node.peer.topology("rope", NO_FACES, SEGMENTS + 1, edges=EDGES)
    node.peer.topology("cloth", FACES, N * N)
    kinds = np.zeros(2, int)
    for k in range(8):
        node.peer.vertices("rope", rope(k), stamp=k, frame_id="world")
        node.peer.vertices("cloth", sheet_positions(N, k), stamp=k, frame_id="world")
        node.frames_status(processed=2 * (k + 1))
        if k:
            response = node.contacts(k)[-1]
            assert assert_same_contacts(response, frame(k - 1), frame(k), scene()) > 0
            kinds += np.bincount(response.kind, minlength=2)
    assert (kinds > 0).all()
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        assert len(list(replay.steps())) == 7
    assert (replay.verified, replay.diverged, replay.unverified) == (7, 0, 0)
    assert hpccd("view", str(path), "--output", str(picture)).returncode == 0
    assert picture.stat().st_size > 20_000


def test_wrong_edges_are_rejected_and_said(start_node):
    node = start_node({"meshes": ["rope"], "max_edges": SEGMENTS})
    for version, edges in enumerate(([[0, 1], [1, SEGMENTS + 1]], np.tile(EDGES, (2, 1)))):
        node.peer.topology("rope", NO_FACES, SEGMENTS + 1, version, edges=np.array(edges))
    node.frames_status(topologies_rejected__rope__index_range=1, topologies_rejected__rope__too_large=1)
    node.peer.topology("rope", NO_FACES, SEGMENTS + 1, 2, edges=EDGES)
    for k in range(2):
        node.peer.vertices("rope", rope(k), stamp=k, frame_id="world", topology_version=2)
    assert node.contacts(1)[-1].total > 0


def test_asked_of_detect(start_node):
    node = start_node({"meshes": ["floor"]})
    request = Detect.Request(mesh_names=["rope", "cloth"], query="intersections")
    request.topologies = [
        mesh_messages.topology_message(NO_FACES, SEGMENTS + 1, edges=EDGES),
        mesh_messages.topology_message(FACES, N * N),
    ]
    request.end = [mesh_messages.vertices_message(part, 0) for part in (rope(2), sheet_positions(N, 2))]
    future = node.peer.client().call_async(request)
    node.wait_until(future.done, "response")
    response = future.result()
    expected = hc.Detector(scene()).intersections(frame(2)).ef
    assert response.success and response.contacts.total == len(expected) > 0
    assert 0 in response.contacts.mesh_a, "edges of the rope intersect the cloth"
