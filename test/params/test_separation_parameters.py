# SPDX-License-Identifier: Apache-2.0
"""Parameters minimum_separation, pair_separation and distances: what they say to the detector, and bad values."""

import math

import pytest

from hpccd_ros.detect.separation import Separation
from hpccd_ros.params import scene_parameters, values
from hpccd_ros.params.values import ParameterError


def options(**given):
    settings, meshes = values.checked({"meshes": ["robot", "cloth"], **given})
    scene_parameters.check(settings, meshes)
    return scene_parameters.detector_options(settings)


def test_what_the_detector_is_told():
    assert options().separation == Separation() and not options().distances
    pairs = ["robot:cloth:5e-3", "cloth:cloth:0", "cloth:robot:0.005"]
    found = options(minimum_separation=1e-3, pair_separation=pairs, distances=True)
    assert found.separation == Separation(1e-3, (("robot", "cloth", 0.005), ("cloth", "cloth", 0.0)))
    assert found.distances


def test_markers_show_nearest_points_only_where_something_is_to_stay_apart():
    assert options(markers=True).outputs == ("points", "normals")
    assert options(markers=True, minimum_separation=0.1).outputs == ("points", "normals", "closest")
    assert options(markers=True, pair_separation=["robot:cloth:0.1"]).outputs == ("points", "normals", "closest")
    assert options(outputs=["closest"]).outputs == ("closest",)
    assert options(outputs=["weights", "points"]).outputs == ("points", "weights")


@pytest.mark.parametrize(
    "given, text",
    [
        ({"minimum_separation": -1e-3}, "minimum_separation: -0.001 is outside 0.0 .."),
        ({"minimum_separation": math.nan}, "minimum_separation: nan is outside"),
        ({"minimum_separation": math.inf}, "minimum_separation: inf is outside"),
        ({"minimum_separation": 10**400}, "is of the wrong type; expected float"),
        ({"minimum_separation": True}, "minimum_separation: True is of the wrong type; expected float"),
        ({"pair_separation": ["robto:cloth:0.1"]}, "; did you mean robot?"),
        ({"pair_separation": ["robot:cloth"]}, "pair_separation: 'robot:cloth' must be NAME:NAME:DISTANCE"),
        ({"pair_separation": ["robot:cloth:near"]}, "'robot:cloth:near' must be NAME:NAME:DISTANCE"),
        ({"pair_separation": ["robot:cloth:0.1:x"]}, "'robot:cloth:0.1:x' must be NAME:NAME:DISTANCE"),
        ({"pair_separation": ["robot:wall:0.1"]}, "with meshes out of robot, cloth"),
        ({"pair_separation": ["robot:cloth:-0.1"]}, "and a distance from 0 to 1e+150"),
        ({"pair_separation": ["robot:cloth:nan"]}, "and a distance from 0 to 1e+150"),
        ({"pair_separation": ["robot:cloth:inf"]}, "and a distance from 0 to 1e+150"),
        (
            {"pair_separation": ["robot:cloth:0.1", "cloth:robot:0.2"]},
            "'cloth:robot:0.2' contradicts 'robot:cloth:0.1'; leave one out",
        ),
    ],
)
def test_bad_values_are_named(given, text):
    with pytest.raises(ParameterError) as caught:
        options(**given)
    assert text in str(caught.value)
