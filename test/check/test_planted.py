# SPDX-License-Identifier: Apache-2.0
"""All formats give the same frames, and the planted defects are where planted.py lists them."""

import numpy as np
import planted
import pytest

import hpccd_core as hc
from hpccd_core.sequences import open_sequence


@pytest.mark.parametrize("form", planted.WRITERS)
def test_frames_are_bit_identical_in_all_formats(form, tmp_path):
    if form in planted.PACKAGES:
        pytest.importorskip(planted.PACKAGES[form], reason=f"reading {form} needs the extra check")
    shape, faces = planted.positions(), planted.faces()
    paths, options = planted.WRITERS[form](tmp_path, shape)
    sequence = open_sequence(paths, **options)
    assert len(sequence) == planted.N_FRAMES and sequence.missing == {}
    expected = np.concatenate([shape[name] for name in planted.NAMES], axis=1)
    first = sequence.frame(0).meshes
    for k in (*range(planted.N_FRAMES), 3, 100):
        frame = sequence.frame(k)
        assert frame.index == k and frame.meshes is first and frame.vertices.dtype == np.float64
        assert (frame.vertices == expected[k]).all()
    if "split" not in options:
        assert [mesh.name for mesh in first] == list(planted.NAMES)
    for mesh, name in zip(first, planted.NAMES, strict=True):
        assert mesh.n_vertices == shape[name].shape[1] and mesh.faces.dtype == np.uint32
        assert np.array_equal(mesh.faces, faces[name])


def found(shape):
    """(frames with intersections, frames in which a mesh is inside another one, steps with contacts)."""
    scene = hc.Scene()
    for name, faces in planted.faces().items():
        scene.add_mesh(name, faces, n_vertices=shape[name].shape[1])
    detector = hc.Detector(scene, threads=1)
    frames = np.concatenate([shape[name] for name in planted.NAMES], axis=1)
    intersecting = {k for k in range(len(frames)) if len(detector.intersections(frames[k]).ef)}
    inside = {k for k in range(len(frames)) if any(gap.inside for gap in detector.distances(frames[k]))}
    contacts = [detector.detect(a, b) for a, b in zip(frames, frames[1:], strict=False)]
    return intersecting, inside, {k for k, step in enumerate(contacts) if len(step)}


@pytest.mark.parametrize("defect", planted.DEFECTS, ids=[defect.name for defect in planted.DEFECTS])
def test_each_defect_is_where_it_is_listed(defect):
    intersecting, inside, steps = found(planted.positions([defect]))
    assert intersecting == set(defect.frames) and inside == set(defect.inside)
    between = {k for k in range(planted.N_FRAMES - 1) if {k, k + 1} <= set(defect.frames)}
    assert set(defect.steps) <= steps <= set(defect.steps) | between


def test_without_defects_the_sequence_is_clean():
    assert found(planted.positions([])) == (set(), set(), set())
