# SPDX-License-Identifier: Apache-2.0
"""Folders, patterns and lists of mesh files: order, missing frames, several meshes, topology from frame to frame."""

import multiprocessing
import pickle
import random
from concurrent.futures import ThreadPoolExecutor

import malformed
import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.sequences import SequenceError, open_sequence

# A quad with a dent: split along another diagonal than a square.
DENTED = "v 0 0 0\nv {} {} 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"


def write(folder, *names, text=malformed.SQUARE):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def names_of(sequence):
    return [sequence.frame(k).name for k in range(len(sequence))]


@pytest.mark.parametrize(
    "names",
    [
        ["f1.obj", "f2.obj", "f10.obj", "f100.obj"],
        ["f.0008.obj", "f.0009.obj", "f.0010.obj", "f.0011.obj"],
        ["9_cloth.obj", "10_cloth.obj", "11_cloth.obj"],
        ["7.obj", "8.obj", "12.obj"],
        ["frame_0009_v2.obj", "frame_0010_v2.obj", "frame_0011_v2.obj"],
        ["run2_f9.obj", "run2_f10.obj", "run2_f11.obj"],
        ["A1.OBJ", "A2.OBJ"],
        ["f_-002.obj", "f_-001.obj", "f_001.obj", "f_002.obj"],
        ["2026-01-9.obj", "2026-01-10.obj"],
    ],
)
def test_frames_are_in_the_order_of_their_numbers(names, tmp_path):
    write(tmp_path, *names)
    assert names_of(open_sequence(tmp_path)) == names
    shuffled = [tmp_path / name for name in names]
    random.Random(1).shuffle(shuffled)
    assert names_of(open_sequence(shuffled)) == names
    assert names_of(open_sequence(f"{tmp_path}/*.[oO][bB][jJ]")) == names


@pytest.mark.parametrize("form", ["frame{0}_part{1}.obj", "part{1}_frame{0}.obj", "part{1}.{0}.obj", "{0}/part{1}.obj"])
def test_numbered_meshes(form, tmp_path):
    write(tmp_path, *(form.format(frame, part) for frame in (8, 9, 10) for part in (1, 2)))
    sequence = open_sequence(f"{tmp_path}/*/*.obj" if "/" in form else tmp_path)
    assert len(sequence) == 3
    assert names_of(sequence) == [", ".join(form.format(frame, part) for part in (1, 2)) for frame in (8, 9, 10)]
    assert sequence.notes[0].startswith(
        "files differ in several numbers: one counts frames, the others are parts of mesh names ("
    )


def test_one_folder_a_frame(tmp_path):
    write(tmp_path, "9/cloth.obj", "9/body.obj", "10/cloth.obj", "10/body.obj")
    sequence = open_sequence(f"{tmp_path}/*/*.obj")
    assert len(sequence) == 2 and [mesh.name for mesh in sequence.frame(1).meshes] == ["body", "cloth"]


@pytest.mark.parametrize(
    "numbers, missing, notes",
    [
        ([0, 1, 2, 3], {}, ()),
        ([5, 10, 15, 20], {}, ("frame numbers increase by 5",)),
        ([1, 2, 4, 5, 9], {2: 1, 4: 3}, ("frame 3 is missing between f2.obj and f4.obj",
                                         "frames 6 to 8 are missing between f5.obj and f9.obj")),
        ([0, 10, 20, 40], {3: 1}, ("frame numbers increase by 10", "frame 30 is missing between f20.obj and f40.obj")),
        ([3, 8], {}, ("frame numbers increase by 5",)),
        ([4], {}, ()),
    ],
)  # fmt: skip
def test_missing_frames_are_named(numbers, missing, notes, tmp_path):
    write(tmp_path, *(f"f{number}.obj" for number in numbers))
    sequence = open_sequence(tmp_path)
    assert (sequence.missing, sequence.notes) == (missing, notes)


