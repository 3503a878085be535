# SPDX-License-Identifier: Apache-2.0
"""Messages <-> numpy: views where possible, each kind of bad message rejected with its reason."""

import math
from array import array
from types import SimpleNamespace

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from clouds import F32, F64, cloud
from hpccd.msg import ContactArray, MeshTopology, MeshVertices
from hypothesis import given, settings
from hypothesis import strategies as st
from sensor_msgs.msg import PointCloud2, PointField

import hpccd_core as hc
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros.detect.layout import Layout
from hpccd_ros.frames.drops import Reason
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import contact_messages, fields, mesh_messages
from hpccd_ros.middleware.fields import InvalidMessageError

LIMITS = {"max_vertices": 100, "max_faces": 100, "max_edges": 100}
POINTS = np.arange(12, dtype=np.float32).reshape(4, 3) * 0.5


def rejected(reason, read, *args):
    with pytest.raises(InvalidMessageError) as caught:
        read(*args)
    assert caught.value.reason == reason
    return str(caught.value)


def test_stamps():
    latest = (2**31 - 1) * 10**9 + 999_999_999
    for ns in (0, 1, 999_999_999, 1_000_000_000, 1_700_000_000_123_456_789, latest):
        assert fields.stamp_to_ns(fields.ns_to_stamp(ns)) == ns


BAD_STAMPS = [Time(nanosec=10**9), Time(sec=2**31 - 1, nanosec=2**32 - 1), Time(sec=-1), Time(sec=-(2**31), nanosec=5)]


@pytest.mark.parametrize("stamp", BAD_STAMPS, ids=["nanosec", "last second", "negative", "most negative"])
def test_stamps_that_are_no_time(stamp):
    assert str(stamp.sec) in rejected(Reason.MALFORMED, fields.stamp_to_ns, stamp)
    topology = mesh_messages.topology_message(np.array([[0, 1, 2]]), 3)
    topology.header.stamp = stamp
    rejected(Reason.MALFORMED, mesh_messages.topology_from_message, topology, LIMITS)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.uint32, np.uint8])
def test_array_fields(dtype):
    values = np.arange(24).astype(dtype).reshape(4, 6)
    field = fields.to_field(values[:, ::2])
    assert np.array_equal(np.frombuffer(field, dtype), values[:, ::2].ravel())
    assert len(fields.to_field(values[:0])) == 0


def test_topology_is_a_view():
    faces = np.array([[0, 1, 2], [2, 1, 3]])
    edges = np.array([[3, 4], [4, 0]])
    message = mesh_messages.topology_message(faces, 5, edges=edges, version=7)
    topology = mesh_messages.topology_from_message(message, LIMITS)
    assert (topology.version, topology.n_vertices) == (7, 5)
    assert topology.faces.dtype == np.uint32 and np.array_equal(topology.faces, faces)
    assert np.shares_memory(topology.faces, np.frombuffer(message.faces, np.uint32))
    assert topology.edges.dtype == np.uint32 and np.array_equal(topology.edges, edges)
    assert np.shares_memory(topology.edges, np.frombuffer(message.edges, np.uint32))


def test_bad_topologies():
    read, limits = mesh_messages.topology_from_message, {**LIMITS, "max_faces": 2, "max_edges": 3}

    def message(faces, n, edges=()):
        return MeshTopology(n_vertices=n, faces=array("I", faces), edges=array("I", edges))

    assert "face 1 names vertex 3" in rejected(Reason.INDEX_RANGE, read, message([0, 1, 2, 0, 2, 3], 3), LIMITS)
    assert "edge 1 names vertex 4" in rejected(Reason.INDEX_RANGE, read, message([], 4, [0, 1, 4, 3]), LIMITS)
    rejected(Reason.MALFORMED, read, message([0, 1], 3), LIMITS)
    assert "edges has 3 indices" in rejected(Reason.MALFORMED, read, message([0, 1, 2], 3, [0, 1, 2]), LIMITS)
    rejected(Reason.TOO_LARGE, read, message([0, 1, 2] * 3, 3), limits)
    assert "max_edges" in rejected(Reason.TOO_LARGE, read, message([0, 1, 2] * 2, 3, [0, 1] * 4), limits)
    rejected(Reason.TOO_LARGE, read, message([0, 1, 2], 101), limits)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_vertices_are_a_view(dtype):
    points = POINTS.astype(dtype)
    message = mesh_messages.vertices_message(points, 5, step=3)
    vertices = mesh_messages.vertices_from_message(message, 100)
    assert vertices.dtype == dtype and np.array_equal(vertices, points)
    field = message.vertices_f32 if dtype == np.float32 else message.vertices_f64
    assert np.shares_memory(vertices, np.frombuffer(field, dtype))


