# SPDX-License-Identifier: Apache-2.0
"""How far a step may go, asked again and again from one start, by every method."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.options import METHODS


def _two_sheets(n):
    grid = np.arange(n * n).reshape(n, n)
    a, b, c, d = (x.ravel() for x in (grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:], grid[1:, 1:]))
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    flat = np.stack([*np.meshgrid(np.arange(n), np.arange(n)), np.zeros((n, n))], 2).reshape(-1, 3).astype(float)
    scene = hc.Scene()
    scene.add_mesh("below", faces)
    scene.add_mesh("above", faces)
    start = np.vstack([flat, flat + [0, 0, 3]])
    end = start.copy()
    end[n * n :] -= [0.1, 0.2, 4]
    return scene, start, end


@pytest.mark.parametrize("method", METHODS)
def test_from_one_start_again_and_again(method):
    """The third call looks at leaves that a list of near pairs leaves open: of the tree, whatever the method."""
    scene, start, end = _two_sheets(6)
    asked = hc.Detector(scene, method=method, backend="cpu", threads=1)
    for part in (1, 0.5, 2.0, 0.0, 0.9, 3.0, 0.9):
        step = asked.collision_free_step(start, start + part * (end - start))
        assert step == pytest.approx(min(1.0, 0.75 / part) if part else 1.0, abs=1e-9)
        if part == 2.0:  # contacts in between, by the method's own hierarchy
            found = asked.detect(start, end)
            assert found.hash == hc.Detector(scene, backend="cpu").detect(start, end).hash and len(found)
