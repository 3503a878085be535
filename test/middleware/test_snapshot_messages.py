# SPDX-License-Identifier: Apache-2.0
"""Results about one snapshot, and the separation in force, as messages."""

import dataclasses
import math

import numpy as np
import pytest
from hpccd.msg import ContactArray, DistanceArray

import hpccd_core as hc
from hpccd_core.options import OUTPUTS
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.middleware import contact_messages, result_fields, snapshot_messages

LAYOUT = Layout(
    ("cloth", "ball", "floor"), np.array([0, 10, 14, 20]), np.array([0, 8, 12, 20]), topology_versions=(3, 0, 9)
)
UNUSED = ContactArray.NONE
NEAR = hc.Proximity(
    vf=np.array([[3, 9], [12, 0]], np.uint32),
    vf_distance=np.array([0.5, 0.25]),
    ee=np.array([[1, 2, 10, 13], [4, 5, 6, 7]], np.uint32),
    ee_distance=np.array([0.0, 0.75]),
    hash=2**64 - 5,
    outputs={
        "normals": np.arange(12.0).reshape(4, 3),
        "closest": np.arange(24.0).reshape(4, 2, 3),
        "vertices": np.array([[3, 10, 11, 13], [12, 7, 0, 9], [1, 2, 10, 13], [4, 5, 6, 7]], np.uint32),
        "weights": np.arange(16.0).reshape(4, 4),
    },
)
HITS = hc.Intersections(ef=np.array([[1, 2, 9], [10, 13, 0], [14, 19, 19]], np.uint32), hash=7)


def near(**options):
    message = ContactArray()
    given = {"max_contacts": 0, "outputs": OUTPUTS} | options
    snapshot_messages.fill_proximity(message, NEAR, LAYOUT, **given)
    return message


def test_near_pairs():
    message = near()
    assert (list(message.kind), list(message.distance)) == ([0, 0, 1, 1], [0.5, 0.25, 0.0, 0.75])
    assert list(message.features_a) == [3, UNUSED, 2, UNUSED, 1, 2, 4, 5]
    assert list(message.features_b) == [1, UNUSED, 0, UNUSED, 0, 3, 6, 7]
    assert (len(message.toc), message.first_toc) == (0, math.inf), "a snapshot has no times"
    assert (message.total, message.truncated, message.hash) == (4, False, 2**64 - 5)
    assert list(message.topology_versions) == [3, 0, 9]
    back = contact_messages.read_contacts(message, LAYOUT)
    for name in ("vf", "vf_distance", "ee", "ee_distance", *NEAR.outputs):
        assert np.array_equal(getattr(back, name), getattr(NEAR, name)), name
    assert list(message.vertices) == [3, 0, 1, 3, 2, 7, 0, 9, 1, 2, 0, 3, 4, 5, 6, 7], "within their meshes"
    assert len(message.points) == len(message.approach) == 0
    only = near(outputs=("closest",))
    assert len(only.closest) == 24 and len(only.normals) == len(only.vertices) == len(only.weights) == 0


@pytest.mark.parametrize("limit, kept", [(1, [2]), (2, [1, 2]), (3, [0, 1, 2])])
def test_the_nearest_are_kept(limit, kept):
    message = near(max_contacts=limit)
    assert list(message.distance) == np.array([0.5, 0.25, 0.0, 0.75])[kept].tolist()
    assert (message.total, message.truncated, message.hash) == (4, True, NEAR.hash)
    back = contact_messages.read_contacts(message, LAYOUT)
    for name, values in NEAR.outputs.items():
        assert np.array_equal(getattr(back, name), values[kept]), name
    assert len(back.ee) == 1


@pytest.mark.parametrize("limit", [0, 2, 3])
def test_edges_in_faces(limit):
    message = ContactArray()
    snapshot_messages.fill_intersections(message, HITS, LAYOUT, max_contacts=limit)
    sent = limit or 3
    assert set(message.kind) == {ContactArray.EDGE_FACE} and len(message.kind) == sent
    assert list(message.mesh_a) == [0, 1, 2][:sent] and list(message.mesh_b) == [1, 0, 2][:sent]
    assert list(message.features_a) == [1, 2, 0, 3, 0, 5][: 2 * sent]
    assert list(message.features_b) == [1, UNUSED, 0, UNUSED, 7, UNUSED][: 2 * sent]
    assert (message.total, message.truncated, message.hash) == (3, sent < 3, 7)
    assert np.array_equal(contact_messages.read_contacts(message, LAYOUT).ef, HITS.ef[:sent])


