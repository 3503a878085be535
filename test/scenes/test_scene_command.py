# SPDX-License-Identifier: Apache-2.0
"""`hpccd scene` on the command line."""

import os

import numpy as np
import pytest

from hpccd_ros import cli, scenes


def run(capsys, *words):
    """(exit status, standard output, standard error) of `hpccd scene WORDS`."""
    status = cli.main(["scene", *map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


def test_help_tells_examples_and_options(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["scene", "--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    for word in ("--list", "--publish", "--rate", "--loop", "--mcap", "--npz", "--png", "--params", "cloth-drop"):
        assert word in text


def test_list_names_all(capsys):
    status, out, _ = run(capsys, "--list")
    assert status == 0
    assert [line.split()[0] for line in out.splitlines()] == scenes.names()


def test_name_alone_describes_and_says_what_to_do_next(capsys):
    status, out, _ = run(capsys, "breaking-like", "--frames", 2)
    assert status == 0
    assert "252,028 triangles" in out and "--publish" in out
    assert "ground: 128 triangles, static, no self-collision" in out


def test_files_are_written_and_not_overwritten(capsys, tmp_path):
    names = [tmp_path / f for f in ("a.mcap", "a.npz", "a.yaml", "a.png")]
    options = ["--mcap", names[0], "--npz", names[1], "--params", names[2], "--png", names[3], "--at", "0,10"]
    status, out, _ = run(capsys, "two-triangles", *options)
    assert status == 0
    assert all(name.stat().st_size > 100 and f"wrote {name}" in out for name in names)
    assert names[3].read_bytes().startswith(b"\x89PNG")
    for option, name in (("--mcap", names[0]), ("--npz", names[1]), ("--params", names[2])):
        before = name.read_bytes()
        status, _, err = run(capsys, "two-triangles", option, name)
        assert status == 2 and str(name) in err and "remove it or name another" in err
        assert name.read_bytes() == before


def test_step_is_what_the_detector_takes(capsys, tmp_path):
    status, _, _ = run(capsys, "two-triangles", "--npz", tmp_path / "step.npz", "--step", 5)
    assert status == 0
    with np.load(tmp_path / "step.npz") as archive:
        assert archive["vertices_t0"].shape == archive["vertices_t1"].shape == (6, 3)
        assert archive["faces"].tolist() == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "which scene? `hpccd scene --list`"),
        (["dragon"], "unknown scene 'dragon'; there are"),
        (["two-triangles", "--size", "0"], "size 0.0 is outside"),
        (["two-triangles", "--frames", "1"], "needs a whole number of at least 2"),
        (["two-triangles", "--rate", "0"], "--rate 0.0: must be above 0"),
        (["two-triangles", "--publish", "--wait", "-1"], "--wait -1.0"),
        (["two-triangles", "--loop"], "--loop belongs to --publish"),
        (["two-triangles", "--step", "1"], "--step belongs to --npz"),
        (["two-triangles", "--at", "1"], "--at belongs to --png"),
        (["two-triangles", "--npz", "x.npz", "--step", "11"], "--step 11: the scene has steps 1 to 10"),
        (["two-triangles", "--png", "x.png", "--at", "1,x"], "--at 1,x: frame numbers"),
        (["two-triangles", "--png", "x.png", "--at", "11"], "--at 11: the scene has frames 0 to 10"),
        (["two-triangles", "--png", "x.xyz", "--at", "1"], "--png x.xyz: Format 'xyz' is not supported"),
        (["two-triangles", "--mcap", "x.bag"], "name a file that ends in .mcap"),
        (
            ["two-triangles", "--npz", os.path.join("no", "such", "folder", "x.npz")],
            "x.npz: there is no folder no/such/folder; create it\n",
        ),
        (["two-triangles", "--mcap", "no/x.mcap"], "no/x.mcap: there is no folder no; create it\n"),
    ],
)
def test_wrong_use_is_explained(capsys, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    status, _, err = run(capsys, *words)
    assert status == 2
    assert err.startswith("hpccd scene: ") and message in err
    assert not list(tmp_path.iterdir()), "nothing is left behind"
