# SPDX-License-Identifier: Apache-2.0
"""A node with a mesh of points, streamed as point clouds, beside capsules and a sheet: detected as by the core, drawn,
requested, recorded and computed again from the file."""

import numpy as np
from cloth_and_net_stream import listen
from clouds import F64, cloud
from hpccd.msg import ContactArray, DistanceArray
from node_calls import set_parameter
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros import client
from hpccd_ros.bag.reader import Recording
from hpccd_ros.middleware import qos
from hpccd_ros.middleware.fields import ns_to_stamp
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

N, GRAINS = 8, 40
FACES = sheet_faces(N)
ROD = np.array([[0, 1], [1, 2]], np.uint32)  # and a point beside it
MESHES = ("grains", "rod", "cloth")
GIVEN = {
    "meshes": list(MESHES),
    "points": ["grains", "rod"],
    "thickness": ["grains:0.03", "rod:0.02"],
    "mesh.grains.input": "points",
    "distances": True,
}


def positions(k):
    rng = np.random.default_rng(4)
    grains = rng.uniform(0, 0.34, (GRAINS, 3)) + 0.02 * np.sin(rng.uniform(0, 9, (GRAINS, 3)) + k)
    rod = np.array([[0.1, 0.1, 0.1], [0.2, 0.3, 0.15], [0.3, 0.8, 0.1], [0.1, 0.2, 0.12]]) + (0, 0, 0.03 * k)
    return grains, rod, sheet_positions(N, k).astype(float)


def frame(k):
    return np.concatenate(positions(k))


def result(k, grains=0.03, outputs=()):
    """Of the core, for the step to frame k."""
    scene = hc.Scene()
    scene.add_points("grains", GRAINS, thickness=grains)
    scene.add_points("rod", 4, edges=ROD, thickness=0.02)
    scene.add_mesh("cloth", FACES)
    detector = hc.Detector(scene, outputs=outputs)
    return detector.detect(frame(k - 1), frame(k)), detector.distances(frame(k))


class Stream:
    """Frames of all meshes, each processed before the next is sent."""

    def __init__(self, node):
        self.node, self.sent = node, 0
        node.peer.topology("rod", (), 4, edges=ROD)
        node.peer.topology("cloth", FACES, N * N)
        self.send()

    def send(self):
        grains, *others = positions(self.sent)
        message = cloud(grains, kinds=[F64] * 3)
        message.header.stamp, message.header.frame_id = ns_to_stamp(self.sent), "world"
        self.node.peer.publisher(PointCloud2, "meshes/grains/points").publish(message)
        for name, part in zip(MESHES[1:], others, strict=True):
            self.node.peer.vertices(name, part, stamp=self.sent, frame_id="world")
        self.sent += 1
        self.node.frames_status(processed=3 * self.sent)
        return self.node.contacts(self.sent - 1)[-1] if self.sent > 1 else None

    def expect(self, **options):
        message = self.send()
        contacts, _ = result(self.sent - 1, **options)
        found = client.contacts_from_message(message)
        assert message.total == len(contacts) and message.hash == contacts.hash
        assert found.n_vertex_vertex == len(contacts.vv) > 0 and found.n_vertex_edge == len(contacts.ve) > 0
        assert found.n_vertex_face == len(contacts.vf) > 0 and found.n_edge_edge == len(contacts.ee)
        return found, contacts


