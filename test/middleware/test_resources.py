# SPDX-License-Identifier: Apache-2.0
"""package:// and file:// lead to the file that is meant, or nowhere; a node, its recording and a replay follow them."""

import os
import subprocess
import sys

import numpy as np
import pytest
from node_process import assert_same_contacts
from sources import SOURCES
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core import MeshFileError
from hpccd_ros.middleware.resources import local_path

N = 8
FACES = sheet_faces(N)


@pytest.fixture
def share(tmp_path, monkeypatch):
    """The share folder of a package robot_parts."""
    prefix = tmp_path / "install"
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / "robot_parts").touch()
    share = prefix / "share" / "robot_parts"
    (share / "meshes").mkdir(parents=True)
    monkeypatch.setenv("AMENT_PREFIX_PATH", os.pathsep.join([str(prefix), os.environ.get("AMENT_PREFIX_PATH", "")]))
    return share


def test_paths_stay_as_they_are(share):
    for path in ("x.obj", "/a/x.obj", "~/x.obj", "a:b/x.obj", "package:/x.obj", ""):
        assert local_path(path) == path


def test_uris_lead_to_files(share):
    assert local_path("package://robot_parts/meshes/x.dae") == str(share / "meshes" / "x.dae")
    assert local_path("PACKAGE://robot_parts/a%20b..c.obj") == str(share / "a b..c.obj")
    assert local_path("file:///a/b%20c.obj") == local_path("file://localhost/a/b%20c.obj") == "/a/b c.obj"


@pytest.mark.parametrize(
    "uri, why",
    [
        ("package://nobody/x.obj", "no package 'nobody' is installed"),
        ("package://robot_parts/../secret.obj", "leads out of the share folder of robot_parts"),
        ("package://robot_parts/meshes/../../secret.obj", "leads out"),
        ("package://robot_parts/%2e%2e/secret.obj", "leads out"),
        ("package://robot_parts/meshes/%2e%2e%2f%2e%2e%2fsecret.obj", "leads out"),
        ("package://robot_parts//etc/x.obj", "leads out"),
        ("package://../x.obj", "write package://PACKAGE/PATH"),
        ("package://%2e%2e/x.obj", "write package://PACKAGE/PATH"),
        ("package:///x.obj", "write package://PACKAGE/PATH"),
        ("package://robot_parts", "write package://PACKAGE/PATH"),
        ("package://robot_parts/", "write package://PACKAGE/PATH"),
        (f"package://{'a' * 100_000}/x.obj", "package"),
        ("file://elsewhere/x.obj", "names another machine"),
        ("file://x.obj", "names another machine"),
        ("https://host/x.obj", "scheme 'https'; use package://, file:// or a path"),
    ],
)
def test_uris_that_lead_nowhere_are_rejected(share, uri, why):
    with pytest.raises(MeshFileError, match=why) as caught:
        local_path(uri)
    assert len(str(caught.value)) < 800


def test_a_node_and_a_replay_follow_them(start_node, share, tmp_path):
    floor = np.array([[-5, -5, 0.01], [5, -5, 0.01], [0, 5, 0.01]])
    lines = [f"v {x} {y} {z}" for x, y, z in floor] + ["f 1 2 3"]
    file = share / "meshes" / "floor.obj"
    file.write_text("\n".join(lines) + "\n")
    recording = tmp_path / "run.mcap"
    node = start_node(
        {
            "meshes": ["cloth", "floor"],
            "record": str(recording),
            "mesh": {"floor": {"file": "package://robot_parts/meshes/floor.obj", "static": True}},
        }
    )
    node.peer.topology("cloth", FACES, N * N)
    for k in range(3):
        node.peer.vertices("cloth", sheet_positions(N, k), k)
        node.contacts(k)
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    scene.add_mesh("floor", np.array([[0, 1, 2]]), static=True)
    ends = [np.concatenate([sheet_positions(N, k).astype(np.float64), floor]) for k in range(3)]
    for k, message in enumerate(node.contacts(2), start=1):
        assert_same_contacts(message, ends[k - 1], ends[k], scene)
    assert sum(message.total for message in node.peer.received) > 0
    assert node.stop() == 0, node.output()
    file.unlink()  # the recording carries it along
    replay = subprocess.run(
        [sys.executable, "-m", "hpccd_ros.cli", "replay", str(recording)],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env={**os.environ, "PYTHONPATH": SOURCES},
    )
    assert replay.returncode == 0, replay.stdout


def test_a_node_says_which_package_is_missing(start_node):
    node = start_node({"meshes": ["cloth"], "mesh": {"cloth": {"file": "package://nobody/cloth.obj"}}}, wait=False)
    assert node.process.wait(timeout=60) == 1
    assert "package://nobody/cloth.obj: no package 'nobody' is installed" in node.output()
    assert "Traceback" not in node.output()
