# SPDX-License-Identifier: Apache-2.0
"""Scenes written to files, read back by others' readers."""

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

from hpccd_ros import scenes
from hpccd_ros.bag.reader import Recording
from hpccd_ros.scenes import files


@pytest.fixture(scope="module")
def breaking():
    return scenes.make("breaking-like", size=1 / 64, frames=14)


def test_mcap_holds_every_frame_for_independent_readers(breaking, tmp_path):
    path = tmp_path / "breaking.mcap"
    files.write_mcap(breaking, path, rate=50.0)
    faces, vertices = {}, {}
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert stamp == time
            _, _, mesh, kind = connection.topic.split("/")
            if kind == "topology":
                faces.setdefault(mesh, {})[message.version] = (stamp, message.faces.reshape(-1, 3))
            else:
                row = (stamp, message.topology_version, message.step, message.vertices_f32.reshape(-1, 3))
                vertices.setdefault(mesh, []).append(row)
    assert set(vertices) == set(breaking.mesh_names)
    for m, mesh in enumerate(breaking.mesh_names):
        assert len(vertices[mesh]) == len(breaking)
        for frame, (stamp, version, step, xyz) in zip(breaking.frames(), vertices[mesh], strict=True):
            assert stamp == 10**9 + frame.index * 20_000_000
            assert step == frame.index
            np.testing.assert_array_equal(xyz, frame[m])
            assert faces[mesh][version][0] <= stamp
            np.testing.assert_array_equal(faces[mesh][version][1], breaking.faces(frame.index)[m])


@pytest.fixture(scope="module")
def arm():
    return scenes.make("arm-and-cloth", size=0.1, frames=13)


def test_mcap_holds_a_robot_as_its_description_and_joint_states(arm, tmp_path):
    path = tmp_path / "arm.mcap"
    files.write_mcap(arm, path, rate=50.0)
    (robot,) = arm.robots
    found = {}
    with AnyReader([path]) as reader:
        for connection, time, raw in reader.messages():
            found.setdefault(connection.topic, []).append((time, reader.deserialize(raw, connection.msgtype)))
    meshes = {f"/meshes/{mesh}/{kind}" for mesh in ("table", "cloth") for kind in ("topology", "vertices")}
    assert set(found) == {"/robot_description", "/joint_states", *meshes}
    assert [message.data for _, message in found["/robot_description"]] == [robot.description]
    for frame, (time, message) in zip(arm.frames(), found["/joint_states"], strict=True):
        assert time == 10**9 + frame.index * 20_000_000
        assert dict(zip(message.name, message.position, strict=True)) == robot.joint_positions(frame.time)
    with Recording(path) as recording:
        assert recording.info["parameters"]["robots"] == ["arm"]
        assert recording.info["topics"]["/joint_states"] == "joint_states"


def test_npz_holds_links_under_their_names(arm, tmp_path):
    files.write_npz(arm, tmp_path / "arm.npz")
    with np.load(tmp_path / "arm.npz") as archive:
        assert archive["meshes"].tolist() == arm.mesh_names
        hand = arm.mesh_names.index("arm/hand")
        np.testing.assert_array_equal(archive["arm/hand/0/faces"], arm.meshes[hand].faces)
        np.testing.assert_array_equal(archive["arm/hand/0/vertices"], [frame[hand] for frame in arm.frames()])


def test_parameter_file_names_robots_and_no_links(arm, tmp_path):
    files.write_parameters(arm, tmp_path / "node.yaml")
    tree = yaml.safe_load((tmp_path / "node.yaml").read_text())["/**"]["ros__parameters"]
    assert tree == {
        "meshes": ["table", "cloth"],
        "mesh": {
            "table": {"static": True, "self_collision": False},
            "cloth": {"static": False, "self_collision": True},
        },
        "robots": ["arm"],
        "robot": {
            "arm": {
                "description": "robot_description",
                "joint_states": "joint_states",
                "pose": [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            }
        },
        "frame_id": "world",
    }


def test_mcap_is_the_same_file_each_time_and_names_its_scene(tmp_path):
    scene = scenes.make("two-triangles")
    # The bag's metadata hold one name.
    first, second = (tmp_path / folder / "scene.mcap" for folder in "ab")
    for path in (first, second):
        path.parent.mkdir()
        files.write_mcap(scene, path, rate=30.0)
    assert first.read_bytes() == second.read_bytes()
    with Recording(first) as recording:
        assert recording.info["scene"] == "two-triangles"
        assert recording.info["parameters"]["meshes"] == ["lower", "upper"]
        assert recording.message_count == 2 + 2 * 11


def test_npz_holds_frames_by_topology_version(breaking, tmp_path):
    files.write_npz(breaking, tmp_path / "breaking.npz")
    with np.load(tmp_path / "breaking.npz") as archive:
        assert archive["meshes"].tolist() == breaking.mesh_names
        versions = sorted(int(key.split("/")[1]) for key in archive.files if key.endswith("/faces") and "statue" in key)
        assert versions == list(range(len(versions))) and len(versions) > 3
        frame = 0
        for version in versions:
            assert archive[f"statue/{version}/first_frame"] == frame
            for vertices in archive[f"statue/{version}/vertices"]:
                np.testing.assert_array_equal(vertices, breaking.frame(frame)[0])
                np.testing.assert_array_equal(archive[f"statue/{version}/faces"], breaking.faces(frame)[0])
                frame += 1
        assert frame == len(breaking) == len(archive["boulder/0/vertices"])


def test_step_file_is_one_scene_wide_motion(breaking, tmp_path):
    index = next(frame.index for frame in breaking.frames() if frame.topologies)
    files.write_step(breaking, index, tmp_path / "step.npz")
    with np.load(tmp_path / "step.npz") as archive:
        frame = breaking.frame(index)
        np.testing.assert_array_equal(archive["vertices_t1"], frame.stacked())
        np.testing.assert_array_equal(archive["vertices_t0"], frame.stacked_start())
        parts = breaking.faces(index)
        assert len(archive["faces"]) == sum(map(len, parts))
        assert archive["faces"].max() < len(archive["vertices_t0"])
        last = archive["faces"][-len(parts[-1]) :].astype(np.int64) - (len(frame[0]) + len(frame[1]))
        np.testing.assert_array_equal(last, parts[-1])


def test_parameter_file_names_the_meshes(breaking, tmp_path):
    files.write_parameters(breaking, tmp_path / "node.yaml")
    tree = yaml.safe_load((tmp_path / "node.yaml").read_text())["/**"]["ros__parameters"]
    assert tree["meshes"] == ["statue", "boulder", "ground"]
    assert tree["mesh"]["ground"] == {"static": True, "self_collision": False}
    assert tree["mesh"]["statue"] == {"static": False, "self_collision": True}
