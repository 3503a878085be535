# SPDX-License-Identifier: Apache-2.0
"""The arm drags the cloth: who holds it, who touches what, and that links are where kinematics puts them."""

import dataclasses

import numpy as np
import pytest

import hpccd_core
from hpccd_ros import scenes
from hpccd_ros.bench import sources
from hpccd_ros.robots import arm
from hpccd_ros.scenes import dragged_cloth, messages
from hpccd_ros.scenes.gripper import LENGTH, THICKNESS, WIDTH, Gripper, in_grip, under_tips
from hpccd_ros.scenes.robot import CORNER_STEPS, JOINT_STEPS

SETUP = dragged_cloth.Setup()
FINE = 1501  # frames: 250 a second
#: What cubics between samples and single precision may add.
SLACK = 2e-5


@pytest.fixture(scope="module")
def scene():
    return scenes.make("arm-and-cloth")


def seen_by_the_gripper(scene, index):
    frame = scene.frame(index)
    gripper = Gripper(frame.time)
    return gripper.local(frame[1].T.astype(float)), gripper


def at(scene, time):
    return round(time / scene.frame_period)


def test_meshes_are_table_cloth_and_the_links_of_the_robot(scene):
    (robot,) = scene.robots
    links = [f"arm/{link.name}" for link in robot.robot.description.links]
    assert scene.mesh_names == ["table", "cloth", *links] and len(links) == 11
    assert [mesh.name for mesh in scene.sent_meshes] == ["table", "cloth"]
    assert [mesh.name for mesh in scene.meshes if mesh.static] == ["table"]
    assert [mesh.name for mesh in scene.meshes if mesh.self_collision] == ["cloth"]
    assert len(scene.meshes[1].faces) == 5_000
    table = scene.frame(0)[0]
    assert table.max(axis=0) == pytest.approx([arm.TABLE[1], arm.TABLE[3], 0.0])
    assert table.min(axis=0) == pytest.approx([arm.TABLE[0], arm.TABLE[2], -0.03])


@pytest.mark.parametrize("index", [0, 77, 203, 360])
def test_links_are_where_kinematics_puts_them(scene, index):
    frame, (robot,) = scene.frame(index), scene.robots
    joints = robot.joint_positions(frame.time)
    for name, exact in arm.joint_positions(frame.time).items():
        assert joints.get(name, exact) == pytest.approx(exact, abs=0.5 / JOINT_STEPS)
    assert list(joints) == list(robot.robot.kinematics.inputs)
    placements = robot.robot.placements(robot.robot.kinematics.state(joints))
    for vertices, placement in zip(frame[2:], placements, strict=True):
        # Single precision of at most 1 m, and the corners' rounding.
        assert np.abs(vertices - placement.vertices).max() < 2**-24 + 1 / CORNER_STEPS


@pytest.mark.parametrize("frames", [361, FINE])
def test_other_libraries_sines_round_to_the_same_joints_and_corners(scene, frames):
    """No value is so near to the middle between two steps that one off by 1e-14 would be rounded elsewhere."""
    (robot,) = scene.robots
    motion = [robot.motion(arm.DURATION * (k / (frames - 1))) for k in range(frames)]
    joints = np.array([[values[name] for name in robot.robot.kinematics.inputs] for values in motion])
    corners = np.concatenate([mesh.vertices for mesh in robot.robot.meshes])
    for values, steps in ((joints, JOINT_STEPS), (corners, CORNER_STEPS)):
        scaled = values * steps
        from_middle = np.abs(scaled - np.floor(scaled) - 0.5) / steps
        assert from_middle.min() > 1e-14


def test_cloth_is_taken_dragged_and_left(scene):
    grasp, closed, release = (at(scene, time) for time in (arm.CLOSING[0], arm.CLOSING[1], arm.OPENING[0]))
    flat = scene.frame(0)[1]
    assert np.abs(scene.frame(grasp)[1] - flat)[:, :2].max() < 1e-4, "it lies still until the fingers are there"
    q, gripper = seen_by_the_gripper(scene, closed)
    held = in_grip(q, gripper.opening, 1e-3)
    pads, opening = seen_by_the_gripper(scene, grasp)
    pads = under_tips(pads, opening.opening, 0.0)
    assert held.sum() >= 10 and pads.sum() >= 4
    assert q[2][held].max() > 0.02, "a fold stands up between the fingers"
    for index in range(closed + 1, release, 7):
        later, _ = seen_by_the_gripper(scene, index)
        assert np.abs(later - q)[:, held | pads].max() < SLACK
    path = np.array(arm.RELEASE) - arm.GRASP
    moved = (scene.frame(release)[1] - flat)[:, :2]
    assert np.abs(moved[held].mean(axis=0) - path).max() < 0.02
    assert np.abs(moved.mean(axis=0) - path).max() < 0.1
    after = scene.frame(at(scene, arm.OPENING[1]))[1], scene.frame(len(scene) - 1)[1]
    assert np.abs(after[1] - after[0])[:, :2].mean() < 2e-3, "let go, it stays"
    q, _ = seen_by_the_gripper(scene, len(scene) - 1)
    assert q[2].max() < -0.05, "the gripper is above it"


