# SPDX-License-Identifier: Apache-2.0
"""hpccd-check with hostile names, files, streams and results: a verdict or a sentence, and no other file is touched."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time

import malformed
import numpy as np
import planted
import pytest
from page_parts import Page
from sources import SOURCES

from hpccd_core.check import Options, command, workers
from hpccd_core.sequences import SequenceError, open_sequence

FACES, VERTICES = malformed.FACES, malformed.VERTICES
NAMES = ["[bold]x[]:smile:", "a\nb\t\x1b[31m", "$\\frac{$", "<script>alert(1)<!--x", os.fsdecode(b"c\xff"), "\u202e布"]


def check(*words):
    return command.main([str(word) for word in words])


@pytest.fixture
def folder(tmp_path):
    """Two frames of a square."""
    (tmp_path / "frames").mkdir()
    for k in (1, 2):
        (tmp_path / "frames" / f"a_{k}.obj").write_text(malformed.SQUARE)
    return tmp_path / "frames"


@pytest.fixture
def strange(tmp_path):
    """Two frames that intersect, with a mesh of each of NAMES."""
    folder = tmp_path / "strange"
    folder.mkdir()
    crossed = malformed.SQUARE + "v .2 .3 -1\nv .2 .3 1\nv .3 .9 1\nf 5 6 7\n"
    for name in NAMES:
        for k in (1, 2):
            (folder / f"{name}_{k}.obj").write_text(crossed)
    return folder


@pytest.mark.parametrize("columns", [0, 20, 2000])
def test_names_are_shown_as_they_are(columns, strange, monkeypatch, capsys):
    """On a terminal, narrow and wide, and elsewhere (0)."""
    if columns:
        monkeypatch.setenv("FORCE_COLOR", "1")
        monkeypatch.setenv("COLUMNS", str(columns))
        monkeypatch.setenv("LINES", "50")
    assert check(strange) == 1
    lines = re.sub("\x1b\\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
    names = [name.encode("utf-8", "backslashreplace").decode() for name in NAMES]
    shown = ["".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in name) for name in names]
    for k in (1, 2):
        (line,) = [line for line in lines if f"[bold]x[]:smile:_{k}.obj" in line and not line.startswith("defects")]
        assert all(f"{name}_{k}.obj" in line for name in shown) and line.replace("\t", "").isprintable()


def test_reports_hold_any_name(strange, tmp_path, capfd):
    results = {kind: tmp_path / f"result.{kind}" for kind in ("json", "csv", "html", "png")}
    assert check(strange, *(f"--{kind}={path}" for kind, path in results.items())) == 1
    names = [name.encode("utf-8", "backslashreplace").decode() for name in NAMES]
    file = json.loads(results["json"].read_text())["frames"][1]["file"]
    assert all(f"{name}_2.obj" in file for name in names)
    with open(results["csv"], newline="", encoding="utf-8") as stream:
        assert list(csv.reader(stream))[2][1] == file
    page = results["html"].read_text(encoding="utf-8")
    assert {mesh["name"] for mesh in Page(results["html"]).said["meshes"]} == set(names) and "<script>alert" not in page
    assert results["png"].read_bytes().startswith(b"\x89PNG") and capfd.readouterr().err == ""


def test_results_never_replace_frames(folder, tmp_path, capsys):
    before = (folder / "a_1.obj").read_bytes()
    (tmp_path / "link.json").symlink_to(folder / "a_1.obj")
    for path in (folder / "a_1.obj", tmp_path / "link.json"):
        assert check(folder, "--json", path) == 2
        assert "is a name of an input (.obj); give another name" in capsys.readouterr().err
    assert check(folder, "--png", tmp_path / "a.foo") == 2
    assert "--png" in (error := capsys.readouterr().err) and "use one of .png" in error
    assert (folder / "a_1.obj").read_bytes() == before and not (tmp_path / "a.foo").exists()


@pytest.mark.parametrize("option", ["--json", "--csv", "--html", "--png", "--faces", "--scheduler"])
def test_an_empty_name_is_no_name(option, folder, capsys):
    assert check(folder, f"{option}=") == 2
    assert f"{option}: is empty" in capsys.readouterr().err
    assert check("") == 2 and "PATH: is empty" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("redirected", "status"),
    [
        (">/dev/full", 2),
        (">&-", 0),
        (">&- 2>&-", 0),
        ("2>/dev/full", 0),
        ("missing 2>/dev/full", 2),
        ("missing 2>&-", 2),
    ],
)
def test_the_exit_status_remains_without_streams(redirected, status, folder):
    program = "import sys; from hpccd_core.check.command import main; sys.exit(main())"
    where = redirected.removeprefix("missing ")
    path = "missing" if where != redirected else "."
    words = ["sh", "-c", f'"$0" -c "$1" {path} {where}', sys.executable, program]
    ended = subprocess.run(words, cwd=folder, env={"PYTHONPATH": SOURCES}, capture_output=True, text=True, check=False)
    assert ended.returncode == status and "Traceback" not in ended.stderr


def test_an_error_in_the_program_is_no_verdict(folder, capsys, monkeypatch):
    monkeypatch.setattr(command, "_print", lambda *_: 1 / 0)
    assert check(folder) == 2
    assert "ZeroDivisionError" in (error := capsys.readouterr().err) and "no verdict; report it" in error


@pytest.mark.parametrize("name", ["a_3.obj", "a_3.vtk", "a.npz", "a.glb"])
def test_pipes_and_devices_are_no_input(name, tmp_path, capsys):
    os.mkfifo(tmp_path / name)
    for path in (tmp_path / name, f"{tmp_path}/*", tmp_path) if name[1] == "_" else (tmp_path / name, f"{tmp_path}/*"):
        assert check(path) == 2
        assert name in (error := capsys.readouterr().err) and "file" in error
    np.save(tmp_path / "v.npy", VERTICES[None])
    os.mkfifo(tmp_path / "f.npy")
    assert check(tmp_path / "v.npy", "--faces", tmp_path / "f.npy") == 2
    assert "f.npy: is no file" in capsys.readouterr().err


def test_files_that_shrink_while_they_are_read(tmp_path):
    stack = np.stack([np.tile(VERTICES, (1000, 1))] * 3)
    planted.write_glb(tmp_path, {name: of_mesh[:3] for name, of_mesh in planted.positions([]).items()})
    np.save(tmp_path / "c.npy", stack)
    np.save(tmp_path / "f.npy", np.asfortranarray(stack))
    np.save(tmp_path / "faces.npy", FACES)
    faces = tmp_path / "faces.npy"
    for name, options in (("planted.glb", {}), ("c.npy", {"faces": faces}), ("f.npy", {"faces": faces})):
        sequence = open_sequence(tmp_path / name, **options)
        sequence.frame(0)
        os.truncate(tmp_path / name, 150)
        with pytest.raises(SequenceError, match=f"{name}.*(cut off|ends within)"):
            sequence.frame(2)


def test_meshes_of_one_name_are_told_apart(tmp_path):
    """Names that collide with those made from numbers, and recordings of two nodes: none is lost."""
    document, binary = planted.gltf_of({name: of_mesh[:2] for name, of_mesh in planted.positions([]).items()})
    for node, name in zip(document["nodes"], ("a", "a", "a 0", "\ud800"), strict=True):
        node["name"] = name
    (tmp_path / "a.glb").write_bytes(planted.glb(document, binary))
    names = [mesh.name for mesh in open_sequence(tmp_path / "a.glb").frame(1).meshes]
    assert sorted(names) == ["\\ud800", "a 0", "a 0 0", "a 1"]


def test_positions_of_gltf_without_data(tmp_path):
    document, binary = planted.gltf_of({name: of_mesh[:1] for name, of_mesh in planted.positions([]).items()}, False)
    position = document["accessors"][document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]]
    del position["bufferView"]
    position["count"] = 10**8
    (tmp_path / "a.glb").write_bytes(planted.glb(document, binary))
    with pytest.raises(SequenceError, match="elements without data"):
        open_sequence(tmp_path / "a.glb")


def test_compressed_frames_have_a_limit(tmp_path, monkeypatch):
    monkeypatch.setattr("hpccd_core.sequences.arrays._MOST_COMPRESSED", 80)
    np.savez_compressed(tmp_path / "a.npz", vertices=VERTICES[None], faces=FACES)
    with pytest.raises(SequenceError, match="a.npz: vertices: .* save it with numpy.savez"):
        open_sequence(tmp_path / "a.npz").frame(0)
    np.savez(tmp_path / "a.npz", vertices=VERTICES[None], faces=FACES)
    assert len(open_sequence(tmp_path / "a.npz").frame(0).vertices) == 4


def test_meshes_that_a_picture_cannot_show(tmp_path):
    """In the middle of the step all vertices are at one point; coordinates are the largest ones."""
    np.savez(tmp_path / "a.npz", vertices=np.stack([VERTICES * 1e150, VERTICES * -1e150]), faces=FACES)
    assert check(tmp_path / "a.npz", "--png", tmp_path / "a.png", "--html", tmp_path / "a.html") == 1


def test_many_meshes(tmp_path, monkeypatch, capsys):
    for k in range(30):
        (tmp_path / f"{chr(97 + k % 26) * (20 + k)}.obj").write_text(malformed.SQUARE.replace(" 0\n", f" {k}\n"))
    assert check(tmp_path) == 0
    assert " characters) ..." in (out := capsys.readouterr().out) and len(out) < 1000
    monkeypatch.setattr("hpccd_core.check.analysis.MOST_MESHES", 29)
    assert check(tmp_path) == 2
    assert "has 30 meshes, each pair of which is measured; check at most 29 at once" in capsys.readouterr().err


def test_a_thread_may_check(folder, capsys):
    found = []
    thread = threading.Thread(target=lambda: found.append(check(folder)))
    thread.start()
    thread.join()
    assert found == [0]


def test_files_that_are_named_twice_are_one(folder):
    assert len(open_sequence([folder / "a_1.obj", f"{folder}/*.obj", folder / "a_2.obj"])) == 2


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda _: open_sequence(None), TypeError, "paths: expected the name of a file as str or Path, got NoneType"),
        (
            lambda _: open_sequence([b"a.obj"]),
            TypeError,
            "paths: expected the name of a file as str or Path, got bytes",
        ),
        (lambda _: open_sequence([""]), SequenceError, "paths: a name is empty; give a folder"),
        (lambda f: open_sequence(f, split="yes"), TypeError, "split: expected True or False, got str"),
        (lambda f: open_sequence(f, faces=5), TypeError, "faces: expected the name of a file as str or Path, got int"),
        (lambda f: open_sequence(f).frame(1.0), TypeError, "index: expected an integer, got float"),
        (lambda f: open_sequence(f).frame(2), IndexError, "index: 2 is not a frame of .*; use 0 to 1"),
        (lambda _: Options(separation=float("nan")), ValueError, "separation: must be finite and not negative"),
        (lambda _: Options(separation="x"), TypeError, "separation: expected a number, got str"),
    ],
)
def test_wrong_arguments_are_named(call, error, message, folder):
    with pytest.raises(error, match=message):
        call(folder)


def test_an_interrupt_that_a_library_swallows(folder, monkeypatch, capsys):
    def imported(_):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(10)
        except KeyboardInterrupt:
            raise TypeError("half of the library") from None

    monkeypatch.setattr(command, "_library", imported)
    assert check(folder) == 130
    assert capsys.readouterr().err == "hpccd-check: interrupted\n"
    monkeypatch.undo()
    assert check(folder) == 0 and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_the_start_of_a_cluster_is_not_interrupted():
    """The interrupt comes afterwards, and processes that are started in between do not get it."""
    program = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, []))"
    words, found = [sys.executable, "-c", program], []
    with pytest.raises(KeyboardInterrupt), workers._interrupted_later():
        os.kill(os.getpid(), signal.SIGINT)
        found.append(subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip())
    assert found == ["True"]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip() == "False"
