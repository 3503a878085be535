# SPDX-License-Identifier: Apache-2.0
"""The detector finds in each scene what its title promises."""

import functools

import numpy as np
import pytest
import solved_cloth

import hpccd_core
from hpccd_ros import scenes


def contacts_of_steps(scene, steps):
    """{k: contacts of the step from frame k-1 to k}."""
    found = {}
    for k in steps:
        frame = scene.frame(k)
        before = frame.stacked_start() if frame.topologies else scene.frame(k - 1).stacked()
        detector = hpccd_core.Detector(scenes.core_scene(scene, k), accuracy="balanced")
        found[k] = detector.detect(before, frame.stacked())
    return found


def counts(found):
    return {k: len(c.vf) + len(c.ee) for k, c in found.items()}


@functools.cache
def counts_of(name, size, steps):
    return counts(contacts_of_steps(scenes.make(name, size=size), steps))


def test_two_triangles_have_one_contact_at_the_time_told():
    scene = scenes.make("two-triangles")
    found = contacts_of_steps(scene, range(1, 11))
    assert [k for k, c in found.items() if len(c.vf) + len(c.ee)] == [5]
    # Vertex 3 (the upper triangle's corner) and face 0 (the lower triangle); 0.25 below the start, at 0.053 a frame.
    assert found[5].vf.tolist() == [[3, 0]] and len(found[5].ee) == 0
    assert found[5].vf_toc[0] == pytest.approx(0.25 / 0.053 - 4, abs=1e-6)


def test_folding_strip_meets_itself_from_some_frame_on():
    found = counts(contacts_of_steps(scenes.make("folding-strip"), [10, 30, 45, 54]))
    assert found[10] == found[30] == 0
    assert found[45] > 50 and found[54] > 500


def test_cloth_drop_lands_then_folds():
    scene = scenes.make("cloth-drop")
    found = contacts_of_steps(scene, [4, 40, 60, 89])
    n_cloth = scene.meshes[0].n_vertices
    # First the cloth and the ball, which does not collide with itself, then ever more of the cloth with itself.
    assert 0 < counts(found)[4] < 50
    assert all(((c.ee < n_cloth).any(axis=1)).all() for c in found.values())
    assert all(count > 500 for k, count in counts(found).items() if k >= 40)


def test_cloth_ball_is_in_deep_self_contact():
    assert min(counts_of("cloth-ball-like", 1.0, (48, 80)).values()) > 20_000


@pytest.mark.parametrize("name", ["n-body-like-lr", "n-body-like-hr"])
def test_bodies_touch_in_every_step(name):
    scene = scenes.make(name)
    found = contacts_of_steps(scene, [1, *range(5, len(scene), 10)])
    assert min(counts(found).values()) > 20
    # Rigid with rigid, rigid with deforming, with the ground: all three meshes take part.
    ends = np.cumsum([mesh.n_vertices for mesh in scene.meshes])
    meshes = np.concatenate([np.searchsorted(ends, c.ee, side="right")[:, [0, 2]] for c in found.values()])
    pairs = {tuple(sorted(pair)) for pair in np.unique(meshes, axis=0).tolist()}
    assert pairs >= {(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)}


def test_twisted_rods_press_together():
    scene = scenes.make("rod-twist-like")
    found = contacts_of_steps(scene, [10, 120, 240])
    assert counts(found)[10] == 0, "rods lie loose in the bundle"
    assert all(2_000 < counts(found)[k] < 12_000 for k in (120, 240))
    # Turns of the coil meet too: rods at the corners of the bundle, which are no neighbours in it.
    corner_rods = scene.meshes[0].n_vertices
    assert not (found[120].ee < corner_rods).all(axis=1).any()
    assert (found[240].ee < corner_rods).all(axis=1).sum() > 100


def test_body_touches_both_rollers_and_itself():
    scene = scenes.make("armadillo-like")
    found = contacts_of_steps(scene, [60, 150, 190])
    assert all(500 < count < 20_000 for count in counts(found).values())
    ends = np.cumsum([mesh.n_vertices for mesh in scene.meshes])
    for k in (150, 190):
        meshes = np.searchsorted(ends, found[k].ee, side="right")[:, [0, 2]]
        assert {tuple(sorted(pair)) for pair in np.unique(meshes, axis=0).tolist()} == {(0, 0), (0, 1), (0, 2)}


def test_breaking_pieces_collide():
    scene = scenes.make("breaking-like", size=0.1)
    changes = [frame.index for frame in scene.frames() if frame.topologies]
    found = counts(contacts_of_steps(scene, [3, *changes, 40]))
    assert found[3] == 0, "nothing is hit yet"
    assert all(found[k] > 500 for k in changes[1:]), "walls of a fresh crack touch"
    assert found[40] > 1000, "debris lies in a heap"


def test_resolved_cloth_never_touches_and_is_near():
    scene = solved_cloth.make("cloth-ball-resolved", size=0.0625)
    steps = range(1, len(scene), 3)
    assert not any(counts(contacts_of_steps(scene, steps)).values())
    detector = hpccd_core.Detector(scenes.core_scene(scene))
    for k in (100, 219):
        vertices = scene.frame(k).stacked()
        assert len(detector.intersections(vertices)) == 0
        assert len(detector.proximity(vertices, 0.03)) > 2_000, "the reach of the solver at this size"


def test_trials_start_where_resolved_steps_do_and_touch():
    resolved, trial = (solved_cloth.make(f"cloth-ball-{kind}", size=0.0625) for kind in ("resolved", "trial"))
    for k in (0, 120, 218):
        np.testing.assert_array_equal(resolved.frame(k).stacked(), trial.frame(2 * k).stacked())
        assert trial.frame(2 * k).time == resolved.frame(k).time < trial.frame(2 * k + 1).time
    assert min(counts(contacts_of_steps(trial, [121, 241, 361])).values()) > 5


GROWING = [("cloth-ball-like", (48, 80)), ("n-body-like-hr", (24, 48)), ("rod-twist-like", (150, 240))]


@pytest.mark.parametrize(("name", "steps"), GROWING)
def test_contacts_grow_like_the_triangles(name, steps):
    """The same motion, meshed four times as finely, has about four times the contacts."""
    few, many = (counts_of(name, size, steps) for size in (0.25, 1.0))
    ratio = sum(many.values()) / sum(few.values())
    assert 2.5 < ratio < 6.5
