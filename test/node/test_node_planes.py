# SPDX-License-Identifier: Apache-2.0
"""A node with planes and thick meshes: streamed, changed while it runs, drawn, requested, recorded
and computed again from the file."""

import pytest
from cloth_and_net import FACES, MESHES, N, frame, positions
from cloth_and_net_stream import Stream, detection_values, listen
from hpccd.msg import DistanceArray
from node_calls import set_parameter
from visualization_msgs.msg import MarkerArray
from waving_sheet import scene_of

import hpccd_core as hc
from hpccd_ros import client
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import mesh_messages, qos
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

GIVEN = {
    "meshes": list(MESHES),
    "planes": ["floor", "wall"],
    "plane.wall.normal": [-2.0, 0.0, 0.0],
    "plane.wall.offset": -0.5,
    "ignored_pairs": ["net:wall"],
}


def scene():
    made = scene_of(cloth=FACES, net=FACES)
    made.add_plane("floor")
    made.add_plane("wall", (-2, 0, 0), -0.5)
    made.ignore_pair("net", "wall")
    return made


def result(k, **thickness):
    """Of the core, for the step to frame k."""
    detector = hc.Detector(scene())
    for name, value in thickness.items():
        detector.set_thickness(name, value)
    return detector.detect(frame(k - 1), frame(k)), detector.distances(frame(k))


def ask(node, request):
    future = node.peer.client().call_async(request)
    node.wait_until(future.done, "response")
    return future.result()


class Thick(Stream):
    def expect(self, **thickness):
        message = self.send()
        contacts, _ = result(self.sent - 1, **thickness)
        found = client.contacts_from_message(message)
        assert message.total == len(contacts) and message.hash == contacts.hash
        assert found.n_vertex_plane == len(contacts.vp) > 0 and found.n_vertex_face == len(contacts.vf)
        assert found.mesh_names == (*MESHES, "floor", "wall") and found.thickness == thickness
        return message


def test_streamed_changed_recorded_and_verified(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    given = {"distances": True, "outputs": ["points", "normals", "weights"], "record": str(path)}
    node = start_node(GIVEN | given)
    heard = listen(node, DistanceArray, client.DISTANCES_TOPIC, client.DISTANCES_QOS)
    stream = Thick(node)
    message = stream.expect()
    detection_values(stream, near=0)
    assert list(message.mesh_names) == [*MESHES, "floor", "wall"] and len(message.points) == 3 * message.total
    assert stream.set("thickness", ["cloth:0.004", "net:0.001"]).successful
    stream.expect(cloth=0.004, net=0.001)
    assert stream.set("thickness", ["net:0.002"]).successful
    message = stream.expect(net=0.002)
    assert (message.minimum_separation, list(message.thickness)) == (0.0, [0.0, 0.002, 0.0, 0.0])
    node.wait_until(lambda: len(heard) == 3, "distances of three steps")
    for k, thickness in ((1, {}), (2, {"cloth": 0.004, "net": 0.001}), (3, {"net": 0.002})):
        _, gaps = result(k, **thickness)
        told = client.distances_from_message(heard[k - 1])
        assert told.distance.tolist() == [gap.distance for gap in gaps]
        assert (
            told.between("cloth", "floor")
            == next(g for g in gaps if (g.mesh_a, g.mesh_b) == ("cloth", "floor")).distance
        )
    assert {(MESHES + ("floor", "wall"))[b] for b in told.mesh_b[told.kind == DistanceArray.VERTEX_PLANE]} == {
        "floor",
        "wall",
    }
    assert node.stop() == 0
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording))
        steps = list(replay.steps())
    assert (replay.verified, replay.diverged, replay.unverified) == (3, 0, 0), replay.first_divergence
    assert [dict(step.thickness) for step in steps] == [{}, {"cloth": 0.004, "net": 0.001}, {"net": 0.002}]
    found = replay.distances
    assert (found.verified, found.diverged, found.unverified, found.first) == (3, 0, 0, "")
    done = hpccd("replay", path, "--csv", tmp_path / "steps.csv")
    assert done.returncode == 0 and "VERIFIED: 3 results are equal in every contact, time and hash" in done.stdout
    picture = hpccd("view", path, "-o", tmp_path / "step.png")
    assert picture.returncode == 0 and (tmp_path / "step.png").stat().st_size > 10_000, picture.stderr
    page = hpccd("view", path, "--html", tmp_path / "run.html")
    assert page.returncode == 0 and '"floor"' in (tmp_path / "run.html").read_text(), page.stderr


