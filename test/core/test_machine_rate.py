# SPDX-License-Identifier: Apache-2.0
"""What benchmarks ask of the core: rates of the machine, and the time of parts of a step."""

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc
from hpccd_core import _core

RATES = sorted(_core.Rate.__members__)


@pytest.mark.parametrize("simd", _core.simd_levels())
@pytest.mark.parametrize("rate", RATES)
def test_every_rate_of_every_instruction_set(rate, simd):
    for threads in (1, 2):
        found = _core.machine_rate(_core.Rate.__members__[rate], _core.Simd.__members__[simd], threads, 1 << 16)
        assert 1e6 < found < 1e15


def test_nothing_to_read_is_little_to_read():
    assert _core.machine_rate(_core.Rate.read, _core.Simd.auto, 1, 0) > 1e6


def test_parts_of_a_step_are_timed():
    meshes = random_scenes.many_meshes(np.random.default_rng(7))
    detector = hc.Detector(meshes.scene(), backend="cpu", threads=1)
    for _ in range(3):
        detector.detect(meshes.vertices_t0, meshes.vertices_t1)
    stats, profile = detector.stats, detector.profile
    assert 0 <= stats["slabs_ns"] <= 1e6 * profile["elementary"]
    assert stats["leaf_pairs_ns"] >= 0
    detector.proximity(meshes.vertices_t0, 0.1)
    assert "leaf_pairs_ns" not in detector.stats
    published = hc.Detector(meshes.scene(), backend="cpu", method="published")
    published.detect(meshes.vertices_t0, meshes.vertices_t1)
    assert "leaf_pairs_ns" not in published.stats
