# SPDX-License-Identifier: Apache-2.0
"""Nodes as forks (test/support/node_server.py) end as tests see it."""

import signal
import time

import node_server
import pytest
from node_process import PATIENCE


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_right_after_the_start_ends_it(tmp_path, number):
    for count in range(5):
        node = node_server.ForkedNode(["--ros-args", "-p", "meshes:=[a]"], tmp_path / _file(tmp_path, count))
        node.send_signal(number)
        assert node.wait(PATIENCE) == 0, (tmp_path / f"{count}.txt").read_text()
        node.send_signal(number)  # to a node that has ended: nothing


def test_a_killed_node_and_a_wrong_one(tmp_path):
    killed = node_server.ForkedNode(["--ros-args", "-p", "meshes:=[a]"], tmp_path / _file(tmp_path, 0))
    killed.kill()
    wrong = node_server.ForkedNode(["--ros-args", "-p", "accuracy:=none"], tmp_path / _file(tmp_path, 1))
    assert (killed.wait(PATIENCE), wrong.wait(PATIENCE)) == (-signal.SIGKILL, 2)


def test_a_server_that_ends_is_no_running_node(tmp_path):
    node = node_server.ForkedNode(["--ros-args", "-p", "meshes:=[a]"], tmp_path / _file(tmp_path, 0))
    node_server._server.kill()
    node_server._server.wait()
    with pytest.raises(RuntimeError, match="the status is unknown"):
        node.poll()
    time.sleep(0.1)
    node_server.os.kill(node.pid, signal.SIGKILL)
    again = node_server.ForkedNode(["--ros-args", "-p", "meshes:=[a]"], tmp_path / _file(tmp_path, 1))
    again.kill()
    assert again.wait(PATIENCE) == -signal.SIGKILL


def _file(folder, count):
    """An empty file for the output."""
    (folder / f"{count}.txt").touch()
    return f"{count}.txt"
