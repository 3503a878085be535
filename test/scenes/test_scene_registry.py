# SPDX-License-Identifier: Apache-2.0
"""Names, sizes and options of the scenes."""

import re

import numpy as np
import pytest

from hpccd_ros import scenes

# Kim et al. 2009, Table 1.
TABLE_1 = {
    "cloth-ball-like": 92_000,
    "breaking-like": 252_000,
    "n-body-like-lr": 32_000,
    "n-body-like-hr": 146_000,
}

# Vertices of the scenes of incremental potential contact that these are like.
PUBLISHED_VERTICES = {"rod-twist-like": (52_000, 54_000), "armadillo-like": (20_000, 40_000)}


def test_the_papers_scenes_and_small_ones_are_there():
    assert set(TABLE_1) <= set(scenes.names())
    assert {"cloth-drop", "two-triangles", "folding-strip"} <= set(scenes.names())
    assert [name for name, _, _ in scenes.describe()] == scenes.names()


@pytest.mark.parametrize(("name", "described"), [(name, text) for name, text, _ in scenes.describe()])
def test_descriptions_tell_the_size_and_titles_do_not(name, described):
    scene = scenes.make(name, frames=2)
    title, _, count = described.rpartition(", ")
    number, *unit = re.fullmatch(r"(\d+)( K)? triangles", count).groups()
    assert round(scene.n_triangles / (1000 if unit[0] else 1)) == int(number)
    assert title == scene.title and "triangles" not in scene.title.replace("two triangles", "")


@pytest.mark.parametrize("name", TABLE_1)
def test_triangle_counts_are_those_of_table_1(name):
    scene = scenes.make(name, frames=2)
    assert scene.n_triangles == pytest.approx(TABLE_1[name], rel=0.01)


@pytest.mark.parametrize("name", PUBLISHED_VERTICES)
def test_vertex_counts_are_those_published(name):
    fewest, most = PUBLISHED_VERTICES[name]
    assert fewest <= scenes.make(name, frames=2).n_vertices <= most


@pytest.mark.parametrize("size", [0.25, 4.0])
@pytest.mark.parametrize("name", [*TABLE_1, *PUBLISHED_VERTICES, "cloth-drop", "folding-strip"])
def test_size_scales_the_triangle_count(name, size):
    small, large = scenes.make(name, frames=2), scenes.make(name, size=size, frames=2)
    assert large.n_triangles == pytest.approx(size * small.n_triangles, rel=0.06)


def test_demo_cloth_has_five_to_eight_thousand_triangles():
    scene = scenes.make("cloth-drop", frames=2)
    assert 5_000 <= scene.n_triangles <= 8_000
    assert 60 <= dict((n, f) for n, _, f in scenes.describe())["cloth-drop"] <= 120


@pytest.mark.parametrize("name", scenes.names())
def test_frames_and_meshes_fit_together(name):
    scene = scenes.make(name, size=0.25, frames=4)
    assert len(scene) == 4 and len(list(scene.frames())) == 4
    assert all(re.fullmatch("[a-z][a-z_]*", m.name) for m in scene.sent_meshes), "mesh names become topic names"
    links = {mesh.name for robot in scene.robots for mesh in robot.meshes}
    assert set(scene.mesh_names) - {mesh.name for mesh in scene.sent_meshes} == links
    for frame in scene.frames():
        assert len(frame) == len(scene.meshes)
        for faces, vertices in zip(scene.faces(frame.index), frame, strict=True):
            assert vertices.dtype == np.float32 and vertices.shape[1:] == (3,) and vertices.flags.c_contiguous
            assert faces.dtype == np.uint32 and faces.shape[1:] == (3,)
            assert faces.max() < len(vertices)
            assert np.isfinite(vertices).all()
        assert frame.stacked().shape == (sum(map(len, frame)), 3)
    assert [mesh.n_vertices for mesh in scene.meshes] == [len(v) for v in scene.frame(0)]
    assert scene.n_vertices == len(scene.frame(0).stacked())


# Not static, but at rest in the first eight frames.
STILL_AT_FIRST = {
    ("two-triangles", "lower"),
    ("cloth-drop", "ball"),
    ("cloth-ball-like", "ball"),
    ("breaking-like", "statue"),
    ("arm-and-cloth", "arm/base"),
}


@pytest.mark.parametrize("name", scenes.names())
def test_static_meshes_stay_and_all_others_move(name):
    scene = scenes.make(name, size=0.25, frames=8)
    first, last = scene.frame(0), scene.frame(7)
    for mesh, a, b in zip(scene.meshes, first, last, strict=True):
        if mesh.static:
            np.testing.assert_array_equal(a, b)
        elif (name, mesh.name) not in STILL_AT_FIRST:
            assert (np.abs(a - b).max(axis=1) > 0).mean() > 0.5, mesh.name


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"name": "dragon"}, "unknown scene 'dragon'; there are two-triangles"),
        ({"name": "cloth-dorp"}, "armadillo-like; did you mean cloth-drop?"),
        ({"name": "cloth-drop", "size": 0}, "size 0 is outside"),
        ({"name": "cloth-drop", "size": float("nan")}, "size nan is outside"),
        ({"name": "cloth-drop", "frames": 1}, "frames 1: a scene needs"),
        ({"name": "cloth-drop", "frames": 2.5}, "frames 2.5: a scene needs"),
        ({"name": "cloth-drop", "seed": -1}, "seed -1 is not"),
    ],
)
def test_bad_arguments_are_named(arguments, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        scenes.make(**arguments)


@pytest.mark.parametrize("index", [-1, 11])
def test_frames_that_are_not_there_are_named(index):
    with pytest.raises(IndexError, match=f"frame {index} of scene 'two-triangles': it has frames 0 to 10"):
        scenes.make("two-triangles").frame(index)
