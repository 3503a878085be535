# SPDX-License-Identifier: Apache-2.0
"""Any arguments: the documented exit status, one sentence if the node does not start, no traceback."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from node_process import PATIENCE
from sources import SUPPORT

import hpccd_ros

ROOT = Path(hpccd_ros.__file__).resolve().parents[1]
HEAD = "/**:\n  ros__parameters:\n"
MESH = "    meshes: [a]\n    mesh:\n      a:\n        "
ROBOT = "    robots: [r]\n    robot:\n      r: {pose: [0, 0, 0, 0, 0, 0, 1], "

# Content of the parameter file, exit status, and a part of the sentence (or of a warning, where the node starts).
FILES = {
    "empty": ("", 0, ""),
    "null": ("~\n", 0, ""),
    "scalar": ("hello\n", 0, ""),
    "list": ("- a\n- b\n", 2, "Sequences cannot be key at line 1"),
    "node-alone": ("hpccd:\n", 2, "before ros__parameters"),
    "node-scalar": ("/**: 5\n", 2, "before ros__parameters"),
    "parameters-null": ("/**:\n  ros__parameters:\n", 2, "before ros__parameters"),
    "parameters-scalar": ("/**:\n  ros__parameters: 5\n", 2, "before ros__parameters"),
    "parameters-list": ("/**:\n  ros__parameters: [1, 2]\n", 2, "before ros__parameters"),
    "no-ros__parameters": ("/**:\n  accuracy: exact\n", 2, "a parameter file is YAML as config/hpccd.yaml"),
    "one-underscore": ("/**:\n  ros_parameters:\n    accuracy: fast\n", 2, "before ros__parameters"),
    "open-quote": (HEAD + '    accuracy: "fast\n', 2, "near line 3"),
    "open-bracket": (HEAD + "    meshes: [cloth\n", 2, "near line 3"),
    "tabs": ("/**:\n\tros__parameters:\n\t\taccuracy: fast\n", 2, "near line 1"),
    "indentation": (HEAD + "    threads: 1\n   markers: true\n", 2, "near line 4"),
    "twice": (HEAD + "    accuracy: exact\n    accuracy: sloppy\n", 2, "accuracy: 'sloppy' is not valid; use one of"),
    "int-of-70-bits": (HEAD + f"    threads: {2**70}\n", 2, "threads: "),
    "int-of-64-bits": (HEAD + f"    threads: {2**63}\n", 2, "threads: "),
    "negative": (HEAD + "    threads: -1\n", 2, "allowed 0 .. 1,024"),
    "float-for-int": (HEAD + "    threads: 1.5\n", 2, "expected int"),
    "text-for-float": (HEAD + "    max_rate: fast\n", 2, "expected float"),
    "int-for-float": (HEAD + "    max_rate: -10\n", 2, "allowed 0.0 .. 1,000,000.0"),
    "float-overflow": (HEAD + "    max_rate: 1e400\n", 2, "expected float"),
    "nan": (HEAD + "    max_rate: .nan\n", 2, "max_rate: "),
    "inf": (HEAD + "    max_rate: .inf\n", 2, "max_rate: "),
    "nan-in-list": (HEAD + MESH + "pose: [.nan, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]\n", 2, "7 finite numbers"),
    "short-list": (HEAD + MESH + "pose: [0.0]\n", 2, "mesh.a.pose: "),
    "ints-for-floats": (HEAD + MESH + "pose: [0, 0, 0, 0, 0, 0, 2]\n", 2, "it must be 1"),
    "texts-for-floats": (HEAD + MESH + "pose: [a, b]\n", 2, "expected float[]"),
    "nothing-for-float": (HEAD + "    max_rate: []\n", 2, "max_rate: "),
    "nothing-for-floats": (HEAD + MESH + "pose: []\n", 2, "mesh.a.pose: "),
    "long-list": (HEAD + MESH + f"pose: [{', '.join(['0.5'] * 100_000)}]\n", 2, "7 finite numbers"),
    "string-and-int": (HEAD + "    meshes: [a, 1]\n", 2, "Sequence should be of same type"),
    "string-and-bool": (HEAD + "    meshes: [a, true]\n", 2, "Sequence should be of same type"),
    "list-of-lists": (HEAD + "    meshes: [[a], [b]]\n", 2, "Sequences cannot be key"),
    "list-with-null": (HEAD + "    meshes: [a, ~]\n", 2, "cannot be part of a topic name"),
    "list-of-maps": (HEAD + "    meshes: [{a: b}]\n", 2, "meshes.a: meshes is a parameter, not a section"),
    "list-of-ints": (HEAD + "    meshes: [1, 2]\n", 2, "expected string[]"),
    "string-for-list": (HEAD + "    meshes: cloth\n", 2, "expected string[]"),
    "string-for-bool": (HEAD + '    markers: "true"\n', 2, "expected bool"),
    "map-for-list": (
        HEAD + "    meshes: {a: 1}\n",
        2,
        "meshes.a: meshes is a parameter, not a section of others; did you mean mesh.a?",
    ),
    "scalar-for-mesh": (HEAD + "    meshes: [a]\n    mesh: 5\n", 2, "mesh: no parameter; write mesh.NAME.KEY"),
    "empty-list": (HEAD + "    meshes: []\n", 0, ""),
    "no-value": (HEAD + "    accuracy:\n", 2, "No value at line 3"),
    "null-value": (HEAD + "    meshes: ~\n", 2, "expected string[]"),
    "anchor": (HEAD + "    accuracy: &x fast\n    report: *x\n", 2, "Will not support aliasing"),
    "alias-of-map": ("/**: &x\n  ros__parameters:\n    accuracy: fast\nhpccd: *x\n", 2, "Will not support aliasing"),
    "aliases-of-aliases": ("a: &a [x, x]\nb: &b [*a, *a]\n" + HEAD + "    meshes: *b\n", 2, "Sequences can only"),
    "merge-key": (HEAD + "    <<: {accuracy: fast}\n", 0, "is unknown"),
    "tag": (HEAD + "    accuracy: !!python/object/apply:os.getcwd []\n", 2, "accuracy: "),
    "int-key": (HEAD + "    5: 6\n", 0, "parameter 5 is unknown"),
    "null-key": (HEAD + "    ~: 6\n", 0, "parameter ~ is unknown"),
    "list-key": (HEAD + "    [a, b]: 6\n", 2, "Sequences cannot be key"),
    "map-key": (HEAD + "    ? {a: b}\n    : 6\n", 2, "at line 3"),
    "empty-key": (HEAD + '    "": 6\n', 2, "No key at line 3"),
    "deep": (HEAD + "    x: " + "{a: " * 200 + "1" + "}" * 200 + "\n", 0, "is unknown"),
    "brackets": (HEAD + "    x: " + "[" * 2000 + "]" * 2000 + "\n", 0, "is unknown"),
    "umlaut": (HEAD + '    meshes: ["tücher"]\n', 2, "'tücher' cannot be part of a topic name"),
    "nul": (HEAD + '    accuracy: "a\\0b"\n', 2, "accuracy: 'a'"),
    "control-character": (HEAD + "    accuracy: a\x01b\n", 2, "Error parsing"),
    "latin-1": ((HEAD + "    accuracy: \xe9\n").encode("latin-1"), 2, "Error parsing"),
    "utf-16": ((HEAD + "    accuracy: sloppy\n").encode("utf-16"), 2, "accuracy: 'sloppy'"),
    "url-in-braces": (
        HEAD + "    robot: {r: {description: package://arm/arm.urdf, joint_states: js}}\n",
        2,
        "names and values; quote values that contain a colon",
    ),
    "colon-in-brackets": (HEAD + "    thickness: [cloth:0.002]\n", 2, "quote values that contain a colon"),
    "random-bytes": (bytes((i * i * 31 + i) % 256 for i in range(4096)), 2, "Couldn't parse params file"),
    "zeros": (bytes(4096), 2, "Couldn't parse params file"),
    "wildcard": ("/*:\n  ros__parameters:\n    accuracy: sloppy\n", 2, "accuracy: 'sloppy'"),
    "wildcards": ("/**/hpccd:\n  ros__parameters:\n    accuracy: sloppy\n", 2, "accuracy: 'sloppy'"),
    "three-stars": ("/***:\n  ros__parameters:\n    accuracy: fast\n", 2, "node name must not contain"),
    "star-in-name": ("/a*b/**:\n  ros__parameters:\n    accuracy: fast\n", 2, "namespace must not contain"),
    "spaces-in-node": ('"a b!":\n  ros__parameters:\n    accuracy: fast\n', 2, "node name must not contain"),
    "sim-time": (HEAD + "    use_sim_time: 5\n", 2, "use_sim_time"),
    "long-value": (HEAD + f"    accuracy: {'a' * 2_000_000}\n", 2, "is not valid; use one of fast, balanced"),
    "long-mesh-name": (HEAD + f"    meshes: [{'a' * 300}]\n", 2, "give a shorter mesh name"),
    "long-file-name": (HEAD + MESH + f"file: {'x' * 300}.obj\n", 1, "File name too long"),
    "nobody's-file": (HEAD + MESH + "file: ~nosuchuser/x.obj\n", 1, "~nosuchuser/x.obj: no such home folder"),
    "nobody's-description": (
        HEAD + ROBOT + "joint_states: js, description: ~nosuchuser/x.urdf}\n",
        2,
        "robot.r.description: ~nosuchuser/x.urdf: no such home folder",
    ),
    "nobody's-srdf": (
        HEAD + ROBOT + "joint_states: js, srdf: ~nosuchuser/x.srdf}\n",
        2,
        "robot.r.srdf: ~nosuchuser/x.srdf: no such home folder",
    ),
    "one-topic-of-two-types": (
        HEAD + ROBOT + "joint_states: robot_description}\n",
        2,
        "robot.r.description and robot.r.joint_states: both use the topic /robot_description, the first as "
        "std_msgs/msg/String, the second as sensor_msgs/msg/JointState; give each a topic of its own",
    ),
    "joint-states-on-results": (
        HEAD + ROBOT + "joint_states: contacts}\n",
        2,
        "and robot.r.joint_states: both use the topic /contacts",
    ),
    "joint-states-on-the-log": (
        HEAD + ROBOT + "joint_states: /rosout}\n",
        2,
        "/rosout and robot.r.joint_states: both use the topic /rosout",
    ),
    "recording-without-meshes": (HEAD + "    record: FOLDER/record\n", 0, ""),
    "folder-as-file": (HEAD + MESH + "file: /\n", 1, "use one of .obj"),
}

# Arguments after --ros-args, the exit status, a part of the sentence.
ARGUMENTS = {
    "no-such-file": (["--params-file", "/nowhere.yaml"], 2, "/nowhere.yaml'. Error: Error opening YAML file"),
    "folder": (["--params-file", "/"], 2, "Couldn't parse params file: '--params-file /'"),
    "unreadable": (["--params-file", "/proc/self/mem"], 2, "Couldn't parse params file"),
    "nothing-behind": (["--params-file"], 2, "write --params-file FILE"),
    "remapping": (["-r", "contacts"], 2, "write -r FROM:=TO"),
    "namespace": (["-r", "__ns:=a b"], 2, "Couldn't parse remap rule"),
    "long-remapping": (["-r", f"contacts:=/{'a' * 300}"], 2, "contacts: in namespace / and with the remappings given"),
    "remapped-together": (
        ["-p", "meshes:=[a, b]", "-r", "meshes/a/vertices:=x", "-r", "meshes/b/topology:=/x"],
        2,
        "meshes/a/vertices and meshes/b/topology: both use the topic /x",
    ),
    "remapped-together-of-one-type": (
        ["-p", "meshes:=[a, b]", "-r", "meshes/a/vertices:=x", "-r", "meshes/b/vertices:=x"],
        0,
        "",
    ),
    "long-remapping-of-service": (["-r", f"~/detect:=/{'a' * 300}"], 2, "~/detect: "),
    "long-namespace": (["-r", f"__ns:=/{'a' * 230}"], 2, "give another namespace"),
    "parameter": (["-p", "threads"], 2, "write -p NAME:=VALUE"),
    "parameter-of-lists": (["-p", "threads:=[1,a]"], 2, "the entries of a list need one type"),
    "parameter-with-colons": (["-p", "pair_separation:=[a:b:1]"], 2, """in quotes: -p NAME:="['a:b']\""""),
    "unknown-argument": (["--nonsense"], 2, "unknown ROS arguments ['--nonsense']"),
    "log-level": (["--log-level", "nonsense"], 2, "Couldn't parse log level"),
    "log-settings": (["--log-config-file", "/nowhere"], 2, "failed to initialize logging"),
    "enclave": (["--enclave", "a b"], 2, "Enclave name is not valid"),
    "not-utf-8": (["-p", "accuracy:=\udcff"], 2, "not UTF-8"),
}

