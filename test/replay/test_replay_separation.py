# SPDX-License-Identifier: Apache-2.0
"""A replay computes with the separation that each result tells, and checks the smallest distances that were told."""

import csv
import dataclasses
import json

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from hpccd.msg import ContactArray, DistanceArray
from rclpy.serialization import serialize_message

import hpccd_core as hc
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.middleware import contact_messages, fields, result_fields, snapshot_messages
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.frames import FrameSource
from hpccd_ros.replay.recomputed import Replay

FRAMES = range(55, 63)
# In force at the step into each frame; the recording's own parameters tell none of them.
WIDE = Separation(0.0, (("cloth", "ball", 0.02),))
TOLD = [Separation(0.005), Separation(0.005), WIDE, WIDE, NONE, Separation(0.001, (("ball", "cloth", 0.0),)), NONE]


@pytest.fixture(scope="module")
def near_bag(tmp_path_factory):
    """Some frames of the recording of the repository, with results as a node of today gives them: file, and messages
    [(topic, message)] of the results."""
    from sources import ROOT

    path = tmp_path_factory.mktemp("near") / "near.mcap"
    with Recording(ROOT / "bags" / "cloth-drop-small.mcap") as recording:
        setup = recorded_setup.of_recording(recording)
        source, frames, inputs = FrameSource(setup, recording.topics), [], []
        for message in recording.messages():
            if message.topic == "/contacts":
                continue
            completed = source.push(message)
            frames += completed
            if len(frames) - len(completed) in FRAMES or "topology" in message.topic:
                inputs.append(message)
        frames = [frames[k] for k in FRAMES]
        results = list(_results(setup, frames))
        _write(path, recording.info, inputs, results)
    return path, inputs, results


def _results(setup, frames):
    layout = setup.builder.layout(frames[0].topologies)
    options = setup.options("exact", "cpu", 1)
    for first, last, separation in zip(frames, frames[1:], TOLD, strict=False):
        detector = StepDetector(setup.builder, dataclasses.replace(options, separation=separation, distances=True))
        found = detector.detect(first, last)
        message = ContactArray(step=last.step, accuracy="exact", backend="cpu")
        message.header.stamp, message.start = fields.ns_to_stamp(last.stamp), fields.ns_to_stamp(first.stamp)
        contact_messages.fill_contacts(message, found.contacts, layout)
        result_fields.fill_separation(message, separation)
        distances = DistanceArray(step=last.step, accuracy="exact", backend="cpu", header=message.header)
        snapshot_messages.fill_distances(distances, found.gaps, layout)
        yield message, distances


def _write(path, info, inputs, results, distances_first=False):
    """The results stand behind all frames: how late they come does not matter."""
    info = {**info, "topics": info["topics"] | {"/distances": "distances"}}
    bag = BagWriter(path, info=info)
    kinds = {m.topic: f"hpccd/msg/Mesh{m.topic.rpartition('/')[2].capitalize()}" for m in inputs}
    kinds |= {"/contacts": "hpccd/msg/ContactArray", "/distances": "hpccd/msg/DistanceArray"}
    for topic, kind in kinds.items():
        bag.add_topic(Topic(topic, kind, []))
    for message in inputs:
        bag.write(message.topic, message.data, message.log_time, message.publish_time, message.sequence)
    end = max(message.log_time for message in inputs)
    for contacts, distances in results:
        pair = [("/contacts", contacts), ("/distances", distances)]
        for topic, message in reversed(pair) if distances_first else pair:
            end += 1
            bag.write(topic, serialize_message(message), end, end, 1)
    bag.close()


def _replay(path):
    with Recording(path) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording), backend="cpu")
        return replay, list(replay.steps())


def _counts(part):
    return part.verified, part.diverged, part.unverified


def _copy(message, **changes):
    copy = type(message)(**{name: getattr(message, name) for name in message.get_fields_and_field_types()})
    for name, value in changes.items():
        setattr(copy, name, value)
    return copy


@pytest.fixture
def changed(near_bag, tmp_path):
    """Replays a copy with changed fields of one result. which: 0: of the contacts, 1: of the distances."""

    def make(which, number=1, **changes):
        path, inputs, results = near_bag
        results = [list(pair) for pair in results]
        results[number][which] = _copy(results[number][which], **changes)
        with Recording(path) as recording:
            info = recording.info
        target = tmp_path / f"changed-{len(list(tmp_path.iterdir()))}.mcap"
        _write(target, info, inputs, results)
        return target

    return make


