# SPDX-License-Identifier: Apache-2.0
"""Mistakes that users make with the node: each is reported with the problem and its remedy."""

import functools
import itertools
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from hpccd.msg import MeshTopology, MeshVertices
from sensor_msgs.msg import JointState, PointCloud2
from sources import SOURCES, SUPPORT
from std_msgs.msg import String
from visualization_msgs.msg import Marker
from waving_sheet import sheet_faces, sheet_positions

from hpccd_ros.middleware import fields, mesh_messages, qos

CLOTH = {"meshes": ["cloth"]}
TWO = {"meshes": ["cloth", "ball"]}
ARM = {"robots": ["arm"], "frame_id": "world"}
BY_JOINTS = {
    "robots": ["arm"],
    "robot.arm.description": "URDF",
    "robot.arm.joint_states": "joint_states",
    "robot.arm.pose": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
}

# Name -> (parameters, what the node says); it does not start: exit status 2.
REJECTED = {
    "misspelt-stop": (
        CLOTH | {"stop_distanse": 0.1},
        "stop_distanse: no such parameter; a parameter of another node belongs under that node's name in the parameter "
        "file, not under /**; did you mean stop_distance?",
    ),
    "invented-stop": (
        CLOTH | {"stop_now": True},
        "stop_now: no such parameter; those of the topics stop and speed_scale are stop_distance, stop_timeout, "
        "approach_time, stop_detail, clock_error",
    ),
    "misspelt-accuracy": (CLOTH | {"acuracy": "exact"}, "did you mean accuracy?"),
    "capitals": (CLOTH | {"Accuracy": "exact"}, "did you mean accuracy?"),
    "hyphen": (CLOTH | {"minimum-separation": 0.1}, "did you mean minimum_separation?"),
    "singular": (TWO | {"ignored_pair": ["cloth:ball"]}, "did you mean ignored_pairs?"),
    "mesh-instead-of-meshes": ({"mesh": ["cloth"]}, "mesh: no parameter; write mesh.NAME.KEY, with a KEY out of input"),
    "mesh-for-meshes": ({"mesh": ["cloth"]}, "transform, frame, pose; did you mean meshes?"),
    "robot-for-robots": ({"robot": "arm"}, "pose, tolerance; did you mean robots?"),
    "meshes-instead-of-mesh": (
        {"meshes.cloth.file": "cloth.obj"},
        "meshes.cloth.file: meshes is a parameter, not a section of others; did you mean mesh.cloth.file?",
    ),
    "key-of-a-mesh": (
        CLOTH | {"mesh.cloth.fil": "cloth.obj"},
        "mesh.cloth.fil: no such parameter of a mesh; there are input, static, self_collision, ignored_rings, "
        "ignored_at_rest, file, transform, frame, pose; did you mean file?",
    ),
    "thickness-of-a-mesh": (
        CLOTH | {"mesh.cloth.thickness": 0.002},
        'mesh.cloth.thickness: no such parameter of a mesh; write thickness: ["cloth:VALUE"]',
    ),
    "thickness-of-a-plane": (
        CLOTH | {"planes": ["floor"], "plane.floor.thickness": 0.002},
        "plane.floor.thickness: no such parameter of a plane; there are normal, offset",
    ),
    "filter-of-no-mesh": (
        CLOTH | {"ignored_rings": 2},
        "ignored_rings: no such parameter of the node; write mesh.NAME.ignored_rings",
    ),
    "name-of-a-mesh": (
        CLOTH | {"mesh.clot.static": True},
        "mesh.clot.static: clot is not in the parameter meshes (cloth); add it there, or leave out mesh.clot.*; did "
        "you mean mesh.cloth.static?",
    ),
    "mesh-not-listed": (
        {"mesh.cloth.static": True},
        "mesh.cloth.static: cloth is not in the parameter meshes (which is empty); add it there",
    ),
    "key-of-a-robot": (
        ARM | {"robot.arm.joint_state": "joint_states"},
        "robot.arm.joint_state: no such parameter of a robot; there are description, geometry, srdf, joint_states, "
        "frame_prefix, pose, tolerance; did you mean joint_states?",
    ),
    "key-of-a-robot-that-is-needed": (
        {"robots": ["arm"], "robot.arm.joint_state": "joint_states", "robot.arm.pose": [0.0] * 6 + [1.0]},
        "robot.arm.joint_state: no such parameter of a robot",
    ),
    "robot-not-listed": (
        CLOTH | {"robot.arm.joint_states": "joint_states"},
        "robot.arm.joint_states: arm is not in the parameter robots (which is empty); add it there",
    ),
    "robots-instead-of-robot": (
        {"robots.arm.joint_states": "joint_states"},
        "did you mean robot.arm.joint_states?",
    ),
    "key-of-a-pair": (
        TWO | {"pairs.p.meshes": ["cloth", "ball"], "pairs.p.seperation": 0.1},
        "pairs.p.seperation: no parameter of a pair of meshes; there are pairs.NAME.KEY with a NAME without dots and a "
        "KEY out of meshes, accuracy, separation, features, ignored; did you mean separation?",
    ),
    "pair-instead-of-pairs": (
        TWO | {"pair.p.meshes": ["cloth", "ball"]},
        "pair.p.meshes: no such parameter; did you mean pairs.p.meshes?",
    ),
    "tier": (CLOTH | {"accuracy": "exakt"}, "accuracy: 'exakt' is not valid; use one of fast, balanced, "),
    "motion-source": (
        CLOTH | {"mesh.cloth.transform": "tf2"},
        "mesh.cloth.transform: 'tf2' is not valid; use one of none, pose, tf; did you mean tf?",
    ),
    "input": (CLOTH | {"mesh.cloth.input": "pointcloud"}, "mesh.cloth.input: 'pointcloud' is not valid; use one of "),
    "feature": (
        CLOTH | {"features": ["edge-edge"]},
        "features: 'edge-edge' is not valid; use one of vertex_face, edge",
    ),
    "type": (CLOTH | {"threads": "all"}, "threads: "),
    "text-for-a-list": ({"meshes": "cloth"}, "meshes: 'cloth' is of the wrong type; expected string[], e.g. ['cloth']"),
    "unit-of-a-distance": (
        TWO | {"stop_distance": "5cm"},
        "stop_distance: '5cm' is of the wrong type; expected float, e.g. 0.05 (unit of the vertices)",
    ),
    "unit-of-a-time": (TWO | {"stop_timeout": "500ms"}, "expected float, e.g. 0.5 (s)"),
    "comma-in-a-pair": (TWO | {"ignored_pairs": ["cloth, ball"]}, "out of cloth, ball; did you mean cloth:ball?"),
    "quaternion-missing": (
        CLOTH | {"mesh.cloth.transform": "pose", "mesh.cloth.pose": [0.0, 0.0, 1.0]},
        "mesh.cloth.pose: ",
    ),
    "separation-unit": (TWO | {"pair_separation": ["cloth:ball:5mm"]}, "'cloth:ball:5mm' must be NAME:NAME:DISTANCE"),
    "pair-of-an-unknown-mesh": (TWO | {"ignored_pairs": ["cloth:bal"]}, "with two different meshes out of cloth, ball"),
    "slash-in-a-mesh": ({"meshes": ["left/cloth"]}, "meshes: 'left/cloth' cannot be part of a topic name; use letters"),
    "mesh-twice": ({"meshes": ["cloth", "cloth"]}, "meshes: names must differ"),
    "stop-with-one-mesh": (CLOTH | {"stop_distance": 0.1, "mesh.cloth.self_collision": False}, "stop_distance: no two"),
    "transform-without-frame": (CLOTH | {"mesh.cloth.transform": "tf"}, "mesh.cloth.transform: tf needs a frame"),
    "urdf-without-frame": ({"robots": ["arm"]}, "robot.arm.joint_states: not given, so that transforms move the links"),
    "qos": (
        CLOTH | {"qos_overrides./contacts.publisher.reliability": "best-effort"},
        "'best-effort' is not valid; use one of reliable, best_effort; did you mean best_effort?",
    ),
}
# Name -> (parameters, what the log says); the node starts.
WARNED = {
    "foreign": (
        CLOTH | {"other_node_gain": 0.5, "controller.p": 2.0, "update_rate": 50},
        "parameter other_node_gain is unknown and has no effect; docs/parameters.md lists all",
    ),
}
# Name -> (parameters, what the log says); the node cannot be configured: exit status 1.
NOT_CONFIGURED = {
    "file-that-is-not-there": (CLOTH | {"mesh.cloth.file": "/nowhere/cloth.obj"}, "/nowhere/cloth.obj: no such file"),
    "file-of-another-kind": (CLOTH | {"mesh.cloth.file": __file__}, "test_node_mistakes.py: "),
    "everything-static": (CLOTH | {"mesh.cloth.static": True}, "at least one mesh must not be static"),
}
ARGUMENTS = {
    "no---ros-args": (
        ["--params-file", "a.yaml"],
        2,
        "ROS arguments come after --ros-args, for example --ros-args --p",
    ),
    "numbers-of-two-types": (
        ["--ros-args", "-p", "mesh.cloth.pose:=[0, 0, 1.5, 0, 0, 0, 1]"],
        2,
        "the entries of a list need one type: write 0.0, not 0, beside 0.5",
    ),
    "no-file": (["--ros-args", "--params-file", "/nowhere/a.yaml"], 2, "a parameter file is YAML as config/hpccd.yaml"),
    "equals-sign": (["--ros-args", "-p", "accuracy=fast"], 2, "write -p NAME:=VALUE"),
}