def test_smallest_distances():
    points = np.arange(6.0).reshape(2, 3)
    gaps = [
        hc.Gap("cloth", "cloth", 0.5, "edge-edge", (1, 2, 4, 5), points),
        hc.Gap("cloth", "ball", 0.25, "vertex-face", (12, 7), points + 1),  # the vertex is of the second mesh
        hc.Gap("cloth", "floor", 0.0, "edge-face", (14, 19, 3), points + 2),
        hc.Gap("ball", "floor", math.inf, "", (), np.empty((0, 3))),
    ]
    message = DistanceArray()
    snapshot_messages.fill_distances(message, gaps, LAYOUT)
    assert list(message.kind) == [
        DistanceArray.EDGE_EDGE,
        DistanceArray.VERTEX_FACE,
        DistanceArray.EDGE_FACE,
        DistanceArray.NO_PAIR,
    ]
    assert list(message.distance) == [0.5, 0.25, 0.0, math.inf]
    assert list(message.mesh_a) == [0, 1, 2, 1] and list(message.mesh_b) == [0, 0, 0, 2]
    assert list(message.features_a) == [1, 2, 2, UNUSED, 0, 5, UNUSED, UNUSED]
    assert list(message.features_b) == [4, 5, 7, UNUSED, 3, UNUSED, UNUSED, UNUSED]
    assert np.array_equal(np.frombuffer(message.points)[:18].reshape(3, 2, 3), [points, points + 1, points + 2])
    assert not np.any(np.frombuffer(message.points)[18:])
    assert np.frombuffer(message.direction).reshape(4, 3) == pytest.approx(
        np.array([[1, 1, 1], [1, 1, 1], [0, 0, 0], [0, 0, 0]]) / math.sqrt(3)
    )
    assert np.isnan(message.approach_speed).all() and len(message.approach_speed) == 4
    before = [dataclasses.replace(gap, distance=0.75) for gap in gaps]
    snapshot_messages.fill_distances(message, gaps, LAYOUT, before=before, seconds=0.25)
    assert list(message.approach_speed[:3]) == [1, 2, 3] and math.isnan(message.approach_speed[3])
    assert list(message.time_to_contact[:3]) == [0.5, 0.125, 0.0] and math.isnan(message.time_to_contact[3])
    snapshot_messages.fill_distances(
        message, gaps, LAYOUT, before=before, approached=np.array([1.0, -1.0, math.nan, math.nan]), seconds=0.25
    )
    assert list(message.time_to_contact[:3]) == [0.125, 0.125, 0.0], "the larger speed of both"
    assert message.nearest == 2 and list(message.inside) == [DistanceArray.INSIDE_NONE] * 4
    assert (message.mesh_names, list(message.topology_versions)) == (["cloth", "ball", "floor"], [3, 0, 9])


def test_inside_is_of_the_sides_of_the_message():
    """Which may be in the other order than those of the gap; inside is nearer than anything."""
    points = np.arange(6.0).reshape(2, 3)
    gaps = [
        hc.Gap("cloth", "ball", 0.25, "vertex-face", (1, 9), points),
        hc.Gap("cloth", "ball", 0.5, "vertex-face", (1, 9), points, inside="a"),
        hc.Gap("cloth", "ball", 0.5, "vertex-face", (12, 7), points, inside="a"),  # the vertex is of the second mesh
        hc.Gap("cloth", "ball", 0.5, "vertex-face", (12, 7), points, inside="b"),
        hc.Gap("cloth", "ball", 0.5, "vertex-face", (12, 7), points, inside="both"),
    ]
    message = DistanceArray()
    snapshot_messages.fill_distances(message, gaps, LAYOUT, before=gaps, seconds=1.0)
    names = ("INSIDE_NONE", "INSIDE_A", "INSIDE_B", "INSIDE_A", "INSIDE_BOTH")
    assert list(message.inside) == [getattr(DistanceArray, name) for name in names]
    assert list(message.mesh_a) == [0, 0, 1, 1, 1] and message.nearest == 1
    assert list(message.time_to_contact) == [math.inf, 0, 0, 0, 0]


def test_no_meshes_to_tell_of():
    message = DistanceArray()
    snapshot_messages.fill_distances(message, [], LAYOUT)
    assert len(message.distance) == len(message.points) == 0 and len(message.mesh_names) == 3


SEPARATION = Separation(1e-3, (("floor", "cloth", 0.5), ("ball", "ball", 0.0)))


@pytest.mark.parametrize("separation", [NONE, SEPARATION])
def test_separation_comes_back(separation):
    message = ContactArray(mesh_names=["cloth", "ball", "floor"])
    result_fields.fill_separation(message, separation)
    assert message.minimum_separation == separation.minimum
    assert result_fields.read_separation(message) == separation


@pytest.mark.parametrize(
    "changes, text",
    [
        ({"separations": [0.5]}, "have 2, 2 and 1 entries; they belong together"),
        ({"separation_mesh_a": [0, 3]}, "3 names a mesh beyond the 3"),
        ({"separations": [0.5, -1.0]}, "ball:ball: a separation must be finite and not negative, not -1.0"),
        ({"minimum_separation": math.nan}, "a separation must be finite and not negative, not nan"),
    ],
)
def test_separations_that_are_none(changes, text):
    message = ContactArray(mesh_names=["cloth", "ball", "floor"])
    result_fields.fill_separation(message, SEPARATION)
    for name, value in changes.items():
        setattr(message, name, value)
    with pytest.raises(ValueError, match=text):
        result_fields.read_separation(message)
