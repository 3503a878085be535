# SPDX-License-Identifier: Apache-2.0
"""Parameters features and pair_features: what they say to the core, and bad values."""

import pytest

from hpccd_core.options import FEATURES
from hpccd_ros.params import scene_parameters, values
from hpccd_ros.params.values import ParameterError


def checked(**given):
    settings, meshes = values.checked({"meshes": ["robot", "cloth"], **given})
    scene_parameters.check(settings, meshes)
    return settings, meshes


def test_what_the_core_is_told():
    assert scene_parameters.detector_options(checked()[0]).features == FEATURES
    assert scene_parameters.scene_builder(*checked()).pair_features == ()
    settings, meshes = checked(
        features=["edge_edge"],
        pair_features=["robot:cloth:vertex_face", "cloth:cloth:edge_edge", "cloth:cloth:vertex_face"],
    )
    assert scene_parameters.detector_options(settings).features == ("edge_edge",)
    builder = scene_parameters.scene_builder(settings, meshes)
    assert builder.pair_features == (("robot", "cloth", ("vertex_face",)), ("cloth", "cloth", FEATURES))
    assert builder.among(["cloth"]).pair_features == (("cloth", "cloth", FEATURES),)
    assert builder != scene_parameters.scene_builder(*checked())
    turned = scene_parameters.detector_options(checked(features=["edge_edge", "vertex_face"])[0])
    assert turned.features == FEATURES


@pytest.mark.parametrize(
    "given, text",
    [
        ({"features": []}, "features: empty, so nothing would be tested; name vertex_face or edge_edge, or both"),
        ({"features": [""]}, "to leave out pairs of meshes use ignored_pairs"),
        ({"features": ["faces"]}, "features: 'faces' is not valid; use one of vertex_face, edge_edge"),
        ({"features": "vertex_face"}, "features: 'vertex_face' is of the wrong type; expected string[]"),
        ({"pair_features": ["robot:cloth"]}, "pair_features: 'robot:cloth' must be NAME:NAME:KIND with"),
        ({"pair_features": ["robot:cloth:edges"]}, "and a kind out of vertex_face, edge_edge"),
        ({"pair_features": ["robot:wall:edge_edge"]}, "with meshes out of robot, cloth"),
        ({"pair_features": ["robot:cloth:edge_edge:vertex_face"]}, "must be NAME:NAME:KIND"),
    ],
)
def test_bad_values_are_named(given, text):
    with pytest.raises(ParameterError) as caught:
        checked(**given)
    assert text in str(caught.value)
