# SPDX-License-Identifier: Apache-2.0
"""Thickness per mesh and per face: each pair of features has a separation of its own.

The truth: exact results at each separation that occurs, of which each contributes the pairs whose own it is."""

import functools

import numpy as np
import oracle
import pytest
import random_scenes

import hpccd_core as hc

VALUES = np.array([0.0, 0.125, 0.25, 0.625])  # of faces
BASE = 0.125  # of pairs of meshes; most sums with it occur without it too, so the truth is computed once
SCENES = pytest.mark.parametrize("make", random_scenes.ALL, ids=lambda make: make.__name__)


class Thick:
    """Meshes whose faces have one of VALUES each; of meshes without faces, the edges or vertices."""

    def __init__(self, make, seed):
        rng = np.random.default_rng(seed)
        self.meshes = make(rng)
        self.given = [
            rng.choice(VALUES, len(faces) or len(edges) or n)
            for faces, edges, n in zip(self.meshes.faces, self.meshes.edges, self.meshes.n_vertices, strict=True)
        ]
        self.vertices, self.faces, self.edges = {}, [], {}
        first = 0
        for faces, edges, n, given in zip(
            self.meshes.faces, self.meshes.edges, self.meshes.n_vertices, self.given, strict=True
        ):
            for face, t in zip(faces, given, strict=False):
                self.faces.append(t)
                for k in range(3):
                    self._raise(self.edges, tuple(sorted((first + face[k - 1], first + face[k]))), t)
                    self._raise(self.vertices, first + face[k], t)
            for edge, t in zip(edges, np.zeros(len(edges)) if len(faces) else given, strict=False):
                self._raise(self.edges, tuple(sorted(first + edge)), t)
                for v in edge:
                    self._raise(self.vertices, first + v, t)
            if not len(faces) and not len(edges):
                self.vertices.update(zip(range(first, first + n), given, strict=True))
            first += n

    @staticmethod
    def _raise(of, feature, t):
        of[feature] = max(of.get(feature, 0), t)

    def of_vf(self, row):
        return self.vertices.get(row[0], 0) + self.faces[row[1]]

    def of_ee(self, row):
        return self.edges[tuple(row[:2])] + self.edges[tuple(row[2:])]

    def scene(self):
        scene = self.meshes.scene()
        for k, given in enumerate(self.given):
            scene._repeat("set_thickness", (k, given))
        return scene

    def detector(self, **options):
        return hc.Detector(self.scene(), **{"backend": "cpu", "minimum_separation": BASE, **options})

    def truth(self, ask, base):
        """Rows and values of ask(separation), those that have that separation."""
        sums = np.unique(VALUES[:, None] + VALUES)
        rows = {"vf": {}, "ee": {}}
        for total in sums:
            found = ask(base + total)
            for kind, own in (("vf", self.of_vf), ("ee", self.of_ee)):
                values = getattr(found, f"{kind}_{'toc' if hasattr(found, 'vf_toc') else 'distance'}")
                for row, value in zip(getattr(found, kind).tolist(), values.tolist(), strict=True):
                    if own(row) == total:
                        rows[kind][tuple(row)] = value
        return rows


@functools.cache
def thick(make, seed=3):
    return Thick(make, seed)


def assert_rows(rows, values, truth, tolerance=1e-12):
    assert [tuple(row) for row in rows.tolist()] == sorted(truth)
    np.testing.assert_allclose(values, [truth[key] for key in sorted(truth)], atol=tolerance, rtol=1e-12)


@functools.cache
def truth_at(given, separation):
    return given.meshes.truth(minimum_separation=separation)


def truth_of_motion(given, base):
    return given.truth(functools.partial(truth_at, given), base)


@pytest.mark.parametrize("base", [0.0, BASE])
@SCENES
def test_contacts(make, base):
    given = thick(make)
    v0, v1 = given.meshes.vertices_t0, given.meshes.vertices_t1
    truth = truth_of_motion(given, base)
    found = {
        (method, threads): given.detector(method=method, threads=threads, minimum_separation=base).detect(v0, v1)
        for method, threads in (("default", 1), ("default", 2), ("published", 2), ("naive", 2), ("front", 2))
    }
    first = found["default", 1]
    assert_rows(first.vf, first.vf_toc, truth["vf"])
    assert_rows(first.ee, first.ee_toc, truth["ee"])
    assert {c.hash for c in found.values()} == {first.hash}
    earliest = given.detector(report="first", minimum_separation=base).detect(v0, v1)
    kept = first.vf_toc == first.first_toc
    assert (earliest.vf == first.vf[kept]).all() and earliest.first_toc == first.first_toc
    free = given.detector(minimum_separation=base).collision_free_step(v0, v1)
    assert min(first.first_toc, 1) - 1e-9 <= free <= min(first.first_toc, 1)


