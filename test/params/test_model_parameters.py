# SPDX-License-Identifier: Apache-2.0
"""Parameters of planes, thickness, coarse meshes and ignored neighbours: the scene they describe, and bad values."""

import math

import pytest

from hpccd_ros.detect.scene import PlaneSettings
from hpccd_ros.params import scene_parameters, unknown, values
from hpccd_ros.params.values import ParameterError


def checked(**given):
    given = {"meshes": ["cloth", "ball"], **{name.replace("__", "."): value for name, value in given.items()}}
    settings, meshes = values.checked(given)
    unknown.check(values.unknown(given, meshes, settings["robots"], settings["planes"]), settings)
    scene_parameters.check(settings, meshes)
    return settings, meshes


def builder(**given):
    return scene_parameters.scene_builder(*checked(**given))


def thickness(*entries):
    return scene_parameters.detector_options(checked(thickness=list(entries))[0]).thickness


def test_planes():
    assert builder().planes == ()
    assert builder(planes=["floor"]).planes == (PlaneSettings("floor", (0.0, 0.0, 1.0), 0.0),)
    made = builder(planes=["floor", "wall"], plane__wall__normal=[-1, 0, 0], plane__wall__offset=-2)
    assert made.planes[1] == PlaneSettings("wall", (-1.0, 0.0, 0.0), -2.0)
    assert made.names == ("cloth", "ball", "floor", "wall")
    assert made.tested_pairs[:4] == (("cloth", "cloth"), ("cloth", "ball"), ("cloth", "floor"), ("cloth", "wall"))


def test_planes_are_members_of_pairs():
    made = builder(planes=["floor"], ignored_pairs=["ball:floor"])
    assert made.ignored_pairs == (("ball", "floor"),) and ("ball", "floor") not in made.tested_pairs
    settings, _ = checked(planes=["floor"], pair_separation=["cloth:floor:0.1"])
    assert scene_parameters.detector_options(settings).separation.pairs == (("cloth", "floor", 0.1),)


def test_thickness():
    assert thickness() == ()
    assert thickness("cloth:0.002", "ball:0") == (("cloth", 0.002), ("ball", 0.0))
    assert thickness("cloth:1e-3", "cloth:0.001") == (("cloth", 0.001),)


def test_markers_show_nearest_points_of_thick_meshes():
    settings, _ = checked(markers=True, thickness=["cloth:0.1"])
    assert scene_parameters.detector_options(settings).outputs == ("points", "normals", "closest")


def test_points():
    assert [mesh.points for mesh in builder(points=["ball"]).meshes] == [False, True]
    settings, meshes = checked(points=["ball"], mesh__ball__input="points")
    assert [mesh.whole for mesh in scene_parameters.mesh_settings(settings, meshes)] == [False, True]


def test_meshes():
    cloth, ball = builder(mesh__cloth__ignored_rings=2, mesh__cloth__ignored_at_rest=0.0).meshes
    assert (cloth.ignored_rings, cloth.ignored_at_rest) == (2, 0.0)
    assert (ball.ignored_rings, ball.ignored_at_rest) == (0, None)


@pytest.mark.parametrize(
    "given, text",
    [
        ({"planes": ["cloth"]}, "planes: cloth is also in the parameter meshes; choose another name"),
        ({"planes": ["floor", "floor"]}, "planes: names must differ, 'floor' is listed twice"),
        ({"planes": ["a b"]}, "planes: 'a b' cannot be part of a topic name"),
        ({"planes": ["floor"], "plane__floor__normal": [0, 0]}, "plane.floor.normal: [0.0, 0.0] must be three finite"),
        ({"planes": ["floor"], "plane__floor__normal": [0, 0, 0]}, "that are not all 0"),
        ({"planes": ["floor"], "plane__floor__normal": [0.0, 0.0, math.nan]}, "must be three finite numbers"),
        ({"planes": ["floor"], "plane__floor__normal": [0.0, 0.0, 1e300]}, "1e+300 is beyond 1e+150; scale it down"),
        ({"planes": ["floor"], "plane__floor__offset": math.inf}, "plane.floor.offset: inf is outside"),
        ({"planes": ["floor"], "plane__flor__offset": 1.0}, "did you mean plane.floor.offset?"),
        ({"planes": ["floor"], "plane__floor__ofset": 1.0}, "there are normal, offset; did you mean offset?"),
        ({"planes": ["floor"], "planes__floor__offset": 1.0}, "did you mean plane.floor.offset?"),
        ({"planes": ["floor"], "pair_accuracy": ["cloth:floor:fast"]}, "'floor' is a plane; leave out the tier"),
        ({"planes": ["floor"], "pair_features": ["cloth:floor:edge_edge"]}, "is a plane; leave out the features"),
        ({"planes": ["floor"], "ignored_pairs": ["cloth:flor"]}, "did you mean floor?"),
        ({"thickness": ["cloth"]}, "thickness: 'cloth' must be NAME:THICKNESS with a mesh out of cloth, ball"),
        ({"thickness": ["coth:0.1"]}, "did you mean cloth?"),
        ({"thickness": ["cloth:-1"]}, "a number from 0 to 1e+150"),
        ({"thickness": ["cloth:nan"]}, "a number from 0 to 1e+150"),
        ({"thickness": ["cloth 0.1"]}, "did you mean cloth:0.1?"),
        ({"thickness": ["cloth:1", "cloth:2"]}, "'cloth:2' contradicts 'cloth:1'; leave one out"),
        (
            {"stop_detail": ["cloth:1.5"]},
            "'cloth:1.5' must be NAME:RATIO with a mesh out of cloth, ball and a ratio above 0",
        ),
        ({"stop_detail": ["ball:0.1"], "points": ["ball"]}, "stop_detail: 'ball' has points and no faces"),
        (
            {"points": ["ball"], "mesh__ball__input": "points", "mesh__ball__file": "ball.stl"},
            "mesh.ball.file: with mesh.ball.input points each message is the whole mesh; leave one of them out",
        ),
        ({"points": ["bal"]}, "points: 'bal' must be a mesh out of cloth, ball; did you mean ball?"),
        ({"planes": ["floor"], "points": ["floor"]}, "points: 'floor' must be a mesh out of cloth, ball"),
        (
            {"points": ["ball"], "mesh__ball__input": "marker"},
            "with mesh.ball.input marker each message carries them; set mesh.ball.input to vertices or points",
        ),
        ({"planes": ["floor"], "thickness": ["floor:1"]}, "'floor' is a plane, which has none: shift its offset"),
        ({"mesh__cloth__ignored_rings": -1}, "mesh.cloth.ignored_rings: -1 is outside 0 .. 1000"),
        (
            {"mesh__cloth__ignored_at_rest": -0.5},
            "mesh.cloth.ignored_at_rest: -0.5 is not valid; use -1, or at least 0",
        ),
        ({"mesh__cloth__ignored_rings": 2, "mesh__cloth__self_collision": False}, "not tested against itself"),
        ({"mesh__cloth__ignored_at_rest": 0.1, "mesh__cloth__static": True}, "mesh.cloth.ignored_at_rest: 0.1 leaves"),
    ],
)
def test_bad_values_are_named(given, text):
    with pytest.raises(ParameterError) as caught:
        checked(**given)
    assert text in str(caught.value)
