# SPDX-License-Identifier: Apache-2.0
"""hpccd_core.sensor against a slow loop over all vertices, faces and edges."""

import itertools
import re
from types import SimpleNamespace

import numpy as np
import pytest
from distances import DISTANCE
from fuzz.generators import EDGE_EDGE, VERTEX_FACE

import hpccd_core as hc
from hpccd_core.sensor import ContactSensor

OUTPUTS = ("normals", "weights")
REACH = 0.4


class Grasp:
    """A box and a ball, and the triangles and edges of both, as loops read them."""

    def __init__(self):
        box, ball = hc.shapes.box((1.0, 1.0, 1.0)), hc.shapes.icosphere(1)
        self.scene = hc.Scene()
        for name, (_, faces) in {"box": box, "ball": ball}.items():
            self.scene.add_mesh(name, faces, self_collision=False)
        self.n_box = len(box[0])
        self.rest = np.concatenate([box[0], 0.7 * ball[0]])
        self.faces = np.concatenate([box[1], ball[1] + self.n_box]).astype(int)
        edges = self.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        self.edges = np.unique(np.sort(edges, 1), axis=0)

    def poses(self, n, seed):
        rng = np.random.default_rng([46, seed])
        frames = np.repeat(self.rest[None], n, 0)
        frames += rng.normal(0, 0.02, frames.shape)
        directions = rng.normal(size=(n, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        frames[:, self.n_box :] += (directions * rng.uniform(1.2, 2.6, (n, 1)))[:, None]
        return frames

    def pairs(self, x):
        """Vertices and distance of each pair of features of both meshes."""
        own = lambda feature: feature[0] < self.n_box  # noqa: E731
        for v, face in itertools.product(range(len(x)), self.faces.tolist()):
            if own([v]) != own(face):
                yield (v, *face), DISTANCE[VERTEX_FACE](*x[[v, *face]])
        for a, b in itertools.combinations(self.edges.tolist(), 2):
            if own(a) != own(b):
                yield (*a, *b), DISTANCE[EDGE_EDGE](*x[[*a, *b]])

    def read_slowly(self, x, members):
        near = [float(d) for vertices, d in self.pairs(x) if members & set(vertices) and d <= REACH]
        return len(near), min(near, default=np.inf), sum(1 - d / REACH for d in near)


GRASP = Grasp()
GROUPS = {"box": "box", "ball": "ball", "top": ("box", [4, 5, 6, 7]), "some": [1, 9, 12]}
MEMBERS = [set(range(8)), set(range(8, len(GRASP.rest))), {4, 5, 6, 7}, {1, 9, 12}]


@pytest.fixture(scope="module")
def measured():
    frames = GRASP.poses(6, seed=1)
    detector = hc.Detector(GRASP.scene, backend="cpu", threads=2, worlds=len(frames), outputs=OUTPUTS)
    return frames, ContactSensor(detector, GROUPS, REACH).read(frames)


def test_equals_a_slow_loop(measured):
    frames, reading = measured
    expected = [[GRASP.read_slowly(x, members) for members in MEMBERS] for x in frames]
    counts, distances, pressures = np.moveaxis(np.array(expected), -1, 0)
    assert reading.counts.tolist() == counts.tolist() and 0 < (counts[:, 0] == 0).sum() < 6
    np.testing.assert_allclose(reading.distances, distances, rtol=1e-9)
    np.testing.assert_allclose(reading.pressures, pressures, atol=1e-7)


def test_normals_lead_away_from_the_other_surface(measured):
    frames, reading = measured
    for x, normals, distances in zip(frames, reading.normals, reading.distances, strict=True):
        if not np.isfinite(distances[0]):
            continue
        assert np.allclose(np.linalg.norm(normals[:2], axis=1), 1)
        for mesh, vertices in enumerate((slice(0, 8), slice(8, None))):
            moved = x.copy()
            moved[vertices] += 1e-5 * normals[mesh]
            farther = min(d for _, d in GRASP.pairs(moved))
            assert farther - distances[mesh] == pytest.approx(1e-5, rel=0.02)


def test_each_world_as_on_its_own(measured):
    frames, reading = measured
    sensor = ContactSensor(hc.Detector(GRASP.scene, backend="cpu", threads=1, outputs=OUTPUTS), GROUPS, REACH)
    for k, x in enumerate(frames):
        alone = sensor.read(x)
        for name in ("counts", "distances", "normals", "pressures"):
            one, of_all = getattr(alone, name), getattr(reading, name)[k : k + 1]
            assert one.dtype == of_all.dtype and one.tolist() == of_all.tolist()


def test_the_first_of_equal_pairs_gives_the_normal():
    """Four corners of a cube at the same distance from four sides of a square tube: canonical order decides."""
    scene = hc.Scene()
    scene.add_mesh("middle", n_vertices=1)
    walls = np.array([[1, -3, -3], [1, 3, -3], [1, 0, 3], [-1, -3, -3], [-1, 3, -3], [-1, 0, 3]], float)
    scene.add_mesh("walls", [[3, 4, 5], [0, 1, 2]])  # the face at x = -1 comes first
    sensor = ContactSensor(hc.Detector(scene, outputs=OUTPUTS), {"middle": "middle", "walls": "walls"}, 2.0)
    reading = sensor.read(np.concatenate([[[0.0, 0, 0]], walls]))
    assert reading.normals[0].tolist() == [[1, 0, 0], [-1, 0, 0]]
    assert reading.counts[0, 0] == 2 and reading.pressures[0, 0] == 1.0


def test_planes_points_and_ropes():
    scene = hc.Scene()
    scene.add_points("grains", 2, thickness=0.1)
    scene.add_points("rod", 2, edges=[[0, 1]], thickness=0.05)
    scene.add_plane("floor")
    x = np.array([[0, 0, 0.2], [0.25, 0, 0.9], [-1, 0.2, 0.9], [1, 0.2, 0.9]])
    groups = {"grains": "grains", "rod": "rod", "second": [1]}
    reading = ContactSensor(hc.Detector(scene, outputs=OUTPUTS), groups, 0.2).read(x)
    assert reading.counts.tolist() == [[2, 1, 1]]
    np.testing.assert_allclose(reading.distances, [[0.05, 0.05, 0.05]])
    assert reading.normals[0, 0].tolist() in ([0, 0, 1], [0, -1, 0]), "of the floor or of the rod"
    assert reading.normals[0, 1:].tolist() == [[0, 1, 0], [0, -1, 0]]


def test_tensors_give_the_same_numbers():
    """The arithmetic that runs on the device, on PyTorch's CPU device."""
    torch = pytest.importorskip("torch", reason="PyTorch comes with the extra torch")
    frames = GRASP.poses(3, seed=2)
    detector = hc.Detector(GRASP.scene, backend="cpu", threads=2, worlds=3, outputs=OUTPUTS)
    sensor = ContactSensor(detector, GROUPS, REACH)
    on_host = sensor.read(frames)
    near = detector.proximity(frames, REACH)
    names = ("vf_distance", "ee_distance", "normals", "vertices", "vf_offsets", "ee_offsets")
    tensors = SimpleNamespace(**{name: torch.from_numpy(getattr(near, name)) for name in names})
    sensor._torch = torch
    found = sensor._of_pairs(*sensor._on_device(tensors))
    for name in ("counts", "distances", "normals", "pressures"):
        tensor = getattr(found, name)
        assert tensor.numpy().dtype == getattr(on_host, name).dtype
        assert tensor.tolist() == getattr(on_host, name).tolist()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"groups": {"a": "bal"}}, "groups['a']: no mesh is named 'bal'; the scene has box, ball; did you mean ball?"),
        ({"groups": {"a": ("box", [8])}}, "groups['a']: 8 is no vertex of the mesh 'box', which has 8 vertices"),
        ({"groups": {"a": [-1]}}, "groups['a']: -1 is no vertex of the scene, which has 20 vertices"),
        ({"groups": {"a": None}}, "groups['a']: expected a list of vertices, got None; write [0, 1, 2]"),
        ({"groups": {"a": {1, 2}}}, "groups['a']: expected a list of vertices, got {1, 2}"),
        ({"groups": {"a": slice(2)}}, "groups['a']: expected a list of vertices, got slice"),
        ({"groups": {}}, "groups: expected {name: vertices} with at least one group"),
        ({"max_distance": 0.0}, "max_distance: must be greater than 0"),
        ({"detector": hc.Detector(GRASP.scene, outputs="normals")}, "create it with outputs=('normals', 'weights')"),
    ],
)
def test_mistakes_are_explained(arguments, message):
    usual = {"detector": hc.Detector(GRASP.scene, outputs=OUTPUTS), "groups": GROUPS, "max_distance": REACH}
    with pytest.raises((TypeError, ValueError), match=re.escape(message)):
        ContactSensor(**usual | arguments)


def test_planes_are_no_group_and_depth_has_a_limit():
    scene, (vertices, faces) = hc.Scene(), hc.shapes.box((1.0, 1.0, 1.0))
    scene.add_mesh("box", faces, self_collision=False)
    scene.add_plane("floor")
    detector = hc.Detector(scene, outputs=OUTPUTS)
    with pytest.raises(ValueError, match=r"groups\['a'\]: 'floor' is a plane, which has no vertices; give the mesh"):
        ContactSensor(detector, {"a": "floor"}, 1.0)
    reading = ContactSensor(detector, {"a": "box"}, 1e-9).read(vertices - [0, 0, 1e6])
    assert reading.pressures.tolist() == [[8 * 1024.0]] and reading.counts.tolist() == [[8]]
