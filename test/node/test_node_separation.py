# SPDX-License-Identifier: Apache-2.0
"""Meshes that are to stay apart, and the smallest distances between them: streamed, changed while the node runs,
recorded and computed again from the file."""

import math

import hand_and_table
import numpy as np
import pytest
from cloth_and_net import FACES, MESHES, frame
from cloth_and_net_stream import Stream, detection_values, listen
from hpccd.msg import DistanceArray
from node_calls import set_parameter
from visualization_msgs.msg import MarkerArray
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros import client
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import qos
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay


def test_given_at_the_start_and_changed_from_step_to_step(start_node):
    given = {"minimum_separation": 1e-3, "pair_separation": ["net:cloth:5e-3"]}
    stream = Stream(start_node({"meshes": list(MESHES), **given}))
    first = stream.expect(1e-3, cloth_net=5e-3)
    assert first.total > len(hc.Detector(scene_of(cloth=FACES, net=FACES)).detect(frame(0), frame(1)))
    near = detection_values(stream, near=first.total, minimum_separation=0.001)
    assert stream.set("minimum_separation", 0.0).successful
    second = stream.expect(cloth_net=5e-3)
    near = int(detection_values(stream, minimum_separation=0.0, detections=2)["near"])
    sides = np.frombuffer(second.mesh_a, np.uint32), np.frombuffer(second.mesh_b, np.uint32)
    assert near == np.count_nonzero(sides[0] != sides[1]) > 0, "only those pairs that have a separation"
    detection_values(stream, near_total=first.total + near)
    assert stream.set("pair_separation", ["cloth:cloth:0.002", "cloth:net:0.0"]).successful
    stream.expect(cloth_cloth=2e-3, cloth_net=0.0)
    assert stream.set("pair_separation", [""]).successful
    stream.expect()
    detection_values(stream, near=0, detections=4)


@pytest.mark.parametrize(
    "name, value, reason",
    [
        ("minimum_separation", -1.0, "range"),
        ("minimum_separation", math.nan, "minimum_separation out of range Min: 0.0"),
        ("minimum_separation", "wide", "expected float"),
        ("pair_separation", ["cloth:wall:0.1"], "pair_separation: 'cloth:wall:0.1' must be NAME:NAME:DISTANCE with"),
        ("pair_separation", ["cloth:net:-1"], "a distance from 0 to 1e+150"),
        ("pair_separation", ["cloth:net:1", "net:cloth:2"], "contradicts 'cloth:net:1'"),
    ],
)
def test_bad_values_are_rejected_with_a_reason(shared_stream, name, value, reason):
    response = shared_stream.set(name, value)
    assert not response.successful and reason in response.reason, response.reason
    shared_stream.expect(1e-3)


@pytest.fixture(scope="module")
def shared_stream(tmp_path_factory):
    from node_process import NodeProcess

    given = {"meshes": list(MESHES), "minimum_separation": 1e-3}
    node = NodeProcess(tmp_path_factory.mktemp("separation"), given)
    yield Stream(node)
    node.close()


def test_distances_on_request(start_node):
    node = start_node({"meshes": list(MESHES)})
    heard = listen(node, DistanceArray, client.DISTANCES_TOPIC, client.DISTANCES_QOS)
    stream = Stream(node)
    stream.send()
    assert stream.set("distances", True).successful
    step = stream.sent
    stream.send()
    assert stream.set("distances", False).successful
    stream.send()
    detection_values(stream, detections=3)
    node.wait_until(lambda: heard, "distances")
    (message,) = heard
    assert message.backend == "cpu"  # with a GPU too, whatever finds the contacts
    assert (message.header.stamp.nanosec, message.header.frame_id, message.accuracy) == (step, "world", "exact")
    got = client.distances_from_message(message)
    expected = hc.Detector(scene_of(cloth=FACES, net=FACES)).distances(frame(step))
    assert len(expected) == len(got) == 3
    for gap, distance, points in zip(expected, got.distance, got.points, strict=True):
        assert got.between(gap.mesh_a, gap.mesh_b) == gap.distance == distance
        assert np.array_equal(points, gap.points)