@SCENES
@pytest.mark.parametrize("distance", [0.0, 0.375])
def test_proximity(make, distance):
    given = thick(make)
    m = given.meshes
    vertices = m.vertices_t1
    found = given.detector().proximity(vertices, distance)
    truth = given.truth(lambda d: oracle.proximity(vertices, d, m.faces, **m.beside_faces), distance)
    for kind, own in (("vf", given.of_vf), ("ee", given.of_ee)):
        surfaces = {row: value - own(list(row)) for row, value in truth[kind].items()}
        assert_rows(getattr(found, kind), getattr(found, f"{kind}_distance"), surfaces, 1e-9 * np.abs(vertices).max())
    assert given.detector(threads=2).proximity(vertices, distance) == found


@SCENES
def test_distances(make):
    given = thick(make)
    m = given.meshes
    vertices = m.vertices_t1
    # The smallest distance is that of the nearest of all pairs, unless centre surfaces intersect.
    centres = {(g.mesh_a, g.mesh_b): g for g in hc.Detector(m.scene(), backend="cpu").distances(vertices)}
    everything = given.detector().proximity(vertices, 4.0)
    mesh_of = np.repeat([f"mesh{k}" for k in range(len(m.n_vertices))], m.n_vertices)
    face_vertices = np.concatenate([f + n for f, n in zip(m.faces, np.cumsum([0, *m.n_vertices[:-1]]), strict=True)])
    least = {}
    for rows, values, vertex_of in (
        (everything.vf, everything.vf_distance, lambda r: face_vertices[r[1]][0]),
        (everything.ee, everything.ee_distance, lambda r: r[2]),
    ):
        for row, value in zip(rows.tolist(), values.tolist(), strict=True):
            pair = tuple(sorted((mesh_of[row[0]], mesh_of[vertex_of(row)])))
            least[pair] = min(least.get(pair, np.inf), value)
    compared = 0
    for threads in (1, 2):
        for gap in given.detector(threads=threads).distances(vertices):
            if gap.kind == "edge-face":
                assert centres[gap.mesh_a, gap.mesh_b].kind == "edge-face" and gap.distance <= 0
            elif gap.distance < 2.5:
                assert gap.distance == pytest.approx(least[gap.mesh_a, gap.mesh_b], abs=1e-12), gap
                compared += 1
    assert compared or make in (random_scenes.single_mesh, random_scenes.lattice, random_scenes.triangle_soup)


def test_changes_between_calls_equal_a_new_detector():
    given, rng = thick(random_scenes.many_meshes), np.random.default_rng(8)
    inexact = np.append(VALUES[:-1], 0.7)  # no sum with it is exact in single precision
    v0, v1 = given.meshes.vertices_t0, given.meshes.vertices_t1
    detector, scene_values = given.detector(), list(given.given)
    hashes = set()
    for turn in range(8):
        mesh = int(rng.integers(len(scene_values)))
        values = rng.choice(inexact, len(given.given[mesh])) if turn % 2 else np.array([rng.choice(inexact)])
        scene_values[mesh] = values
        detector.set_thickness(f"mesh{mesh}", values)
        scene = given.meshes.scene()
        for k, t in enumerate(scene_values):
            scene._repeat("set_thickness", (k, t))
        new = hc.Detector(scene, backend="cpu", minimum_separation=BASE)
        found = detector.detect(v0, v1)
        hashes.add(found.hash)
        assert found == new.detect(v0, v1)
        assert "build" not in detector.profile or turn == 0
        assert detector.collision_free_step(v0, v1) == new.collision_free_step(v0, v1)
        assert [g.distance for g in detector.distances(v0)] == [g.distance for g in new.distances(v0)]
    assert len(hashes) > 4


def test_zero_is_no_thickness():
    """To the same hash, also beside meshes that have one, and at every tier."""
    meshes = random_scenes.free_at_first(np.random.default_rng(5))
    v0, v1 = meshes.vertices_t0, meshes.vertices_t1
    for accuracy in ("exact", "conservative", "balanced", "fast"):
        plain = hc.Detector(meshes.scene(), backend="cpu", accuracy=accuracy)
        thick = hc.Detector(meshes.scene(), backend="cpu", accuracy=accuracy)
        thick.set_thickness("mesh4", 0.5)
        found, expected = thick.detect(v0, v1), plain.detect(v0, v1)
        of_others = (found.vf < sum(meshes.n_vertices[:4])).all(axis=1) & (found.vf[:, 1] < len(v0))
        assert found.hash != expected.hash
        rows = {tuple(r): t for r, t in zip(found.vf.tolist(), found.vf_toc.tolist(), strict=True)}
        assert all(rows[tuple(r)] <= t for r, t in zip(expected.vf.tolist(), expected.vf_toc.tolist(), strict=True))
        assert of_others.any()
        thick.set_thickness("mesh4", np.zeros(4))
        assert thick.detect(v0, v1) == expected