def test_vertices_of_another_type_are_not_sent():
    with pytest.raises(TypeError, match="use float32 or float64"):
        mesh_messages.vertices_message(np.zeros((3, 3), np.int32), 0)


def test_bad_vertices():
    read = mesh_messages.vertices_from_message
    rejected(Reason.MALFORMED, read, MeshVertices(), 100)
    both = MeshVertices(vertices_f32=array("f", [0] * 3), vertices_f64=array("d", [0] * 3))
    rejected(Reason.MALFORMED, read, both, 100)
    rejected(Reason.MALFORMED, read, MeshVertices(vertices_f32=array("f", [0] * 4)), 100)
    rejected(Reason.TOO_LARGE, read, mesh_messages.vertices_message(POINTS, 0), 3)
    for bad in (math.nan, math.inf, -math.inf):
        for dtype in (np.float32, np.float64):
            points = POINTS.astype(dtype)
            points[2, 1] = bad
            assert "vertex 2" in rejected(Reason.NOT_FINITE, read, mesh_messages.vertices_message(points, 0), 100)


@pytest.mark.parametrize("largest", [np.full((4, 3), np.finfo("f4").max), np.full((4, 3), 1e150)], ids=["f4", "f8"])
def test_largest_coordinates_that_the_core_takes(largest):
    for points in (largest, -largest):
        assert np.array_equal(mesh_messages.vertices_from_message(mesh_messages.vertices_message(points, 0), 9), points)


def test_coordinates_beyond_what_the_core_takes():
    for bad in (1e151, -1e200, np.finfo(np.float64).max):
        points = POINTS.astype(np.float64)
        points[2, 1] = bad
        message = mesh_messages.vertices_message(points, 0)
        text = rejected(Reason.OUT_OF_RANGE, mesh_messages.vertices_from_message, message, 100)
        assert "vertex 2" in text and "1e+150" in text
        rejected(Reason.OUT_OF_RANGE, mesh_messages.vertices_from_cloud, cloud(points, kinds=[F64] * 3), 100)
        points[3, 0] = math.nan
        assert "vertex 3" in rejected(
            Reason.NOT_FINITE, mesh_messages.vertices_from_message, mesh_messages.vertices_message(points, 0), 100
        )


@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"kinds": [F64] * 3},
        {"offsets": [0, 4, 8], "step": 16},
        {"names": "zxy"},
        {"offsets": [8, 4, 0]},
        {"offsets": [1, 6, 11], "step": 17},
        {"kinds": [F32, F64, F32]},
        {"height": 2},
        {"height": 2, "row_pad": 5},
        {"row_pad": 7},
        {"kinds": [F64] * 3, "offsets": [16, 0, 8], "step": 32, "height": 2, "row_pad": 8},
    ],
    ids=str,
)
def test_cloud_layouts(layout):
    names = layout.get("names", "xyz")
    points = POINTS[:, ["xyz".index(n) for n in names]]
    message = cloud(points, **layout)
    got = mesh_messages.vertices_from_cloud(message, 100)
    assert np.array_equal(got, POINTS)
    assert got.flags.c_contiguous and got.flags.aligned
    assert got.dtype == (np.float64 if F64 in layout.get("kinds", []) else np.float32)


def test_dense_cloud_is_a_view():
    message = cloud(POINTS)
    assert np.shares_memory(mesh_messages.vertices_from_cloud(message, 100), np.frombuffer(message.data, np.uint8))


