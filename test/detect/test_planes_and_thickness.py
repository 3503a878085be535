# SPDX-License-Identifier: Apache-2.0
"""Steps with planes, thick meshes and ignored neighbours: equal to the core, kept from step to step. No ROS."""

from dataclasses import replace

import numpy as np
import pytest
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.pair_summary import summarise
from hpccd_ros.detect.plane_patch import patch
from hpccd_ros.detect.scene import PlaneSettings, SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import NO_FACES, MeshSettings, Placement, SceneFrame, Topology

N = 8
SHEET = Topology(3, N * N, sheet_faces(N))
CLOTH, FLOOR = MeshSettings("cloth"), PlaneSettings("floor", (0.0, 0.0, 1.0), 0.0)
WALL = PlaneSettings("wall", (-2.0, 0.0, 0.0), -0.5)  # x <= 0.25
OPTIONS = Options(backend="cpu", threads=1, distances=True)


def frame(k, topology=SHEET, positions=None):
    return SceneFrame(
        k, k, "", (topology,), (sheet_positions(N, k) if positions is None else positions,), ("cloth",), 0.0
    )


def core(thickness=0.0, separations=(), **filters):
    scene = hc.Scene()
    scene.add_mesh("cloth", SHEET.faces, thickness=thickness)
    scene.add_plane("floor")
    scene.add_plane("wall", (-2, 0, 0), -0.5)
    for pair in separations:
        scene.set_separation(*pair)
    for filter_ in filters.values():
        scene.ignore_within("cloth", **filter_)
    return hc.Detector(scene, backend="cpu", threads=1)


def same(found, detector, k=0):
    expected = detector.detect(sheet_positions(N, k), sheet_positions(N, k + 1))
    assert found.contacts == expected and found.contacts.hash == expected.hash
    if found.gaps is not None:
        gaps = detector.distances(sheet_positions(N, k + 1))
        assert [(g.mesh_a, g.mesh_b, g.distance, g.kind) for g in found.gaps] == [
            (g.mesh_a, g.mesh_b, g.distance, g.kind) for g in gaps
        ]
    return expected


def test_planes_come_after_the_meshes():
    builder = SceneBuilder((CLOTH,), planes=(FLOOR, WALL))
    found = StepDetector(builder, OPTIONS).detect(frame(0), frame(1))
    expected = same(found, core())
    assert len(expected.vp) > 0 and set(expected.vp[:, 1]) == {0, 1}
    assert found.layout.mesh_names == ("cloth", "floor", "wall") and found.layout.topology_versions == (3, 0, 0)
    assert found.layout.planes.tolist() == [1, 2]
    summaries = {(s.mesh_a, s.mesh_b): s for s in summarise(found)}
    assert list(summaries) == [("cloth", "cloth"), ("cloth", "floor"), ("cloth", "wall")]
    for plane, name in enumerate(("floor", "wall")):
        rows = expected.vp[:, 1] == plane
        assert summaries["cloth", name].count == rows.sum()
        assert summaries["cloth", name].first_toc == expected.vp_toc[rows].min()


def test_thickness_and_separations_change_without_a_new_detector():
    builder = SceneBuilder((CLOTH,), planes=(FLOOR, WALL))
    detector = StepDetector(builder, OPTIONS)
    detector.detect(frame(0), frame(1))
    kept = detector._detector
    detector.options = replace(OPTIONS, thickness=(("cloth", 0.01),))
    found = detector.detect(frame(0), frame(1))
    same(found, core(0.01))
    assert found.near == len(found.contacts), "all pairs are of the thick mesh"
    pairs = (("cloth", "wall", 0.02),)
    detector.options = replace(OPTIONS, thickness=(("cloth", 0.002),), separation=Separation(0.0, pairs))
    same(detector.detect(frame(0), frame(1)), core(0.002, pairs))
    detector.options = OPTIONS
    found = detector.detect(frame(0), frame(1))
    same(found, core())
    assert found.near == 0 and detector._detector is kept


def test_ignored_planes():
    builder = SceneBuilder((CLOTH,), (("cloth", "floor"),), planes=(FLOOR, WALL))
    found = StepDetector(builder, OPTIONS).detect(frame(0), frame(1))
    assert set(found.contacts.vp[:, 1]) == {1}
    assert [(gap.mesh_a, gap.mesh_b) for gap in found.gaps] == [("cloth", "cloth"), ("cloth", "wall")]


def test_a_body_that_moves_by_poses_falls_on_a_plane():
    """The straight lines of each part deviate from the rotation; the plane's separation grows by that bound."""
    vertices, faces = hc.shapes.box((1, 0.2, 0.2))
    topology, body = Topology(0, len(vertices), faces), Body.of(vertices)
    sheet = sheet_positions(N, 0).astype(np.float64) + (5, 0, 5)
    settings = (MeshSettings("box", self_collision=False, input="pose"), MeshSettings("cloth", self_collision=False))

    def at(stamp, pose):
        place = Placement(body, pose)
        return SceneFrame(stamp, stamp, "", (topology, SHEET), (place.vertices, sheet), ("box",), 0.0, (place, None))

    start, end = Rigid.of((0, 0, 0.6), (0, 0, 0, 1)), Rigid.of((0, 0, 0.4), (0, np.sqrt(0.5), 0, np.sqrt(0.5)))
    detector = StepDetector(SceneBuilder(settings, planes=(FLOOR,)), replace(OPTIONS, distances=False))
    found = detector.detect(at(0, start), at(1, end))
    assert found.bounds.parts > 1 and len(found.bounds.of_meshes) == 3 and found.bounds.of_meshes[2] == 0
    # The lowest corner sinks below 0 where 0.6 - 0.2 t < 0.5 sin(90 t) + 0.1 cos(90 t) degrees.
    t = np.linspace(0, 1, 100_001)
    depth = 0.5 * np.sin(np.pi / 2 * t) + 0.1 * np.cos(np.pi / 2 * t) - (0.6 - 0.2 * t)
    true = t[np.argmax(depth > 0)]
    assert len(found.contacts.vp) and true - 0.01 < found.contacts.first_toc <= true
    assert not len(found.contacts.vf) and set(found.contacts.vp[:, 0]) <= set(range(8))


