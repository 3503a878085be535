# SPDX-License-Identifier: Apache-2.0
"""Some hundred damaged and odd URDFs, SRDFs and parameters of robots, at random: each makes a robot that the core
accepts, or is rejected with RobotError or ParameterError. Nothing else is raised."""

import random
import re

import numpy as np
import pytest
from random_urdf import random_urdf

from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import robot_files
from hpccd_ros.params import robot_parameters, scene_parameters, values
from hpccd_ros.params.values import ParameterError
from hpccd_ros.robots import arm
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.joint_history import JointHistory

ODD = [
    "",
    " ",
    "0",
    "-0.0",
    "-1",
    "1e-320",
    "1e300",
    "1e400",
    "nan",
    "inf",
    "1 2",
    "0 0 0",
    "1 0 1",
    "1 1 1 1",
    "1,5",
    "a/b",
    "a:b",
    "/",
    ":",
    "base",
    "link_1",
    "joint_1",
    "hand",
    "ü",
    "\ufffd",
    "\u200b",
    "x" * 300,
    "${pi}",
    "fixed",
    "floating",
    "continuous",
    "mesh.stl",
    "package://nowhere/a.stl",
    "file:///dev/null",
    "~nosuchuser/a.stl",
]
TAGS = ["box", "sphere", "cylinder", "capsule", "mesh", "link", "joint", "limit", "mimic", "origin", "axis", "geometry"]
SRDF = """<robot name="arm"><disable_collisions link1="base" link2="link_2" reason="Never"/>
<enable_collisions link1="hand" link2="link_7"/><disable_default_collisions link="finger_left"/>
<group name="g"><joint name="joint_1"/></group><passive_joint name="joint_9"/></robot>"""
SHAPES = [
    f"<collision><geometry><{shape}/></geometry></collision>"
    for shape in ('box size="1 2 0"', 'sphere radius="0.1"', 'capsule radius="0.1" length="1"', 'mesh filename="a.obj"')
]
ENCODINGS = ["utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"]
PARAMETERS = {
    "geometry": ["collision", "visual", "both", ""],
    "tolerance": [1e-3, 0.1, 1e-9, 1e-300, 0.0, -1.0, float("nan"), 1e300, 5, "fine"],
    "joint_states": ["joint_states", "", "a b", 3],
    "frame_prefix": ["", "left/", ":"],
    "pose": [[0.0] * 6 + [1.0], [0.0] * 7, [1.0], [], [1e300] * 3 + [0.0, 0.0, 0.0, 1.0], [float("nan")] * 7, "origin"],
}
PAIRS = ["r:r", "r/hand:cloth", "r/nothing:cloth", "r/:cloth", "cloth:cloth", "r", "r/hand:r/hand", "::", "r/a:b:cloth"]


def damaged(rng, text, changes):
    for _ in range(changes):
        kind = rng.randrange(5)
        attributes = list(re.finditer(r'"[^"]*"', text))
        elements = list(re.finditer(r"<[^<>]*/>", text))
        if kind <= 1 and attributes:
            at = rng.choice(attributes)
            text = f'{text[: at.start()]}"{rng.choice(ODD)}"{text[at.end() :]}'
        elif kind == 2 and elements:  # leave out, or repeat
            at = rng.choice(elements)
            text = text[: at.start()] + at[0] * rng.choice([0, 2]) + text[at.end() :]
        elif kind == 3:
            text = re.sub(rf"<(/?){rng.choice(TAGS)}\b", rf"<\1{rng.choice(TAGS)}", text)
        elif rng.random() < 0.2:
            at = rng.randrange(len(text) + 1)
            text = text[:at] + rng.choice(["", "<", "&", "\0", "<!DOCTYPE r>", "]]>"]) + text[at + rng.randrange(3) :]
    return text


def in_bytes(rng, text):
    encoding = rng.choice(ENCODINGS)
    if rng.random() < 0.15:
        declared = rng.choice(["ISO-8859-1", "UTF-16", "klingon", encoding])
        text = f'<?xml version="1.0" encoding="{declared}"?>' + re.sub(r"^<\?xml.*?\?>", "", text)
    return text.encode(encoding, "replace")


def given_parameters(rng):
    given = {"robots": ["r"], "meshes": ["cloth"], "frame_id": rng.choice(["world"] * 9 + [""])}
    for name, choices in PARAMETERS.items():
        if rng.random() < 0.05:
            given[f"robot.r.{name}"] = rng.choice(choices)
    for name, value in (("ignored_pairs", ""), ("pair_separation", ":0.01"), ("pair_accuracy", ":exact")):
        if rng.random() < 0.05:
            given[name] = [rng.choice(PAIRS) + value]
    if rng.random() < 0.15:
        given["stop_distance"] = 0.01
    return given


def used(rng, folder, number):
    """All that a node does with them before a frame comes, and one state of the robot."""
    text = arm.description() if rng.random() < 0.5 else random_urdf(np.random.default_rng(number), links=8)[0]
    text = re.sub("></link>", lambda _: f">{rng.choice(SHAPES)}</link>", text)
    changes = rng.choice([0, 1, 1, 2, 4])
    for name, content in (("r.urdf", damaged(rng, text, changes)), ("r.srdf", damaged(rng, SRDF, rng.randrange(2)))):
        (folder / name).write_bytes(in_bytes(rng, content))
    (folder / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    settings, meshes = values.checked({"robot.r.joint_states": "joint_states", **given_parameters(rng)})
    scene_parameters.check(settings, meshes)
    of_robot = settings["robot"]["r"]
    urdf_text, srdf_text = (robot_files.text_of(str(folder / name)) for name in ("r.urdf", "r.srdf"))
    if rng.random() < 0.3:  # as rclpy gives what came on a topic
        urdf_text = (folder / "r.urdf").read_bytes().decode("utf-8", "replace")
    find = robot_files.resolver(str(folder / "r.urdf"))
    robot = robot_files.robot_of("r", of_robot, urdf_text, srdf_text, find)
    robots = {"r": robot}
    scene_parameters.check(settings, meshes, robots)
    scene_parameters.detector_options(settings, robots)
    robot_parameters.followers(settings, robots, 10)
    topologies = (Topology(0, 3, np.array([[0, 1, 2]], np.uint32)), *(mesh.topology for mesh in robot.meshes))
    scene_parameters.scene_builder(settings, meshes, robots).build(topologies)
    joints = JointHistory(robot.kinematics)
    joints.add(1, robot.kinematics.inputs, [rng.choice([0.0, 0.5, -3.0]) for _ in robot.kinematics.inputs])
    robot.placements(robot.kinematics.state(joints.at(1)))


@pytest.mark.parametrize("block", range(4))
def test_nothing_but_errors_of_robots_and_parameters_is_raised(tmp_path, block):
    taken, rejected = 0, set()
    for number in range(100 * block, 100 * (block + 1)):
        try:
            used(random.Random(number), tmp_path, number)
            taken += 1
        except (RobotError, ParameterError) as error:
            assert "\n" not in str(error) and len(str(error)) < 2000, number
            rejected.add(re.sub(r"[0-9'].*", "", str(error)))
    assert taken >= 15 and len(rejected) >= 10, (taken, sorted(rejected))
