# SPDX-License-Identifier: Apache-2.0
"""Mistakes that users make with the node: each is answered with the problem and its remedy."""

import json
import os
import subprocess
import sys

import pytest
from sources import SOURCES, SUPPORT

CLOTH = {"meshes": ["cloth"]}
TWO = {"meshes": ["cloth", "ball"]}
ARM = {"robots": ["arm"], "frame_id": "world"}

# Name -> (parameters, what the node says); it does not start: exit status 2.
REJECTED = {
    "misspelt-stop": (
        CLOTH | {"stop_distanse": 0.1},
        "stop_distanse: no such parameter; a parameter of another node belongs under that node's name in the parameter "
        "file, not under /**; did you mean stop_distance?",
    ),
    "invented-stop": (
        CLOTH | {"stop_now": True},
        "stop_now: no such parameter; those of the topic stop are stop_distance, stop_timeout, clock_error",
    ),
    "misspelt-accuracy": (CLOTH | {"acuracy": "exact"}, "did you mean accuracy?"),
    "capitals": (CLOTH | {"Accuracy": "exact"}, "did you mean accuracy?"),
    "hyphen": (CLOTH | {"minimum-separation": 0.1}, "did you mean minimum_separation?"),
    "singular": (TWO | {"ignored_pair": ["cloth:ball"]}, "did you mean ignored_pairs?"),
    "mesh-instead-of-meshes": ({"mesh": ["cloth"]}, "mesh: no parameter; write mesh.NAME.KEY, with a KEY out of input"),
    "meshes-instead-of-mesh": (
        {"meshes.cloth.file": "cloth.obj"},
        "meshes.cloth.file: meshes is a parameter, not a section of others; did you mean mesh.cloth.file?",
    ),
    "key-of-a-mesh": (
        CLOTH | {"mesh.cloth.fil": "cloth.obj"},
        "mesh.cloth.fil: no such parameter of a mesh; there are input, static, self_collision, file, transform, frame, "
        "pose; did you mean file?",
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
    "text-for-a-list": ({"meshes": "cloth"}, "expected string[]"),
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
    "file-of-another-kind": (CLOTH | {"mesh.cloth.file": __file__}, "test_natural_mistakes.py: "),
    "everything-static": (CLOTH | {"mesh.cloth.static": True}, "at least one mesh must not be static"),
}
ARGUMENTS = {
    "no---ros-args": (
        ["--params-file", "a.yaml"],
        2,
        "ROS arguments come after --ros-args, for example --ros-args --p",
    ),
    "no-file": (["--ros-args", "--params-file", "/nowhere/a.yaml"], 2, "a parameter file is YAML as config/hpccd.yaml"),
    "equals-sign": (["--ros-args", "-p", "accuracy=fast"], 2, "write -p NAME:=VALUE"),
}


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """{name: [exit status, output]} of all starts."""
    folder = tmp_path_factory.mktemp("mistakes")
    starts = {name: arguments for name, (arguments, _, _) in ARGUMENTS.items()}
    for name, (parameters, _) in {**REJECTED, **WARNED, **NOT_CONFIGURED}.items():
        file = folder / f"{name}.yaml"
        file.write_text(json.dumps({"/**": {"ros__parameters": parameters}}))  # JSON is YAML
        starts[name] = ["--ros-args", "--params-file", str(file), "-r", f"__ns:=/mistake_{os.getpid()}"]
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


def test_foreign_parameters_are_each_warned_of_once(outcomes):
    assert outcomes["foreign"][1].count(" is unknown and has no effect") == 3
