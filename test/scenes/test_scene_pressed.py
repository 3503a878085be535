# SPDX-License-Identifier: Apache-2.0
"""Twisted rods and the body between rollers: closed surfaces, in layers as close as told, moving as told."""

import numpy as np
import pytest

import hpccd_core
from hpccd_ros import scenes

PRESSED = {"rod-twist-like": 240, "armadillo-like": 190}  # and a frame in which much touches


def volume(faces, vertices):
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


@pytest.mark.parametrize("size", [1 / 64, 0.25, 1.0])
@pytest.mark.parametrize("name", PRESSED)
def test_surfaces_are_closed_and_wound_outwards(name, size):
    scene = scenes.make(name, size=size)
    for mesh, vertices in zip(scene.meshes, scene.frame(PRESSED[name]), strict=True):
        sides = mesh.faces.astype(np.int64)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        there, back = sides @ (mesh.n_vertices, 1), sides @ (1, mesh.n_vertices)
        assert len(np.unique(there)) == len(there), "no side belongs to two faces wound alike"
        np.testing.assert_array_equal(np.sort(there), np.sort(back), "each side has another face beyond it")
        assert len(np.unique(mesh.faces)) == mesh.n_vertices
        assert volume(mesh.faces, vertices) > 0


@pytest.mark.parametrize("name", PRESSED)
def test_a_step_moves_a_fraction_of_an_edge(name):
    scene = scenes.make(name)
    before, after = (scene.frame(k).stacked().astype(float) for k in (PRESSED[name] - 1, PRESSED[name]))
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in scene.meshes)])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(scene.meshes, starts, strict=False)])
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    length = np.median(np.linalg.norm(after[edges[:, 0]] - after[edges[:, 1]], axis=1))
    assert 0.1 * length < np.linalg.norm(after - before, axis=1).mean() < length


def test_layers_of_rods_are_close_on_all_sides():
    """Most vertices of the middle rod, pushed outwards by three gaps, meet a neighbour; few by a tenth of one."""
    scene = scenes.make("rod-twist-like")
    frame = scene.frame(240)
    faces, rod = scene.meshes[2].faces, frame[2].astype(float)
    a, b, c = (rod[faces[:, k]] for k in range(3))
    normals = np.zeros_like(rod)
    for k in range(3):
        np.add.at(normals, faces[:, k], np.cross(b - a, c - a))
    normals /= np.linalg.norm(normals, axis=1)[:, None]

    def share_that_meets(distance):
        pushed = np.concatenate([*(mesh.astype(float) for mesh in frame[:2]), rod + distance * normals])
        found = hpccd_core.Detector(scenes.core_scene(scene)).detect(frame.stacked().astype(float), pushed)
        first = scene.n_vertices - len(rod)
        return len(np.unique(found.vf[found.vf[:, 0] >= first, 0])) / len(rod)

    assert share_that_meets(2e-5) < 0.1
    assert 0.2 < share_that_meets(2e-4) < 0.5
    assert share_that_meets(6e-4) > 0.6


def test_rods_coil_up_between_clamps_that_turn_against_each_other():
    scene = scenes.make("rod-twist-like", size=1 / 16)
    straight, coiled = scene.frame(0).stacked(), scene.frame(240).stacked()
    assert np.ptp(straight[:, 0]) == pytest.approx(1.0, abs=0.01)
    assert np.ptp(coiled[:, 0]) < 0.5 and np.ptp(coiled[:, 1:], axis=0).min() > 2 * np.ptp(straight[:, 1:])
    # Ends of the middle rod: its first and last ring turn by as much, in opposite senses.
    now, then = (scene.frame(k)[2][:-2].astype(float) for k in (200, 201))
    ring = 4
    turns = []
    for where in (slice(0, ring), slice(-ring, None)):
        p, q = ((x[where] - x[where].mean(axis=0))[0] for x in (now, then))
        turns.append(np.arcsin(np.cross(p, q)[0] / np.linalg.norm(p) / np.linalg.norm(q)))
    assert turns[0] == pytest.approx(-turns[1], rel=0.05) and abs(turns[0]) > 0.05


def test_body_is_pressed_flat_and_rollers_turn_with_it():
    scene = scenes.make("armadillo-like", size=0.25)
    before, after = scene.frame(149), scene.frame(150)
    body = after[0].astype(float)
    nip = np.abs(body[:, 2]) < 0.02
    assert nip.sum() > 50 and np.ptp(body[nip, 0]) < 0.15
    assert np.ptp(scene.frame(0)[0][:, 0]) > 0.5
    # At the nip both rollers and the skin between them go down.
    for mesh in range(3):
        x, y, z = before[mesh].astype(float).T
        there = (np.abs(z) < 0.03) & (np.abs(x) < 0.09) & (np.abs(y) < 0.4)
        down = (before[mesh] - after[mesh])[there, 2]
        assert there.any() and down.min() > 0.003
