# SPDX-License-Identifier: Apache-2.0
"""hpccd-check: verdict, exit status and files for planted defects, in all formats, however the work is cut."""

import contextlib
import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from fractions import Fraction
from pathlib import Path

import numpy as np
import planted
import pytest
from page_parts import Page
from sources import SOURCES

import hpccd_core as hc
from hpccd_core.check import Options, check_part, command, workers
from hpccd_core.check.workers import report_of
from hpccd_core.sequences import open_sequence


def check(*words):
    """Exit status of hpccd-check with these arguments."""
    return command.main([str(word) for word in words])


def checked(tmp_path, *words):
    """The report as JSON holds it."""
    status = check(*words, "--json", tmp_path / "report.json")
    return status, json.loads((tmp_path / "report.json").read_text())


@pytest.fixture(scope="module")
def npz(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planted")
    planted.write_npz(folder, planted.positions())
    return folder / "planted.npz"


@pytest.fixture(scope="module")
def expected(npz):
    """Frames and steps of the planted sequence, by one detector that sees them in order."""
    rows = list(check_part(open_sequence(npz), Options(), 0, planted.N_FRAMES, 1))
    return [frame for frame, _ in rows], [step for _, step in rows if step is not None]


def test_the_defects_are_those_that_were_planted(expected):
    frames, steps = expected
    assert {f.index for f in frames if f.intersections} == {k for d in planted.DEFECTS for k in d.frames}
    assert {f.index for f in frames if f.inside} == {k for d in planted.DEFECTS for k in d.inside}
    assert {pair for f in frames for pair in f.inside} == {("probe", "body")}
    found = {s.start for s in steps if s.contacts}
    wanted = {k for d in planted.DEFECTS for k in d.steps}
    assert wanted <= found and all({k, k + 1} & {i for d in planted.DEFECTS for i in d.frames} for k in found - wanted)
    assert all((s.first_toc is None) == (s.contacts == 0) for s in steps)


@pytest.mark.parametrize("form", planted.WRITERS)
def test_the_report_is_the_same_in_all_formats(form, expected, tmp_path, capsys):
    if form in planted.PACKAGES:
        pytest.importorskip(planted.PACKAGES[form], reason=f"reading {form} needs the extra check")
    paths, options = planted.WRITERS[form](tmp_path, planted.positions())
    words = [f"--{name}" if value is True else f"--{name}={value}" for name, value in options.items()]
    status, report = checked(tmp_path, *paths, *words)
    assert status == 1 and report["verdict"] == "defects"
    frames, steps = expected
    for row, frame in zip(report["frames"], frames, strict=True):
        assert (row["index"], row["intersections"], row["distance"]) == (
            frame.index,
            frame.intersections,
            frame.distance,
        )
        assert len(row["inside"]) == len(frame.inside)
        assert "split" in options or [tuple(pair) for pair in row["inside"]] == list(frame.inside)
    assert report["steps"] == [vars(step) for step in steps]
    assert "first in frame 10 (" in capsys.readouterr().out.splitlines()[-1]


def test_a_clean_sequence(tmp_path, capsys):
    paths, _ = planted.write_npz(tmp_path, planted.positions([]))
    status, report = checked(tmp_path, *paths)
    assert status == 0 and report["verdict"] == "clean"
    assert not any(frame["intersections"] or frame["inside"] for frame in report["frames"])
    assert not any(step["contacts"] for step in report["steps"])
    smallest = min(frame["distance"] for frame in report["frames"])
    words = f"clean: no contact in 200 frames and 199 steps; smallest distance {smallest:.6g} in frame "
    assert capsys.readouterr().out.splitlines()[-1].startswith(words)


@pytest.mark.parametrize("seed", range(4))
def test_overlapping_parts_give_the_same_rows(seed, npz, expected):
    cuts = sorted(random.Random(seed).sample(range(1, planted.N_FRAMES), 12))
    rows = []
    for begin, end in zip([0, *cuts], [*cuts, planted.N_FRAMES], strict=True):
        rows += check_part(open_sequence(npz), Options(), begin, end, 1)
    assert ([frame for frame, _ in rows], [step for _, step in rows if step is not None]) == expected


def test_reports_are_byte_identical_for_any_number_of_jobs(npz, tmp_path):
    texts = set()
    for jobs in (1, 2, 5):
        files = [tmp_path / f"{jobs}.{kind}" for kind in ("json", "csv")]
        assert check(npz, "--jobs", jobs, "--json", files[0], "--csv", files[1]) == 1
        texts.add(tuple(file.read_bytes() for file in files))
    assert len(texts) == 1


def test_dask_gives_the_same_bytes(npz, tmp_path):
    pytest.importorskip("distributed", reason="needs the extra cluster")
    assert check(npz, "--json", tmp_path / "alone") == 1
    assert check(npz, "--cluster", "--jobs", 4, "--json", tmp_path / "dask") == 1
    assert (tmp_path / "alone").read_bytes() == (tmp_path / "dask").read_bytes()


def test_lost_dask_processes_are_a_sentence(npz, capsys, monkeypatch):
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")

    def lost(*_):
        raise distributed.KilledWorker("part", None, 4)

    monkeypatch.setattr(workers, "on_cluster", lost)
    assert check(npz, "--cluster", "--jobs", 1) == 2
    error = capsys.readouterr().err
    assert error == "hpccd-check: --cluster: processes were ended, perhaps for lack of memory; try fewer jobs\n"

    def fails(**_):
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr(distributed, "LocalCluster", fails)
    assert check(npz, "--cluster", "--jobs", 1) == 2
    assert capsys.readouterr().err.startswith("hpccd-check: --cluster: processes could not be started, perhaps")


def test_csv_has_a_row_for_each_frame(npz, expected, tmp_path):
    check(npz, "--csv", tmp_path / "all.csv")
    rows = list(csv.DictReader((tmp_path / "all.csv").open()))
    frames, steps = expected
    for row, frame, step in zip(rows, frames, [*steps, None], strict=True):
        assert (int(row["index"]), int(row["intersections"])) == (frame.index, frame.intersections)
        assert row["distance"] == repr(frame.distance)
        assert row["contacts_to_next"] == ("" if step is None else str(step.contacts))
        assert row["first_toc"] == ("" if step is None or step.first_toc is None else repr(step.first_toc))


def test_page_and_picture_show_the_defects(npz, expected, tmp_path):
    assert check(npz, "--html", tmp_path / "page.html", "--png", tmp_path / "worst.png") == 1
    page = Page(tmp_path / "page.html")
    frames, steps = expected
    assert [mesh["name"] for mesh in page.said["meshes"]] == list(planted.NAMES)
    assert [step["step"] for step in page.said["steps"]] == [str(k) for k in range(planted.N_FRAMES)]
    assert [step["where"] for step in page.said["steps"]][:2] == ["frame 0", "the step to frame 1"]
    assert [step["total"] for step in page.said["steps"]] == [0, *(step.contacts for step in steps)]
    marked = {k for k, step in enumerate(page.said["steps"]) if any(step["intersecting"])}
    assert marked == {frame.index for frame in frames if frame.intersections}
    curved = [k for k, step in enumerate(page.said["steps"]) if step["curves"][0]]
    assert curved and set(curved) <= marked
    assert page.said["steps"][146]["notices"] == ["probe is inside body."]
    shape = planted.positions()
    for k in (0, 10, 199):
        assert np.abs(page.vertices(1, k) - shape["cloth"][k]).max() <= page.said["meshes"][1]["step"]
    assert (tmp_path / "worst.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_of_faces_without_area(tmp_path):
    """No face covers a pixel, so no surface hides a contact or a curve."""
    line = np.array([[(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0.0)]] * 2)
    np.savez(tmp_path / "line.npz", a_vertices=line, a_faces=[(0, 1, 2)], b_vertices=line, b_faces=[(1, 2, 3)])
    assert check(tmp_path / "line.npz", "--png", tmp_path / "a.png", "--html", tmp_path / "a.html") == 1
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_separation_counts_different_meshes(tmp_path):
    """Two squares, 1 apart, whose distance on the way is 0.5."""
    square, faces = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)]), np.array([(0, 1, 2), (0, 2, 3)])
    above = [np.add(square, (0, 0, z)) for z in (1, 0.5, 1)]
    np.savez(tmp_path / "two.npz", a_vertices=[square] * 3, a_faces=faces, b_vertices=above, b_faces=faces)
    assert check(tmp_path / "two.npz") == 0
    assert check(tmp_path / "two.npz", "--separation", 0.49) == 0
    status, report = checked(tmp_path, tmp_path / "two.npz", "--separation", 0.5)
    assert status == 1 and [bool(step["contacts"]) for step in report["steps"]] == [True, True]
    assert [frame["distance"] for frame in report["frames"]] == [1, 0.5, 1]
    assert check(tmp_path / "two.npz", "--separation", 0.75) == 1


