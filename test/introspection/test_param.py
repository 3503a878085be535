# SPDX-License-Identifier: Apache-2.0
"""`hpccd param` reads and sets what the node has, and shows why it rejects."""

import pytest

from hpccd_ros.params import parameter_file


@pytest.fixture
def node(start_node):
    return start_node({"meshes": ["cloth"], "accuracy": "fast"})


@pytest.fixture
def param(hpccd, node):
    return lambda *arguments: hpccd("param", *arguments, "--node", f"{node.namespace}/hpccd", "--wait", "30")


def test_get_and_list(param):
    assert param("get", "accuracy").stdout == "fast\n"
    assert param("get", "meshes").stdout == "[cloth]\n"
    listed = param("list").stdout.splitlines()
    assert "accuracy: fast" in listed and "mesh.cloth.static: false" in listed and "max_rate: 1000.0" in listed
    of_mesh = param("list", "mesh.cloth").stdout.splitlines()
    assert len(of_mesh) > 4 and all(line.startswith("mesh.cloth.") for line in of_mesh)


@pytest.mark.parametrize(
    "name, given, shown",
    [
        ("accuracy", "balanced", "balanced"),
        ("minimum_separation", "1", "1.0"),  # an integer where a float is wanted
        ("minimum_separation", "1e-3", "0.001"),
        ("outputs", "[points, normals]", "[points, normals]"),
        ("pair_separation", "['cloth:cloth:0.5']", "['cloth:cloth:0.5']"),
        ("distances", "true", "true"),
    ],
)
def test_set(param, name, given, shown):
    done = param("set", name, given)
    assert done.returncode == 0, done.stderr
    assert param("get", name).stdout == f"{shown}\n"


@pytest.mark.parametrize(
    "arguments, says",
    [
        (("set", "accuracy", "exakt"), "not set: accuracy: 'exakt' is "),
        (("set", "meshes", "[net]"), "not set: meshes: read-only; give it when the node starts"),
        (("set", "threads", "-1"), "not set: "),
        (("set", "threads", "99999999999999999999"), "not set: threads: expected int, got float; "),
        (("set", "accuracy", "5"), "not set: accuracy: expected string, got int; write, for example, 'exact'"),
        (
            ("set", "minimum_separation", "1mm"),
            "minimum_separation: expected float, got string; write, for example, 0.01 (unit of the vertices)",
        ),
        (("set", "mesh.cloth.frame", "5"), "expected string, got int; docs/parameters.md has the type of "),
        (("set", "mesh.cloth.pose", "5"), "got int; write, for example, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0] ("),
        (("set", "outputs", "normals"), "not set: outputs: expected string[], got string; "),
        (("set", "meshes", "[1, 2]"), "not set: meshes: expected string[], got int[]; "),
        (
            ("get", "acuracy"),
            "acuracy: NODE has no such parameter, or it has no value; `hpccd param list` shows all; "
            "did you mean accuracy?",
        ),
        (("list", "mesch"), "mesch: no parameter of NODE begins so"),
        (("set", "accuracy"), "set: got accuracy; write hpccd param set NAME VALUE"),
        (("get",), "get: got no NAME; write hpccd param get NAME"),
    ],
)
def test_rejections(param, node, arguments, says):
    done = param(*arguments)
    assert done.returncode == 2 and says.replace("NODE", f"{node.namespace}/hpccd") in done.stderr
    assert done.stderr.startswith("hpccd param: ") and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "text, value",
    [
        ("5", 5),
        ("1e-3", 0.001),
        ("true", True),
        ("exact", "exact"),
        ("[0, 0.5]", [0.0, 0.5]),
        ("[]", [""]),
        ("a: b", "a: b"),
        ("[a, 1]", "[a, 1]"),
        ("2026-01-01", "2026-01-01"),
        ("{", "{"),
        ("99999999999999999999", 1e20),  # beyond an int of ROS
        ("[1, -99999999999999999999]", [1.0, -1e20]),
        ("1" + 400 * "0", "1" + 400 * "0"),
        ("", ""),
    ],
)
def test_values_are_typed_as_ros_types_them(text, value):
    found = parameter_file.value(text)
    assert found == value and type(found) is type(value)
