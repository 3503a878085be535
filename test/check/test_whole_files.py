# SPDX-License-Identifier: Apache-2.0
"""Arrays, point caches and recordings as sequences."""

import struct

import malformed
import numpy as np
import planted
import pytest
from sources import ROOT

from hpccd_core.sequences import SequenceError, open_sequence

STACK = np.random.default_rng(7).random((5, 4, 3))
FACES = malformed.FACES


def frames(sequence, order=None):
    return np.array([sequence.frame(k).vertices for k in (order or range(len(sequence)))])


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
@pytest.mark.parametrize("dtype", ["<f2", "<f4", ">f4", "<f8", ">f8"])
def test_npz_of_any_float(save, dtype, tmp_path):
    stack = STACK.astype(dtype)
    save(tmp_path / "cloth.npz", vertices=stack, faces=FACES)
    sequence = open_sequence(tmp_path / "cloth.npz")
    assert np.array_equal(frames(sequence), stack.astype(np.float64))
    assert np.array_equal(frames(sequence, [4, 0, 2, 1]), stack[[4, 0, 2, 1]].astype(np.float64))
    assert sequence.notes[0] == f"positions are {np.dtype(dtype).newbyteorder('=')}"
    assert sequence.frame(3).name == "cloth.npz[3]" and sequence.frame(3).meshes[0].name == "cloth"


@pytest.mark.parametrize(
    "positions", ["vertices", "positions", "points", "v", "cloth_v", "cloth.positions", "x/y_vertices"]
)
@pytest.mark.parametrize("faces", ["faces", "triangles", "f"])
def test_names_of_arrays(positions, faces, tmp_path):
    np.savez(tmp_path / "a.npz", **{positions: STACK, faces: FACES, "times": np.arange(5.0)})
    sequence = open_sequence(tmp_path / "a.npz")
    assert np.array_equal(frames(sequence), STACK) and np.array_equal(sequence.frame(0).meshes[0].faces, FACES)


def test_npz_of_several_meshes_one_of_them_static(tmp_path):
    arrays = {"cloth_vertices": STACK, "cloth_faces": FACES, "body_vertices": STACK[0] + 5, "body_faces": FACES[:1]}
    np.savez(tmp_path / "a.npz", **arrays)
    sequence = open_sequence(tmp_path / "a.npz")
    frame = sequence.frame(2)
    assert [(mesh.name, len(mesh.faces)) for mesh in frame.meshes] == [("body", 1), ("cloth", 2)]
    assert np.array_equal(frame.vertices, np.concatenate([STACK[0] + 5, STACK[2]]))


def test_fortran_order(tmp_path):
    np.savez(tmp_path / "a.npz", vertices=np.asfortranarray(STACK), faces=FACES)
    np.save(tmp_path / "a.npy", np.asfortranarray(STACK))
    assert np.array_equal(frames(open_sequence(tmp_path / "a.npz")), STACK)
    np.save(tmp_path / "faces.npy", FACES)
    assert np.array_equal(frames(open_sequence(tmp_path / "a.npy", faces=tmp_path / "faces.npy")), STACK)


@pytest.mark.parametrize("kind", ["faces.npy", "faces.npz", "mesh.obj"])
def test_faces_from_another_file(kind, tmp_path):
    np.save(tmp_path / "a.npy", STACK.astype(np.float32))
    (tmp_path / "mesh.obj").write_text(malformed.SQUARE)
    np.save(tmp_path / "faces.npy", FACES.astype(np.int16))
    np.savez(tmp_path / "faces.npz", anything=FACES)
    sequence = open_sequence(tmp_path / "a.npy", faces=tmp_path / kind)
    assert sequence.frame(0).meshes[0].faces.tolist() == FACES.tolist()
    np.savez(tmp_path / "a.npz", vertices=STACK)
    assert open_sequence(tmp_path / "a.npz", faces=tmp_path / kind).frame(0).meshes[0].faces.tolist() == FACES.tolist()


@pytest.mark.parametrize("save, suffix", [(np.savez, "npz"), (np.savez_compressed, "npz"), (np.save, "npy")])
def test_memory_is_that_of_a_frame(save, suffix, tmp_path, monkeypatch):
    tracemalloc = pytest.importorskip("tracemalloc")
    stack = np.random.default_rng(1).random((100, 2000, 3)).astype(np.float32)  # 2.4 MB
    faces = {"faces": np.array([[0, 1, 1999]])}
    np.savez(tmp_path / "f.npz", **faces)
    if suffix == "npz":
        save(tmp_path / "a.npz", vertices=stack, **faces)
    else:
        save(tmp_path / "a.npy", stack)
    sequence = open_sequence(tmp_path / f"a.{suffix}", faces=None if suffix == "npz" else tmp_path / "f.npz")
    tracemalloc.start()
    try:
        for k in range(100):
            assert sequence.frame(k).vertices[5, 1] == stack[k, 5, 1]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 600_000


