# SPDX-License-Identifier: Apache-2.0
"""A robot whole: from its texts to contacts."""

from itertools import pairwise

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.rigid.cuts import Margin, fewest_parts, grown
from hpccd_core.rigid.motion import Linear
from hpccd_core.rigid.transform import IDENTITY, Rigid
from hpccd_ros.frames.types import TF
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.robot import Robot

URDF = """<robot name="swing"><link name="base"/>
<link name="rod"><collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.02 0.02"/></geometry></collision></link>
<link name="bob"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<link name="tip"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/></joint>
<joint name="slide" type="prismatic"><parent link="rod"/><child link="bob"/><axis xyz="1 0 0"/></joint>
<joint name="roll" type="continuous"><parent link="bob"/><child link="tip"/><origin xyz="0 0 1"/></joint></robot>"""
SRDF = '<robot name="swing"><disable_collisions link1="rod" link2="tip"/></robot>'


def test_links_with_geometry_are_meshes_with_names_and_bodies():
    robot = Robot.of(URDF)
    assert [mesh.name for mesh in robot.meshes] == ["swing/rod", "swing/bob", "swing/tip"]
    for mesh in robot.meshes:
        assert mesh.topology.n_vertices == len(mesh.vertices) == len(mesh.body.vertices)
        assert mesh.topology.faces.max() == len(mesh.vertices) - 1
    assert robot.ignored_pairs == (("swing/bob", "swing/rod"), ("swing/bob", "swing/tip"))


def test_the_srdf_and_a_name_of_ones_own():
    robot = Robot.of(URDF, SRDF, name="arm")
    assert {frozenset(pair) for pair in robot.ignored_pairs} == {
        frozenset(("arm/" + a, "arm/" + b)) for a, b in [("rod", "bob"), ("bob", "tip"), ("rod", "tip")]
    }


def test_a_srdf_of_which_an_entry_names_no_link_of_the_robot_is_used_with_a_warning():
    robot = Robot.of(URDF, SRDF.replace("</", '<disable_collisions link1="bob" link2="gripper_of_another"/></'))
    assert robot.ignored_pairs == Robot.of(URDF, SRDF).ignored_pairs
    (warning,) = robot.warnings
    assert "are ignored: <disable_collisions> in line 1 names 'gripper_of_another'" in warning
    assert Robot.of(URDF, SRDF).warnings == ()


def test_slashes_and_colons_of_links_become_underscores_in_names_of_meshes():
    text = URDF.replace('"rod"', '"left/rod:1"').replace('"base"', '"left/base:1"').replace('"turn"', '"left/turn:1"')
    robot = Robot.of(text, SRDF.replace('"rod"', '"left/rod:1"'), name="arm")
    assert [mesh.name for mesh in robot.meshes] == ["arm/left_rod_1", "arm/bob", "arm/tip"]
    assert robot.ignored_pairs == (("arm/bob", "arm/left_rod_1"), ("arm/bob", "arm/tip"), ("arm/left_rod_1", "arm/tip"))
    assert robot.warnings == (
        "URDF: in names of meshes / and : become _: link 'left/rod:1' is arm/left_rod_1",
    )  # of the base, which has no geometry, nothing is said
    assert robot.settings("b_")[0].frame == "b_left/rod:1"
    assert robot.kinematics.inputs[0] == "left/turn:1"
    with pytest.raises(RobotError, match="'left/rod' and 'left:rod' would both be the mesh 'swing/left_rod'.*rename"):
        Robot.of(URDF.replace('"rod"', '"left/rod"').replace('"bob"', '"left:rod"'))


def test_a_box_without_thickness_is_a_surface_that_is_touched():
    """A ground plane, as people write it, and a ball that falls through it."""
    ground = Robot.of(
        '<robot name="world"><link name="ground"><collision><origin xyz="0 0 0.5"/><geometry><box size="4 6 0"/>'
        "</geometry></collision></link></robot>"
    )
    ball = Robot.of(
        '<robot name="b"><link name="l"><collision><geometry><sphere radius="1"/></geometry></collision></link></robot>'
    )
    (plane,), (round_one,) = ground.meshes, ball.meshes
    scene = hc.Scene()
    scene.add_mesh("plane", plane.topology.faces, n_vertices=plane.topology.n_vertices, self_collision=False)
    scene.add_mesh("ball", round_one.topology.faces, self_collision=False)
    t0, t1 = (np.concatenate([plane.vertices, round_one.vertices + [0.3, 0.2, z]]) for z in (3.5, -3.5))
    contacts = hc.Detector(scene).detect(t0, t1)
    assert contacts.first_toc == pytest.approx(2.0 / 7.0, abs=1e-3)
    assert hc.Detector(scene).distances(t0)[0].distance == pytest.approx(2.0, abs=1e-3)


