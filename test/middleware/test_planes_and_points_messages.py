# SPDX-License-Identifier: Apache-2.0
"""Contacts and distances of planes, and thickness, as messages and back."""

import dataclasses

import numpy as np
import pytest
from hpccd.msg import ContactArray, DistanceArray

import hpccd_core as hc
from hpccd_core.options import OUTPUTS
from hpccd_ros import client
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import contact_messages, result_fields, snapshot_messages

VERTICES, FACES = hc.shapes.grid(4, 4)
BALL, BALL_FACES = hc.shapes.icosphere(1)
NAMES, PLANES = ("ball", "cloth"), ("floor", "wall")
TOPOLOGIES = (Topology(4, len(BALL), BALL_FACES), Topology(2, len(VERTICES), FACES))
LAYOUT = Layout.of(NAMES, TOPOLOGIES, PLANES)
START = np.vstack([0.3 * BALL + [0, 0, 0.8], VERTICES + [0, 0, 0.3]])
END = START - np.repeat([[0, 0, 1.0], [0, 0, 0.4]], [len(BALL), len(VERTICES)], axis=0)
NONE = ContactArray.NONE


@pytest.fixture(scope="module")
def detector():
    scene = hc.Scene()
    scene.add_mesh("ball", BALL_FACES)
    scene.add_mesh("cloth", FACES)
    scene.add_plane("floor")
    scene.add_plane("wall", (1, 0, 0), -0.9)
    return hc.Detector(scene, backend="cpu", outputs=OUTPUTS, minimum_separation=0.01)


def message_of(contacts, **options):
    message = ContactArray()
    contact_messages.fill_contacts(message, contacts, LAYOUT, **options)
    return message


def test_there_and_back(detector):
    contacts = detector.detect(START, END)
    assert len(contacts.vf) and len(contacts.ee) and set(contacts.vp[:, 1]) == {0, 1}
    message = message_of(contacts)
    assert list(message.mesh_names) == [*NAMES, *PLANES] and list(message.topology_versions) == [4, 2, 0, 0]
    assert contact_messages.beyond_meshes(message, LAYOUT) is None
    back = contact_messages.read_contacts(message, LAYOUT)
    for name in ("vf", "vf_toc", "ee", "ee_toc", "vp", "vp_toc", "vv", "vv_toc", "ve", "ve_toc", *contacts.outputs):
        assert np.array_equal(getattr(back, name), getattr(contacts, name)), name
    arrays = client.contacts_from_message(message)
    assert (arrays.n_vertex_face, arrays.n_edge_edge, arrays.n_vertex_plane) == tuple(
        len(getattr(contacts, kind)) for kind in ("vf", "ee", "vp")
    )
    of_planes = slice(len(contacts.vf) + len(contacts.ee), None)
    assert np.array_equal(arrays.mesh_b[of_planes], 2 + contacts.vp[:, 1])
    assert (arrays.features_b[of_planes] == NONE).all() and (arrays.features_a[of_planes, 1] == NONE).all()
    assert np.array_equal(client.scene_contacts(message, LAYOUT).vp, contacts.vp)


@pytest.mark.parametrize("limit", [1, 7, 30])
def test_the_earliest_are_kept(detector, limit):
    contacts = detector.detect(START, END)
    toc = contact_messages.times_of(contacts)
    keep = contact_messages.lowest(toc, limit)
    back = contact_messages.read_contacts(message_of(contacts, max_contacts=limit), LAYOUT)
    assert np.array_equal(np.concatenate([back.vf_toc, back.ee_toc, back.vp_toc]), toc[keep])
    assert np.array_equal(back.points, contacts.points[keep])


def test_proximity(detector):
    near = detector.proximity(END, 0.2)
    message = ContactArray()
    snapshot_messages.fill_proximity(message, near, LAYOUT, max_contacts=0, outputs=OUTPUTS)
    back = contact_messages.read_contacts(message, LAYOUT)
    assert len(near.vp) and near.vp_distance.min() < 0
    for name in ("vf", "vf_distance", "ee", "ee_distance", "vp", "vp_distance"):
        assert np.array_equal(getattr(back, name), getattr(near, name)), name


def test_distances(detector):
    gaps = detector.distances(END)
    message = DistanceArray()
    snapshot_messages.fill_distances(message, gaps, LAYOUT)
    found = client.distances_from_message(message)
    for row, gap in enumerate(gaps):
        if gap.kind != "vertex-plane":
            continue
        assert found.kind[row] == DistanceArray.VERTEX_PLANE and found.distance[row] == gap.distance
        assert found.mesh_names[found.mesh_b[row]] == gap.mesh_b and found.mesh_names[found.mesh_a[row]] == gap.mesh_a
        assert (found.features_b[row] == NONE).all()
        assert found.between(gap.mesh_a, gap.mesh_b) == gap.distance
    assert sum(gap.kind == "vertex-plane" for gap in gaps) == 4 and min(gap.distance for gap in gaps) < 0


@pytest.mark.parametrize(
    "name, row, value, text",
    [
        ("mesh_b", 0, 1, "features_b of contact"),  # a mesh, not a plane
        ("mesh_b", 0, 9, "mesh_b names mesh 9 of 4"),
        ("features_b", 0, 0, "features_b of contact"),
        ("features_a", 1, 0, "features_a of contact"),
        ("features_a", 0, 99, "features_a of contact"),
    ],
)
def test_what_does_not_exist_is_noticed(detector, name, row, value, text):
    contacts = detector.detect(START, END)
    message = message_of(contacts)
    first = len(contacts.vf) + len(contacts.ee)
    getattr(message, name)[(2 * first if name.startswith("features") else first) + row] = value
    assert text in contact_messages.beyond_meshes(message, LAYOUT)


def test_thickness_and_shapes_at_rest():
    message = ContactArray(mesh_names=[*NAMES, *PLANES])
    assert result_fields.read_thickness(message) == result_fields.read_rest(message) == ()
    result_fields.fill_thickness(message, (("cloth", 0.5), ("ball", 0.0)))
    result_fields.fill_rest(message, (-1, 7))
    assert list(message.thickness) == [0.0, 0.5, 0.0, 0.0] and list(message.rest_stamps) == [-1, 7, -1, -1]
    assert result_fields.read_thickness(message) == (("cloth", 0.5),) and result_fields.read_rest(message) == (
        -1,
        7,
        -1,
        -1,
    )
    for values, text in (([0.5], "thickness: 1 entry for 4 meshes"), ([0, -1.0, 0, 0], r"must lie in \[0, 1e\+300\]")):
        message.thickness = values
        with pytest.raises(ValueError, match=text):
            result_fields.read_thickness(message)
    message.rest_stamps = [1]
    with pytest.raises(ValueError, match="rest_stamps: 1 entry for 4 meshes"):
        result_fields.read_rest(message)


def test_a_layout_that_lacks_the_planes_is_rejected(detector):
    message = message_of(detector.detect(START, END))
    with pytest.raises(ValueError, match="layout: it is of the meshes ball, cloth"):
        client.scene_contacts(message, Layout.of(NAMES, TOPOLOGIES))
    with pytest.raises(ValueError, match="topologies: 1 of 2 meshes"):
        Layout.of(NAMES, TOPOLOGIES[:1], PLANES)
    assert dataclasses.asdict(Layout.of((*NAMES, *PLANES), TOPOLOGIES, PLANES))["mesh_names"] == LAYOUT.mesh_names
