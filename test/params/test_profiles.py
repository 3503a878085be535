# SPDX-License-Identifier: Apache-2.0
"""The shipped profiles: a real node starts with each and behaves as the profile says."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from node_process import assert_same_contacts
from waving_sheet import scene_of, sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_ros.middleware import fields

CONFIG = Path(__file__).resolve().parents[2] / "config"
PROFILES = sorted((CONFIG / "profiles").glob("*.yaml"))
N = 16
FACES = sheet_faces(N)


def values_of(profile):
    return yaml.safe_load(profile.read_text())["/**"]["ros__parameters"]


def stream(node, mesh, frames):
    """One after the other, so that none gives way; the responses."""
    node.peer.topology(mesh, FACES, N * N)
    for k, vertices in enumerate(frames):
        node.peer.vertices(mesh, vertices, stamp=k + 1)
        node.contacts(k)
    return node.contacts(len(frames) - 1)


@pytest.mark.parametrize("profile", [p for p in PROFILES if "meshes" not in values_of(p)], ids=lambda path: path.stem)
def test_profile_on_a_scene_of_ones_own(start_node, profile):
    values = values_of(profile)
    node = start_node({"meshes": ["cloth"]}, profiles=(profile,))
    frames = [sheet_positions(N, k) for k in range(4)]
    for k, message in enumerate(stream(node, "cloth", frames), start=1):
        options = {name: values[name] for name in ("accuracy", "report") if name in values}
        assert assert_same_contacts(message, *frames[k - 1 : k + 1], scene_of(cloth=FACES), **options) > 0
        assert message.accuracy == values["accuracy"]
        with_points = "points" in values.get("outputs", [])
        assert len(message.points) == (3 * len(message.toc) if with_points else 0)
    assert "is unknown and has no effect" not in node.output()


def test_static_environment(start_node):
    node = start_node({}, profiles=(CONFIG / "profiles" / "static_environment.yaml",))
    room = sheet_positions(N, 9, offset=0.004)
    node.peer.topology("room", FACES, N * N)
    node.peer.vertices("room", room, stamp=0)
    node.frames_status(processed=1)
    frames = [sheet_positions(N, k) for k in range(3)]
    scene = hc.Scene()
    scene.add_mesh("object", FACES)
    scene.add_mesh("room", FACES, static=True, self_collision=False)
    scene.set_accuracy("object", "room", "balanced")
    between = 0
    for k, message in enumerate(stream(node, "object", frames), start=1):
        assert_same_contacts(message, *(np.concatenate([frame, room]) for frame in frames[k - 1 : k + 1]), scene)
        sides = np.frombuffer(message.mesh_a, np.uint32), np.frombuffer(message.mesh_b, np.uint32)
        between += np.count_nonzero(sides[0] != sides[1])
        assert not np.any((sides[0] == 1) & (sides[1] == 1)), "the room is not tested against itself"
    assert between > 0


def test_accuracy_of_a_pair_reaches_the_core(start_node):
    """Times of the tier fast are rounded to single precision, so that the tier shows in the hash."""
    node = start_node({"meshes": ["a", "b"], "pair_accuracy": ["a:a:fast", "a:b:fast", "b:b:fast"]})
    scene = scene_of(a=FACES, b=FACES)
    for pair in ("aa", "ab", "bb"):
        scene.set_accuracy(*pair, "fast")
    frames = []
    for k in range(3):
        parts = sheet_positions(N, k), sheet_positions(N, k + 2, offset=0.003)
        frames.append(np.concatenate(parts))
        for name, part in zip("ab", parts, strict=True):
            if k == 0:
                node.peer.topology(name, FACES, N * N)
            node.peer.vertices(name, part, stamp=k)
        node.contacts(k)
    exact = hc.Detector(scene_of(a=FACES, b=FACES))
    differs = 0
    for k, message in enumerate(node.contacts(2), start=1):
        assert assert_same_contacts(message, *frames[k - 1 : k + 1], scene) > 0
        differs += message.hash != exact.detect(*frames[k - 1 : k + 1]).hash
        assert fields.stamp_to_ns(message.header.stamp) == k
    assert differs
