# SPDX-License-Identifier: Apache-2.0
"""Markers of intersection curves and depths, over DDS: where they are, and that none stays."""

import threading
import time

import numpy as np
import pytest
import rclpy
from node_calls import set_parameter
from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from hpccd_core import shapes
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology
from hpccd_ros.middleware import environment, fields, qos
from hpccd_ros.node.life_cycle import GuardedLifecycleNode
from hpccd_ros.node.viewer_publisher import ViewerPublisher
from hpccd_ros.params import values

BALL, FACES = shapes.icosphere(4)
BOX, BOX_FACES = shapes.box()
RADIUS = 0.25
APART, MEETS, INSIDE = (4.0, 0, 0), (0.4, 0.01, 0.02), (0.1, 0.01, 0.02)


class Shown:
    """A ball beside, in the surface of, or inside a box; the array of markers of each step."""

    def __init__(self, node):
        self.node, self.sent, self.arrays = node, 0, []
        node.peer.node.create_subscription(MarkerArray, "markers", self.arrays.append, qos.MARKERS)
        node.wait_until(lambda: node.peer.node.count_publishers("markers"), "publisher of markers")
        node.peer.topology("ball", FACES, len(BALL))
        node.peer.topology("box", BOX_FACES, len(BOX))
        node.peer.vertices("box", BOX, stamp=0, frame_id="world")
        node.frames_status(received__box=1)  # a ball without it would be dropped
        self.send(APART)

    def send(self, place):
        self.node.peer.vertices("ball", RADIUS * BALL + place, stamp=self.sent, step=self.sent, frame_id="world")
        if self.sent:
            self.node.contacts(self.sent)
        self.sent += 1

    def of(self, place):
        """(the marker of intersections, those of depth) of the next step with this place."""
        self.send(place)
        stamp = self.sent - 1
        array = self.node.wait_until(
            lambda: [a for a in self.arrays if fields.stamp_to_ns(a.markers[0].header.stamp) == stamp], "markers"
        )[-1]
        assert len({(marker.ns, marker.id) for marker in array.markers}) == len(array.markers)
        assert {marker.header.frame_id for marker in array.markers} == {"world"}
        assert {fields.stamp_to_ns(marker.header.stamp) for marker in array.markers} == {stamp}
        (curves,) = (marker for marker in array.markers if marker.ns == "intersections")
        return curves, [marker for marker in array.markers if marker.ns == "depth"]


def array_of(marker):
    return np.array([(p.x, p.y, p.z) for p in marker.points])


def is_deleted(marker):
    return marker.action == Marker.DELETE and not marker.points


@pytest.fixture
def node(start_node):
    def started(**parameters):
        common = {"meshes": ["ball", "box"], "markers": True, "markers_rate": 1000.0, "markers_size": 0.02}
        return start_node({**common, "mesh.box.static": True, **parameters})

    return started


def test_curves_and_depths_come_and_go(node):
    shown = Shown(node(markers_depth=True))
    curves, (arrow,) = shown.of(APART)
    assert is_deleted(curves) and is_deleted(arrow)

    curves, (arrow,) = shown.of(MEETS)
    assert (curves.type, curves.action) == (Marker.LINE_LIST, Marker.ADD)
    points = array_of(curves)
    assert len(points) >= 20 and np.abs(points[:, 0] - 0.5).max() < 1e-9, "in the side of the box"
    ends = points.reshape(-1, 2, 3)
    assert np.array_equal(ends[1:, 0], ends[:-1, 1]) and np.array_equal(ends[-1, 1], ends[0, 0]), "one closed curve"
    assert np.linalg.norm(points[:, 1:] - MEETS[1:], axis=1).max() < RADIUS
    assert (arrow.type, arrow.action) == (Marker.ARROW, Marker.ADD)
    start, end = array_of(arrow)
    assert end[0] == pytest.approx(0.5) and start[0] == pytest.approx(0.4 - RADIUS), "from the deepest vertex"
    assert np.allclose(end - start, [0.1 + RADIUS, 0, 0], atol=1e-6)
    assert 0 < arrow.scale.x < arrow.scale.y == 0.02 and 0 < arrow.scale.z <= 0.5 * (end - start)[0]

    curves, (arrow,) = shown.of(INSIDE)
    assert is_deleted(curves), "a ball inside a box meets no surface"
    start, end = array_of(arrow)
    assert np.allclose(end - start, [0.4 + RADIUS, 0, 0], atol=1e-6)

    curves, (arrow,) = shown.of(APART)
    assert is_deleted(curves) and is_deleted(arrow)


