# SPDX-License-Identifier: Apache-2.0
"""Contacts of a patch with itself at known times, whatever makes it look free of them."""

import folded_patches
import numpy as np
import oracle
import pytest
from folded_patches import SHAPES
from fuzz.steps import is_first

import hpccd_core as hc

NAMES = pytest.mark.parametrize("name", SHAPES)
FREE = 1.0


def scene_of(faces, n_vertices):
    scene = hc.Scene()
    scene.add_mesh("patch", faces, n_vertices=n_vertices)
    return scene


def true_step(faces, start, end, separation=0.0):
    found = oracle.earliest_contacts(
        start[None], end[None], [faces], n_vertices=[len(start)], minimum_separation=separation
    )
    return min(float(found[0]), FREE)


def assert_steps(faces, start, end, separation=0.0):
    """As both tiers promise; also from where the step ends, and a step that ends just before or behind the contact."""
    true = true_step(faces, start, end, separation)
    stops = []
    if 0 < true < FREE:
        stops = [start + part * (end - start) for part in (true - 1e-6, min(1.0, true + 1e-6))]
    shorter_steps = [(stop, true_step(faces, start, stop, separation)) for stop in stops]
    scene = scene_of(faces, len(start))
    for accuracy in ("exact", "conservative"):
        options = {"accuracy": accuracy, "minimum_separation": separation, "backend": "cpu", "threads": 2}
        every, first = (hc.Detector(scene, report=report, **options) for report in ("all", "first"))
        step = every.collision_free_step(start, end)
        assert true - 1e-9 <= step <= true, accuracy
        assert first.collision_free_step(start, end) == step
        assert is_first(first.detect(start, end), every.detect(start, end))
        for stop, shorter in shorter_steps:
            assert shorter - 1e-9 <= every.collision_free_step(start, stop) <= shorter
    return true


@NAMES
def test_the_shapes_are_what_they_say(name):
    faces, start, end, time = SHAPES[name]()
    assert true_step(faces, start, end) == pytest.approx(FREE if time is None else time, abs=1e-9)
    found = hc.Detector(scene_of(faces, len(start)), backend="cpu").detect(start, end)
    if time is None or time == FREE:
        assert found.first_toc > FREE - 1e-9
    else:
        assert len(found) > 0


@NAMES
def test_steps(name):
    faces, start, end, _ = SHAPES[name]()
    assert_steps(faces, start, end)


@NAMES
def test_steps_with_a_separation(name):
    """Neighbours that share no vertex count: no argument about normals holds within the separation."""
    faces, start, end, _ = SHAPES[name]()
    noise = np.random.default_rng(3).normal(0, 0.01, (2, *start.shape))  # no thousand pairs at one time: slow to prove
    assert_steps(faces, start + noise[0], end + noise[1], 0.0625)


@NAMES
def test_names_and_sides_of_the_faces_change_nothing(name):
    """Faces in any order, with any corner first, and some turned over: no winding can be relied on."""
    rng = np.random.default_rng(1)
    faces, start, end, _ = SHAPES[name]()
    expected = hc.Detector(scene_of(faces, len(start)), backend="cpu").collision_free_step(start, end)
    for turned in (0.0, 0.3, 1.0):
        other = rng.permuted(faces[rng.permutation(len(faces))], axis=1) if turned == 0.3 else faces.copy()
        over = rng.random(len(faces)) < turned
        other[over] = other[over][:, ::-1]
        step = hc.Detector(scene_of(other, len(start)), backend="cpu").collision_free_step(start, end)
        assert step == pytest.approx(expected, abs=1e-12)
        assert step <= true_step(other, start, end)


@pytest.mark.parametrize("part", range(4))
def test_turned_and_noisy(part):
    """Away from the axes, and without the symmetries by which everything meets at once."""
    rng = np.random.default_rng(2)
    for name in list(SHAPES)[part::4]:
        faces, start, end, _ = SHAPES[name]()
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        noise = rng.normal(0, 0.01, (2, *start.shape))
        assert_steps(faces, (start + noise[0]) @ turn, (end + noise[1]) @ turn)


@NAMES
def test_a_patch_beside_another_and_with_vertices_of_its_own_in_no_face(name):
    """Two copies in one mesh, one an ulp later in its motion, and a lone vertex that flies through both."""
    faces, start, end, _ = SHAPES[name]()
    n = len(start)
    away = np.array([64.0, 0, 0])
    both = np.concatenate([faces, faces + n])
    lone_start, lone_end = start.mean(axis=0) + [0, 0.125, 16], start.mean(axis=0) + [0.25, 0, -16]
    v0 = np.concatenate([start, start + away, [lone_start]])
    v1 = np.concatenate([end, np.nextafter(end, 0) + away, [lone_end]])
    assert_steps(both, v0, v1)


def test_a_vertex_that_leaves_its_ring_in_the_plane():
    faces, start, end, _ = folded_patches.inner_vertex_that_leaves()
    assert 0 < assert_steps(faces, start, end) < 0.5
