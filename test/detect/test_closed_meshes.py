# SPDX-License-Identifier: Apache-2.0
"""Which meshes are closed, from topology to topology. No ROS."""

import numpy as np

from hpccd_ros.detect.closed_meshes import ClosedMeshes
from hpccd_ros.frames.types import Topology

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.uint32)


def test_changed_topologies_are_tested_again():
    closed, sheet, nothing = (Topology(0, 4, TETRAHEDRON[:n]) for n in (4, 3, 0))
    meshes = ClosedMeshes()
    assert meshes.of([closed, sheet, nothing, closed]) == [True, False, False, True]
    assert meshes.of([sheet, sheet, closed]) == [False, False, True]
    assert meshes.of([Topology(1, 4, TETRAHEDRON[:3]), Topology(1, 4, TETRAHEDRON)]) == [False, True]
    assert meshes.of([]) == []


def test_unchanged_topologies_are_not():
    """Their faces are not read: here they change behind its back, which no message does."""
    topology = Topology(0, 4, TETRAHEDRON.copy())
    meshes = ClosedMeshes()
    assert meshes.of([topology]) == [True]
    topology.faces[0] = topology.faces[1]
    assert meshes.of([topology, Topology(0, 4, topology.faces)]) == [True, False]
