# SPDX-License-Identifier: Apache-2.0
"""`hpccd bench ...`: results, and messages for wrong options."""

import collections
import os
import subprocess

import numpy as np
import pytest
from bag_tools import typestore
from base_bags import SECOND, Maker
from sources import ROOT

import hpccd_core as hc
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.bench import accuracy, choice, sources
from hpccd_ros.bench.report import Report, commit

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")
SCHEMA = {"benchmark": str, "command": str, "machine": dict, "arguments": dict, "other_processes_share": float}
SCHEMA |= {"notes": list, "failures": list, "rows": list}


def test_cpu(product):
    status, result, _ = product("cpu", *STRIP, "--report", "all,first,any")
    assert status == 0 and result["failures"] == []
    assert {key: type(value) for key, value in result.items()} == SCHEMA
    every, first, any_ = result["rows"]
    assert every["contacts"] >= first["contacts"] >= any_["contacts"]
    assert every["stages_ms"]["total"] > 0 and every["candidates"] > every["contacts"]
    assert result["command"] == "hpccd bench cpu folding-strip --size 0.1 --steps 2 --repeat 1 --report all,first,any"
    assert result["machine"]["commit"] and result["machine"]["cores"] >= 1


def test_the_commit_is_read_without_writing_to_the_checkout(tmp_path):
    header = tmp_path / "hpccd_core" / "include" / "hpccd" / "scene.h"
    header.parent.mkdir(parents=True)
    header.touch()
    for words in ("init -q", "add .", "-c user.name=n -c user.email=e commit -qm subject"):
        subprocess.run(["git", "-C", tmp_path, *words.split()], check=True)
    os.utime(header, (0, 0))  # git would note the new time in its index, under a lock
    index = (tmp_path / ".git" / "index").read_bytes()
    assert len(commit(header.parent)) == 10 and (tmp_path / ".git" / "index").read_bytes() == index
    header.write_text("changed")
    assert commit(header.parent).endswith("+changes")