@pytest.mark.parametrize("suffix, dtype", [("pc2", "<f4"), ("pc16", "<f2"), ("mdd", ">f4")])
def test_point_caches(suffix, dtype, tmp_path):
    stack = STACK.astype(dtype)
    pc2 = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 4, 0, 1, 5)
    head = pc2 if suffix != "mdd" else struct.pack(">ii5f", 5, 4, *range(5))
    (tmp_path / f"a.{suffix}").write_bytes(head + stack.tobytes())
    (tmp_path / "mesh.obj").write_text(malformed.SQUARE)
    sequence = open_sequence(tmp_path / f"a.{suffix}", faces=tmp_path / "mesh.obj")
    assert np.array_equal(frames(sequence, [3, 0, 1, 2, 4]), stack[[3, 0, 1, 2, 4]].astype(np.float64))
    assert sequence.notes == (f"positions are {np.dtype(dtype).newbyteorder('=')}",)
    assert sequence.frame(4).name == f"a.{suffix}[4]" and sequence.frame(0).meshes[0].faces.tolist() == FACES.tolist()


def test_a_recording_of_the_node():
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    sequence = open_sequence(ROOT / "bags/cloth-drop-small.mcap")
    first = sequence.frame(0)
    assert len(sequence) == 90 and sequence.missing == {}
    assert [(mesh.name, mesh.n_vertices, len(mesh.faces)) for mesh in first.meshes] == [
        ("ball", 92, 180), ("cloth", 484, 882)]  # fmt: skip
    assert sequence.frame(89).meshes is first.meshes
    assert sequence.notes == ("positions are in the coordinate frame world",)


def test_a_recording_has_the_frames_that_the_node_computed():
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    reader = pytest.importorskip("mcap.reader")
    from mcap_ros2.decoder import DecoderFactory

    import hpccd_core as hc

    sequence = open_sequence(ROOT / "bags/cloth-drop-small.mcap")
    scene = hc.Scene()
    cloth, ball = reversed(sequence.frame(0).meshes)
    scene.add_mesh("cloth", cloth.faces, n_vertices=cloth.n_vertices)
    scene.add_mesh("ball", ball.faces, n_vertices=ball.n_vertices, self_collision=False)
    detector = hc.Detector(scene, threads=1)
    ordered = [np.roll(sequence.frame(k).vertices, -ball.n_vertices, axis=0) for k in range(len(sequence))]
    with open(ROOT / "bags/cloth-drop-small.mcap", "rb") as file:
        recorded = reader.make_reader(file, decoder_factories=[DecoderFactory()])
        hashes = [message.hash for *_, message in recorded.iter_decoded_messages(topics=["/contacts"])]
    assert [detector.detect(a, b).hash for a, b in zip(ordered, ordered[1:], strict=False)] == hashes


def test_meshes_with_one_message_are_static(tmp_path):
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    planted.write_recording(tmp_path / "a.mcap", {name: of[:3] for name, of in planted.positions([]).items()})
    note = "body has one message: its mesh is the same in all frames"
    assert open_sequence(tmp_path / "a.mcap").notes == ("positions are in the coordinate frame world", note)
    planted.write_recording(tmp_path / "b.mcap", {name: of[:1] for name, of in planted.positions([]).items()})
    assert open_sequence(tmp_path / "b.mcap").notes == ("positions are in the coordinate frame world",)


def test_a_topology_that_changes_in_a_recording(tmp_path):
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    shape = {name: planted.positions([])[name][:4] for name in ("cloth", "probe")}
    planted.write_recording(tmp_path / "a.mcap", shape, second=(2, "probe"))
    sequence = open_sequence(tmp_path / "a.mcap")
    for order in (range(4), (3, 0, 2, 1)):
        found = {k: sequence.frame(k) for k in order}
        assert [len(found[k].meshes[1].faces) for k in range(4)] == [4, 4, 1, 1]
    assert found[2].meshes is not found[1].meshes and np.array_equal(frames(sequence)[:, 49:], shape["probe"])


def test_missing_frames_of_a_recording_are_those_of_its_steps(tmp_path):
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    shape = {name: planted.positions([])[name][:4] for name in ("cloth", "probe")}
    planted.write_recording(tmp_path / "a.mcap", shape, steps=[3, 4, 7, 8])
    sequence = open_sequence(tmp_path / "a.mcap")
    assert sequence.missing == {2: 2} and "frames 5 to 6 are missing" in sequence.notes[-1]


def test_parameters_of_the_node_that_need_replay(tmp_path):
    pytest.importorskip("mcap_ros2", reason="recordings need the extra check")
    from mcap.reader import make_reader
    from mcap.writer import Writer

    source = ROOT / "bags/cloth-drop-small.mcap"
    with open(source, "rb") as file, open(tmp_path / "a.mcap", "wb") as out:
        text = next(record for record in make_reader(file).iter_metadata() if record.name == "hpccd").metadata["json"]
        writer = Writer(out)
        writer.start()
        changed = text.replace('"mesh.ball.transform": "none"', '"mesh.ball.transform": "tf"')
        writer.add_metadata("hpccd", {"json": changed})
        writer.finish()
    assert changed != text
    with pytest.raises(SequenceError, match="mesh.ball.transform = tf; use hpccd replay"):
        open_sequence(tmp_path / "a.mcap")
