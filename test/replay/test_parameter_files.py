# SPDX-License-Identifier: Apache-2.0
"""--params: a file with which the node would not start ends a replay with one sentence."""

import os
import socket

import pytest
from bag_tools import rewrite
from in_process import hpccd

NODE = "/**:\n  ros__parameters:\n    meshes: [cloth, ball]\n"
ALIASES = "a0: &a0 [x, x]\n" + "".join(f"a{k + 1}: &a{k + 1} [*a{k}, *a{k}]\n" for k in range(20))


@pytest.fixture
def foreign(small_bag, tmp_path):
    """A recording of another recorder."""
    rewrite(small_bag, tmp_path / "foreign.mcap", info={})
    return tmp_path / "foreign.mcap"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not a ROS parameter file"),
        ("- a list\n", "not a ROS parameter file"),
        ("word\n", "not a ROS parameter file"),
        ("meshes: [cloth, ball]\n", "not a ROS parameter file"),
        ("/**:\n  parameters: {}\n", "not a ROS parameter file"),
        ("/**:\n  ros__parameters:\n", "not a ROS parameter file"),
        ("/**:\n  ros__parameters: [1]\n", "not a ROS parameter file"),
        ("/**: {ros__parameters: {}}\n", "names no mesh"),
        ("{[", "cannot be read: "),
        ("\0\1\2", "cannot be read: "),
        ("[" * 5_000, "cannot be read: "),
        ("a: 2020-13-45\n", "cannot be read: a value has an invalid form"),
        ("a: !!bool maybe\n", "cannot be read: a value has an invalid form"),
        ("a: !!timestamp soon\n", "cannot be read: a value has an invalid form"),
        (NODE + "    'thre\\nads': 1\n", "thre\\nads"),
        (NODE + "    threads: &t 1\n    detect_jobs: *t\n", "ROS parameter files have no aliases"),
        (ALIASES + NODE, "ROS parameter files have no aliases"),
        ("&a {/**: *a}\n", "ROS parameter files have no aliases"),
        (NODE + "    threads:\n", "threads has no value"),
        (NODE + "    threads: many\n", "threads: 'many' is of the wrong type; expected int"),
        (NODE + "    threads: 5000\n", "threads: 5000 is outside 0 .. 1024"),
        (NODE + "    stamp_tolerance: fast\n", "stamp_tolerance: 'fast' is of the wrong type; expected float"),
        (NODE + "    report: some\n", "report: 'some' is not valid; use one of all, first, any"),
        (NODE + "    ignored_pairs: [cloth:shirt]\n", "ignored_pairs: 'cloth:shirt' must be"),
        (NODE + "    mesh: {ball: {static: 1}}\n", "mesh.ball.static: 1 is of the wrong type; expected bool"),
        (NODE + "    mesh: {ball: {pose: [0.0, 1.0]}}\n", "mesh.ball.pose: "),
        (NODE + "    mesh: {ball: {file: /nowhere/x.obj}}\n", "no such file"),
        (NODE + "    mesh: {ball: {static: true}, cloth: {static: true}}\n", "at least one mesh must not be static"),
        (NODE + "    mesh: {ball: {transform: tf}}\n", "tf needs a frame to transform to"),
        (NODE.replace("cloth,", "'a b',"), "cannot be part of a topic name"),
        (NODE.replace("[cloth, ball]", "cloth"), "meshes: 'cloth' is of the wrong type; expected string[]"),
        (NODE.replace("[cloth, ball]", "{cloth: 1}"), "names no mesh"),
    ],
)
def test_wrong_parameter_files(foreign, tmp_path, text, says):
    path = tmp_path / "node.yaml"
    path.write_text(text)
    for command in (("replay", foreign), ("replay", foreign, "--publish"), ("view", foreign)):
        done = hpccd(*command, "--params", path)
        assert not done.traceback, done.traceback
        assert done.status == 2 and f"--params {path}: " in done.err or says == "no such file", done
        assert says in done.err and done.err.count("\n") == 1, done.err


def test_what_is_no_parameter_file_at_all(foreign, small_bag, tmp_path):
    fifo, listening = tmp_path / "fifo", tmp_path / "socket"
    os.mkfifo(fifo)
    large = tmp_path / "large.yaml"
    large.write_bytes(b"# " + b"x" * 2_000_000)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(listening))
        for path in (tmp_path / "none.yaml", tmp_path, fifo, listening, "/dev/zero", small_bag, large):
            done = hpccd("replay", foreign, "--params", path)
            assert done.status == 2 and done.err.startswith(f"hpccd replay: --params {path}: cannot be read: "), done


def test_numbers_and_unknown_names_are_taken_as_the_node_takes_them(foreign, tmp_path):
    path = tmp_path / "node.yaml"
    path.write_text(NODE + "    stamp_tolerance: 1e-3\n    mesh: {ball: {self_collision: false}}\n    tresholds: 5\n")
    done = hpccd("replay", foreign, "--params", path)
    assert done.status == 0 and "VERIFIED: 89" in done.out, done
    assert done.err == "parameter tresholds is unknown and has no effect; docs/parameters.md lists all\n"


def test_a_misspelt_name_in_the_file_is_rejected_as_the_node_rejects_it(foreign, tmp_path):
    path = tmp_path / "node.yaml"
    path.write_text(NODE + "    minimum_seperation: 0.1\n")
    done = hpccd("replay", foreign, "--params", path)
    assert done.status == 2 and "minimum_seperation: no such parameter; " in done.err
    assert done.err.endswith("did you mean minimum_separation?\n")


def test_a_plane_that_the_node_did_not_have_is_named(small_bag, tmp_path):
    path = tmp_path / "node.yaml"
    path.write_text(NODE + "    mesh: {ball: {self_collision: false}}\n    planes: [floor]\n")
    done = hpccd("replay", small_bag, "--params", path)
    assert done.status == 1 and "DIVERGED: 89 of 89 results differ" in done.out, done
    assert "meshes cloth, ball were recorded, now they are cloth, ball, floor" in done.out
