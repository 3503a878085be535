# SPDX-License-Identifier: Apache-2.0
"""The configurations for RViz and Foxglove: they parse, and all that they name is what a real node publishes."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from builtin_interfaces.msg import Time
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.detect.scene import PlaneSettings
from hpccd_ros.node import markers

CONFIG = Path(__file__).resolve().parents[2] / "config"
OF_ALL = {"stamp": Time(), "frame_id": ""}
NONE = np.empty((0, 3))
NAMESPACES = {
    marker.ns
    for marker in (
        *markers.contact_markers(NONE, NONE, NONE, 0, size=1.0, limit=1, **OF_ALL).markers,
        *markers.plane_markers([PlaneSettings("floor")], [NONE], **OF_ALL),
        markers.intersection_marker([], size=1.0, **OF_ALL),
        *markers.depth_markers([], size=1.0, count=1, **OF_ALL),
    )
}
CLASSES = {"PointCloud2": "sensor_msgs/msg/PointCloud2", "MarkerArray": "visualization_msgs/msg/MarkerArray"}


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """{topic: type} of a node as it runs by default but for its namespace, and its diagnostics' names."""
    from node_process import NodeProcess

    node = NodeProcess(tmp_path_factory.mktemp("viewers"), {"meshes": ["cloth"], "markers": True})
    try:
        node.peer.topology("cloth", sheet_faces(8), 64)
        for k in range(2):
            node.peer.vertices("cloth", sheet_positions(8, k), k, frame_id="world")
        message = node.contacts(1)[0]
        peer = node.peer.node

        def published():
            names = {
                topic.removeprefix(node.namespace): types[0]
                for topic, types in peer.get_topic_names_and_types()
                if any(info.node_name == "hpccd" for info in peer.get_publishers_info_by_topic(topic))
            }
            # Whose an endpoint is comes to be known a little later, of each at its own time.
            return names if {"/contacts", "/markers", "/surface", "/diagnostics"} <= names.keys() else None

        yield node.wait_until(published, "publishers of the node"), set(node.peer.statuses), message
    finally:
        node.close()


def test_rviz(published):
    topics, _, _ = published
    tree = yaml.safe_load((CONFIG / "hpccd.rviz").read_text())["Visualization Manager"]
    shown = [display for display in tree["Displays"] if "Topic" in display]
    assert {display["Class"].rpartition("/")[2] for display in shown} == set(CLASSES)
    for display in shown:
        kind = CLASSES[display["Class"].rpartition("/")[2]]
        assert topics[display["Topic"]["Value"]] == kind and display["Enabled"]
        assert display["Topic"]["Reliability Policy"] == "Reliable"
    (of_markers,) = (display for display in shown if "Namespaces" in display)
    assert of_markers["Namespaces"].keys() == NAMESPACES
    assert tree["Global Options"]["Fixed Frame"]


def test_foxglove(published):
    topics, statuses, message = published
    layout = json.loads((CONFIG / "foxglove_layout.json").read_text())
    panels = layout["configById"]

    def leaves(part):
        return [part] if isinstance(part, str) else leaves(part["first"]) + leaves(part["second"])

    assert sorted(leaves(layout["layout"])) == sorted(panels)
    view = panels["3D!contacts"]["topics"]
    assert set(view) <= set(topics) and view["/markers"]["namespaces"].keys() == NAMESPACES
    for name, panel in panels.items():
        if name.startswith("Plot!"):
            for path in panel["paths"]:
                topic, _, field = path["value"].partition(".")
                assert topic in topics and hasattr(message, field)
        if name.startswith("Diagnostic"):
            assert panel["topicToRender"] in topics
    assert panels["DiagnosticStatusPanel!detection"]["selectedName"].removeprefix("/hpccd: ") in statuses
