# SPDX-License-Identifier: Apache-2.0
"""A DDS domain of its own for the test run, shared with the processes that it starts."""

import os

import pytest

# Domains 0..101 are safe on Linux whatever the ephemeral port range is.
os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))


@pytest.fixture
def start_node(tmp_path):
    """Starts nodes as processes; ``start_node(parameters, remaps=(...), wait=True)`` -> NodeProcess."""
    from node_process import NodeProcess

    nodes = []

    def start(parameters, **options):
        nodes.append(NodeProcess(tmp_path, parameters, **options))
        return nodes[-1]

    yield start
    for node in nodes:
        node.close()