# Name of the only section in a file -> whether it is for the node /NAMESPACE/hpccd; the node starts.
SECTIONS = {
    "hpccd_node": False,
    "/hpccd": False,
    "/NS/hpccd_node": False,
    "/NS/hpccd/more": False,
    "/*/hpccd_node": False,
    "/*": False,
    "/**": True,
    "/**/hpccd": True,
    "/*/hpccd": True,
    "/NS/*": True,
    "NS/hpccd": True,
}
# Values on the command line of a parameter that the file gives as a float: ROS alone would leave them out.
OVERRIDDEN = ["5cm", "0,05", "'0.2'", "1e-2m"]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """{name: [exit status, output]} of all starts."""
    folder = tmp_path_factory.mktemp("mistakes")
    starts = {name: arguments for name, (arguments, _, _) in ARGUMENTS.items()}
    for name, (parameters, _) in {**REJECTED, **WARNED, **NOT_CONFIGURED}.items():
        file = folder / f"{name}.yaml"
        file.write_text(json.dumps({"/**": {"ros__parameters": parameters}}))  # JSON is YAML
        starts[name] = ["--ros-args", "--params-file", str(file), "-r", f"__ns:=/mistake_{os.getpid()}"]
    file = folder / "overridden.yaml"
    file.write_text(json.dumps({"/**": {"ros__parameters": TWO | {"stop_distance": 0.05}}}))
    for value in OVERRIDDEN:
        starts[value] = ["--ros-args", "--params-file", str(file), "-p", f"stop_distance:={value}"]
    for number, section in enumerate(SECTIONS):
        namespace = f"section_{os.getpid()}_{number}"
        file = folder / f"section_{number}.yaml"
        name = section.replace("NS", namespace)
        file.write_text(json.dumps({name: {"ros__parameters": {"threads": number + 1}}}))
        starts[section] = ["--ros-args", "--params-file", str(file), "-r", f"__ns:=/{namespace}"]
    done = subprocess.run(
        [sys.executable, str(SUPPORT / "forked_nodes.py")],
        input=json.dumps(starts),
        capture_output=True,
        text=True,
        timeout=500,
        env={**os.environ, "PYTHONPATH": SOURCES},
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


AT_THE_START = {
    **{name: (2, says) for name, (_, says) in REJECTED.items()},
    **{name: (0, says) for name, (_, says) in WARNED.items()},
    **{name: (1, says) for name, (_, says) in NOT_CONFIGURED.items()},
    **{name: (status, says) for name, (_, status, says) in ARGUMENTS.items()},
}


@pytest.mark.parametrize("name", AT_THE_START)
def test_mistake_at_the_start(outcomes, name):
    status, says = AT_THE_START[name]
    ended, output = outcomes[name]
    assert ended == status and says in output, output
    assert "Traceback" not in output


@pytest.mark.parametrize("value", OVERRIDDEN)
def test_text_on_the_command_line_does_not_leave_the_number_of_a_file_in_force(outcomes, value):
    ended, output = outcomes[value]
    assert ended == 2 and "on the command line has not the type of 0.05 in the parameter file" in output, output


@pytest.mark.parametrize("section", SECTIONS)
def test_a_file_without_a_section_for_the_node_is_reported(outcomes, section):
    ended, output = outcomes[section]
    reported = "has no section for this node and so no effect on it; name a section /section_" in output
    assert ended == 0 and reported != SECTIONS[section], output


def test_foreign_parameters_are_each_warned_of_once(outcomes):
    assert outcomes["foreign"][1].count(" is unknown and has no effect") == 3


N = 4
URDF = """<robot name="arm">
  <link name="base"/>
  <link name="upper"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
  </joint>
</robot>"""


def positions(stamp=1):
    return mesh_messages.vertices_message(sheet_positions(N, 0), stamp)


def topology():
    message = MeshTopology(version=0, n_vertices=N * N)
    message.faces = fields.to_field(sheet_faces(N))
    return message


def joints(name, stamp, position=0.1):
    message = JointState(name=[name], position=[position])
    message.header.stamp = fields.ns_to_stamp(stamp)
    return message


class Mistake:
    """parameters: of the node. topics: name -> (type, QoS, messages that are sent one after the other, again and
    again). says: what the log must have, NS stands for the namespace of the node."""

    def __init__(self, parameters, topics, says):
        self.parameters, self.topics, self.says = parameters, topics, says


RELIABLE, BEST_EFFORT, LATCHED = qos.keep_last(5), qos.keep_last(5, reliable=False), qos.keep_last(1, latched=True)
IN_STREAM = {
    "wrong-topic": Mistake(
        CLOTH,
        {"mesh/cloth/vertices": (MeshVertices, RELIABLE, [positions()])},
        "NS/mesh/cloth/vertices: the node does not subscribe to this topic; did you mean NS/meshes/cloth/vertices?",
    ),
    "wrong-place": Mistake(
        CLOTH,
        {"simulation/out": (MeshVertices, RELIABLE, [positions()])},
        "NS/simulation/out (hpccd/msg/MeshVertices): the node does not subscribe to this topic; publish on "
        "meshes/NAME/vertices, with a NAME out of the parameter meshes",
    ),
    "wrong-mesh": Mistake(
        CLOTH,
        {"meshes/clot/vertices": (MeshVertices, RELIABLE, [positions()])},
        "NS/meshes/clot/vertices belongs to no mesh in the parameter meshes (cloth); did you mean "
        "NS/meshes/cloth/vertices?",
    ),
    "wrong-topic-of-the-topology": Mistake(
        CLOTH,
        {"meshes/cloth/toplogy": (MeshTopology, LATCHED, [topology()])},
        "NS/meshes/cloth/toplogy: the node does not subscribe to this topic; did you mean NS/meshes/cloth/topology?",
    ),
    "other-input": Mistake(
        CLOTH,
        {"meshes/cloth/points": (PointCloud2, RELIABLE, [PointCloud2()])},
        "NS/meshes/cloth/points: the node does not subscribe to this topic; set mesh.cloth.input: points, or publish "
        "on NS/meshes/cloth/vertices",
    ),
    "wrong-type": Mistake(
        CLOTH,
        {"meshes/cloth/vertices": (PointCloud2, RELIABLE, [PointCloud2()])},
        "NS/meshes/cloth/vertices: a publisher of node NS/peer sends sensor_msgs/msg/PointCloud2, and the node expects "
        "hpccd/msg/MeshVertices; publish this type, or use another topic",
    ),
    "no-publisher": Mistake(
        CLOTH,
        {},
        "NS/meshes/cloth/vertices: it has no publisher; start one, or let it publish on this topic",
    ),
    "publisher-that-stopped": Mistake(
        CLOTH,
        {"meshes/cloth/vertices": (MeshVertices, RELIABLE, [])},
        "NS/meshes/cloth/vertices: no message for 3 s from its publisher of node NS/peer; check that it still ",
    ),
    "topology-missing": Mistake(
        CLOTH,
        {"meshes/cloth/vertices": (MeshVertices, RELIABLE, [positions(k) for k in range(1, 50)])},
        "NS/meshes/cloth/topology: it has no publisher; start one",
    ),
    "topology-not-sent": Mistake(
        CLOTH,
        {
            "meshes/cloth/topology": (MeshTopology, LATCHED, []),
            "meshes/cloth/vertices": (MeshVertices, RELIABLE, [positions(k) for k in range(1, 50)]),
        },
        "NS/meshes/cloth/topology: no message so far from its publisher of node NS/peer; publish it: once is enough",
    ),
    "static-marker-not-sent": Mistake(
        {"meshes": ["cloth", "floor"], "mesh.floor.static": True, "mesh.floor.input": "marker"},
        {"meshes/floor/marker": (Marker, RELIABLE, [])},
        "NS/meshes/floor/marker: no message so far from its publisher of node NS/peer; publish it again: messages sent "
        "before the node subscribed are not received",
    ),
    "description-not-sent": Mistake(
        {"robots": ["arm"], "frame_id": "world"},
        {"robot_description": (String, LATCHED, [])},
        "robot arm waits for its description on NS/robot_description: no message so far from its publisher of node "
        "NS/peer; publish it: once is enough",
    ),
    "topology-volatile": Mistake(
        CLOTH,
        {"meshes/cloth/topology": (MeshTopology, RELIABLE, [topology()])},
        "NS/meshes/cloth/topology: a publisher of node NS/peer offers volatile but the node requests transient_local, "
        "so none of its messages are received; let the publisher offer transient_local (latched)",
    ),
    "vertices-best-effort": Mistake(
        CLOTH,
        {"meshes/cloth/vertices": (MeshVertices, BEST_EFFORT, [positions()])},
        "offers best_effort but the node requests reliable, so none of its messages are received; set "
        "input_reliability: best_effort, or let the publisher offer reliable",
    ),
    "zero-stamps": Mistake(
        CLOTH,
        {
            "meshes/cloth/topology": (MeshTopology, LATCHED, [topology()]),
            "meshes/cloth/vertices": (MeshVertices, RELIABLE, [positions(0)]),
        },
        "cloth: stamp_repeated: ",
    ),
    "count-of-vertices": Mistake(
        CLOTH,
        {
            "meshes/cloth/topology": (MeshTopology, LATCHED, [topology()]),
            "meshes/cloth/vertices": (
                MeshVertices,
                RELIABLE,
                [mesh_messages.vertices_message(np.zeros((7, 3)), k) for k in range(9)],
            ),
        },
        f"cloth: wrong_vertex_count: 7 vertices, topology version 0 has {N * N}",
    ),
    "pose-without-shape": Mistake(
        CLOTH | {"mesh.cloth.input": "pose"},
        {"meshes/cloth/pose": (PoseStamped, RELIABLE, [PoseStamped()])},
        "NS/meshes/cloth/vertices: it has no publisher; start one",
    ),
    "joint-states-without-stamp": Mistake(
        BY_JOINTS,
        {"joint_states": (JointState, RELIABLE, [joints("shoulder", 0)])},
        "NS/joint_states: header.stamp is 0 in every message, so the robot does not move; let the publisher set it",
    ),
    "joint-states-in-degrees": Mistake(
        BY_JOINTS,
        {"joint_states": (JointState, RELIABLE, [joints("shoulder", k * 10**8, 45.0) for k in range(1, 1000)])},
        "NS/joint_states: joint shoulder is at 45 rad, outside its limits -1 .. 1 in the description; send "
        "radians (this looks like degrees)",
    ),
    "joint-states-of-another-robot": Mistake(
        BY_JOINTS,
        {"joint_states": (JointState, RELIABLE, [joints("left_shoulder", k * 10**8) for k in range(1, 1000)])},
        "NS/joint_states: no message names a joint of the robot (shoulder); the last one names left_shoulder; use the "
        "names of its description; did you mean shoulder?",
    ),
    "no-joint-states": Mistake(
        BY_JOINTS,
        {},
        "NS/joint_states: it has no publisher; start one",
    ),
    "joint-states-on-another-topic": Mistake(
        BY_JOINTS,
        {"joint_state": (JointState, RELIABLE, [joints("shoulder", k * 10**8) for k in range(1, 1000)])},
        "NS/joint_states: it has no publisher; start one, or let it publish on this topic; NS/joint_state has "
        "publishers: if that is meant, set robot.arm.joint_states: NS/joint_state, or start the node with -r "
        "NS/joint_states:=NS/joint_state",
    ),
    "joint-states-without-their-parameter": Mistake(
        {"robots": ["arm"], "robot.arm.description": "URDF", "frame_id": "world"},
        {"joint_states": (JointState, RELIABLE, [joints("shoulder", k * 10**8) for k in range(1, 1000)])},
        "robot arm waits for transforms, and NS/joint_states has publishers; if this topic moves it, set "
        "robot.arm.joint_states: NS/joint_states; no frame yet: no transform connects 'upper' and 'world'; received: ",
    ),
    "description-in-another-namespace": Mistake(
        {"robots": ["arm"], "frame_id": "world"},
        {"arm/robot_description": (String, LATCHED, [String(data=URDF)])},
        "robot_state_publisher, or name its topic or a URDF file; NS/arm/robot_description has publishers: if that is "
        "meant, set robot.arm.description: NS/arm/robot_description, or start the node with -r "
        "NS/robot_description:=NS/arm/robot_description",
    ),
    "no-description": Mistake(
        {"robots": ["arm"], "frame_id": "world"},
        {},
        "robot arm waits for its description on NS/robot_description, which has no publisher; start "
        "robot_state_publisher, or name its topic or a URDF file",
    ),
}


# Few enough nodes at once: discovery on one host reaches 32 participants of a domain.
GROUPS = [tuple(IN_STREAM)[k::3] for k in range(3)]


@pytest.mark.parametrize("names", GROUPS, ids=range(3))
def test_mistakes_in_streams(start_node, tmp_path, names):
    """Several at once, each with a node of its own: the time is that of waiting."""
    (tmp_path / "arm.urdf").write_text(URDF)
    running = []
    for name in names:
        mistake = IN_STREAM[name]
        parameters = {
            key: str(tmp_path / "arm.urdf") if value == "URDF" else value for key, value in mistake.parameters.items()
        }
        node = start_node(parameters, wait=False)
        publishers = [
            (node.peer.node.create_publisher(kind, topic, profile), itertools.cycle(messages) if messages else ())
            for topic, (kind, profile, messages) in mistake.topics.items()
        ]
        running.append((name, node, publishers, mistake.says.replace("NS", node.namespace)))
    lacking = dict.fromkeys(names)

    def all_said():
        for name, node, publishers, says in running:
            for publisher, messages in publishers:
                if (message := next(iter(messages), None)) is not None:
                    publisher.publish(message)
            if says in node.output():
                lacking.pop(name, None)
        return not lacking

    try:
        running[0][1].wait_until(all_said, "every mistake in the log")
    except AssertionError:
        outputs = [f"{name}: {node.output()}" for name, node, _, _ in running if name in lacking]
        raise AssertionError(f"not said: {list(lacking)}\n" + "\n".join(outputs)) from None
    for _, node, _, says in running:
        lines = [line for line in node.output().splitlines() if says in line]
        # Rejected messages have a second line, which counts them, after some seconds: on a slow machine.
        assert sum("more of these in between" not in line for line in lines) == 1, "once an episode"
        node.wait_until(functools.partial(_reported, node, says), f"{says} on /diagnostics")


def _reported(node, says):
    return any(says in text for _, _, values in node.peer.statuses.values() for text in values.values())
