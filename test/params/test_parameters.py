# SPDX-License-Identifier: Apache-2.0
"""The parameter table: descriptors, checks with reasons, the shipped configuration."""

from pathlib import Path

import pytest
import rclpy
import yaml
from rclpy.node import Node
from rclpy.parameter import Parameter

from hpccd_ros.params import parameters, scene_parameters, values
from hpccd_ros.params.table import MESH_ROWS, NEVER, NODE_ROWS, PAIR_ROWS, PLANE_ROWS, ROBOT_ROWS
from hpccd_ros.params.values import ParameterError

CONFIG = Path(__file__).resolve().parents[2] / "config"


@pytest.fixture
def node_with():
    """Makes nodes with the parameter overrides given, in a context of their own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    nodes = []

    def make(**overrides):
        values = [Parameter(name.replace("__", "."), value=value) for name, value in overrides.items()]
        nodes.append(Node("parameters_test", context=context, parameter_overrides=values))
        return nodes[-1]

    yield make
    for node in nodes:
        node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.mark.parametrize(
    "row", [*NODE_ROWS, *MESH_ROWS, *PAIR_ROWS, *PLANE_ROWS, *ROBOT_ROWS], ids=lambda row: row.name
)
def test_each_row_is_sound(row):
    assert values.unusable_value(row, row.default) is None
    assert row.text and not row.text.endswith(".")
    described = parameters.descriptor(row)
    assert described.read_only == (row.change == NEVER)
    if row.span is not None:
        assert values.unusable_value(row, row.span[1] + max(1, row.span[1])) is not None
        assert values.unusable_value(row, row.span[0] - max(1, abs(row.span[0]))) is not None
    if row.choices:
        value = ["nonsense"] if row.kind == "string[]" else "nonsense"
        assert "nonsense" in values.unusable_value(row, value)
    example = values.example(row)
    assert (example or row.kind == "string") and row.unit in example
    assert row.example is None or values.unusable_value(row, row.example) is None


def test_defaults(node_with):
    settings, meshes = parameters.declare(node_with())
    assert settings == {row.name: row.default for row in NODE_ROWS} | {"pairs": {}, "plane": {}, "robot": {}}
    assert meshes == {}


def test_overrides_reach_the_settings(node_with):
    node = node_with(meshes=["cloth", "floor"], mesh__floor__static=True, outputs=["points"], threads=3)
    settings, meshes = parameters.declare(node)
    assert settings["meshes"] == ["cloth", "floor"] and settings["threads"] == 3
    assert settings["outputs"] == ["points"]
    assert meshes["floor"]["static"] and not meshes["cloth"]["static"]
    assert node.describe_parameter("meshes").read_only


@pytest.mark.parametrize(
    "overrides, text",
    [
        ({"meshes": ["a b"]}, "meshes: 'a b' cannot be part of a topic name"),
        ({"meshes": ["a", "a"]}, "names must differ"),
        ({"meshes": ["a", "b"], "ignored_pairs": ["a:c"]}, "ignored_pairs: 'a:c'"),
        ({"meshes": ["a", "b"], "ignored_pairs": ["a"]}, "ignored_pairs: 'a'"),
        ({"meshes": ["cloth", "ball"], "ignored_pairs": ["cloth:bal"]}, "out of cloth, ball; did you mean ball?"),
        ({"meshes": ["cloth", "ball"], "ignored_pairs": ["cloth,ball"]}, "ball; did you mean cloth:ball?"),
        ({"meshes": ["cloth", "ball"], "pair_accuracy": ["cloth ball fast"]}, "; did you mean cloth:ball:fast?"),
        ({"meshes": ["cloth", "ball"], "pair_features": ["coth:ball:edge_edge"]}, "edge_edge; did you mean cloth?"),
        ({"meshes": ["cloth", "ball"], "pair_accuracy": ["ball:Cloth:fast"]}, "exact; did you mean cloth?"),
        ({"meshes": ["a", "b"], "pair_accuracy": ["a:b"]}, "pair_accuracy: 'a:b' must be NAME:NAME:TIER"),
        ({"meshes": ["a", "b"], "pair_accuracy": ["a:c:fast"]}, "meshes out of a, b"),
        ({"meshes": ["a", "b"], "pair_accuracy": ["a:b:best"]}, "a tier out of fast, balanced"),
        ({"meshes": ["a", "b"], "pair_accuracy": ["a:b:fast", "b:a:exact"]}, "'b:a:exact' contradicts 'a:b:fast'"),
        ({"meshes": ["a"], "mesh__a__transform": "tf"}, "mesh.a.transform: tf needs a frame to transform to"),
        ({"meshes": ["a"], "mesh__a__frame": "arm", "frame_id": "world"}, "'arm' is not the scene's frame 'world'"),
        ({"meshes": ["a"], "mesh__a__pose": [0.0] * 7}, "mesh.a.pose: "),
        (
            {
                "meshes": ["a"],
                "frame_id": "world",
                "mesh__a__transform": "tf",
                "mesh__a__static": True,
                "mesh__a__file": "a.obj",
            },
            "give mesh.a.pose",
        ),
        ({"accuracy": "sloppy"}, "accuracy: 'sloppy' is not valid; use one of fast, balanced"),
        ({"outputs": ["points", "colours"]}, "outputs: 'colours' is not valid; use one of"),
        ({"threads": -1}, "threads"),
        ({"record_split_size": 1e-6}, "record_split_size: 1e-06 is not valid; use 0, or at least 0.01"),
        ({"record_split_time": 1e-9}, "record_split_time: 1e-09 is not valid; use 0, or at least 0.1"),
        ({"stop_distance": -0.05}, "stop_distance: -0.05 is not valid; use -1, or at least 0"),
        ({"threads": "many"}, "threads"),
        ({"stamp_tolerance": True}, "stamp_tolerance"),
        ({"stamp_tolerance": -1}, "stamp_tolerance"),
        ({"stamp_tolerance": [1]}, "stamp_tolerance"),
        ({"meshes": ["a"], "mesh__a__pose": ["0", "1"]}, "mesh.a.pose: "),
        ({"meshes": ["a"], "mesh__a__pose": 1}, "mesh.a.pose: "),
        (
            {"meshes": ["a"], "mesh__a__input": "clouds"},
            "mesh.a.input: 'clouds' is not valid; use one of vertices, points",
        ),
    ],
)
def test_bad_values_are_named(node_with, overrides, text):
    with pytest.raises(ParameterError) as caught:
        scene_parameters.check(*parameters.declare(node_with(**overrides)))
    assert text in str(caught.value)


def test_integers_are_floats_where_floats_are_wanted(node_with):
    node = node_with(meshes=["a"], mesh__a__pose=[0, 0, 1, 0, 0, 0, 1], stamp_tolerance=2, minimum_separation=0)
    settings, meshes = parameters.declare(node)
    scene_parameters.check(settings, meshes)
    assert meshes["a"]["pose"] == [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    assert all(type(entry) is float for entry in meshes["a"]["pose"])
    assert (settings["stamp_tolerance"], type(settings["stamp_tolerance"])) == (2.0, float)
    assert node.get_parameter("mesh.a.pose").type_ == Parameter.Type.DOUBLE_ARRAY
    assert node.get_parameter("minimum_separation").type_ == Parameter.Type.DOUBLE
    of_file = values.checked({"meshes": ["a"], "mesh.a.pose": [0, 0, 1, 0.5, 0, 0, 1], "max_rate": 5})
    assert of_file[1]["a"]["pose"] == [0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 1.0]
    assert type(of_file[0]["max_rate"]) is float


def test_unknown_parameters_are_noticed(node_with):
    node = node_with(acuracy="exact", meshes=["a"], mesh__b__static=True)
    parameters.declare(node)
    assert parameters.unknown_overrides(node) == ["acuracy", "mesh.b.static"]


def test_changes_at_run_time(node_with):
    node = node_with(meshes=["a"])
    settings, meshes = parameters.declare(node)
    changes, configured = [], [True]
    parameters.watch(
        node,
        settings,
        meshes,
        configured=lambda: configured[0],
        check=lambda wanted, _: "fast is not built" if wanted["accuracy"] == "fast" else None,
        on_change=lambda: changes.append(dict(settings)),
    )

    def change(name, value):
        (result,) = node.set_parameters([Parameter(name, value=value)])
        return result

    assert change("max_contacts", 5).successful and settings["max_contacts"] == 5
    assert change("outputs", ["normals"]).successful and settings["outputs"] == ["normals"]
    assert change("outputs", [""]).successful and settings["outputs"] == []
    rejections = {
        "accuracy": ("fast", "fast is not built"),
        "report": ("some", "report: 'some' is not valid; use one of"),
        "frame_queue": (
            4,
            "frame_queue: read-only while the node is configured; run hpccd lifecycle deactivate, then cleanup",
        ),
        "mesh.a.static": (True, "mesh.a.static: read-only while"),
        "meshes": (["b"], "read-only"),
        "threads": (-4, "range"),
        "record_split_size": (1e-6, "use 0, or at least"),
    }
    for name, (value, reason) in rejections.items():
        result = change(name, value)
        assert not result.successful and reason in result.reason
    assert len(changes) == 3
    assert settings["accuracy"] == "exact" and settings["threads"] == 0
    configured[0] = False
    assert change("frame_queue", 4).successful and settings["frame_queue"] == 4
    assert change("mesh.a.static", True).successful and meshes["a"]["static"]
    result = change("mesh.a.input", "clouds")
    assert not result.successful and "mesh.a.input: 'clouds' is not valid; use one of" in result.reason
    assert not change("meshes", ["b"]).successful


@pytest.mark.parametrize("path", sorted(CONFIG.rglob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_configurations(path, node_with):
    ((name, body),) = yaml.safe_load(path.read_text()).items()
    assert name == "/**"

    def flat(tree, prefix=""):
        for key, value in tree.items():
            if isinstance(value, dict):
                yield from flat(value, f"{prefix}{key}.")
            else:
                yield f"{prefix}{key}", value

    values = {key: value for key, value in flat(body["ros__parameters"]) if value != []}
    node = node_with(**{key.replace(".", "__"): value for key, value in values.items()})
    settings, meshes = parameters.declare(node)
    assert parameters.unknown_overrides(node) == []
    for key, value in values.items():
        if not key.startswith("mesh."):
            assert settings[key] == (value if value != [""] else [])


def test_default_configuration_shows_every_parameter_and_its_default():
    text = (CONFIG / "hpccd.yaml").read_text()
    shown = yaml.safe_load(text)["/**"]["ros__parameters"]
    for row in NODE_ROWS:
        if row.name != "meshes":
            assert values.normalise(row, shown[row.name]) == row.default, row.name
    for row in MESH_ROWS:
        assert values.normalise(row, shown["mesh"]["cloth"][row.name]) == row.default, row.name