def test_stop_heeds_planes_and_thickness():
    builder = SceneBuilder((CLOTH,), planes=(FLOOR,))
    flat = np.column_stack([sheet_positions(N, 0)[:, :2], np.full(N * N, 0.5)])
    high, low = frame(0, positions=flat), frame(1, positions=flat - (0, 0, 0.25))
    nearness = Nearness(builder, OPTIONS, 0.2)
    assert nearness.within(high, low) == (None, 0.2) and nearness.not_closed(high) == ["cloth"]
    nearness.set(replace(OPTIONS, thickness=(("cloth", 0.05),)), 0.2)
    assert nearness.within(high, low) == (("cloth", "floor"), 0.2)
    nearness.set(OPTIONS, 0.25)
    assert nearness.within(high, low) == (("cloth", "floor"), 0.25), "exactly the distance counts"


def test_patch_of_a_plane():
    vertices = [np.array([[0.0, 0, 1], [2, 0, 1], [0, 2, 1.5]]), np.empty((0, 3))]
    corners = patch(PlaneSettings("floor", (0.0, 0.0, 3.0), 1.5), vertices)
    assert corners.shape == (4, 3) and np.allclose(corners[:, 2], 0.5)
    assert np.allclose(corners.mean(axis=0)[:2], [1, 1])
    assert np.cross(corners[1] - corners[0], corners[2] - corners[0])[2] > 0
    assert patch(PlaneSettings("floor", (0.0, 0.0, 1.0), -100.0), vertices) is None
    assert patch(FLOOR, [np.empty((0, 3))]) is None


@pytest.mark.parametrize("huge", [1e-300, 1e150])
def test_patch_of_a_plane_with_an_extreme_normal(huge):
    corners = patch(PlaneSettings("floor", (0.0, 0.0, huge), 0.0), [np.array([[0.0, 0, 1], [2, 2, 1]])])
    assert np.allclose(corners[:, 2], 0.0)


GRAINS = MeshSettings("grains", points=True)


def grains_and_cloth(k, n=30):
    """Grains fall onto the sheet."""
    grains = np.random.default_rng(2).uniform(0, 0.33, (n, 3)) + (0, 0, 0.2 - 0.25 * k)
    topologies = Topology(n, n, NO_FACES), SHEET
    return SceneFrame(k, k, "", topologies, (grains, sheet_positions(N, k).astype(float)), ("grains", "cloth"), 0.0)


def test_points_of_a_mesh_are_tested_and_heeded_by_stop():
    builder = SceneBuilder((GRAINS, CLOTH))
    options = replace(OPTIONS, thickness=(("grains", 0.02),))
    start, end = grains_and_cloth(0), grains_and_cloth(1)
    found = StepDetector(builder, options).detect(start, end)
    scene = hc.Scene()
    scene.add_points("grains", 30, thickness=0.02)
    scene.add_mesh("cloth", SHEET.faces)
    expected = hc.Detector(scene).detect(*(np.concatenate(frame.vertices) for frame in (start, end)))
    assert found.contacts == expected and min(len(expected.vv), len(expected.vf)) > 0
    summaries = {(s.mesh_a, s.mesh_b): s.count for s in summarise(found)}
    assert summaries["grains", "grains"] == len(expected.vv)
    least = next(gap.distance for gap in found.gaps if (gap.mesh_a, gap.mesh_b) == ("grains", "cloth"))
    nearness = Nearness(builder, options, 0.0)
    assert nearness.within(start, end) == (("grains", "cloth"), 0.0) and least < 0
    with pytest.raises(ValueError, match=r"faces: 98 triangles in a mesh of points; .*take grains out"):
        builder.build((SHEET, SHEET))


def test_points_that_move_by_poses():
    """Each point of a body that turns is tested against a resting one."""
    body = Body.of(np.array([[0.5, 0, 0], [-0.5, 0, 0], [0, 0.5, 0.1]]))
    topologies = Topology(3, 3, NO_FACES), Topology(1, 1, NO_FACES)
    settings = (replace(GRAINS, name="body", self_collision=False, input="pose"), replace(GRAINS, name="grain"))

    def at(stamp, angle):
        place = Placement(body, Rigid.of((0, 0, 0), (0, 0, np.sin(angle / 2), np.cos(angle / 2))))
        resting = np.array([[0.5 * np.cos(1.0), 0.5 * np.sin(1.0), 0]])
        return SceneFrame(stamp, stamp, "", topologies, (place.vertices, resting), ("body",), 0.0, (place, None))

    options = replace(OPTIONS, thickness=(("body", 0.01), ("grain", 0.01)), distances=False)
    found = StepDetector(SceneBuilder(settings), options).detect(at(0, 0.0), at(1, 1.5))
    # The chord of 0.02 is an angle of 0.04.
    true = (1.0 - 2 * np.arcsin(0.02)) / 1.5
    assert found.bounds.parts > 1 and found.contacts.vv.tolist() == [[0, 3]]
    assert true - 0.01 < found.contacts.first_toc <= true