@pytest.mark.parametrize("distances_first", [False, True])
def test_each_result_with_its_own_separation(near_bag, tmp_path, distances_first):
    path, inputs, results = near_bag
    with Recording(path) as recording:
        _write(tmp_path / "x.mcap", recording.info, inputs, results, distances_first)
    replay, steps = _replay(tmp_path / "x.mcap")
    assert _counts(replay) == _counts(replay.distances) == (7, 0, 0)
    assert [step.separation for step in steps] == TOLD
    assert any(len(message.separations) and message.total for message, _ in results)


def test_the_command_tells_the_separations(near_bag, tmp_path, hpccd):
    done = hpccd("replay", near_bag[0], "--csv", "steps.csv", "--json", "all.json")
    assert done.returncode == 0, done.stdout + done.stderr
    told = "separation 0, cloth:ball:0.02; separation 0.001, ball:cloth:0; separation 0.005"
    assert f"VERIFIED: 7 results are equal in every contact, time and hash (accuracy exact; {told})" in done.stdout
    assert "  7 results about distances are equal, points included" in done.stdout
    rows = list(csv.DictReader((tmp_path / "steps.csv").open()))
    assert [row["separation"] for row in rows] == [separation.text for separation in TOLD]
    (row,) = json.loads((tmp_path / "all.json").read_text())
    assert (row["result"], row["distances_verified"]) == ("VERIFIED", 7)
    assert row["separation"] == ["0, cloth:ball:0.02", "0.001, ball:cloth:0", "0.005"]


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"minimum_separation": 0.0}, "recorded at t ="),
        ({"minimum_separation": 0.05}, "found now at t ="),
        ({"minimum_separation": -1.0}, "malformed: separation: a separation must be finite and not negative"),
        ({"separations": [0.5]}, "malformed: separation_mesh_a, separation_mesh_b and separations have 0, 0 and 1"),
        ({"thickness": [0.5]}, "malformed: thickness: 1 entry for 2 meshes"),
        ({"thickness": [0.0, -0.5]}, "malformed: thickness: must lie in [0, 1e+300]"),
        ({"thickness": [float("nan"), 0.0]}, "malformed: thickness: must lie in [0, 1e+300]"),
        ({"thickness": [1e301, 0.0]}, "malformed: thickness: must lie in [0, 1e+300]"),
        ({"thickness": [1e300, 0.0]}, "found now at t ="),
        ({"distance": [0.5]}, "malformed: distance has 1 entries; contacts of a step have none"),
        ({"closest": [0.5]}, "malformed: closest has 1 entries"),
        ({"vertices": [5] * 6}, "malformed: vertices has 6 entries"),
        ({"weights": [0.5]}, "malformed: weights has 1 entries"),
        ({"approach": [-0.5]}, "malformed: approach has 1 entries"),
    ],
)
def test_a_result_with_another_separation_diverges(changed, changes, says):
    replay, steps = _replay(changed(0, **changes))
    assert _counts(replay) == (6, 1, 0)
    assert replay.first_divergence is steps[1] and says in steps[1].difference, steps[1].difference


def test_distances_that_differ_are_named(changed, near_bag, hpccd):
    assert _counts(_replay(changed(1, step=1))[0].distances) == (7, 0, 0), "a number that the publisher gave"
    told = np.array(near_bag[2][1][1].distance)
    path = changed(1, distance=np.nextafter(told, 2.0).tolist())
    replay, _ = _replay(path)
    assert _counts(replay) == (7, 0, 0) and _counts(replay.distances) == (6, 1, 0)
    assert "cloth - cloth: distance [" in replay.distances.first and "was recorded, now it is [" in (
        replay.distances.first
    )
    done = hpccd("replay", path)
    assert done.returncode == 1 and "DIVERGED: 1 of 7 results about distances differ, the first:" in done.stdout
    assert "  7 results are equal in every contact" in done.stdout and "VERIFIED" not in done.stdout


def test_a_thick_plane_diverges(near_bag, tmp_path):
    path, inputs, _ = near_bag
    with Recording(path) as recording:
        info = recording.info
    info["parameters"] |= {"planes": ["floor"], "plane.floor.offset": -10.0}
    _write(tmp_path / "plane.mcap", info, inputs, [])
    with Recording(tmp_path / "plane.mcap") as recording:
        setup = recorded_setup.of_recording(recording)
        source = FrameSource(setup, recording.topics)
        frames = [frame for message in recording.messages(source.topics) for frame in source.push(message)]
    results = list(_results(setup, frames))
    assert list(results[0][0].mesh_names) == ["cloth", "ball", "floor"]
    results[1] = [_copy(message, thickness=[0.0, 0.0, 0.5]) for message in results[1]]
    _write(tmp_path / "thick.mcap", info, inputs, results)
    replay, steps = _replay(tmp_path / "thick.mcap")
    assert _counts(replay) == _counts(replay.distances) == (6, 1, 0)
    assert steps[1].difference.endswith("malformed: thickness: 'floor' is a plane, which has none")
    assert replay.distances.first.endswith("malformed: thickness: 'floor' is a plane, which has none")


