# SPDX-License-Identifier: Apache-2.0
"""The mesh of a file is placed by a pose."""

import numpy as np
import pytest

from hpccd_core import MeshFileError
from hpccd_ros.frames.rigid_mesh import place

VERTICES = np.array([[2, 0, 0], [0, 1, 0], [1, 5, 0.125], [7, 7, 7], [2, 0, 0], [-0.0, 0, 3]], np.float64)


def test_pose():
    half = np.sqrt(0.5)
    assert place(VERTICES, [0, 0, 0, 0, 0, 0, 1]) is VERTICES, "no pose, no rounding"
    assert np.array_equal(place(VERTICES, [1, 2, 3, 0, 0, 0, 1]), VERTICES + [1, 2, 3])
    turned = place(VERTICES, [0, 0, 1, 0, 0, half, half])  # 90 degrees about z
    expected = np.stack([-VERTICES[:, 1], VERTICES[:, 0], VERTICES[:, 2] + 1], axis=1)
    assert np.allclose(turned, expected, atol=1e-15)
    with pytest.raises(MeshFileError, match="it must be 1"):
        place(VERTICES, [0, 0, 0, 0, 0, 0, 2])
    with pytest.raises(MeshFileError, match="7 finite numbers"):
        place(VERTICES, [0, 0, 0])
    with pytest.raises(MeshFileError, match="placed by it, vertex 0 is"):
        place(VERTICES, [0, 2e150, 0, 0, 0, 0, 1])