def test_direction_and_speed_of_approach(start_node):
    """From consecutive snapshots of the stream; after a pause of the distances the first knows of none before it."""
    node = start_node({"meshes": list(hand_and_table.MESHES), "distances": True})
    heard = listen(node, DistanceArray, client.DISTANCES_TOPIC, client.DISTANCES_QOS)
    for name in hand_and_table.MESHES:
        node.peer.topology(name, hand_and_table.FACES, 3)
    half = 500_000_000

    def send(k, height):
        node.peer.vertices("hand", hand_and_table.hand(height), stamp=k * half)
        node.peer.vertices("table", hand_and_table.TABLE, stamp=k * half)
        node.frames_status(processed=2 * (k + 1))

    for k, height in enumerate((1.0, 0.75, 0.5, 0.625, 0.0)):
        send(k, height)
    assert set_parameter(node, "distances", False).successful
    send(5, 0.5)
    assert set_parameter(node, "distances", True).successful
    send(6, 0.25)
    node.wait_until(lambda: len(heard) == 5, "distances of five steps")
    told = [client.distances_from_message(message) for message in heard]
    assert [arrays.between("hand", "table") for arrays in told] == [0.75, 0.5, 0.625, 0.0, 0.25]
    rows = [next(row for row in range(3) if arrays.mesh_a[row] != arrays.mesh_b[row]) for arrays in told]
    speeds = [arrays.approach_speed[row] for arrays, row in zip(told, rows, strict=True)]
    assert speeds[1:4] == [0.5, -0.25, 1.25] and math.isnan(speeds[0]) and math.isnan(speeds[4])
    times = [arrays.time_to_contact[row] for arrays, row in zip(told, rows, strict=True)]
    assert times[1:4] == [1.0, math.inf, 0.0] and math.isnan(times[0]) and math.isnan(times[4])
    assert [arrays.nearest for arrays in told] == rows
    down = [arrays.direction[row].tolist() for arrays, row in zip(told, rows, strict=True)]
    assert down == [[0, 0, -1]] * 3 + [[0, 0, 0], [0, 0, -1]], "from the vertex of the hand; none where they touch"


def test_the_sides_of_near_pairs_are_marked(start_node):
    node = start_node({"meshes": list(MESHES), "markers": True, "markers_rate": 1000.0, "markers_max": 10})
    heard = listen(node, MarkerArray, "markers", qos.MARKERS)
    stream = Stream(node)
    stream.send()
    assert stream.set("minimum_separation", 5e-3).successful
    response = stream.send()
    assert len(response.closest) == 0, "the contacts carry nearest points only where asked for (outputs)"
    near = [markers.markers[3] for markers in node.wait_until(lambda: len(heard) == 2 and heard, "two marker arrays")]
    assert [(len(marker.points), marker.ns) for marker in near] == [(0, "near"), (20, "near")]
    ends = np.array([[point.x, point.y, point.z] for point in near[1].points]).reshape(-1, 2, 3)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert lengths.max() > 1e-3 and lengths.max() <= 5e-3 * (1 + 1e-9)


def test_recorded_with_all_its_changes_and_verified(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    given = {"distances": True, "outputs": ["closest", "weights"], "record": str(path)}
    node = start_node({"meshes": list(MESHES), **given})
    stream = Stream(node)
    stream.expect()
    assert stream.set("minimum_separation", 1e-3).successful
    assert len(stream.expect(1e-3).closest) > 0
    assert stream.set("pair_separation", ["net:net:0.004", "cloth:net:0.002"]).successful
    stream.expect(1e-3, cloth_net=2e-3, net_net=4e-3)
    assert stream.set("distances", False).successful
    assert stream.set("outputs", ["normals"]).successful
    last = stream.expect(1e-3, cloth_net=2e-3, net_net=4e-3)
    assert len(last.normals) == 3 * last.total and len(last.weights) == 0
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert (replay.verified, replay.diverged, replay.unverified) == (4, 0, 0)
    *with_weights, without = (step.recorded for step in steps)
    assert all(len(message.weights) == 4 * message.total > 0 for message in with_weights) and not len(without.weights)
    told = "0.001, net:net:0.004, cloth:net:0.002"
    assert [step.separation.text for step in steps] == ["", "0.001", told, told]
    found = replay.distances
    assert (found.verified, found.diverged, found.unverified, found.first) == (3, 0, 0, "")
    done = hpccd("replay", path)
    assert done.returncode == 0 and "  3 results about distances are equal" in done.stdout, done.stdout
    equal = "VERIFIED: 4 results are equal in every contact, time and hash"
    assert f"{equal} (accuracy exact; separation 0.001; separation {told})" in done.stdout, done.stdout
