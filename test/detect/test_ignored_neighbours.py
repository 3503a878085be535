# SPDX-License-Identifier: Apache-2.0
"""Neighbours within a mesh that are ignored: by rings of edges, or by their distance at rest, in a file or in the first
frame. No ROS."""

from dataclasses import replace

import numpy as np
import pytest
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.interpenetration import InterpenetrationDetector
from hpccd_ros.detect.rest_shapes import RestShapes
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

N = 8
SHEET = Topology(3, N * N, sheet_faces(N))
OTHER = Topology(4, N * N, sheet_faces(N)[::-1].copy())
DISTANCE = 0.05
CLOTH = MeshSettings("cloth", ignored_at_rest=DISTANCE)
THICK = Options(backend="cpu", threads=1, thickness=(("cloth", 0.02),), distances=True)


def frame(k, topology=SHEET):
    return SceneFrame(k, k, "", (topology,), (sheet_positions(N, k),), ("cloth",), 0.0)


def core(topology=SHEET, **filters):
    scene = hc.Scene()
    scene.add_mesh("cloth", topology.faces, thickness=0.02)
    if filters:
        scene.ignore_within("cloth", **filters)
    return hc.Detector(scene, backend="cpu", threads=1)


def same(found, detector, k):
    expected = detector.detect(sheet_positions(N, k), sheet_positions(N, k + 1))
    assert found.contacts == expected and found.contacts.hash == expected.hash
    assert [g.distance for g in found.gaps] == [g.distance for g in detector.distances(sheet_positions(N, k + 1))]
    return len(expected)


def at_rest(k, **given):
    return core(rest_vertices=sheet_positions(N, k), distance=DISTANCE, **given)


def test_rings():
    detector = StepDetector(SceneBuilder((replace(CLOTH, ignored_at_rest=None, ignored_rings=2),)), THICK)
    count = same(detector.detect(frame(0), frame(1)), core(rings=2), 0)
    assert 0 < count < len(core().detect(sheet_positions(N, 0), sheet_positions(N, 1)))


def test_the_first_frame_is_at_rest_until_the_triangles_change():
    detector = StepDetector(SceneBuilder((CLOTH,)), THICK)
    found = detector.detect(frame(5), frame(6))
    same(found, at_rest(5), 5)
    assert found.rest_stamps == (5,)
    made = detector._detector
    found = detector.detect(frame(6), frame(7))
    same(found, at_rest(5), 6)
    assert found.rest_stamps == (5,) and detector._detector is made
    found = detector.detect(frame(8, OTHER), frame(9, OTHER))
    assert found.rest_stamps == (8,)
    expected = at_rest(8, topology=OTHER).detect(sheet_positions(N, 8), sheet_positions(N, 9))
    assert found.contacts == expected


def test_a_file_has_the_shape_at_rest():
    of_file = replace(SHEET, rest=sheet_positions(N, 3).astype(np.float64))
    found = StepDetector(SceneBuilder((CLOTH,)), THICK).detect(frame(5, of_file), frame(6, of_file))
    same(found, at_rest(3), 5)
    assert found.rest_stamps == ()


def test_detectors_share_shapes():
    builder, rest = SceneBuilder((CLOTH,)), RestShapes((0,))
    first, second = (StepDetector(builder, THICK, rest) for _ in range(2))
    first.detect(frame(2), frame(3))
    assert second.detect(frame(4), frame(5)).rest_stamps == (2,)
    rest.forget()
    assert second.detect(frame(4), frame(5)).rest_stamps == (4,)


def test_meshes_without_pairs_within_need_no_shape():
    settings = (replace(CLOTH, self_collision=False), MeshSettings("net"))
    assert SceneBuilder(settings).rest_of_frames == ()
    assert SceneBuilder((CLOTH, MeshSettings("net"))).rest_of_frames == (0,)
    SceneBuilder((replace(CLOTH, self_collision=False),)).build((SHEET,))
    with pytest.raises(
        ValueError, match=r"mesh.cloth.ignored_at_rest: the shape at rest is unknown here; give mesh.clo"
    ):
        SceneBuilder((CLOTH,)).build((SHEET,))


def test_no_curve_is_drawn_along_a_seam_that_is_ignored():
    panel, faces = hc.shapes.grid(4, 4)
    vertices = np.vstack([panel, panel + [2, 0, 0]])
    seam = Topology(5, len(vertices), np.vstack([faces, faces + len(panel)]))
    moved = vertices * [1.0, 1.0, 0.5] + [0, 0, 3.0]
    search = InterpenetrationDetector(SceneBuilder((replace(CLOTH, ignored_at_rest=0.0),)))
    of_file = replace(seam, rest=vertices)
    assert len(search.intersections((seam,), (moved,))) > 0  # the shape at rest is unknown
    assert len(search.intersections((seam,), (moved,), (vertices,))) == 0
    apart = vertices + np.repeat([[0, 0, 0], [0, 0, 1]], len(panel), axis=0)
    assert len(search.intersections((seam,), (moved,), (apart,))) > 0
    assert len(search.intersections((of_file,), (moved,))) == 0
    found = StepDetector(SceneBuilder((replace(CLOTH, ignored_at_rest=0.0),)), Options(backend="cpu")).detect(
        SceneFrame(0, 0, "", (seam,), (vertices,), ("cloth",), 0.0),
        SceneFrame(1, 1, "", (seam,), (moved,), ("cloth",), 0.0),
    )
    assert len(search.intersections((seam,), (moved,), found.rest)) == 0