def test_a_separation_that_is_too_large_is_a_sentence(tmp_path, capsys):
    """As where it is given in millimetres for positions in metres: the contacts would not fit into memory."""
    vertices, faces = hc.shapes.icosphere(24)
    of_mesh = {name: np.array([vertices + (x, 0, 0)] * 2, np.float32) for name, x in (("a", 0), ("b", 3))}
    np.savez(tmp_path / "two.npz", a_vertices=of_mesh["a"], a_faces=faces, b_vertices=of_mesh["b"], b_faces=faces)
    assert check(tmp_path / "two.npz", "--separation", 0.5) == 0
    assert check(tmp_path / "two.npz", "--separation", 1000) == 2
    says = f"two.npz[0]: about {len(vertices) ** 2:,} pairs of vertices of different meshes are within the separation"
    assert says in capsys.readouterr().err


def test_a_collapsed_frame_is_a_sentence(tmp_path, capsys):
    """As a simulation that failed writes it: each face would touch each other one."""
    vertices, faces = hc.shapes.icosphere(24)
    np.savez(tmp_path / "zero.npz", vertices=[vertices, vertices, 0 * vertices], faces=faces)
    assert check(tmp_path / "zero.npz") == 2
    assert "zero.npz[2]: about 16,597,441 pairs of vertices are at one position" in capsys.readouterr().err


