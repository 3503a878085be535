# SPDX-License-Identifier: Apache-2.0
"""Robots are drawn by their visual geometry, whose links meet; contacts stay those of the collision geometry."""

import dataclasses

import numpy as np
import pytest
from page_parts import Page

import hpccd_core as hc
from hpccd_ros import scenes
from hpccd_ros.bag.reader import Recording
from hpccd_ros.picture.of_recording import meshes_in_the_middle
from hpccd_ros.picture.visual_geometry import VisualGeometry
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay
from hpccd_ros.robots import arm
from hpccd_ros.robots.robot import Robot

FRAMES = 8


@pytest.fixture(scope="module")
def scene():
    return scenes.make("arm-and-cloth", size=0.1, frames=FRAMES)


@pytest.fixture(scope="module")
def recorded(scene, tmp_path_factory):
    from hpccd_ros.scenes import files

    path = tmp_path_factory.mktemp("arm") / "arm.mcap"
    files.write_mcap(scene, path, rate=50.0)
    return path


def test_links_of_the_arm_meet_where_they_are_drawn(scene):
    (robot,) = scene.robots
    seen = dataclasses.replace(robot, geometry="visual")
    joints = [(joint.parent, joint.child) for joint in seen.robot.description.joints]
    core = hc.Scene()
    for mesh in seen.meshes:
        core.add_mesh(mesh.name, mesh.faces, n_vertices=mesh.n_vertices, self_collision=False)
    detector = hc.Detector(core)
    for time in np.linspace(0, arm.DURATION, 7):
        gaps = {
            (gap.mesh_a, gap.mesh_b): gap.distance for gap in detector.distances(np.concatenate(seen.vertices(time)))
        }
        for parent, child in joints:
            a, b = f"arm/{parent}", f"arm/{child}"
            assert gaps.get((a, b), gaps.get((b, a))) < 1e-3, (a, b, time)


def test_contacts_are_of_the_collision_geometry(scene):
    """The visual geometry is larger, and no part of the scene."""
    text = arm.description()
    collision, visual = (Robot.of(text, geometry=kind, name="arm") for kind in ("collision", "visual"))
    assert [mesh.name for mesh in scene.robots[0].meshes] == [mesh.name for mesh in collision.meshes]
    seen, touched = (sum(mesh.topology.n_vertices for mesh in robot.meshes) for robot in (visual, collision))
    assert seen > touched
    assert scene.n_triangles == sum(len(faces) for faces in scene.faces())


def test_a_replay_draws_it_where_the_links_are(scene, recorded):
    with Recording(recorded) as recording:
        setup = recorded_setup.of_recording(recording)
        visual = VisualGeometry(setup.visual())
        step = list(Replay(recording, setup, outputs=("points",)).steps())[-1]
    seen = dataclasses.replace(scene.robots[0], geometry="visual")
    period = scene.frame_period
    expected = [
        0.5 * a + 0.5 * b
        for a, b in zip(seen.vertices((FRAMES - 2) * period), seen.vertices((FRAMES - 1) * period), strict=True)
    ]
    drawn = {name: (vertices, faces) for name, vertices, faces, _ in meshes_in_the_middle(step, visual)}
    assert set(drawn) == set(scene.mesh_names)
    for mesh, vertices in zip(seen.meshes, expected, strict=True):
        assert np.array_equal(drawn[mesh.name][1], mesh.faces)
        assert np.allclose(drawn[mesh.name][0], vertices, atol=1e-5)
    plain = {name: len(faces) for name, _, faces, _ in meshes_in_the_middle(step)}
    assert plain == {mesh.name: len(mesh.faces) for mesh in scene.meshes}


def test_a_page_draws_it_and_keeps_the_links_for_contacts(hpccd, scene, recorded, tmp_path):
    done = hpccd("view", recorded, "--html", "arm.html")
    assert done.returncode == 0, done.stderr
    page = Page(tmp_path / "arm.html")
    meshes = page.said["meshes"]
    assert [mesh["name"] for mesh in meshes[: len(scene.meshes)]] == scene.mesh_names
    links = [mesh for mesh in meshes if mesh["name"].startswith("arm/")]
    hidden = [mesh["group"] for mesh in links if mesh["hidden"]]
    assert set(hidden) == {"arm: collision geometry"} and len(hidden) == len(links) / 2
    assert {mesh["group"] for mesh in links if not mesh["hidden"]} == {"arm"}
    assert len({mesh["colour"] for mesh in links}) == 1
    assert not any(mesh["hidden"] for mesh in meshes if mesh not in links)
    assert np.array_equal(page.faces(0, 0), scene.faces()[0])


def test_a_robot_without_visual_geometry_is_drawn_by_its_collision_geometry(recorded):
    with Recording(recorded) as recording:
        setup = recorded_setup.of_recording(recording)
        names = setup.mesh_names
        step = next(s for s in Replay(recording, setup, outputs=("points",)).steps() if s.contacts is not None)
    assert [name for name, *_ in meshes_in_the_middle(step, VisualGeometry({}))] == names