def test_cloth_stays_above_the_table_and_out_of_the_fingers(scene):
    for index in range(len(scene)):
        q, gripper = seen_by_the_gripper(scene, index)
        cloth = scene.frame(index)[1]
        assert cloth[:, 2].min() > -SETUP.sunk - 1e-7
        assert (cloth[:, 0] > arm.TABLE[0]).all() and (cloth[:, 0] < arm.TABLE[1]).all()
        assert (cloth[:, 1] > arm.TABLE[2]).all() and (cloth[:, 1] < arm.TABLE[3]).all()
        for side in (1, -1):
            into = side * q[1] - gripper.opening
            inside = [WIDTH / 2 - np.abs(q[0]), into, THICKNESS - into, q[2], LENGTH - q[2]]
            assert np.minimum.reduce(inside).max() < SETUP.depth + SLACK


def test_cloth_does_not_tear(scene):
    faces = scene.meshes[1].faces
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    ends = [scene.frame(k)[1][edges].astype(float) for k in range(0, len(scene), 20)]
    lengths = np.array([np.linalg.norm(e[:, 0] - e[:, 1], axis=1) for e in ends])
    stretch = lengths / lengths[0]
    assert np.quantile(stretch, 0.99, axis=1).max() < 1.2
    # More were an edge that goes round a finger, or through it.
    assert stretch.max() < 1.7


def contacts_of_pairs(scene, index):
    """{(mesh, mesh): contacts} of the step to frame `index`."""
    detector = hpccd_core.Detector(scenes.core_scene(scene))
    found = detector.detect(scene.frame(index - 1).stacked(), scene.frame(index).stacked())
    vertices, faces = (
        np.cumsum(counts) for counts in zip(*((m.n_vertices, len(m.faces)) for m in scene.meshes), strict=True)
    )
    sides = [
        *zip(*(np.searchsorted(vertices, found.ee[:, k], side="right") for k in (0, 2)), strict=True),
        *zip(
            np.searchsorted(vertices, found.vf[:, 0], side="right"),
            np.searchsorted(faces, found.vf[:, 1], side="right"),
            strict=True,
        ),
    ]
    pairs = {}
    for a, b in sides:
        pair = tuple(sorted((scene.mesh_names[a], scene.mesh_names[b])))
        pairs[pair] = pairs.get(pair, 0) + 1
    return pairs


def test_contacts_are_those_that_one_sees(scene):
    assert contacts_of_pairs(scene, 40) == {}, "the fingers are still above"
    total = {}
    for index in range(at(scene, arm.CLOSING[0]) + 1, len(scene), 5):
        found = contacts_of_pairs(scene, index)
        assert sum(found.values()) < 2_000
        for pair, count in found.items():
            total[pair] = total.get(pair, 0) + count
    fingers = {"arm/finger_left", "arm/finger_right"}
    assert {name for pair in total for name in pair} == {"table", "cloth", *fingers}
    assert total["cloth", "table"] > 1_000 and sum(total.get((name, "cloth"), 0) for name in fingers) > 50
    assert not {("arm/finger_left", "table"), ("arm/finger_right", "table")} & set(total)


def test_ignored_pairs_are_not_tested(scene):
    """Links that are joined overlap: whoever tests them sees them touch."""
    vertices = scene.frame(150).stacked()

    def pairs(of):
        gaps = hpccd_core.Detector(scenes.core_scene(of)).distances(vertices)
        return {tuple(sorted((gap.mesh_a, gap.mesh_b))): gap.distance for gap in gaps}

    ignored = {tuple(sorted(pair)) for pair in scene.ignored_pairs}
    assert ("arm/link_1", "arm/link_2") in ignored
    honoured, all_pairs = pairs(scene), pairs(dataclasses.replace(scene, ignored_pairs=()))
    assert ignored == set(all_pairs) - set(honoured)
    assert min(all_pairs[pair] for pair in ignored) < 1e-3
    assert min(distance for pair, distance in honoured.items() if "cloth" not in pair) > 5e-4
    assert sources.of_scene("arm-and-cloth", 0.05).step(3).ignored_pairs == scene.ignored_pairs


def test_other_ignored_pairs_than_a_robots_own_are_given_to_the_node(scene):
    more = dataclasses.replace(scene, ignored_pairs=(*scene.ignored_pairs, ("arm/base", "table")))
    assert messages.node_parameters(more)["ignored_pairs"] == ["arm/base:table"]
    assert "ignored_pairs" not in messages.node_parameters(scene)


def test_size_is_that_of_the_cloth(scene):
    small, large = (scenes.make("arm-and-cloth", size=size, frames=5) for size in (0.25, 4.0))
    assert len(small.meshes[1].faces) == pytest.approx(1250, rel=0.06)
    assert len(large.meshes[1].faces) == pytest.approx(20_000, rel=0.06)
    for other in (small, large):
        for k, mesh in enumerate(scene.meshes):
            if mesh.name != "cloth":
                np.testing.assert_array_equal(other.frame(3)[k], scene.frame(270)[k])
        assert np.abs(other.frame(3)[1].mean(axis=0) - scene.frame(270)[1].mean(axis=0)).max() < 2e-3


def test_more_frames_show_the_same_motion_finer(scene):
    fine = scenes.make("arm-and-cloth", frames=FINE)
    assert fine.frame_period == pytest.approx(1 / 250) and scene.frame_period == pytest.approx(1 / 60)
    for index in (0, 500, 1000, 1500):
        for a, b in zip(fine.frame(index), scene.frame(index * 360 // 1500), strict=True):
            assert np.abs(a - b).max() < 1e-6
    # Between two frames of the coarse one the cloth goes on, no faster than about a metre a second.
    steps = np.array([np.abs(fine.frame(k)[1] - fine.frame(k - 1)[1]).max() for k in range(700, 730)])
    assert 1e-4 < steps.min() and steps.max() < 4e-3
