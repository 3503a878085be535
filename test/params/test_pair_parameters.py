# SPDX-License-Identifier: Apache-2.0
"""Parameters pairs.NAME.*: what they say to the core, beside the lists that say the same, and bad values."""

import pytest

from hpccd_core.options import FEATURES
from hpccd_ros.detect.separation import Separation
from hpccd_ros.params import pair_parameters, scene_parameters, values
from hpccd_ros.params.values import ParameterError


def checked(given=None, **lists):
    """Of the parameters pairs.NAME.KEY in ``given`` and of others."""
    pairs = {f"pairs.{name}": value for name, value in (given or {}).items()}
    settings, meshes = values.checked({"meshes": ["robot", "cloth", "floor"], **pairs, **lists})
    scene_parameters.check(settings, meshes)
    return settings, meshes


def test_each_key_reaches_the_core():
    given = {
        "a.meshes": ["robot", "cloth"],
        "a.accuracy": "fast",
        "a.separation": 5e-3,
        "a.features": ["edge_edge", "vertex_face"],
        "b.meshes": ["cloth", "cloth"],
        "b.separation": 0.0,
        "b.features": ["edge_edge"],
        "c.meshes": ["floor", "robot"],
        "c.ignored": True,
        "d.meshes": ["floor", "cloth"],
    }
    settings, meshes = checked(given)
    builder = scene_parameters.scene_builder(settings, meshes)
    assert builder.pair_accuracies == (("robot", "cloth", "fast"),)
    assert builder.pair_features == (("robot", "cloth", FEATURES), ("cloth", "cloth", ("edge_edge",)))
    assert builder.ignored_pairs == (("floor", "robot"),)
    told = scene_parameters.detector_options(settings).separation
    assert told == Separation(0.0, (("robot", "cloth", 5e-3), ("cloth", "cloth", 0.0)))


def test_both_ways_side_by_side():
    given = {"a.meshes": ["cloth", "robot"], "a.separation": 0.1, "a.ignored": True, "a.features": ["vertex_face"]}
    settings, meshes = checked(
        given,
        pair_separation=["robot:cloth:1e-1", "cloth:cloth:0.2"],
        ignored_pairs=["robot:cloth"],
        pair_features=["robot:cloth:vertex_face"],
        pair_accuracy=["robot:cloth:fast"],
    )
    told = scene_parameters.detector_options(settings).separation
    assert told.pairs == (("robot", "cloth", 0.1), ("cloth", "cloth", 0.2))
    builder = scene_parameters.scene_builder(settings, meshes)
    assert builder.ignored_pairs == (("robot", "cloth"),)
    assert builder.pair_features == (("robot", "cloth", ("vertex_face",)),)
    assert builder.pair_accuracies == (("robot", "cloth", "fast"),)


def test_nothing_is_unknown_of_a_pair_that_is_named():
    given = {"meshes": ["a", "b"], "pairs.x.meshes": ["a", "b"], "pairs.x.accuracy": "fast", "other": 1}
    assert values.unknown(given, ["a", "b"]) == ["other"]


PAIR = {"a.meshes": ["robot", "cloth"]}