def test_many_missing_frames_are_summed_up(tmp_path):
    write(tmp_path, *(f"f{k}.obj" for k in range(60) if k % 3))
    notes = open_sequence(tmp_path).notes
    assert len(notes) == 11 and notes[-1] == "9 more frames are missing in 9 more places"


def test_several_meshes_a_frame(tmp_path):
    write(tmp_path, "cloth_1.obj", "cloth_2.obj", "body_1.obj", "body_2.obj", "floor.obj", "ball_v2.obj")
    sequence = open_sequence(tmp_path)
    frame = sequence.frame(1)
    assert len(sequence) == 2 and frame.name == "body_2.obj, cloth_2.obj" and len(frame.vertices) == 16
    assert [mesh.name for mesh in frame.meshes] == ["ball_v2", "body", "cloth", "floor"]
    assert sequence.notes == (
        "ball_v2.obj is one file: its mesh is the same in all frames",
        "floor.obj is one file: its mesh is the same in all frames",
    )


def test_files_without_common_names_are_one_frame(tmp_path):
    write(tmp_path, "cloth.obj", "body.obj")
    sequence = open_sequence([tmp_path / "cloth.obj", tmp_path / "body.obj"])
    assert (
        len(sequence) == 1
        and sequence.up is None
        and sequence.notes == ("no two files differ in their frame number only: the 2 files are meshes of one frame",)
    )


def test_hidden_files_other_formats_and_folders_are_ignored(tmp_path):
    write(tmp_path, "f1.obj", "f2.obj", ".f3.obj", "f4.mtl", "f5.obj/f.txt")
    assert names_of(open_sequence(tmp_path)) == ["f1.obj", "f2.obj"]


def test_opening_reads_no_file(tmp_path, monkeypatch):
    write(tmp_path, *(f"f{k}.obj" for k in range(100)), text="no mesh")
    monkeypatch.setattr("pathlib.Path.read_bytes", lambda self: pytest.fail("read"))
    assert len(open_sequence(tmp_path)) == 100


def test_topology_is_one_object_while_it_does_not_change(tmp_path):
    write(tmp_path, "f1.obj", "f2.obj")
    write(tmp_path, "f3.obj", "f4.obj", text=malformed.SQUARE.replace("f 1 3 4\n", ""))
    write(tmp_path, "f5.obj", text=malformed.SQUARE + "v 2 2 2\n")
    frames = [open_sequence(tmp_path).frame(0)] + [frame for frame in map(open_sequence(tmp_path).frame, range(5))]
    same = [a.meshes is b.meshes for a, b in zip(frames[1:], frames[2:], strict=False)]
    assert same == [True, False, True, False]
    assert [len(frame.meshes[0].faces) for frame in frames] == [2, 2, 2, 1, 1, 2]


@pytest.mark.parametrize("order", [range(3), (2, 1, 0), (1,)])
def test_polygons_are_split_as_in_the_first_frame(order, tmp_path):
    pytest.importorskip("mapbox_earcut", reason="dented polygons need the extra meshes")
    for k, dent in enumerate((0.25, 1, 2)):
        write(tmp_path, f"f{k}.obj", text=DENTED.format(dent, 1 - dent))
    alone = [hc.load_mesh(tmp_path / f"f{k}.obj")[1].tolist() for k in range(3)]
    assert alone[0] != alone[1]
    sequence = open_sequence(tmp_path)
    assert [sequence.frame(k).meshes[0].faces.tolist() for k in order] == [alone[0]] * len(order)


def test_polygons_that_the_first_frame_lacks_are_split_alike_in_any_order(tmp_path):
    pytest.importorskip("mapbox_earcut", reason="dented polygons need the extra meshes")
    write(tmp_path, "f0.obj")
    for k, dent in enumerate((0.25, 1, 2), 1):
        write(tmp_path, f"f{k}.obj", text=DENTED.format(dent, 1 - dent))
    forward, backward = open_sequence(tmp_path), open_sequence(tmp_path)
    frames = [forward.frame(k).meshes[0] for k in range(4)]
    assert frames[1] is not frames[2] and frames[2] is frames[3]
    for k in (3, 2, 1, 0):
        assert backward.frame(k).meshes[0].faces.tolist() == frames[k].faces.tolist()