def test_the_mesh_that_is_not_static_is_moved(node):
    shown = Shown(node(meshes=["box", "ball"], markers_depth=True))
    _, (arrow,) = shown.of(MEETS)
    start, end = array_of(arrow)
    assert (end - start)[0] == pytest.approx(0.1 + RADIUS)


def test_they_are_chosen_while_the_node_runs(node):
    shown = Shown(node())
    curves, (arrow,) = shown.of(MEETS)
    assert curves.points and is_deleted(arrow), "depths only where they are asked for"
    assert set_parameter(shown.node, "markers_depth", True).successful
    assert set_parameter(shown.node, "markers_intersections", False).successful
    curves, (arrow,) = shown.of(MEETS)
    assert is_deleted(curves) and arrow.points
    assert set_parameter(shown.node, "markers_depth", False).successful
    curves, (arrow,) = shown.of(MEETS)
    assert is_deleted(curves) and is_deleted(arrow)


def test_no_more_points_than_asked_for(node):
    shown = Shown(node(markers_max=10))
    curves, _ = shown.of(MEETS)
    points = array_of(curves)
    assert 10 < len(points) <= 2 * 9, "two of each segment"
    assert np.array_equal(points[0], points[-1])


def test_arrows_of_a_pair_that_is_free_again_are_deleted(start_node):
    balls = [f"ball{k}" for k in range(3)]
    node = start_node({"meshes": balls, "markers": True, "markers_depth": True, "markers_rate": 1000.0})
    arrays = []
    node.peer.node.create_subscription(MarkerArray, "markers", arrays.append, qos.MARKERS)
    node.wait_until(lambda: node.peer.node.count_publishers("markers"), "publisher of markers")
    for name in balls:
        node.peer.topology(name, FACES, len(BALL))
    seen = []
    for stamp, distance in enumerate((9.0, 1.5, 9.0)):
        for k, name in enumerate(balls):
            node.peer.vertices(name, BALL + np.array([distance * k, 0.01 * k, 0]), stamp, step=stamp)
        if stamp:
            node.contacts(stamp)
            (found,) = node.wait_until(
                lambda stamp=stamp: [
                    a for a in arrays if fields.stamp_to_ns(a.markers[0].header.stamp) == stamp and len(a.markers) > 5
                ],
                "markers",
            )
            seen.append({m.id: m.action for m in found.markers if m.ns == "depth"})
    assert seen == [{0: Marker.ADD, 1: Marker.ADD}, {0: Marker.DELETE, 1: Marker.DELETE}]


def running():
    return [thread for thread in threading.enumerate() if thread.name == "viewers"]


def test_without_subscribers_nothing_is_computed():
    """The thread begins with the first subscriber. When the node ends, a computation under way is cancelled."""
    environment.prepare()
    context = rclpy.Context()
    rclpy.init(context=context)
    node = GuardedLifecycleNode("shows", context=context)
    settings, _ = values.checked({"markers": True, "markers_depth": True, "markers_rate": 1000.0})
    viewers = ViewerPublisher(node, settings)
    # Deep inside each other, of many triangles: that takes seconds.
    vertices, faces = shapes.icosphere(80)
    topology = Topology(0, len(vertices), faces)
    frames = [
        SceneFrame(k, k, "world", (topology,) * 2, (vertices, vertices + [0.1, 0.02, k]), tuple("ab"), 0.0)
        for k in (0, 3)
    ]
    builder = SceneBuilder(tuple(MeshSettings(name, self_collision=False) for name in "ab"))
    found = StepDetector(builder, Options(outputs=("points", "normals"))).detect(*frames[::-1])
    viewers.show(found, Header(), builder)
    assert not running()

    arrays = []
    node.create_subscription(MarkerArray, "markers", arrays.append, qos.MARKERS)
    while not node.count_subscribers("markers") or not running():
        viewers.show(found, Header(), builder)
        time.sleep(0.01)
    time.sleep(0.1)
    began = time.monotonic()
    node.unconfigure()
    assert time.monotonic() - began < 2.0
    assert not running()
    node.destroy_node()
    rclpy.try_shutdown(context=context)