@pytest.mark.parametrize(
    "name, value, reason",
    [
        ("thickness", ["cloth:-1"], "thickness: 'cloth:-1' must be NAME:THICKNESS with a mesh out of"),
        ("thickness", ["nett:1"], "with a mesh out of cloth, net and a number from 0"),  # no planes
        ("thickness", ["floor:1"], "'floor' is a plane, which has none: shift its offset, or use pair_separation"),
        ("plane.floor.offset", 1.0, "plane.floor.offset: read-only while the node is configured"),
        ("planes", ["wall"], "read-only"),
    ],
)
def test_bad_changes_are_rejected_with_a_reason(shared, name, value, reason):
    answer = set_parameter(shared.node, name, value)
    assert not answer.successful and reason in answer.reason, answer.reason
    shared.expect()


@pytest.mark.parametrize("planes", [("floor", "wall"), ("wall",)])
def test_requests_have_the_planes_of_the_node(shared, planes):
    ends = [dict(zip(MESHES, positions(k), strict=True)) for k in (0, 1)]
    topologies = dict.fromkeys(MESHES, mesh_messages.topology_message(FACES, N * N))
    request = client.collision_free_step_request(*ends, topologies=topologies)
    request.query = "contacts"
    # Planes are named with the meshes, in any place, and have neither topology nor positions; no names mean all.
    request.mesh_names = [] if len(planes) == 2 else ["wall", *MESHES]
    response = ask(shared.node, request)
    assert response.success, response.message
    found = client.contacts_from_message(response.contacts)
    assert found.mesh_names == (*MESHES, *planes)
    assert {found.mesh_names[mesh] for mesh in found.mesh_b[-found.n_vertex_plane :]} == set(planes)
    request.query = "distances"
    response = ask(shared.node, request)
    gaps = client.distances_from_message(response.distances)
    assert (
        gaps.mesh_names == (*MESHES, *planes) and (gaps.kind == DistanceArray.VERTEX_PLANE).sum() == 2 * len(planes) - 1
    )


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        (["wall", "floor"], "mesh_names: floor, wall have no positions; name meshes that are tested against them"),
        (["wall", *MESHES, "wall"], "mesh_names: names must differ, 'wall' occurs twice"),
    ],
)
def test_requests_need_meshes_and_each_name_once(shared, names, reason):
    ends = [dict(zip(MESHES, positions(k), strict=True)) for k in (0, 1)]
    topologies = dict.fromkeys(MESHES, mesh_messages.topology_message(FACES, N * N))
    request = client.collision_free_step_request(*ends, topologies=topologies)
    request.mesh_names = names
    response = ask(shared.node, request)
    assert not response.success and response.message == reason


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    from node_process import NodeProcess

    node = NodeProcess(tmp_path_factory.mktemp("planes"), GIVEN)
    yield Thick(node)
    node.close()


def test_planes_are_drawn(start_node):
    node = start_node(GIVEN | {"markers": True, "markers_rate": 1000.0})
    heard = listen(node, MarkerArray, "markers", qos.MARKERS)
    stream = Thick(node)
    stream.send()
    assert "active: meshes cloth, net; planes floor, wall; tests" in node.output()
    node.wait_until(lambda: heard, "markers")
    planes = [marker for marker in heard[-1].markers if marker.ns == "planes"]
    assert [len(marker.points) for marker in planes] == [6, 6]
    assert all(abs(point.z) < 1e-9 for point in planes[0].points)
    assert all(abs(point.x - 0.25) < 1e-9 for point in planes[1].points)