def test_distances_of_a_scene_without_pairs_are_verified(near_bag, tmp_path, hpccd):
    """There are no distances to measure, and each result says so."""
    path, inputs, _ = near_bag
    with Recording(path) as recording:
        info = recording.info
    info["parameters"] |= {"mesh.cloth.self_collision": False, "ignored_pairs": ["ball:cloth"]}
    _write(tmp_path / "silent.mcap", info, inputs, [])
    with Recording(tmp_path / "silent.mcap") as recording:
        setup = recorded_setup.of_recording(recording)
        source = FrameSource(setup, recording.topics)
        frames = [frame for message in recording.messages(source.topics) for frame in source.push(message)]
    results = list(_results(setup, frames))
    assert len(results) == 7 and not any(len(distances.distance) for _, distances in results)
    _write(tmp_path / "x.mcap", info, inputs, results)
    done = hpccd("replay", "x.mcap")
    assert done.returncode == 0 and "  7 results about distances are equal" in done.stdout, done.stdout + done.stderr


def test_results_from_before_there_were_directions_are_verified(changed):
    assert _counts(_replay(changed(1, direction=[], approach_speed=[]))[0].distances) == (7, 0, 0)
    before = changed(1, time_to_contact=[], inside=[], nearest=2**32 - 1)
    assert _counts(_replay(before)[0].distances) == (7, 0, 0)


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"mesh_names": ["cloth", "sphere"]}, "mesh_names ['cloth', 'sphere'] were recorded"),
        ({"topology_versions": [0, 7]}, "topology_versions [0, 7] were recorded, now they are [0, 0]"),
        ({"kind": [0]}, "kind has 1 entries, 2 belong to 2 pairs of meshes"),
        ({"distance": [0.5]}, "1 pairs of meshes were recorded, now there are 2; are the parameters those of the node"),
        ({"accuracy": "best"}, "accuracy 'best' is none of fast"),
        ({"points": [0.0] * 12}, "points ["),
        ({"direction": [0.5] * 6}, "direction ["),
        ({"inside": [0, 2]}, "inside [2] was recorded, now it is [0]"),
        ({"nearest": 0}, "nearest 0 was recorded, now it is 1"),
        ({"direction": [0.5]}, "direction has 1 entries, 6 belong to 2 pairs of meshes"),
    ],
)
def test_malformed_distances_diverge(changed, changes, says):
    found = _replay(changed(1, **changes))[0].distances
    assert _counts(found) == (6, 1, 0) and says in found.first, found.first


def test_distances_without_their_frame_are_not_called_verified(changed, near_bag, hpccd):
    header = _copy(near_bag[2][1][1].header, stamp=Time(sec=2**31 - 1))
    path = changed(1, header=header)
    assert _counts(_replay(path)[0].distances) == (6, 0, 1)
    done = hpccd("replay", path)
    assert done.returncode == 1 and "  1 result about distances NOT VERIFIED, the first: distances at" in done.stdout
    before = _copy(header, stamp=Time(sec=1))
    assert _counts(_replay(changed(1, header=before))[0].distances) == (6, 0, 0), "it began before the recording did"
    negative = _copy(header, stamp=Time(sec=-1))
    assert "malformed: stamp has sec -1" in _replay(changed(1, header=negative))[0].distances.first


def test_the_bag_is_what_it_says(near_bag):
    """Made by this package: the core alone finds the same."""
    path, _, results = near_bag
    _, steps = _replay(path)
    for step, (message, _), separation in zip(steps, results, TOLD, strict=True):
        scene = hc.Scene()
        for name, topology in zip(("cloth", "ball"), step.end_frame.topologies, strict=True):
            self_collision = name != "ball"
            scene.add_mesh(name, topology.faces, n_vertices=topology.n_vertices, self_collision=self_collision)
        for a, b, distance in separation.pairs:
            scene.set_separation(a, b, distance)
        ends = [np.concatenate(frame.vertices) for frame in (step.start_frame, step.end_frame)]
        assert hc.Detector(scene, minimum_separation=separation.minimum).detect(*ends).hash == message.hash