def test_a_recording_and_a_mesh_file(product, tmp_path):
    (tmp_path / "part.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    recording = str(ROOT / "bags" / "cloth-drop-small.mcap")
    few = ("--steps", "4", "--repeat", "1", "--report", "all")
    status, result, _ = product("cpu", recording, str(tmp_path / "part.obj"), *few)
    recorded, mesh = result["rows"]
    assert status == 0 and recorded["scene"] == "cloth-drop-small" and recorded["contacts"] > 0
    assert (mesh["scene"], mesh["triangles"], mesh["steps"]) == ("part", 8, 4)
    assert mesh["contacts"] > 0, "the copy moves through the mesh"


def ropes_that_cross(path):
    """Record two ropes along x and y; the second falls through the first in the third of five steps."""
    store, line = typestore(), np.linspace(-1, 1, 4)
    make = Maker(store)
    types = {f"/meshes/{m}/{k.lower()}": f"hpccd/msg/Mesh{k}" for m in "ab" for k in ("Topology", "Vertices")}
    node = {"format": 1, "hpccd": "0", "node": "/hpccd", "parameters": {"meshes": ["a", "b"], "frame_id": "world"}}
    bag = BagWriter(path, info={**node, "topics": {topic: topic[1:] for topic in types}})
    for topic, kind in types.items():
        bag.add_topic(Topic(topic, kind, []))
    times = iter(range(10**18, 2 * 10**18, 10**6))

    def write(topic, message):
        time = next(times)
        bag.write(topic, bytes(store.serialize_cdr(message, types[topic])), time, time, 1 + time % 10**18)

    topology = store.types["hpccd/msg/MeshTopology"]
    edges = np.array([0, 1, 1, 2, 2, 3], np.uint32)
    for mesh in "ab":
        given = {"version": 0, "n_vertices": 4, "faces": np.zeros(0, np.uint32), "edges": edges}
        write(f"/meshes/{mesh}/topology", topology(header=make.header(0, ""), **given))
    for k in range(6):
        ends = {"a": (line, 0 * line, 0 * line), "b": (0 * line + 0.05, line + 0.03, 0 * line + 0.25 - 0.1 * k)}
        for mesh, xyz in ends.items():
            write(f"/meshes/{mesh}/vertices", make.vertices((k + 1) * SECOND, k, np.stack(xyz, axis=1)))
    bag.close()


def test_ropes_of_a_recording_keep_their_edges(tmp_path):
    path = tmp_path / "ropes.mcap"
    ropes_that_cross(path)
    source = sources.of_recording(path)
    steps = [source.step(k) for k in range(source.n_steps)]
    found = [hc.Detector(s.scene(), backend="cpu").detect(s.vertices_t0, s.vertices_t1) for s in steps]
    assert [len(contacts) for contacts in found] == [0, 0, 1, 0, 0]


def test_tiers(product):
    status, result, _ = product("accuracy", *STRIP, "--simd", "auto,scalar")
    assert status == 0 and len(result["rows"]) == 4 * 2
    for row in result["rows"]:
        assert sum(row["decided"].values()) == pytest.approx(row["candidates"]), "each pair is decided once"


@pytest.mark.parametrize(
    ("tier", "change", "failures"),
    [
        ("exact", {}, 0),
        ("exact", {"invented": 1}, 1),
        ("exact", {"toc_worst": 1e-11}, 1),
        ("conservative", {"invented": 3}, 0),
        ("conservative", {"latest": 1e-15}, 1),
        ("balanced", {"missed": 5}, 0),
    ],
)
def test_a_broken_promise_fails(tier, change, failures):
    report = Report("accuracy", "hpccd bench accuracy", {})
    row = {"scene": "s", "accuracy": tier, "missed": 0, "invented": 0, "toc_worst": 0.0, "latest": 0.0}
    row["detail"] = choice.FULL
    report.add(**row | change)
    accuracy.check(report)
    assert len(report.failures) == failures


def test_other_contacts_fail(product, monkeypatch):
    detect, seen = hc.Detector.detect, collections.Counter()

    def nothing_in_the_second_round(self, start, end):
        seen[end.tobytes()] += 1
        return detect(self, start, end if seen[end.tobytes()] < 3 else start)

    monkeypatch.setattr(hc.Detector, "detect", nothing_in_the_second_round)
    few = ("--steps", "1", "--repeat", "2", "--report", "all")
    status, result, _ = product("cpu", *STRIP[:3], *few)
    assert status == 1 and "contacts differ between calls" in result["failures"][0]


def test_files_of_one_name_are_told_apart(tmp_path):
    """Results are kept by name: of two the second would count for nothing."""
    paths = [tmp_path / name for name in ("a/run.npz", "b/run.npz", "b/run.obj")]
    for path in paths[:2]:
        path.parent.mkdir()
        np.savez(path, **STEP)
    paths[2].write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    names = [source.name for source in sources.resolve([*map(str, paths), "folding-strip"], None, ())]
    assert names == [*map(str, paths), "folding-strip"]
    assert [source.name for source in sources.resolve([str(paths[0])], None, ())] == ["run"]


OTHER = next(simd for simd in ("neon", "avx2") if simd not in hc._core.simd_levels())


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("cpu", "no-such-scene"), "no-such-scene: neither a file"),
        (("cpu", "cloth-dorp"), "did you mean cloth-drop?"),
        (("cpu", *STRIP[:-1], "0"), "--repeat 0: time from 1 to 100,000"),
        (("cpu", *STRIP[:-1], "1000000"), "--repeat 1000000: time from 1 to 100,000"),
        (("cpu", *STRIP, "--report", "all,last"), "'last' is not known; choose from all, first, any"),
        (("cpu", *STRIP, "--steps", "-1"), "--steps -1: must not be negative"),
        (("accuracy", *STRIP, "--tiers", "best"), "'best' is not known"),
        (("accuracy", *STRIP, "--threads", "100000"), "at most 1024"),
        (("accuracy", *STRIP, "--simd", OTHER), f"--simd {OTHER}: none of these works here"),
        (("accuracy", "y" * 300), "name a file or a scene"),
        (("cpu", "empty.obj"), "empty.obj"),
        # A file that cannot be written is rejected before anything is measured.
        (("cpu", *STRIP, "--label", "a/b"), "--label a/b"),
        (("cpu", *STRIP, "--out", "empty.obj/folder"), "--out empty.obj/folder"),
        (("accuracy", *STRIP, "--picture", "/proc/no/x.png"), "--picture: /proc/no/x.png cannot be written"),
        (("accuracy", *STRIP, "--picture", "no/trade.png"), "--picture: no/trade.png cannot be written"),
        (("accuracy", *STRIP, "--picture", "x.bogus"), "name a .png"),
        (("accuracy", *STRIP, "--picture", ""), "name a .png"),
        (("accuracy", *STRIP, "--label", ""), "--label"),
        (("accuracy", *STRIP, "--label", "a\nb"), "--label"),
        (("accuracy", *STRIP, "--label", "x" * 300), "cannot be written"),
    ],
)
def test_wrong_options_are_explained(product, capsys, tmp_path, monkeypatch, arguments, text):
    monkeypatch.setattr(accuracy.measure, "measure", lambda *_: pytest.fail("measured"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.obj").write_text("")
    status, result, _ = product(*arguments)
    assert status == 2 and result is None
    assert text in capsys.readouterr().err


def test_a_link_that_leads_nowhere_stays(product, tmp_path):
    for name in ("cpu-test.json", "trade.png"):
        (tmp_path / name).symlink_to(tmp_path / "nowhere")
    assert product("cpu", "no-such-scene")[0] == 2
    assert product("accuracy", "no-such-scene", "--picture", str(tmp_path / "trade.png"))[0] == 2
    assert (tmp_path / "cpu-test.json").is_symlink() and (tmp_path / "trade.png").is_symlink()
    assert not (tmp_path / "nowhere").exists()


@pytest.mark.skipif("gpu" in hc.backends(), reason="a GPU works here")
def test_a_machine_without_a_gpu_is_explained(product, capsys):
    assert product("gpu", *STRIP)[0] == 2
    assert "no usable GPU" in capsys.readouterr().err
    assert product("accuracy", *STRIP, "--backend", "gpu")[0] == 2
    assert "--backend gpu: none of these works here" in capsys.readouterr().err


STEP = {"vertices_t0": np.eye(3), "vertices_t1": np.eye(3) + 1, "faces": np.array([[0, 1, 2]])}
NO_CONTACTS = {"vf": np.zeros((0, 2)), "ee": np.zeros((0, 4)), "vf_toc": np.zeros(0), "ee_toc": np.zeros(0)}


@pytest.mark.parametrize(
    ("arrays", "says"),
    [
        ({"faces": np.array([[0, 1, 7]])}, "not a step"),
        ({"faces": np.array([[0.0, 1.0, 2.0]])}, "not a step"),
        ({"faces": np.zeros((0, 3), np.uint32)}, "no faces"),
        ({"vertices_t1": np.eye(4)}, "not a step"),
        ({"vertices_t0": np.full((3, 3), np.nan)}, "not a step"),
        ({"vertices_t0": np.array("abc")}, "not a step"),
        ({**NO_CONTACTS, "vf": np.zeros((2, 3))}, "vf has shape (2, 3)"),
        ({**NO_CONTACTS, "ee_toc": np.zeros(3)}, "ee_toc has shape (3,)"),
        ({**NO_CONTACTS, "vf": np.array(1)}, "vf has shape ()"),
    ],
)
def test_files_that_hold_no_step(product, tmp_path, capfd, arrays, says):
    np.savez(tmp_path / "bad.npz", **{**STEP, **arrays})
    status, _, _ = product("accuracy", str(tmp_path / "bad.npz"), "--repeat", "1")
    assert status == 2 and says in capfd.readouterr().err


@pytest.mark.parametrize("kind", ["cut off", "an array alone", "text", "a byte changed"])
def test_files_that_cannot_be_read(product, tmp_path, capfd, kind):
    folder, path = tmp_path / "data", tmp_path / "data" / "bad.npz"
    folder.mkdir()
    if kind == "an array alone":
        with path.open("wb") as file:
            np.save(file, np.eye(3))
    elif kind == "a byte changed":
        np.savez_compressed(path, **STEP)
        content = bytearray(path.read_bytes())
        # Where the first array begins: behind 30 bytes, its name and what else is said of it. 7: no block of zlib.
        content[30 + int.from_bytes(content[26:28], "little") + int.from_bytes(content[28:30], "little")] = 7
        path.write_bytes(content)
    else:
        np.savez(path, **STEP)
        path.write_bytes(path.read_bytes()[:200] if kind == "cut off" else b"no step")
    for words in ([str(path)], ["data", "--data", str(folder)]):
        assert product("cpu", *words, "--repeat", "1")[0] == 2
        assert "bad.npz: not an .npz file of numbers" in capfd.readouterr().err
    assert product("cpu", "nosuchscene", "--data", str(folder))[0] == 2
    assert "nosuchscene: neither a file" in capfd.readouterr().err
