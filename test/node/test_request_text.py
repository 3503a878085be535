# SPDX-License-Identifier: Apache-2.0
"""Texts about requests to ~/detect, which go into responses and logs. No DDS."""

import pytest
from detect_requests import changed

from hpccd_ros.detect.core import Cancellation, Options
from hpccd_ros.detect.kept_detectors import KeptDetectors
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import MeshSettings
from hpccd_ros.node import detect_request
from hpccd_ros.node.detect_query import RequestError

LIMITS = {"max_meshes": 9, "max_vertices": 999, "max_faces": 999, "max_edges": 999, "max_contacts": 9}
NAME = "cloth\n[FATAL] \x1b[31m"


def other_version(request):
    request.end[0].topology_version = 4


def no_end(request):
    request.end = []


def bad_topology(request):
    request.topologies[0].n_vertices = 1


@pytest.mark.parametrize("change", [other_version, no_end, bad_topology])
def test_names_cannot_forge_lines_of_a_log(change):
    scene = detect_request.NodeScene(SceneBuilder((MeshSettings("cloth"),)), {"cloth": None})
    request = changed(change, names=(NAME,))
    with pytest.raises(RequestError, match=r"cloth\\n\[FATAL\] \\x1b\[31m") as caught:
        detect_request.compute(request, scene, Options(backend="cpu"), LIMITS, KeptDetectors(0), Cancellation())
    assert str(caught.value).isprintable()
