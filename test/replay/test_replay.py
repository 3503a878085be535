# SPDX-License-Identifier: Apache-2.0
"""A replay finds the recorded contacts again, and says where they differ if they do."""

import csv
import dataclasses
import json
import re

import numpy as np
import pytest
from bag_tools import rewrite

from hpccd_ros.bag.decode import make_decoder
from hpccd_ros.bag.reader import Recording, RecordingError
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.frames.drops import Input
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

RESULT = 60  # one of the 89 results, with contacts of both kinds


def _replay(path, **options):
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording), **options)
        return replay, list(replay.steps())


def _dropped(replay):
    return replay.source.rejected[Input.VERTICES].by_mesh_and_reason()


def _changed_result(source, target, change, result=RESULT):
    """Copy with one result changed in place by `change(decoded)`."""

    def edit(index, message, decoded):
        if message.topic == "/contacts" and index == result:
            change(decoded)
        return decoded

    rewrite(source, target, edit)
    return target


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_the_recording_of_the_repository_is_verified(small_bag, threads):
    replay, steps = _replay(small_bag, threads=threads, backend="cpu")
    assert (replay.verified, replay.diverged, replay.unverified) == (89, 0, 0)
    assert replay.frames == 90 and len(steps) == replay.recorded_results == 89
    assert sum(step.total for step in steps) == sum(step.recorded.total for step in steps) == 10_213
    assert [step.step for step in steps] == list(range(1, 90))


def test_an_unchanged_copy_is_verified(small_bag, tmp_path):
    rewrite(small_bag, tmp_path / "copy.mcap")
    replay, _ = _replay(tmp_path / "copy.mcap")
    assert (replay.verified, replay.diverged) == (89, 0)


def test_results_hold_the_versions_of_their_topologies(small_bag):
    _, steps = _replay(small_bag)
    assert all(list(step.recorded.topology_versions) == [0, 0] for step in steps)


@pytest.mark.parametrize("with_hash", [True, False], ids=["hash", "text only"])
def test_another_definition_is_rejected(small_bag, with_hash):
    """A field less, or of another type: the bytes would be misread. A comment more changes nothing."""
    with Recording(small_bag) as recording:
        topic = recording.topics["/contacts"]
        same = topic if with_hash else dataclasses.replace(topic, type_hash="")
        message = next(recording.messages(["/contacts"]))
        same = dataclasses.replace(same, definition="# of a later day\n" + topic.definition)
        decoded = make_decoder(same)(message)
        assert list(decoded.mesh_names) == ["cloth", "ball"] and decoded.backend == "cpu"
        for then, now in (("uint64 total", "uint32 total"), ("uint32 report\n", "")):
            other = topic.definition.replace(then, now)
            assert other != topic.definition
            type_hash = "RIHS01_of_then" if with_hash else ""
            with pytest.raises(RecordingError, match="another definition of hpccd/msg/ContactArray"):
                make_decoder(dataclasses.replace(same, definition=other, type_hash=type_hash))


def _first_edge_edge(decoded):
    return int(np.argmax(decoded.kind == 1))


def _later(decoded, index):
    toc = decoded.toc.copy()
    toc[index] = np.nextafter(toc[index], 2)
    _set("toc", toc)(decoded)


def _other_vertex(decoded):
    features = decoded.features_a.copy()
    features[0] += 1
    _set("features_a", features)(decoded)


def _remove_last(decoded):
    sizes = {"kind": 1, "mesh_a": 1, "mesh_b": 1, "features_a": 2, "features_b": 2, "toc": 1}
    for name, per_contact in sizes.items():
        _set(name, getattr(decoded, name)[:-per_contact])(decoded)


def _set(name, value):
    return lambda decoded: object.__setattr__(decoded, name, value)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda d: _later(d, 0), r"vertex (cloth|ball):\d+ - face (cloth|ball):\d+: recorded at t = .*, now at t = "),
        (lambda d: _later(d, _first_edge_edge(d)), r"edge \(.*\) - edge \(.*\): recorded at t = .*, now at t = "),
        (_other_vertex, r"vertex .* - face .*: (recorded at t = .*, now not found|found now at t = .*, not recorded)"),
        (_remove_last, r"edge .* found now at t = .*, not recorded"),
        (_set("hash", 12345), r"hash 0x0000000000003039 was recorded, now it is .*although all contacts are equal"),
        (_set("total", 7), r"7 contacts were recorded, now there are"),
        (_set("first_toc", 0.5), r"first time of contact: recorded 0\.5, now"),
        (_set("toc", np.zeros(3)), r"malformed: toc has 3 entries"),
        (_set("mesh_names", ["cloth", "sphere"]), r"malformed: its meshes are"),
        (_set("topology_versions", np.array([0, 3], np.uint32)), r"\[0, 3\] were recorded, now they are \[0, 0\]"),
        (_set("mesh_a", np.full(1, 9, np.uint32)), r"malformed: mesh_a has 1 entries"),
    ],
)
def test_a_changed_result_diverges_and_is_named(small_bag, tmp_path, change, says):
    path = _changed_result(small_bag, tmp_path / "changed.mcap", change)
    replay, steps = _replay(path)
    assert (replay.verified, replay.diverged) == (88, 1)
    assert replay.first_divergence is steps[RESULT]
    assert replay.first_divergence.step == RESULT + 1
    assert np.all(np.array([bool(s.difference) for s in steps]) == (np.arange(89) == RESULT))
    assert re.search(says, steps[RESULT].difference), steps[RESULT].difference


