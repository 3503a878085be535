# SPDX-License-Identifier: Apache-2.0
"""examples/cloth_on_ball as its users run it, in one process and with a node over DDS."""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from compare_steps import SCENES, compared

import hpccd_ros
from hpccd_ros import cli

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "examples" / "cloth_on_ball" / "run.py"
SMALL = ("--cells", "16", "--frames", "30", "--picture", "")


def run(folder, *words, status=0):
    """The output of the example."""
    environment = {**os.environ, "PYTHONPATH": str(Path(hpccd_ros.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, PROGRAM, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout + done.stderr


def frames(path):
    with np.load(path) as archive:
        return archive["cloth/0/vertices"], archive["ball/0/vertices"]


def check_same_frames(one, other):
    for here, dds in zip(frames(one), frames(other), strict=True):
        np.testing.assert_array_equal(here, dds)


def test_in_one_process(tmp_path, capsys):
    said = run(tmp_path, "--cells", "16", "--frames", "12", "--mcap", "a.mcap", "--picture", "")
    assert "intersections  0 in all 12 frames" in said
    assert re.search(r"plausible +yes", said) and re.search(r"\d+ % of it in hpccd", said)
    assert cli.main(["replay", str(tmp_path / "a.mcap")]) == 0
    assert "11 steps computed, 0 contacts" in capsys.readouterr().out


def test_with_a_node_in_the_loop(tmp_path, capsys):
    """The same motion to the bit, and a recording of the node that is verified."""
    run(tmp_path, *SMALL, "--npz", "here.npz")
    said = run(tmp_path, *SMALL, "--node", "--npz", "dds.npz", "--mcap", "dds.mcap")
    assert "intersections  0 in all 30 frames" in said
    check_same_frames(tmp_path / "here.npz", tmp_path / "dds.npz")
    assert cli.main(["replay", str(tmp_path / "dds.mcap")]) == 0
    assert "VERIFIED: 29 results are equal" in capsys.readouterr().out


def test_moves_that_are_shortened_are_the_same_over_dds(tmp_path):
    """To the bit: how much of a move is free is asked as the detector of this process is."""
    fast = ("--cells", "20", "--seed", "1", "--spin", "30", "--frames", "74", "--picture", "")
    for words in (("--npz", "here.npz"), ("--node", "--npz", "dds.npz")):
        said = run(tmp_path, *fast, *words)
        assert int(re.search(r"(\d+) of them shortened", said)[1]) > 0
    check_same_frames(tmp_path / "here.npz", tmp_path / "dds.npz")


PINCHED = ("--cells", "40", "--pinched", "--frames", "34", "--picture", "")


def test_a_pinched_corner_with_a_step_for_each_vertex(tmp_path):
    said = run(tmp_path, *PINCHED, "--step", "vertices")
    assert "intersections  0 in all 34 frames" in said
    assert re.search(r"plausible +yes", said)
    assert int(re.search(r"(\d+) of them shortened", said)[1]) > 0
    assert "0.330 s, 10.00 ms a move" in said


def test_a_pinched_corner_with_a_node_in_the_loop(tmp_path):
    """The plate, too, is a mesh of the node, and is not tested against the ball."""
    for words in (("--npz", "here.npz"), ("--node", "--npz", "dds.npz")):
        run(tmp_path, *PINCHED, *words)
    check_same_frames(tmp_path / "here.npz", tmp_path / "dds.npz")


@pytest.mark.parametrize("step", ["global", "vertices"])
def test_the_comparison_of_steps_is_that_of_the_page(step):
    """But for the frames a second."""
    page = (ROOT / "docs" / "simulators.md").read_text()
    shown = re.search(rf"^\| fast ball \| {step} \| (.*) \|$", page, re.MULTILINE)[1].split(" | ")
    cells = compared(SCENES["fast ball"], step).split(" | ")
    assert cells[:4] + cells[5:] == shown[:4] + shown[5:]


@contextlib.contextmanager
def running_node(*words):
    """A node with these ROS arguments; its name."""
    name = f"exa{os.getpid()}"
    node = subprocess.Popen(
        [sys.executable, "-m", "hpccd_ros.node", "--ros-args", *words, "-r", f"__node:={name}"],
        cwd=Path(hpccd_ros.__file__).parents[1],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield name
    finally:
        node.terminate()
        assert node.wait(60) == 0


def test_with_a_node_that_runs_already(tmp_path):
    run(tmp_path, *SMALL, "--params", "cloth.yaml")
    with running_node("--params-file", tmp_path / "cloth.yaml") as name:
        assert "intersections  0 in all 30 frames" in run(tmp_path, *SMALL, "--node", name)


@pytest.mark.parametrize(
    "words",
    [("-p", "max_contacts:=0"), ("-p", "outputs:=[normals, weights]", "-p", "max_contacts:=1")],
    ids=["no outputs", "not all pairs"],
)
def test_a_node_that_leaves_out_what_the_solver_needs(tmp_path, words):
    with running_node("-p", "meshes:=[cloth, ball]", *words) as name:
        said = run(tmp_path, *SMALL, "--node", name, status=2)
    assert "leaves out pairs, normals or weights: start it with the file that --params writes" in said


@pytest.mark.parametrize(
    "words",
    [("--frames", "2"), ("--frames", "8"), ("--frames", "100", "--spin", "0")],
    ids=["one move", "ball not met yet", "ball at rest"],
)
def test_where_the_ball_gives_next_to_no_spin(tmp_path, words):
    assert re.search(r"plausible +yes", run(tmp_path, "--cells", "16", "--picture", "", *words))


def test_a_picture(tmp_path):
    run(tmp_path, "--cells", "16", "--frames", "2", "--picture", "a.png")  # a panel for each frame, of six at most
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_cloth_that_is_stuck_ends_with_one_sentence(tmp_path):
    said = run(tmp_path, "--cells", "12", "--spin", "30", "--frames", "150", "--picture", "", status=1)
    assert re.search(r"^cloth_on_ball: the cloth is stuck at .* a slower ball", said, re.MULTILINE)
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--frames", "1"), "--frames 1: from 2 to 100000"),
        (("--spin", "nan"), "--spin nan: from 0 to 30"),
        (("--picture", "a.xyz"), "--picture a.xyz: name a file that ends in .png"),
        (("--npz", "no/a.npz"), "there is no folder no"),
        (("--node", "--step", "vertices"), "--step vertices: a node returns one factor for a step; leave out --node"),
        (("--mcap", "a.bag"), "a.bag: name a file that ends in .mcap"),
        (("--npz", "there.npz"), "there.npz: name a file that ends in .npz and does not exist yet"),
    ],
)
def test_wrong_use_is_named(tmp_path, words, message):
    (tmp_path / "there.npz").touch()
    assert message in run(tmp_path, *words, status=2)
