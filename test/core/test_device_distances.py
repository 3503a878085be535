# SPDX-License-Identifier: Apache-2.0
"""Distances as arrays: the core packs them for a device; here it leaves them on the host, where they are compared."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import device_distances

FIELDS = ("distance", "kind", "features", "points", "vertices", "weights", "normal", "inside")
DTYPES = dict.fromkeys(FIELDS, np.float64) | {"kind": np.int32, "inside": np.int32}
DTYPES |= {"features": np.uint32, "vertices": np.uint32}


class There:
    """A DeviceArray, of an array on the host."""

    def __init__(self, array):
        self.array = array
        self.shape = array.shape

    def row(self, k):
        return There(self.array[k])

    def to_host(self):
        return self.array


def meshes():
    """A rope, two boxes, points in no edge, and a mesh without anything: each kind but those of planes and points."""
    scene = hc.Scene()
    box, faces = hc.shapes.box()
    ball, ball_faces = hc.shapes.icosphere(3)
    scene.add_mesh("box", faces, shape=box)
    scene.add_mesh("ball", ball_faces, shape=ball, self_collision=False)
    scene.add_mesh("rope", edges=[[0, 1], [1, 2]], shape=np.array([[-4.0, 0, 0], [0, 0.1, 2.5], [4, 0, 0]]))
    scene.add_mesh("nothing", np.empty((0, 3), int), n_vertices=0, shape=np.empty((0, 3)))
    return scene


POSES = [
    [[x, y, z, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1]]
    for x, y, z in ((0, 0, 0), (1.2, 0, 0.3), (7, 0.1, 2), (0, 3, 0))
]


def of_core(detector, poses=None, vertices=None):
    """As Detector.distances makes them of results on a device."""
    query = detector._ask("distance_arrays", vertices, None, poses=poses)
    found = {name: There(value) if name != "pairs" else value for name, value in query.items()}
    return device_distances.distances_of(found, detector.worlds, detector._layout.mesh_names)


def test_as_the_list_of_the_host():
    detector = hc.Detector(meshes(), backend="cpu")
    kinds, insides = set(), set()
    for poses in POSES:
        expected = detector.distances(poses=poses)
        for given in ({"poses": poses}, {"vertices": detector.positions_at(poses)}):
            found = of_core(detector, **given)
            assert found.to_host() == expected
            assert repr(found.to_host()) == repr(expected)  # types and shapes of empty arrays too
            assert found.pairs == tuple((gap.mesh_a, gap.mesh_b) for gap in expected)
            assert found.world(0) is found
        kinds |= {gap.kind for gap in expected}
        insides |= {gap.inside for gap in expected}
        for name in FIELDS:
            array = getattr(found, name).array
            assert array.dtype == DTYPES[name] and array.flags.c_contiguous and len(array) == len(expected)
        assert [found.KINDS[k] for k in found.kind.array] == [gap.kind for gap in expected]
        assert [found.INSIDE[k] for k in found.inside.array] == [gap.inside for gap in expected]
        left_out = np.isin(found.kind.array, [found.KINDS.index(""), found.KINDS.index("edge-face")])
        for name in ("vertices", "weights", "normal"):
            assert not getattr(found, name).array[left_out].any()
        assert not found.features.array[:, 2:][found.kind.array == 1].any()
    assert kinds == {"", "vertex-face", "edge-edge", "edge-face"} and {None, "a"} <= insides


def test_many_worlds():
    detector = hc.Detector(meshes(), backend="cpu", worlds=len(POSES))
    expected = detector.distances(poses=POSES)
    found = of_core(detector, poses=POSES)
    assert found.to_host() == expected
    assert found.points.shape == (len(POSES), len(found.pairs), 2, 3)
    for k, gaps in enumerate(expected):
        assert found.world(k).to_host() == gaps
        assert found.world(k).distance.shape == (len(gaps),)
    with pytest.raises(ValueError, match="^world: "):
        found.world(len(POSES))
    assert repr(found) == f"DeviceDistances({len(found.pairs)} pairs of meshes in {len(POSES)} worlds)"
    assert found == of_core(detector, poses=POSES) and found != found.world(0)
    assert found != of_core(detector, poses=POSES[::-1])


def test_the_worlds_of_one_are_an_axis_too():
    detector = hc.Detector(meshes(), backend="cpu", worlds=1)
    found = of_core(detector, poses=POSES[:1])
    assert found.to_host() == detector.distances(poses=POSES[:1]) and len(found.distance.shape) == 2


def test_kinds_of_planes_and_points():
    """Detectors with results on a device reject both; the arrays have them all the same."""
    scene = meshes()
    scene.add_plane("floor", offset=-3)
    scene.add_points("grains", 2, thickness=0.1)
    detector = hc.Detector(scene, backend="cpu")
    vertices = np.array([[0.0, 0, 5], [9, 9, 9]])
    expected = detector.distances(vertices, poses=POSES[0])
    assert of_core(detector, POSES[0], vertices).to_host() == expected
    assert {"vertex-plane", "vertex-vertex"} <= {gap.kind for gap in expected}


def test_no_pairs():
    scene = hc.Scene()
    scene.add_mesh("one", [[0, 1, 2]], self_collision=False)
    for worlds, shape, expected in ((None, (3, 3), []), (2, (2, 3, 3), [[], []])):
        found = of_core(hc.Detector(scene, backend="cpu", worlds=worlds), vertices=np.zeros(shape))
        assert found.to_host() == expected and found.pairs == ()


def test_rejected_as_on_the_host():
    detector = hc.Detector(meshes(), backend="cpu")
    bad = detector.positions_at(POSES[0])
    bad[3, 1] = np.nan
    with pytest.raises(ValueError, match=r"^vertices\[3, 1\] is NaN"):
        of_core(detector, vertices=bad)
    with pytest.raises(ValueError, match="^poses"):
        of_core(detector, poses=POSES[0][:2])