def test_a_changed_vertex_diverges(small_bag, tmp_path):
    def edit(index, message, decoded):
        if message.topic == "/meshes/cloth/vertices" and index == 50:
            vertices = decoded.vertices_f32.copy()
            vertices[2::3] += np.float32(0.01)
            _set("vertices_f32", vertices)(decoded)
        return decoded

    rewrite(small_bag, tmp_path / "changed.mcap", edit)
    replay, _ = _replay(tmp_path / "changed.mcap")
    assert replay.diverged == 2  # the step into the changed frame, and the one out of it
    assert replay.first_divergence.step == 50


def test_results_without_their_frames_are_not_called_verified(small_bag, tmp_path):
    def edit(index, message, decoded):
        lost = message.topic == "/meshes/ball/vertices" and index == 40
        return None if lost else decoded

    rewrite(small_bag, tmp_path / "gap.mcap", edit)
    replay, steps = _replay(tmp_path / "gap.mcap")
    assert (replay.verified, replay.diverged, replay.unverified) == (87, 0, 2)
    assert re.search("lists a message of meshes/ball/vertices sent at .*, which the recording lacks", steps[39].missing)
    assert "the inputs taken make no frame at its start" in steps[40].missing


def test_stamps_that_are_no_time(small_bag, tmp_path):
    def edit(index, message, decoded):
        if index == 40 and message.topic in ("/meshes/ball/vertices", "/contacts"):
            decoded.header.stamp.nanosec += 10**9
        return decoded

    rewrite(small_bag, tmp_path / "stamps.mcap", edit)
    replay, steps = _replay(tmp_path / "stamps.mcap")
    assert (replay.verified, replay.diverged, replay.unverified) == (87, 0, 2)
    assert _dropped(replay) == {("ball", "malformed"): 1, ("cloth", "incomplete"): 1}
    assert re.search("the result is malformed: .*nanosec", steps[40].missing)


def test_frames_that_the_node_dropped(small_bag, tmp_path):
    """Under overload the node steps from the last frame that it took to the latest: some frames have no result."""

    def edit(index, message, decoded):
        return None if message.topic == "/contacts" and index % 3 else decoded

    rewrite(small_bag, tmp_path / "dropped.mcap", edit)
    replay, _ = _replay(tmp_path / "dropped.mcap")
    assert (replay.verified, replay.diverged, replay.unverified) == (30, 0, 0)


def test_a_recording_that_began_in_the_middle(small_bag, tmp_path):
    def edit(index, message, decoded):
        return None if message.topic.endswith("vertices") and index < 20 else decoded

    rewrite(small_bag, tmp_path / "middle.mcap", edit)
    replay, steps = _replay(tmp_path / "middle.mcap")
    assert (replay.verified, replay.diverged, replay.unverified) == (69, 0, 0)
    assert sum(step.before_recording for step in steps) == 20


def test_results_before_their_frames(small_bag, tmp_path):
    """The recorder may take the result of a fast node before the vertices that it belongs to."""
    with Recording(small_bag) as recording:
        writer = BagWriter(tmp_path / "early.mcap", info=recording.info)
        for topic in recording.topics.values():
            writer.add_topic(Topic(topic.name, topic.type_name, []))
        for message in recording.messages():
            early = 500_000_000 if message.topic == "/contacts" else 0
            writer.write(message.topic, message.data, message.log_time - early, message.publish_time, message.sequence)
        writer.close()
    replay, _ = _replay(tmp_path / "early.mcap")
    assert (replay.verified, replay.diverged, replay.unverified) == (89, 0, 0)


def test_without_contacts_every_step_is_computed(small_bag, tmp_path):
    rewrite(
        small_bag,
        tmp_path / "meshes.mcap",
        lambda index, message, decoded: None if message.topic == "/contacts" else decoded,
    )
    replay, steps = _replay(tmp_path / "meshes.mcap", accuracy="exact")
    _, recorded = _replay(small_bag)
    assert [s.contacts.hash for s in steps] == [s.recorded.hash for s in recorded]
    assert replay.verified == 0