def test_separation_leaves_out_distances_within_a_mesh(tmp_path):
    square, faces = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0.0)]), np.array([(0, 1, 2), (0, 2, 3)])
    np.savez(tmp_path / "one.npz", vertices=[square, square], faces=faces)
    status, report = checked(tmp_path, tmp_path / "one.npz", "--separation", 2)
    assert status == 0 and report["frames"][0]["distance"] == 0.5**0.5


@pytest.mark.parametrize("n_frames", [1, 2])
def test_the_separation_is_exact_where_a_distance_is_rounded(n_frames, tmp_path):
    a, b = [(0, 0, 0), (-1, 0, 0), (0, -1, 0)], [(1, 1, 1), (2, 1, 1), (1, 2, 1)]
    vertices = {"a_vertices": np.array([a] * n_frames, float), "b_vertices": np.array([b] * n_frames, float)}
    np.savez(tmp_path / "two.npz", a_faces=[(0, 1, 2)], b_faces=[(0, 1, 2)], **vertices)
    below = 1.7320508075688772  # the square root of 3, rounded down
    assert Fraction(below) ** 2 < 3 < Fraction(np.nextafter(below, 2)) ** 2
    status, report = checked(tmp_path, tmp_path / "two.npz", "--separation", repr(below))
    assert status == 0 and report["frames"][0]["distance"] == below
    assert check(tmp_path / "two.npz", "--separation", repr(float(np.nextafter(below, 2)))) == 1


@pytest.mark.parametrize("beside", [False, True])
def test_a_flat_fold_touches_itself(beside, tmp_path, capsys):
    """Two triangles of one edge, folded onto each other: no edge intersects a face that has no vertex of it."""
    folded = {
        "a_vertices": np.array([[(0, 0, 0), (4, 0, 0), (0, 4, 0), (1, 1, 0.0)]]),
        "a_faces": [(0, 1, 2), (1, 0, 3)],
    }
    other = {"b_vertices": np.array([[(0, 0, 9), (1, 0, 9), (0, 1, 9.0)]]), "b_faces": [(0, 1, 2)]}
    np.savez(tmp_path / "fold.npz", **folded, **(other if beside else {}))
    status, report = checked(tmp_path, tmp_path / "fold.npz")
    assert status == 1 and report["frames"][0]["distance"] == 0 and report["frames"][0]["intersections"] == 0
    says = "defects: 1 of 1 frame where a mesh touches itself; first in frame 0 (fold.npz[0])"
    assert capsys.readouterr().out.splitlines()[-1] == says


def write_frames(folder, *meshes):
    """An OBJ file for each of (vertices, faces)."""
    for k, (vertices, faces) in enumerate(meshes):
        lines = [f"v {x} {y} {z}" for x, y, z in vertices] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
        (folder / f"mesh_{k}.obj").write_text("\n".join(lines) + "\n")
    return folder


TRIANGLE = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
SQUARE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 1, 2), (1, 3, 2)]