def test_cloud_of_one_row_may_leave_row_step_empty():
    message = cloud(POINTS)
    message.row_step = 0
    assert np.array_equal(mesh_messages.vertices_from_cloud(message, 100), POINTS)


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_any_cloud_layout(data):
    kinds = data.draw(st.lists(st.sampled_from([F32, F64]), min_size=3, max_size=3))
    sizes = [4 if k == F32 else 8 for k in kinds]
    order = data.draw(st.permutations(range(3)))
    gaps = data.draw(st.lists(st.integers(0, 5), min_size=4, max_size=4))
    offsets, at = [0, 0, 0], 0
    for axis, gap in zip(order, gaps, strict=False):
        at += gap
        offsets[axis] = at
        at += sizes[axis]
    message = cloud(
        POINTS,
        kinds=kinds,
        offsets=offsets,
        step=at + gaps[3],
        height=data.draw(st.sampled_from([1, 2, 4])),
        row_pad=data.draw(st.integers(0, 9)),
    )
    assert np.array_equal(mesh_messages.vertices_from_cloud(message, 100), POINTS)


def test_bad_clouds():
    read = mesh_messages.vertices_from_cloud
    assert "swap the bytes" in rejected(Reason.BIG_ENDIAN, read, cloud(POINTS, big=True), 100)
    assert "'z'" in rejected(Reason.MALFORMED, read, cloud(POINTS, names="xyw"), 100)
    assert r"has x, y, w\n\x07" in rejected(Reason.MALFORMED, read, cloud(POINTS, names=["x", "y", "w\n\x07"]), 100)
    integers = cloud(POINTS, kinds=[F32, PointField.INT32, F32])
    assert "'y'" in rejected(Reason.UNSUPPORTED_TYPE, read, integers, 100)
    several = cloud(POINTS)
    several.fields[0].count = 3
    rejected(Reason.UNSUPPORTED_TYPE, read, several, 100)
    outside = cloud(POINTS)
    outside.fields[2].offset = 9
    assert "point_step is 12" in rejected(Reason.MALFORMED, read, outside, 100)
    short = cloud(POINTS)
    short.data = short.data[:-1]
    assert "need 48" in rejected(Reason.MALFORMED, read, short, 100)
    overlapping = cloud(POINTS, height=2)
    overlapping.row_step = 20
    rejected(Reason.MALFORMED, read, overlapping, 100)
    rejected(Reason.MALFORMED, read, PointCloud2(fields=cloud(POINTS).fields, point_step=12), 100)
    rejected(Reason.TOO_LARGE, read, cloud(POINTS), 3)
    bad = POINTS.copy()
    bad[3, 0] = math.nan
    rejected(Reason.NOT_FINITE, read, cloud(bad), 100)


def test_cloud_that_claims_to_be_huge():
    message = cloud(POINTS)
    message.width = message.height = 2**32 - 1
    rejected(Reason.TOO_LARGE, mesh_messages.vertices_from_cloud, message, 100)


LAYOUT = Layout(("cloth", "ball", "floor"), np.array([0, 10, 14, 20]), np.array([0, 8, 12, 20]))


def _corners(face):
    """Of a face of the cloth, or else of the ball."""
    return [5, 0, 9] if face < 8 else [12, 10, 13]


def contacts(vf, ee, vf_toc, ee_toc):
    n = len(vf) + len(ee)
    return SimpleNamespace(
        vf=np.array(vf, np.uint32).reshape(-1, 2),
        ee=np.array(ee, np.uint32).reshape(-1, 4),
        vp=np.empty((0, 2), np.uint32),
        vv=np.empty((0, 2), np.uint32),
        ve=np.empty((0, 3), np.uint32),
        vp_toc=np.empty(0),
        vv_toc=np.empty(0),
        ve_toc=np.empty(0),
        vf_toc=np.array(vf_toc, np.float64),
        ee_toc=np.array(ee_toc, np.float64),
        points=np.arange(3.0 * n).reshape(-1, 3),
        normals=-np.arange(3.0 * n).reshape(-1, 3),
        closest=np.arange(6.0 * n).reshape(-1, 2, 3),
        vertices=np.array([*([v, *_corners(f)] for v, f in vf), *ee], np.uint32).reshape(-1, 4),
        weights=np.arange(4.0 * n).reshape(-1, 4),
        approach=-np.arange(1.0 * n),
        first_toc=min([*vf_toc, *ee_toc], default=math.inf),
        hash=2**64 - 3,
    )


SAMPLE = contacts(
    [[3, 9], [12, 0], [19, 11]], [[1, 2, 10, 13], [4, 5, 6, 7], [11, 12, 15, 19]], [0.5, 0.25, 0.5], [0.5, 0.0, 1.0]
)