def test_a_frame_that_the_core_cannot_take_is_stepped_over(small_bag, tmp_path):
    """As the node does: the motion goes on from the frame before it."""

    def edit(index, message, decoded):
        if message.topic == "/contacts":
            return None
        if message.topic == "/meshes/cloth/vertices" and index == 40:
            _set("vertices_f64", np.full(len(decoded.vertices_f32), 1e200))(decoded)
            _set("vertices_f32", decoded.vertices_f32[:0])(decoded)
        return decoded

    rewrite(small_bag, tmp_path / "far.mcap", edit)
    replay, steps = _replay(tmp_path / "far.mcap", accuracy="exact")
    assert [step.step for step in steps] == [k for k in range(1, 90) if k != 40]
    assert steps[39].start == steps[38].end and steps[39].total > 0
    assert _dropped(replay) == {("cloth", "out_of_range"): 1, ("ball", "incomplete"): 1}


def test_recording_of_another_recorder_needs_parameters(small_bag, tmp_path, hpccd):
    path = tmp_path / "foreign.mcap"
    rewrite(small_bag, path, info={})
    with Recording(path) as recording, pytest.raises(RecordingError, match="--params"):
        recorded_setup.of_recording(recording)
    (tmp_path / "node.yaml").write_text(
        "/**:\n  ros__parameters:\n    meshes: [cloth, ball]\n    mesh: {ball: {self_collision: false}}\n"
    )
    assert hpccd("replay", path, "--params", "node.yaml").returncode == 0
    (tmp_path / "other.yaml").write_text("/**:\n  ros__parameters:\n    meshes: [shirt]\n")
    wrong = hpccd("replay", path, "--params", "other.yaml")
    assert wrong.returncode == 2 and "has no vertices of the meshes shirt" in wrong.stderr
    (tmp_path / "bad.yaml").write_text("- a list")
    bad = hpccd("replay", path, "--params", "bad.yaml")
    assert bad.returncode == 2 and "not a ROS parameter file" in bad.stderr


def test_wrong_scene_parameters_diverge(small_bag, tmp_path):
    rewrite(
        small_bag,
        tmp_path / "x.mcap",
        info={"parameters": {"meshes": ["cloth", "ball"], "ignored_pairs": ["cloth:ball"]}},
    )
    replay, _ = _replay(tmp_path / "x.mcap")
    assert replay.diverged > 50 and "now not found" in replay.first_divergence.difference


def test_replay_command(hpccd, small_bag, tmp_path):
    done = hpccd("replay", small_bag, "--csv", "steps.csv")
    assert done.returncode == 0, done.stderr
    assert "VERIFIED: 89 results are equal in every contact, time and hash (accuracy exact)" in done.stdout
    rows = list(csv.DictReader((tmp_path / "steps.csv").open()))
    assert len(rows) == 89 and {row["result"] for row in rows} == {"equal"}
    assert all(row["hash"] == row["recorded_hash"] for row in rows)
    again = hpccd("replay", small_bag, "--csv", "steps.csv")
    assert again.returncode == 2 and "not overwritten" in again.stderr

    path = _changed_result(small_bag, tmp_path / "changed.mcap", lambda d: _later(d, 0))
    changed = hpccd("replay", path)
    assert changed.returncode == 1
    assert "DIVERGED: 1 of 89 results differ, first in step 61" in changed.stdout
    assert "vertex " in changed.stdout and "now at t = " in changed.stdout


def test_a_part_of_a_recording(hpccd, small_bag, tmp_path):
    with Recording(small_bag) as recording:
        first = next(recording.messages()).log_time
        results = [(m.log_time - first) * 1e-9 for m in recording.messages(["/contacts"])]
    replay, steps = _replay(small_bag, begin=1.0, end=2.0)
    assert [s.at for s in steps] == [at for at in results if 1.0 <= at <= 2.0] and len(steps) > 10
    assert (replay.verified, replay.diverged) == (len(steps), 0)
    done = hpccd("replay", small_bag, "--from", "1", "--to", "2", "--rate", "4", "--json", "part.json")
    assert done.returncode == 0 and f"VERIFIED: {len(steps)} results" in done.stdout
    (row,) = json.loads((tmp_path / "part.json").read_text())
    assert (row["result"], row["verified"]) == ("VERIFIED", len(steps))
    done = hpccd("replay", small_bag, "--from", "1000")
    assert "NOTHING VERIFIED: no step of the recording ends between --from and --to" in done.stdout


def test_one_step_at_each_enter(hpccd, small_bag):
    done = hpccd("replay", small_bag, "--from", "1", "--step", input="\n\n")
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stdout.splitlines() if ", hash 0x" in line]
    assert len(lines) == 3 and all(line.endswith(", equal") for line in lines)
    assert "VERIFIED: 3 results" in done.stdout
    done = hpccd("replay", small_bag, "--from", "1", "--step", "--threads", "1", input="")
    assert "; 1 thread\n" in done.stdout and "VERIFIED: 1 result is equal in every contact" in done.stdout


def test_replay_of_unusable_files(hpccd, small_bag, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(small_bag.read_bytes()[:200_000])
    for path, says in ((cut, "cut off"), (tmp_path / "none.mcap", "does not exist"), (__file__, "is not an MCAP file")):
        done = hpccd("replay", path)
        assert done.returncode == 2, done.stdout
        assert says in done.stderr and done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