def test_streamed_changed_recorded_and_verified(start_node, tmp_path, hpccd):
    path = tmp_path / "run.mcap"
    node = start_node(GIVEN | {"outputs": ["points", "normals", "weights"], "record": str(path)})
    heard = listen(node, DistanceArray, client.DISTANCES_TOPIC, client.DISTANCES_QOS)
    stream = Stream(node)
    found, contacts = stream.expect(outputs=("points", "normals", "weights"))
    assert (found.points == contacts.points).all() and (found.normals == contacts.normals).all()
    a, b = found.features_a[-len(contacts.ve) :, 0], found.features_b[-len(contacts.ve) :]
    offsets = np.array([0, GRAINS])
    ve = np.column_stack([a + offsets[found.mesh_a[-len(a) :]], b + offsets[found.mesh_b[-len(a) :]][:, None]])
    assert ve.tolist() == contacts.ve.tolist()
    assert set_parameter(node, "thickness", ["grains:0.05", "rod:0.02"]).successful
    stream.expect(grains=0.05)
    assert not set_parameter(node, "points", ["rod"]).successful  # while configured
    node.wait_until(lambda: len(heard) == 2, "distances of two steps")
    for k, thickness in ((1, 0.03), (2, 0.05)):
        _, gaps = result(k, grains=thickness)
        told = client.distances_from_message(heard[k - 1])
        assert told.distance.tolist() == [gap.distance for gap in gaps]
        assert {DistanceArray.VERTEX_VERTEX, DistanceArray.VERTEX_FACE} <= set(told.kind.tolist())
    assert node.stop() == 0
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        assert [mesh.points for mesh in setup.builder.meshes] == [True, True, False]
        replay = Replay(recording, setup)
        steps = list(replay.steps())
    assert (replay.verified, replay.diverged, replay.unverified) == (2, 0, 0), replay.first_divergence
    assert [dict(step.thickness)["grains"] for step in steps] == [0.03, 0.05]
    assert (replay.distances.verified, replay.distances.diverged) == (2, 0), replay.distances.first
    done = hpccd("replay", path, "--csv", tmp_path / "steps.csv")
    assert done.returncode == 0 and "VERIFIED: 2 results are equal in every contact, time and hash" in done.stdout
    picture = hpccd("view", path, "-o", tmp_path / "step.png")
    assert picture.returncode == 0 and (tmp_path / "step.png").stat().st_size > 10_000, picture.stderr
    page = hpccd("view", path, "--html", tmp_path / "run.html")
    assert page.returncode == 0 and '"grains"' in (tmp_path / "run.html").read_text(), page.stderr


def test_requests_and_triangles(start_node):
    node = start_node(GIVEN)
    stream = Stream(node)
    stream.expect()
    service = node.peer.client()

    def ask(topologies):
        ends = [dict(zip(MESHES, positions(k), strict=True)) for k in (0, 1)]
        request = client.collision_free_step_request(*ends, topologies=topologies)
        request.query, request.mesh_names = "contacts", [] if topologies is None else list(MESHES)
        future = service.call_async(request)
        return node.wait_until(lambda: future.result() if future.done() else None, "response")

    topologies = {
        "grains": client.topology_message((), GRAINS),
        "rod": client.topology_message((), 4, edges=ROD),
        "cloth": client.topology_message(FACES, N * N),
    }
    response = ask(topologies)
    assert response.success, response.message
    assert response.contacts.hash == result(1)[0].hash
    assert list(response.contacts.kind).count(ContactArray.VERTEX_VERTEX) == len(result(1)[0].vv)
    topologies["grains"] = client.topology_message([[0, 1, 2]], GRAINS)
    response = ask(topologies)
    assert not response.success and "take grains out of parameter points" in response.message
    node.peer.topology("rod", [[0, 1, 2]], 4, version=1)
    node.frames_status(**{"topologies_rejected.rod.bad_topology": 1})
    node.peer.topology("grains", (), GRAINS)
    node.frames_status(**{"topologies_rejected.grains.topology_conflict": 1})


def test_points_alone_are_drawn(start_node, tmp_path, hpccd):
    """Nothing in the scene has a triangle."""
    path = tmp_path / "run.mcap"
    given = {"meshes": ["grains"], "points": ["grains"], "mesh.grains.input": "points", "thickness": ["grains:0.05"]}
    node = start_node(given | {"markers": True, "markers_rate": 1e3, "record": str(path)})
    heard = listen(node, MarkerArray, "markers", qos.MARKERS)
    for k in range(3):
        message = cloud(positions(k)[0])
        message.header.stamp, message.header.frame_id = ns_to_stamp(k), "world"
        node.peer.publisher(PointCloud2, "meshes/grains/points").publish(message)
        node.frames_status(processed=k + 1)
    node.wait_until(lambda: len(node.contacts(2)) == 2 and heard, "results and markers")
    assert node.contacts(2)[0].total > 0
    assert node.stop() == 0
    done = hpccd("replay", path)
    assert done.returncode == 0 and "VERIFIED: 2 results" in done.stdout
    picture = hpccd("view", path, "-o", tmp_path / "step.png")
    assert picture.returncode == 0, picture.stderr
    page = hpccd("view", path, "--html", tmp_path / "run.html")
    assert page.returncode == 0, page.stderr
