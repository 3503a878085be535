# SPDX-License-Identifier: Apache-2.0
"""Frames that carry their topology: it is in force with the frame, and the same object as long as it is equal."""

import numpy as np

from hpccd_ros.frames.assembler import FrameAssembler
from hpccd_ros.frames.drops import Input, Reason
from hpccd_ros.frames.types import AssemblyRules, MeshFrame, MeshSettings, Topology

TWO = np.array([[0, 1, 2], [2, 1, 3]], np.uint32)


def assembler(*meshes, **rules):
    return FrameAssembler(meshes, AssemblyRules(**rules))


def frame(stamp, version=9, faces=TWO, n=4, frame_id="", value=0.0):
    topology = Topology(version, n, faces.copy())
    return MeshFrame(stamp, np.full((n, 3), value), version, None, frame_id, topology=topology)


WHOLE = MeshSettings("cloth", whole=True)


def test_an_equal_topology_is_the_same_one():
    scene = assembler(WHOLE)
    (first,), (second,) = (scene.add("cloth", frame(stamp)).frames for stamp in (1, 2))
    assert second.topologies[0] is first.topologies[0] is scene.topology("cloth")
    assert second.same_scene(first)


def test_another_one_is_in_force_from_its_frame_on_whatever_its_version():
    scene = assembler(WHOLE)
    frames = [frame(1), frame(2, version=3, faces=TWO[:1], n=3), frame(3, version=3, faces=TWO[:1], n=3), frame(4)]
    (a,), (b,), (c,), (d,) = (scene.add("cloth", one).frames for one in frames)
    assert [one.topologies[0].version for one in (a, b, c, d)] == [9, 3, 3, 9]
    assert not b.same_scene(a) and c.same_scene(b) and not d.same_scene(c)


def test_the_same_version_of_other_content_is_another_one():
    scene = assembler(WHOLE)
    (a,), (b,) = (scene.add("cloth", one).frames for one in (frame(1), frame(2, faces=TWO[::-1])))
    assert not b.same_scene(a) and np.array_equal(b.topologies[0].faces, TWO[::-1])


def test_that_of_a_rejected_frame_is_not_in_force():
    scene = assembler(WHOLE)
    scene.add("cloth", frame(5))
    (rejection,) = scene.add("cloth", frame(5, version=3, faces=TWO[:1], n=3)).rejections
    assert rejection.reason == Reason.REPEATED
    (rejection,) = scene.add("cloth", frame(4, version=3, faces=TWO[:1], n=3)).rejections
    assert rejection.reason == Reason.BACKWARD
    assert scene.topology("cloth").version == 9
    (after,) = scene.add("cloth", frame(6)).frames
    assert after.topologies[0] is scene.topology("cloth")


def test_a_topology_of_its_own_is_rejected():
    scene = assembler(WHOLE)
    scene.add("cloth", frame(1))
    (rejection,) = scene.set_topology("cloth", Topology(10, 3, TWO[:1]), new_publisher=True).rejections
    assert (rejection.reason, rejection.what) == (Reason.TOPOLOGY_CONFLICT, Input.TOPOLOGY)
    assert "the topology comes with the positions (parameter mesh.cloth.input)" in rejection.text
    assert scene.topology("cloth").version == 9


def test_a_cloud_is_all_of_a_mesh_of_points():
    scene = assembler(MeshSettings("grains", whole=True, points=True))
    clouds = [MeshFrame(stamp, np.full((n, 3), float(stamp)), sent=stamp) for stamp, n in enumerate((4, 4, 5, 4))]
    (a,), (b,), (c,), (d,) = (scene.add("grains", cloud).frames for cloud in clouds)
    assert b.same_scene(a) and not c.same_scene(b) and not d.same_scene(c)
    topologies = [one.topologies[0] for one in (a, c, d)]
    assert [t.n_vertices for t in topologies] == [t.version for t in topologies] == [4, 5, 4]
    assert not any(len(t.faces) + len(t.edges) for t in topologies)
    assert [origin.topology for one in (a, b, c) for origin in one.origins] == [0, 1, 2]


def test_beside_a_static_whole_mesh():
    scene = assembler(MeshSettings("room", static=True, whole=True), WHOLE)
    (rejection,) = scene.add("cloth", frame(1)).rejections
    assert rejection.reason == Reason.STATIC_MISSING
    scene.add("room", frame(77, version=5, value=1.0))
    (a,) = scene.add("cloth", frame(2)).frames
    scene.add("room", frame(78, version=5, value=1.0))
    (b,) = scene.add("cloth", frame(3)).frames
    assert b.same_scene(a) and b.vertices[0] is a.vertices[0], "the same positions again change nothing"
    scene.add("room", frame(79, version=6, faces=TWO[:1], n=3, value=1.0))
    (c,) = scene.add("cloth", frame(4)).frames
    assert not c.same_scene(b) and len(c.vertices[0]) == 3


def test_positions_of_an_older_topology_of_a_static_mesh_are_forgotten():
    scene = assembler(MeshSettings("room", static=True, whole=True), WHOLE)
    scene.add("room", frame(1, frame_id="world"))
    scene.add("room", frame(2, version=6, faces=TWO[:1], n=3, frame_id="hall"))
    (rejection,) = scene.add("cloth", frame(3, frame_id="world")).rejections
    assert rejection.reason == Reason.STATIC_MISSING and "only in 'hall'" in rejection.text