# Arguments without --ros-args, or behind its end.
OTHERS = {
    "without---ros-args": (["--params-file", "config/hpccd.yaml"], 2, "unknown arguments --params-file, config"),
    "help": (["--help"], 2, "unknown arguments --help: ROS arguments come after --ros-args"),
    "behind-the-end": (["--ros-args", "-p", "threads:=1", "--", "scene.yaml"], 2, "unknown arguments scene.yaml"),
    "end": (["--ros-args", "-p", "threads:=1", "--"], 0, ""),
}

CASES = [*FILES, *ARGUMENTS, *OTHERS]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """{name: [exit status, output]} of all starts."""
    folder = tmp_path_factory.mktemp("hostile")
    starts = {name: ["--ros-args", *arguments] for name, (arguments, _, _) in ARGUMENTS.items()}
    starts |= {name: arguments for name, (arguments, _, _) in OTHERS.items()}
    for name, (content, _, _) in FILES.items():
        file = folder / f"{name}.yaml"
        file.write_bytes(content if isinstance(content, bytes) else content.replace("FOLDER", str(folder)).encode())
        starts[name] = ["--ros-args", "--params-file", str(file)]
    done = subprocess.run(
        [sys.executable, str(SUPPORT / "forked_nodes.py")],
        input=json.dumps(starts),
        # Over shared memory Fast DDS prints errors about the processes that other tests have killed.
        env={**os.environ, "PYTHONPATH": str(ROOT), "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"},
        text=True,
        capture_output=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def sentences(output):
    """Lines of the node; rcl prints lines of its own before it raises, which nothing can keep it from."""
    lines = output.splitlines()
    return [line for line in lines if line.startswith("hpccd: ") or ("[hpccd]" in line and "[INFO]" not in line)]


@pytest.mark.parametrize("name", CASES)
def test_status_and_sentence(outcomes, name):
    _, expected, text = (FILES | ARGUMENTS | OTHERS)[name]
    status, output = outcomes[name]
    assert status == expected, output[:3000]
    assert "Traceback" not in output
    told = sentences(output)
    if expected or text:
        (sentence,) = told
        assert text in sentence, sentence
        assert len(sentence) < 1200
        others = [line for line in output.splitlines() if line not in told and "[INFO]" not in line]
        assert all("[rcl]: " in line for line in others), others
    else:
        assert not told


@pytest.mark.parametrize(
    "variables",
    [
        {"HOME": None, "ROS_HOME": None, "ROS_LOG_DIR": None},
        {"HOME": "/proc/nothing", "ROS_HOME": None, "ROS_LOG_DIR": None},
        {"ROS_LOG_DIR": "/dev/null"},
        {"ROS_LOG_DIR": "/proc"},
        {"ROS_LOG_DIR": "/tmp/\udcff"},
    ],
    ids=["no-home", "home-not-writable", "log-folder-is-a-file", "log-folder-not-writable", "log-folder-not-utf-8"],
)
def test_a_log_that_cannot_be_written_keeps_no_node_from_starting(variables):
    environment = {key: value for key, value in {**os.environ, **variables}.items() if value is not None}
    node = subprocess.Popen(
        [sys.executable, "-m", "hpccd_ros.node"],
        cwd=ROOT,
        env=environment,
        text=True,
        stderr=subprocess.PIPE,
    )
    lines = []
    for line in node.stderr:
        lines.append(line)
        if "active: meshes" in line:
            break
    node.terminate()
    lines += node.stderr.readlines()
    assert node.wait(PATIENCE) == 0, lines
    assert "hpccd: no log file is written: " in lines[0] and "set ROS_LOG_DIR" in lines[0]
    assert "active: meshes" in lines[1] and len(lines) == 2


@pytest.mark.parametrize(
    "variable, value, status",
    [
        ("ROS_DOMAIN_ID", "one", 2),
        ("ROS_DOMAIN_ID", "500", 2),
        ("ROS_STATIC_PEERS", "a;;b", 1),
        ("RMW_IMPLEMENTATION", "rmw_nobody_cpp", 2),
        ("RMW_IMPLEMENTATION", "a/b", 2),
    ],
)
def test_settings_of_the_environment_that_ros_rejects(variable, value, status):
    done = subprocess.run(
        [sys.executable, "-m", "hpccd_ros.node"],
        cwd=ROOT,
        env={**os.environ, variable: value},
        text=True,
        stderr=subprocess.PIPE,
        timeout=PATIENCE,
    )
    assert done.returncode == status, done.stderr
    (sentence,) = sentences(done.stderr)
    assert variable in sentence and "Traceback" not in done.stderr