def test_changed_meshes_are_an_error_or_left_out(tmp_path, capsys):
    folder = write_frames(tmp_path, TRIANGLE, TRIANGLE, SQUARE, SQUARE)
    assert check(folder, "--jobs", 1) == 2
    assert "mesh_2.obj: mesh 'mesh' changed from 3 to 4 vertices" in capsys.readouterr().err
    status, report = checked(tmp_path, folder, "--changes")
    assert status == 0 and [step["contacts"] for step in report["steps"]] == [0, None, 0]
    assert "1 of 3 steps not checked, because meshes changed" in capsys.readouterr().out
    assert check(folder, "--changes", "--html", tmp_path / "page.html") == 0
    assert [mesh["topologies"] for mesh in Page(tmp_path / "page.html").said["meshes"]][0][1]["faces"] == 2


def test_components_that_may_be_inside_another_are_a_note(tmp_path, capsys):
    outer, inner = ([(x, y, z) for x in (0, a) for y in (0, a) for z in (0, a)] for a in (3, 1))
    box = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
    box += [(1, 5, 7), (1, 7, 3)]
    vertices = outer + [(x + 1, y + 1, z + 1) for x, y, z in inner]
    folder = write_frames(tmp_path, (vertices, box + [tuple(k + 8 for k in face) for face in box]))
    assert check(folder) == 0
    assert "several connected components; whether one is inside another is only reported with --split" in (
        capsys.readouterr().out
    )
    assert check(folder, "--split") == 1
    assert "mesh_0.1 in mesh_0.0" in (out := capsys.readouterr().out) and "whether" not in out


def test_a_separation_within_one_mesh_has_no_effect_and_a_note(tmp_path, capsys):
    strip = (
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 0), (1, 2, 0)],
        [(0, 1, 2), (1, 3, 2), (2, 3, 4), (3, 5, 4)],
    )
    assert check(write_frames(tmp_path, strip, strip), "--separation", 2) == 0
    out = capsys.readouterr().out
    assert "note: the separation has no effect" in out and "within" not in out


def test_weld_joins_doubled_vertices(tmp_path, capsys):
    doubled = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (3, 4, 5)]
    torn = [*doubled[0][:3], (1, 0, 1), *doubled[0][4:]], doubled[1]
    folder = tmp_path / "seam"
    folder.mkdir()
    assert check(write_frames(folder, doubled, doubled)) == 1
    assert "note: 2 vertices have the position of another one of the same mesh" in capsys.readouterr().out
    assert check(folder, "--weld") == 0
    assert "note" not in capsys.readouterr().out
    write_frames(folder, doubled, torn)
    assert check(folder, "--weld") == 2
    assert "vertices 1 and 3, at one position in the first frame, are apart here" in capsys.readouterr().err
    loose = [*([(1, 0, z)] + doubled[0] for z in (0, 5))]  # a vertex in no face that moves away
    faces = [tuple(k + 1 for k in face) for face in doubled[1]]
    assert check(write_frames(folder, *((vertices, faces) for vertices in loose)), "--weld") == 0


def test_several_sequences_in_one_command(npz, tmp_path, capsys):
    paths, _ = planted.write_npz(tmp_path, planted.positions([]))
    status, report = checked(tmp_path, npz, *paths)
    assert status == 1 and report["verdict"] == "defects"
    assert [one["verdict"] for one in report["sequences"]] == ["defects", "clean"]
    assert [one["source"] for one in report["sequences"]] == [str(npz), str(paths[0])]
    assert check(npz, *paths, "--html", tmp_path / "page.html") == 2
    assert "--html: shows one sequence, 2 are given" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--separation", "nan"), "--separation nan: must be a finite number, 0 or more"),
        (("--separation", "-1"), "--separation -1.0: must be a finite number, 0 or more"),
        (("--jobs", "-2"), "--jobs -2: must be 0 or more"),
        (("--weld", "--changes"), "--weld: joins vertices as in the first frame; leave out --changes"),
        (("--json", "no/folder/report.json"), "--json no/folder/report.json: there is no folder no/folder; create it"),
        (("--scheduler", "tcp://127.0.0.1:9"), "--scheduler tcp://127.0.0.1:9: no Dask scheduler responds there"),
    ],
)
def test_wrong_use_is_a_sentence(words, says, npz, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    if words[0] == "--scheduler":
        distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
        whole = distributed.Client
        monkeypatch.setattr(distributed, "Client", lambda address, timeout: whole(address, timeout="2s"))
    assert check(npz, *words) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"hpccd-check: {says}") and error.count("\n") == 1