def test_settings_are_those_of_meshes_that_transforms_move():
    settings = Robot.of(URDF, name="arm").settings("left_")
    assert [(s.name, s.frame, s.input, s.rigid) for s in settings][0] == ("arm/rod", "left_rod", TF, True)
    assert not any(s.self_collision or s.static for s in settings)


def test_placements_are_the_links_at_their_poses():
    robot = Robot.of(URDF)
    state = robot.kinematics.state({"turn": np.pi / 2, "slide": 0.25, "roll": 0.0}, Rigid.of([0, 0, 2.0], [0, 0, 0, 1]))
    rod, bob, tip = robot.placements(state)
    assert rod.vertices.max(axis=0) == pytest.approx([0.01, 1.0, 2.01])
    assert bob.vertices.mean(axis=0) == pytest.approx([0.0, 0.25, 2.0])
    assert tip.vertices.mean(axis=0) == pytest.approx([0.0, 0.25, 3.0])
    assert rod.body is robot.meshes[0].body


@pytest.mark.parametrize("base", [IDENTITY, Rigid.of([1.0, -2.0, 0.5], [0.5, -0.5, 0.5, 0.5])], ids=["origin", "far"])
def test_vertices_placed_together_are_those_of_each_pose(base):
    robot = Robot.of(URDF)
    placements = robot.placements(robot.kinematics.state({"turn": 0.7, "slide": -0.25, "roll": -0.0}, base))
    for placement, mesh in zip(placements, robot.meshes, strict=True):
        assert placement.vertices.tobytes() == placement.pose.apply(mesh.vertices).tobytes()
        assert placement.moved(IDENTITY).vertices.tobytes() == placement.vertices.tobytes()


def test_places_that_the_core_cannot_take_are_rejected():
    for offset in ("1e200", "1e147"):
        with pytest.raises(RobotError, match="fully stretched, the robot would reach 1.4"):
            Robot.of(URDF.replace('xyz="0 0 1"/></joint></robot>', f'xyz="{offset} {offset} 0"/></joint></robot>'))
    robot = Robot.of(URDF)
    state = robot.kinematics.state({"turn": 0.0, "slide": 0.0, "roll": 0.0}, Rigid.of((0, 2e147, 0), (0, 0, 0, 1)))
    with pytest.raises(RobotError, match="in mesh 'swing/rod' vertex 0 is .* a mesh that moves by poses must lie in"):
        robot.placements(state)


def test_the_finer_the_tolerance_the_more_triangles():
    fine, coarse = (len(Robot.of(URDF, tolerance=tolerance).meshes[1].topology.faces) for tolerance in (1e-4, 1e-2))
    assert fine > 4 * coarse


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"geometry": "visual"}, "geometry: no link has <visual>, so the robot has no meshes; try collision"),
        ({"geometry": "both"}, "geometry: 'both'"),
        ({"urdf_text": URDF.replace(' name="swing"', "")}, "name: the description has none; give one"),
        (
            {"srdf_text": SRDF.replace("link2", "link3")},
            "SRDF, line 1: <disable_collisions> has no attribute link2; add it",
        ),
        ({"tolerance": 0.0}, "link 'bob': tolerance 0: must be above 0"),
    ],
)
def test_what_cannot_be_used_is_rejected(arguments, message):
    with pytest.raises(RobotError, match=message):
        Robot.of(**({"urdf_text": URDF} | arguments))


def test_a_contact_that_straight_lines_cut_short_is_found():
    """The bob swings by half a turn; a pin stands where only the arc passes, not its chord."""
    robot = Robot.of(URDF)
    still = {"slide": 1.0, "roll": 0.0}
    start, end = (robot.kinematics.state({"turn": turn} | still) for turn in (-1.5, 1.5))
    pin = np.array([[1.0, -0.01, -0.1], [1.02, 0.01, -0.1], [1.0, 0.0, 0.1]])
    scene = hc.Scene()
    for mesh in robot.meshes:
        scene.add_mesh(mesh.name, mesh.topology.faces, self_collision=False)
    scene.add_mesh("pin", np.array([[0, 1, 2]]), static=True)
    for pair in robot.ignored_pairs:
        scene.ignore_pair(*pair)
    motions = [*robot.motions(start, end), Linear(pin, pin)]
    detector = hc.Detector(scene)
    straight = detector.detect(*(np.concatenate([m.vertices(cut, 1) for m in motions]) for cut in (0, 1)))
    assert not len(straight)
    cut = fewest_parts(motions, 1e-3, 64)
    margins = [Margin.of(motion, cut.parts) for motion in motions]
    for mesh, margin in zip(robot.meshes, margins, strict=False):
        detector.set_separation(mesh.name, "pin", grown(0.0, margin, margins[-1]))
    frames = [np.concatenate([m.vertices(k, cut.parts) for m in motions]) for k in range(cut.parts + 1)]
    assert cut.enough and sum(len(detector.detect(a, b)) for a, b in pairwise(frames)) > 0
