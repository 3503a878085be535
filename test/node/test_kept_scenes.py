# SPDX-License-Identifier: Apache-2.0
"""~/detect keeps parts of a request for the next one: the scene and its detector, unless the request was given up."""

import numpy as np
import pytest
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros import client
from hpccd_ros.detect.core import Cancellation, Options
from hpccd_ros.detect.kept_detectors import KeptDetectors
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import MeshSettings, Topology
from hpccd_ros.node.detect_request import NodeScene, compute

N = 10
FACES = sheet_faces(N)
TOPOLOGY = client.topology_message(FACES, N * N)
BUILDER, TOPOLOGIES, OPTIONS = SceneBuilder((MeshSettings("cloth"),)), (Topology(0, N * N, FACES),), Options()
LIMITS = {"max_meshes": 4, "max_vertices": 1000, "max_faces": 1000, "max_edges": 1000, "max_contacts": 0}


def request(step, query="collision_free_step"):
    start, end = ({"cloth": sheet_positions(N, k)} for k in (step, step + 1))
    out = client.collision_free_step_request(start, end, topologies={"cloth": TOPOLOGY})
    out.query = query
    return out


def response(kept, asked, cancellation=None):
    return compute(asked, NodeScene(BUILDER, {}), OPTIONS, LIMITS, kept, cancellation or Cancellation())


def detector_in(kept):
    used = kept.take(BUILDER, TOPOLOGIES, OPTIONS)
    if used is not None:
        kept.keep(used)
    return used


def test_requests_of_any_kind_share_a_detector_and_response_as_a_new_one():
    kept = KeptDetectors(2)
    response(kept, request(0))
    first = detector_in(kept)
    assert first is not None
    for step in range(4):
        positions = [sheet_positions(N, k) for k in (step, step + 1)]
        new = hc.Detector(scene_of(cloth=FACES))
        assert response(kept, request(step)).collision_free_step == new.collision_free_step(*positions)
        assert response(kept, request(step, "contacts")).contacts.hash == new.detect(*positions).hash
        distances = response(kept, request(step, "distances")).distances.distance
        assert np.array_equal(distances, [gap.distance for gap in new.distances(positions[1])])
        assert detector_in(kept) is first


def test_a_request_that_was_given_up_leaves_nothing():
    kept, given_up = KeptDetectors(2), Cancellation()
    given_up.cancel()
    with pytest.raises(hc.Cancelled):
        response(kept, request(0), given_up)
    assert detector_in(kept) is None
    response(kept, request(0))
    assert detector_in(kept) is not None


def test_a_request_given_up_after_its_response_spoils_nothing():
    kept, late = KeptDetectors(2), Cancellation()
    expected = response(kept, request(0), late).collision_free_step
    late.cancel()
    assert response(kept, request(0)).collision_free_step == expected


def test_a_rejected_request_leaves_what_others_left():
    kept = KeptDetectors(2)
    response(kept, request(0))
    first = detector_in(kept)
    wrong = request(0)
    wrong.end[0].vertices_f32 = wrong.end[0].vertices_f32[:-3]
    with pytest.raises(ValueError, match="end"):
        response(kept, wrong)
    assert detector_in(kept) is first