def test_a_result_replaces_neither_input_nor_another_result(npz, tmp_path, capsys):
    assert check(npz, "--json", npz) == 2
    assert f"--json {npz}: is an input, too; give another name" in capsys.readouterr().err
    assert check(npz, "--json", tmp_path / "x", "--csv", tmp_path / "x") == 2
    assert "is the file of --json, too" in capsys.readouterr().err


def test_a_quoted_pattern_is_what_the_shell_makes_of_it(tmp_path, capsys):
    clean = planted.positions([])
    planted.write_npz(tmp_path, {name: of_mesh[:2] for name, of_mesh in clean.items()})
    (tmp_path / "planted.npz").rename(tmp_path / "a.npz")
    (tmp_path / "b.npz").write_bytes((tmp_path / "a.npz").read_bytes())
    assert check(tmp_path / "*.npz") == 0
    assert [line.split(": ")[1] for line in capsys.readouterr().out.splitlines() if "clean" in line] == ["clean"] * 2


@pytest.mark.parametrize("option", ["--sepration", "--sep"])
def test_a_misspelt_option_names_the_nearest(option, npz, capsys):
    with pytest.raises(SystemExit) as ended:
        check(npz, option, 1)
    assert ended.value.code == 2 and "did you mean --separation?" in capsys.readouterr().err


@pytest.fixture
def long_check(tmp_path):
    """hpccd-check of 8,000 frames in two processes, which are running; and the process numbers of these."""
    program = "import sys; from hpccd_core.check.command import main\nif __name__ == '__main__': sys.exit(main())"
    (tmp_path / "program.py").write_text(program)
    shape = planted.positions([])
    planted.write_npz(tmp_path, {name: np.tile(of_mesh, (40, 1, 1)) for name, of_mesh in shape.items()})
    process = subprocess.Popen(
        [sys.executable, "program.py", "planted.npz", "--jobs", "2", "--json", "report.json"],
        cwd=tmp_path,
        env={"PYTHONPATH": SOURCES, "PATH": "/usr/bin"},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        yield process, workers_of(process)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def workers_of(process):
    """Its children that have loaded the core, when there are two."""
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and process.poll() is None:
        children = [
            int(child) for child in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        ]
        loaded = [child for child in children if "_core" in maps(child)]
        if len(loaded) == 2:
            return loaded
        time.sleep(0.05)
    raise AssertionError(f"no workers; {process.poll()}")


def maps(process):
    try:
        return Path(f"/proc/{process}/maps").read_text()
    except OSError:  # it has ended
        return ""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_leaves_no_file(number, long_check, tmp_path):
    process, workers = long_check
    process.send_signal(number)
    assert process.wait(60) == 130 and process.stderr.read() == "hpccd-check: interrupted\n"
    assert sorted(file.name for file in tmp_path.iterdir()) == ["planted.npz", "program.py"]
    assert not any(map(maps, workers))


def test_a_killed_worker_is_a_sentence(long_check, tmp_path):
    process, workers = long_check
    os.kill(workers[0], signal.SIGKILL)
    assert process.wait(60) == 2
    assert process.stderr.read().startswith("hpccd-check: --jobs: a process was ended, perhaps for lack of memory; try")
    assert not (tmp_path / "report.json").exists()


def test_workers_end_with_a_killed_command(long_check):
    process, workers = long_check
    process.kill()
    deadline = time.monotonic() + 20
    while any(map(maps, workers)):
        assert time.monotonic() < deadline, "workers go on without the command"
        time.sleep(0.05)


def test_the_ros_command_is_the_same(hpccd, npz, tmp_path):
    done = hpccd("check", npz, "--json", "report.json")
    assert done.returncode == 1 and done.stdout.splitlines()[-1].startswith("defects: ")
    assert check(npz, "--json", tmp_path / "core.json") == 1
    assert (tmp_path / "report.json").read_bytes() == (tmp_path / "core.json").read_bytes()
    assert hpccd("check", "no.npz").returncode == 2


def test_a_report_of_all_rows(npz, expected):
    frames, steps = expected
    rows = list(zip(frames, [*steps, None], strict=True))
    report = report_of(open_sequence(npz), Options(), rows)
    assert not report.clean and report.verdict == "defects" and len(report.bad_rows()) > 20
