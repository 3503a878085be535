# SPDX-License-Identifier: Apache-2.0
"""`hpccd lifecycle` of a real node."""

import pytest


@pytest.fixture
def node(start_node):
    return start_node({"meshes": ["cloth"]})


@pytest.fixture
def lifecycle(hpccd, node):
    return lambda *arguments: hpccd("lifecycle", *arguments, "--node", f"{node.namespace}/hpccd", "--wait", "30")


def test_transitions(node, lifecycle):
    name = f"{node.namespace}/hpccd"
    assert lifecycle("get").stdout == f"{name}: active\n"
    done = lifecycle("activate")
    assert done.returncode == 2 and f"activate: {name} is active; it can deactivate, shutdown\n" in done.stderr
    for action, state in (
        ("deactivate", "inactive"),
        ("cleanup", "unconfigured"),
        ("configure", "inactive"),
        ("activate", "active"),
        ("shutdown", "finalized"),
    ):
        done = lifecycle(action)
        assert (done.returncode, done.stdout) == (0, f"{name}: {state}\n"), action


def test_a_transition_that_fails(start_node, hpccd, tmp_path):
    """The mesh file is read when the node is configured."""
    file = tmp_path / "cloth.obj"
    node = start_node({"meshes": ["cloth"], "mesh.cloth.file": str(file), "autostart": False}, wait=False)
    done = hpccd("lifecycle", "configure", "--wait", "60", "--node", f"{node.namespace}/hpccd")
    assert (done.returncode, done.stdout) == (1, f"{node.namespace}/hpccd: unconfigured\n"), done.stderr
    assert "cannot configure: " in node.output() and "no such file" in node.output()