def test_outputs_follow_the_separation_of_the_pair():
    scene = hc.Scene()
    scene.add_mesh("floor", [[0, 1, 2]], thickness=0.25)
    scene.add_mesh("pin", n_vertices=1, thickness=0.5)
    end = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0]])
    start = end + [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 3]]
    found = hc.Detector(scene, backend="cpu", outputs=("points", "normals", "closest", "weights")).detect(start, end)
    assert found.vf_toc == pytest.approx([0.75], abs=1e-12)
    assert found.normals.tolist() == [[0, 0, 1]]
    np.testing.assert_allclose(found.points, [[1, 1, 0.375]], atol=1e-12)
    np.testing.assert_allclose(found.closest, [[[1, 1, 0.75], [1, 1, 0]]], atol=1e-12)
    assert found.approach.tolist() == [-3.0]


@pytest.mark.parametrize("size", [1e-300, 1e-6, 1e6, 1e100, 1e300])
def test_any_magnitude(size):
    """Thickness far below and above the extent of a scene."""
    given = thick(random_scenes.many_meshes)
    v0, v1 = given.meshes.vertices_t0, given.meshes.vertices_t1
    detector = given.detector(minimum_separation=0)
    for k, values in enumerate(given.given):
        detector.set_thickness(k, values * size)
    if size < 1:
        expected = {tuple(r) for r in given.meshes.truth().vf.tolist()}
        assert expected <= {tuple(r) for r in detector.detect(v0, v1).vf.tolist()}
        return
    found = detector.detect(v0, v1)
    face_vertices = detector_faces(given.meshes)
    pairs = {
        (v, f)
        for v in range(len(v0))
        for f, face in enumerate(face_vertices)
        if v not in face and given.of_vf((v, f)) > 0
    }
    assert pairs <= {tuple(r) for r in found.vf.tolist()}


@pytest.mark.parametrize("times_extent", [0.9, 1.01, 1.3, 1.7, 3.0])
def test_one_thick_mesh_around_the_whole_scene(times_extent):
    """Thickness on one side only: as a separation, half of which grows each side."""
    rng = np.random.default_rng(4)
    for corner in rng.choice([-1.0, 1.0], (8, 3)):
        scene = hc.Scene()
        scene.add_mesh("thin", [[0, 1, 2]])
        scene.add_mesh("thick", [[0, 1, 2]], thickness=64 * times_extent)
        vertices = rng.normal(0, 0.3, (6, 3))
        vertices[3:] += 64 * corner
        expected = hc.Detector(scene, backend="cpu")
        expected.set_thickness("thick", 0.0)
        expected.set_separation("thin", "thick", 64 * times_extent)
        found = hc.Detector(scene, backend="cpu").detect(vertices, vertices)
        assert found == expected.detect(vertices, vertices)
        assert times_extent < 1.75 or len(found) == 15


def detector_faces(meshes):
    firsts = np.cumsum([0, *meshes.n_vertices[:-1]])
    return [tuple(face + first) for faces, first in zip(meshes.faces, firsts, strict=True) for face in faces]


def test_greatest_thickness():
    vertices, faces = hc.shapes.grid(2, 2)
    scene = hc.Scene()
    for mesh in "ab":
        scene.add_mesh(mesh, faces, thickness=1e300, self_collision=False)
    both = np.concatenate([vertices, vertices + [0, 0, 1]])
    detector = hc.Detector(scene)
    (gap,) = detector.distances(both)
    assert (gap.distance, gap.kind) == (-2e300, "vertex-face")
    assert detector.proximity(both, 0.0).vf_distance.tolist() == [-2e300] * (2 * len(vertices) * len(faces))
    assert detector.detect(both, both).first_toc == 0


@pytest.mark.parametrize(
    ("thickness", "error", "words"),
    [
        (-1.0, ValueError, "thickness.0.: must be finite and not negative"),
        ([0.1, float("nan")], ValueError, "thickness.1.: must be finite"),
        ([0.1, 1e301], ValueError, "thickness.1.: must be at most 1e.300; choose a larger unit"),
        ([0.1, 0.1, 0.1], ValueError, "one number or 2, one for each face, got 3"),
        ([[0.1]], ValueError, "shape"),
        ("0.1", TypeError, "thickness"),
        (None, TypeError, "thickness"),
        (True, TypeError, "thickness"),
    ],
)
def test_invalid_values(thickness, error, words):
    scene = hc.Scene()
    with pytest.raises(error, match=words):
        scene.add_mesh("cloth", [[0, 1, 2], [0, 2, 3]], thickness=thickness)
    assert scene.mesh_names == []
    scene.add_mesh("cloth", [[0, 1, 2], [0, 2, 3]], thickness=[0.1, 0.2])
    detector = hc.Detector(scene)
    with pytest.raises(error, match="thickness"):
        detector.set_thickness("cloth", thickness)
    with pytest.raises(ValueError, match="did you mean cloth"):
        detector.set_thickness("clot", 0.1)
