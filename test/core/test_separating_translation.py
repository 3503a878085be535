# SPDX-License-Identifier: Apache-2.0
"""Separating translations against the oracle: intervals of all edges and faces, in rationals."""

import numpy as np
import oracle
import pytest

import hpccd_core as hc

TETRAHEDRON = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def detector_of(*meshes, **options):
    scene = hc.Scene()
    for name, (vertices, faces) in zip("abcdefgh", meshes, strict=False):
        scene.add_mesh(name, faces, n_vertices=len(vertices))
    return hc.Detector(scene, backend="cpu", threads=1, **options), np.concatenate([v for v, _ in meshes])


def separating(a, b, direction):
    detector, vertices = detector_of(a, b)
    return detector.separating_translation(vertices, "a", "b", direction)


def box(low, high):
    vertices, faces = hc.shapes.box()
    return (vertices + 0.5) * (np.asarray(high, float) - low) + low, faces


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def ring():
    """Four bars around the z axis, overlapping at the corners: the hole is 2 wide."""
    return joined(
        *(box(*corners) for corners in (((-2, -2, 0), (2, -1, 1)), ((-2, 1, 0), (2, 2, 1)))),
        *(box(*corners) for corners in (((-2, -2, 0), (-1, 2, 1)), ((1, -2, 0), (2, 2, 1)))),
    )


def mesh_of(rng, kind):
    """Closed and open meshes of 4 to 40 faces; on grids with degenerate faces."""
    if kind == "doubles":
        place = rng.normal(size=3)
        return (
            joined(*((rng.normal(size=(4, 3)) + place, TETRAHEDRON) for _ in range(rng.integers(1, 4))))
            if rng.random() < 0.7
            else (rng.normal(size=(8, 3)), np.array([rng.permutation(8)[:3] for _ in range(6)]))
        )
    low = rng.integers(-4, 3, 3)
    what = rng.integers(5)
    if what == 0:
        return box(low, low + rng.integers(1, 5, 3))
    if what == 1:
        return joined(box(low, low + rng.integers(1, 5, 3)), box(low + 1, low + rng.integers(2, 4, 3)))
    if what == 2:
        vertices, faces = ring()
        return np.roll(vertices, rng.integers(3), axis=1) + rng.integers(-2, 3, 3), faces
    if what == 3:
        return joined(*((rng.integers(-3, 4, (4, 3)).astype(float), TETRAHEDRON) for _ in range(rng.integers(1, 4))))
    return rng.integers(-3, 4, (8, 3)).astype(float), np.array([rng.permutation(8)[:3] for _ in range(8)])


@pytest.mark.parametrize("kind", ["grid", "doubles"])
def test_equals_the_oracle(kind):
    rng = np.random.default_rng(44)
    pairs = [(mesh_of(rng, kind), mesh_of(rng, kind)) for _ in range(1500)]
    directions = rng.normal(size=(len(pairs), 3)) if kind == "doubles" else rng.integers(-2, 3, (len(pairs), 3))
    directions = np.where((directions == 0).all(axis=1, keepdims=True), [[0, 0, 1]], directions).astype(float)
    expected = oracle.separating_translations(pairs, directions)
    found = [separating(a, b, d) for (a, b), d in zip(pairs, directions, strict=True)]
    wrong = np.flatnonzero(np.abs(found - expected) > 1e-12 * np.abs(expected))
    assert not len(wrong), (wrong[:5], np.array(found)[wrong[:5]], expected[wrong[:5]])
    assert (expected > 0).sum() > 300 and (expected == 0).sum() > 100