def stl(corners):
    lines = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in np.asarray(corners, float).reshape(-1, 3).tolist()]
    facets = [
        "facet\nouter loop\n" + "\n".join(lines[k : k + 3]) + "\nendloop\nendfacet" for k in range(0, len(lines), 3)
    ]
    return "solid\n" + "\n".join(facets) + "\nendsolid\n"


def test_corners_of_stl_are_joined_as_in_the_first_frame(tmp_path):
    square = malformed.VERTICES[malformed.FACES]
    touching = square.copy()
    touching[touching[..., 1] == 1] = (0, 0, 0)  # two vertices meet a third one in the second frame
    torn = square + np.array([[[0.0]], [[1.0]]])
    for k, corners in enumerate((square, touching, torn)):
        write(tmp_path, f"f{k}.stl", text=stl(corners))
    sequence = open_sequence(tmp_path)
    frames = [sequence.frame(k) for k in range(3)]
    assert frames[0].meshes is frames[1].meshes and frames[2].meshes is not frames[1].meshes
    assert [mesh.n_vertices for frame in frames for mesh in frame.meshes] == [4, 4, 6]
    for frame, corners in zip(frames, (square, touching, torn), strict=True):
        assert np.array_equal(frame.vertices[frame.meshes[0].faces], corners)


# What follows the vertices of a file whose faces equal those of the file before.
VERTICES, FACES = malformed.SQUARE[: malformed.SQUARE.index("f")], malformed.SQUARE[malformed.SQUARE.index("f") :]
SECOND = {
    "other positions": VERTICES.replace("v 1 1 0", "v 1 1 2") + FACES,
    "one vertex more": "v 9 9 9\n" + VERTICES + FACES,
    "one vertex less": VERTICES.replace("v 0 1 0\n", "") + FACES,
    "a face before": VERTICES + "f 2 3 4\ng a\n" + FACES,
    "an indented face before": VERTICES + " f 2 3 4\n" + FACES,
    "a line that goes on": VERTICES + "f 2 3 \\\n" + FACES,
    "windows line ends": (VERTICES + FACES).replace("\n", "\r\n"),
    "not finite": VERTICES.replace("v 1 1 0", "v 1 nan 0") + FACES,
    "a damaged vertex": VERTICES.replace("v 1 1 0", "v 1 1") + FACES,
}
FIRST = {
    "usual": malformed.SQUARE,
    "normals between": VERTICES + "vn 0 0 1\n" + FACES,
    "a vertex at the end": malformed.SQUARE + "v 5 5 5\n",
    "an indented vertex at the end": malformed.SQUARE + "\t v 5 5 5\n",
    "numbers from the end": VERTICES + "f -4 -3 -2\nf -4 -2 -1\n",
}


@pytest.mark.parametrize("second", SECOND)
@pytest.mark.parametrize("first", FIRST)
def test_a_frame_is_what_the_file_alone_is(first, second, tmp_path):
    write(tmp_path, "f1.obj", text=FIRST[first])
    write(tmp_path, "f2.obj", text=SECOND[second].replace(FACES, FIRST[first][FIRST[first].index("f") :]))
    sequence = open_sequence(tmp_path)
    sequence.frame(0)
    try:
        vertices, faces = hc.load_mesh(tmp_path / "f2.obj")
    except hc.MeshFileError as error:
        with pytest.raises(SequenceError) as same:
            sequence.frame(1)
        assert str(same.value) == str(error)
    else:
        frame = sequence.frame(1)
        assert np.array_equal(frame.vertices, vertices) and np.array_equal(frame.meshes[0].faces, faces)