@pytest.mark.parametrize(
    "given, lists, text",
    [
        ({"a.separation": 0.1}, {}, "pairs.a.meshes: [] must be two names out of robot, cloth, floor"),
        ({"a.meshes": ["robot"]}, {}, "pairs.a.meshes: ['robot'] must be two names"),
        ({"a.meshes": ["robot", "cloth", "floor"]}, {}, "must be two names out of robot, cloth, floor"),
        ({"a.meshes": ["robot", "wall"]}, {}, "pairs.a.meshes: ['robot', 'wall'] must be two names"),
        ({"a.meshes": "robot"}, {}, "pairs.a.meshes: 'robot' is of the wrong type; expected string[]"),
        (PAIR | {"a.seperation": 0.1}, {}, "pairs.a.seperation: no parameter of a pair of meshes; there are"),
        (PAIR | {"a.b.separation": 0.1}, {}, "KEY out of meshes, accuracy, separation, features, ignored"),
        ({"a": 3}, {}, "pairs.a: no parameter of a pair of meshes"),
        (PAIR | {"a.separation": "wide"}, {}, "pairs.a.separation: 'wide' is of the wrong type; expected float"),
        (PAIR | {"a.separation": -1.0}, {}, "pairs.a.separation: -1.0 is outside 0.0 .. 1e+150"),
        (PAIR | {"a.accuracy": "best"}, {}, "pairs.a.accuracy: 'best' is not valid; use one of fast, balanced"),
        (
            PAIR | {"a.features": ["faces"]},
            {},
            "pairs.a.features: 'faces' is not valid; use one of vertex_face, edge_edge",
        ),
        (PAIR | {"a.ignored": "yes"}, {}, "pairs.a.ignored: 'yes' is of the wrong type; expected bool"),
        (
            {"a.meshes": ["cloth", "cloth"], "a.ignored": True},
            {},
            "pairs.a.ignored: both meshes of the pair are cloth; to switch off tests within a mesh set "
            "mesh.cloth.self_collision",
        ),
        (
            PAIR | {"a.separation": 0.2},
            {"pair_separation": ["cloth:robot:0.1"]},
            "pairs.a.separation: '0.2' contradicts pair_separation: 'cloth:robot:0.1'; leave one out",
        ),
        (
            PAIR | {"a.accuracy": "fast"},
            {"pair_accuracy": ["robot:cloth:exact"]},
            "pairs.a.accuracy: 'fast' contradicts pair_accuracy: 'robot:cloth:exact'; leave one out",
        ),
        (
            PAIR | {"a.features": ["edge_edge"]},
            {"pair_features": ["robot:cloth:vertex_face", "cloth:robot:edge_edge"]},
            "contradicts pair_features: 'robot:cloth:vertex_face, cloth:robot:edge_edge'; leave one out",
        ),
        (
            PAIR | {"a.ignored": False},
            {"ignored_pairs": ["cloth:robot"]},
            "pairs.a.ignored: 'False' contradicts ignored_pairs: 'cloth:robot'; leave one out",
        ),
        (
            PAIR | {"a.separation": 0.2, "b.meshes": ["cloth", "robot"], "b.separation": 0.3},
            {},
            "pairs.b.separation: '0.3' contradicts pairs.a.separation: '0.2'; leave one out",
        ),
    ],
)
def test_bad_values_are_named(given, lists, text):
    with pytest.raises(ParameterError) as caught:
        checked(given, **lists)
    assert text in str(caught.value)


LINKS = {"arm": ("arm/a", "arm/hand"), "left": ("left/a", "left/hand")}


def separations(*entries):
    settings, _ = values.checked({"meshes": ["cloth"], "robots": ["arm", "left"], "pair_separation": list(entries)})
    found = pair_parameters.separation(settings, LINKS)
    return {frozenset(names): distance for *names, distance in found.pairs}


@pytest.mark.parametrize("entries", [("arm:left/hand:0.1", "arm/hand:left:0.2"), ("arm:arm/hand:0.1", "arm/a:arm:0.2")])
def test_what_is_said_of_two_links_by_their_robots_may_not_differ(entries):
    for order in (entries, entries[::-1]):
        with pytest.raises(ParameterError, match="contradicts 'ar.*give these two links a value of their own"):
            separations(*order)
    pair = ("arm/hand", "left/hand") if "left" in entries[0] else ("arm/a", "arm/hand")
    assert separations(f"{':'.join(pair)}:0.3", *entries)[frozenset(pair)] == 0.3
    same = [entry.rpartition(":")[0] + ":0.1" for entry in entries]
    assert separations(*same)[frozenset(pair)] == 0.1