def test_a_gap_ends_the_translation_unless_the_mesh_is_enclosed():
    bar = box((-0.5, -0.5, -3), (0.5, 0.5, 3))
    outer = box((-9, -9, -9), (9, 9, 9))
    assert separating(bar, ring(), (1, 0, 0)) == 0  # through the hole, without contact
    thick = box((-1.5, -0.5, -3), (0.25, 0.5, 3))
    assert separating(thick, ring(), (1, 0, 0)) == 0.5  # from one side of the ring into the hole
    assert separating(ring(), thick, (-3, 0, 0)) == 0.5
    as_wide = box((-1.5, -0.5, -3), (0.5, 0.5, 3))
    assert separating(as_wide, ring(), (1, 0, 0)) == 3.5  # one contact ends exactly when the next begins
    inside = box((0, 0, 0), (1, 1, 1))
    assert separating(inside, outer, (0, 0, 5)) == 9  # no contact at first, but enclosed
    assert separating(outer, inside, (0, 0, -5)) == 9
    lid = outer[0], outer[1][1:]  # no longer closed
    assert separating(inside, lid, (0, 0, 1)) == 0


def test_shells_one_in_another():
    """Each shell in the space between the shells of the other: two components, one of which is not enclosed."""
    shell = joined(box((0, 0, 0), (8, 8, 8)), (box((1, 1, 1), (7, 7, 7))[0], box((0, 0, 0), (1, 1, 1))[1][:, ::-1]))
    assert separating(box((2, 2, 2), (3, 3, 3)), shell, (1, 0, 0)) == 0  # in the hole
    assert separating(box((0.25, 2, 2), (0.5, 3, 3)), shell, (1, 0, 0)) == 0.75  # in the wall
    assert separating(box((0.25, 2, 2), (0.5, 3, 3)), shell, (-1, 0, 0)) == 0.5


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e6, 1e299])
@pytest.mark.parametrize("length", [5e-324, 1.0, 1e308])
def test_scales(scale, length):
    a, b = hc.shapes.icosphere(3), hc.shapes.icosphere(4)
    expected = separating(a, b, (1, 0, 0))
    found = separating((scale * a[0], a[1]), (scale * b[0], b[1]), (length, 0, 0))
    assert found == pytest.approx(scale * expected, rel=1e-12)


def test_float32_and_meshes_between():
    """Other meshes of the scene do not matter, nor which of its rules apply."""
    a, b = box((0, 0, 0), (2, 2, 2)), box((1, 1, 1), (3, 3, 3))
    scene = hc.Scene()
    for name, (vertices, faces) in {"a": a, "other": a, "b": b}.items():
        scene.add_mesh(name, faces, n_vertices=len(vertices))
    scene.ignore_pair("a", "b")
    detector = hc.Detector(scene, minimum_separation=0.5)
    vertices = np.concatenate([a[0], a[0], b[0]]).astype(np.float32)
    assert detector.separating_translation(vertices, "a", "b", (0, -2, 0)) == 1
    assert detector.separating_translation(vertices, 2, 0, (0, -2, 0)) == 3
    assert "translation" in detector.profile


@pytest.mark.parametrize("direction", [(0, 0, 0), (0, np.nan, 1), (np.inf, 0, 0), (1, 0), "z"])
def test_invalid_directions(direction):
    detector, vertices = detector_of(box((0, 0, 0), (1, 1, 1)), box((0, 0, 0), (1, 1, 1)))
    with pytest.raises((ValueError, TypeError), match="direction"):
        detector.separating_translation(vertices, "a", "b", direction)


def test_invalid_meshes():
    scene = hc.Scene()
    scene.add_mesh("a", TETRAHEDRON)
    scene.add_mesh("rope", [], n_vertices=2, edges=[[0, 1]])
    detector, vertices = hc.Detector(scene), np.zeros((6, 3))
    cases = (("a", "rope", "mesh_b: 'rope' has no faces"), ("rope", "a", "mesh_a: 'rope'"), (0, "a", "same"))
    for a, b, message in cases:
        with pytest.raises(ValueError, match=message):
            detector.separating_translation(vertices, a, b, (1, 0, 0))
    with pytest.raises(ValueError, match="worlds"):
        detector_of(*[box((0, 0, 0), (1, 1, 1))] * 2, worlds=2)[0].separating_translation(
            np.zeros((2, 16, 3)), "a", "b", (1, 0, 0)
        )