def test_components_become_meshes(tmp_path):
    second = "v 5 0 0\nv 6 0 0\nv 5 1 0\nv 7 7 7\nf 7 6 5\n"
    write(tmp_path, "f1.obj", "f2.obj", text=malformed.SQUARE + second)
    sequence = open_sequence(tmp_path, split=True)
    frame = sequence.frame(1)
    assert [(mesh.name, mesh.n_vertices, mesh.faces.tolist()) for mesh in frame.meshes] == [
        ("f.0", 4, [[0, 1, 2], [0, 2, 3]]),
        ("f.1", 3, [[2, 1, 0]]),
    ]
    assert frame.vertices[4:].tolist() == [[5, 0, 0], [6, 0, 0], [5, 1, 0]]
    assert sequence.frame(0).meshes is frame.meshes
    assert sequence.notes[-1] == "connected components are meshes of their own; vertices of no face are left out"


def test_sixty_four_components_in_any_order(tmp_path):
    vertices, faces = hc.shapes.grid(6, 3)
    order = np.random.default_rng(3).permutation(64 * len(vertices))
    place = np.argsort(order)
    moved = np.concatenate([vertices + [10 * k, 0, 0] for k in range(64)])[order]
    renumbered = np.concatenate([place[faces.astype(int) + k * len(vertices)] for k in range(64)])
    renumbered = renumbered[np.random.default_rng(4).permutation(len(renumbered))]
    np.savez(tmp_path / "a.npz", vertices=moved[None], faces=renumbered)
    frame = open_sequence(tmp_path / "a.npz", split=True).frame(0)
    before = 0
    for mesh in frame.meshes:
        assert mesh.n_vertices == len(vertices) and len(mesh.faces) == len(faces)
        own = frame.vertices[before : before + mesh.n_vertices]
        assert np.ptp(own[:, 0]) < 9
        before += mesh.n_vertices
    assert len(frame.meshes) == 64 and before == len(order)


def read_second(sequence):
    return sequence.frame(1).vertices.tobytes()


def test_sequences_go_to_other_processes(tmp_path):
    stack = np.random.default_rng(5).random((3, 4, 3))
    np.savez_compressed(tmp_path / "a.npz", vertices=stack, faces=malformed.FACES)
    sequence = open_sequence(tmp_path / "a.npz")
    assert sequence.frame(0).vertices.tobytes() == stack[0].tobytes()
    assert read_second(pickle.loads(pickle.dumps(sequence))) == stack[1].tobytes()
    # A forked process must not share the position in the file.
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map(read_second, [sequence] * 8) == [stack[1].tobytes()] * 8


def test_copies_share_what_they_have_opened(tmp_path):
    write(tmp_path, "f1.obj", "f2.obj")
    other = open_sequence(tmp_path)
    copies = [pickle.dumps(open_sequence(tmp_path))] * 3
    meshes = [pickle.loads(copy).frame(k % 2).meshes for k, copy in enumerate(copies)]
    assert meshes[0] is meshes[1] is meshes[2] and meshes[0] is not other.frame(0).meshes
    with ThreadPoolExecutor(1) as pool:
        assert pool.submit(lambda: pickle.loads(copies[0]).frame(0).meshes).result() is not meshes[0]


def test_many_sequences_at_once_keep_their_topology(tmp_path):
    write(tmp_path, "f1.obj", "f2.obj")
    sequences = [open_sequence(tmp_path, split=True) for _ in range(9)]
    first = [sequence.frame(0).meshes for sequence in sequences]
    assert all(sequence.frame(1).meshes is meshes for sequence, meshes in zip(sequences, first, strict=True))


def test_frames_beyond_the_end_are_an_index_error(tmp_path):
    write(tmp_path, "f1.obj")
    with pytest.raises(IndexError, match="use 0 to 0"):
        open_sequence(tmp_path).frame(1)


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "mcap.reader", None)
    (tmp_path / "a.mcap").write_bytes(b"")
    with pytest.raises(SequenceError, match=r"package mcap; .*hpccd-core\[check\]"):
        open_sequence(tmp_path / "a.mcap")