def filled(found, layout=LAYOUT, **options):
    message = ContactArray()
    contact_messages.fill_contacts(message, found, layout, **options)
    return message


def test_contacts_in_local_indices():
    message = filled(SAMPLE)
    none = ContactArray.NONE
    assert message.mesh_names == ["cloth", "ball", "floor"]
    assert list(message.kind) == [0, 0, 0, 1, 1, 1]
    assert list(message.mesh_a) == [0, 1, 2, 0, 0, 1]
    assert list(message.mesh_b) == [1, 0, 1, 1, 0, 2]
    assert list(message.features_a) == [3, none, 2, none, 5, none, 1, 2, 4, 5, 1, 2]
    assert list(message.features_b) == [1, none, 0, none, 3, none, 0, 3, 6, 7, 1, 5]
    within = [[3, 2, 0, 3], [2, 5, 0, 9], [5, 2, 0, 3], [1, 2, 0, 3], [4, 5, 6, 7], [1, 2, 1, 5]]
    assert np.array_equal(np.array(message.vertices).reshape(-1, 4), within)
    assert (message.first_toc, message.total, message.truncated, message.hash) == (0.0, 6, False, 2**64 - 3)


def test_contacts_read_back():
    for found, layout in [
        (SAMPLE, LAYOUT),
        (contacts([], [], [], []), LAYOUT),
        (SAMPLE, Layout(("all",), np.array([0, 20]), np.array([0, 20]))),
    ]:
        back = contact_messages.read_contacts(filled(found, layout), layout)
        for name in ("vf", "vf_toc", "ee", "ee_toc", *OUTPUT_ARRAYS):
            value = getattr(back, name)
            assert np.array_equal(value, getattr(found, name)), name
            assert value.dtype == getattr(found, name).dtype


def test_topology_versions():
    faces = np.array([[0, 1, 2]], np.uint32)
    layout = Layout.of(("cloth", "ball"), (Topology(7, 3, faces), Topology(2**32 - 1, 3, faces)))
    message = filled(contacts([[3, 0]], [], [0.5], []), layout)
    assert list(message.topology_versions) == [7, 2**32 - 1]
    assert contact_messages.read_contacts(message, layout).vf.tolist() == [[3, 0]]
    other = Layout.of(("cloth", "ball"), (Topology(8, 3, faces), Topology(2**32 - 1, 3, faces)))
    with pytest.raises(ValueError, match=r"layout: .* versions \[7, 4294967295\], the layout is of \[8, 4294967295\]"):
        contact_messages.read_contacts(message, other)


def test_no_contacts():
    message = filled(contacts([], [], [], []))
    assert (message.total, message.first_toc, len(message.toc)) == (0, math.inf, 0)


@pytest.mark.parametrize("limit", range(1, 8))
def test_truncation_keeps_the_earliest_in_canonical_order(limit):
    message = filled(SAMPLE, max_contacts=limit)
    toc = np.concatenate([SAMPLE.vf_toc, SAMPLE.ee_toc])
    expected = np.sort(np.argsort(toc, kind="stable")[:limit])
    assert list(message.toc) == toc[expected].tolist()
    assert message.total == 6 and message.truncated == (limit < 6)
    assert message.first_toc == 0.0 and message.hash == SAMPLE.hash
    back = contact_messages.read_contacts(message, LAYOUT)
    for name in OUTPUT_ARRAYS:
        assert np.array_equal(getattr(back, name), getattr(SAMPLE, name)[expected]), name
    assert np.array_equal(back.vf, SAMPLE.vf[expected[expected < 3]])
    assert np.array_equal(back.ee, SAMPLE.ee[expected[expected >= 3] - 3])


def sizes_of_outputs(message):
    return {name: size for name in OUTPUT_ARRAYS if (size := len(getattr(message, name)))}


def test_outputs_not_asked_for_are_not_sent():
    assert sizes_of_outputs(filled(SAMPLE, outputs=("normals",))) == {"normals": 18}
    assert sizes_of_outputs(filled(SAMPLE, outputs=("weights",))) == {"vertices": 24, "weights": 24, "approach": 6}
    nothing = SimpleNamespace(**{**vars(SAMPLE), "points": None, "normals": np.empty((0, 3))})
    assert not {"points", "normals"} & set(sizes_of_outputs(filled(nothing)))
    assert not sizes_of_outputs(filled(hc.Contacts.none()))
