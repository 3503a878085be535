# SPDX-License-Identifier: Apache-2.0
"""Options reach the core by name: each sets one field, and no other."""

import pytest

import hpccd_core as hc
from hpccd_core import _core

FIELDS = [name for name in dir(_core.Options) if not name.startswith("_")]


def values(options):
    return {name: getattr(options, name) for name in FIELDS if name != "features"}


@pytest.mark.parametrize("name", [name for name in FIELDS if name != "features"])
def test_an_option_sets_one_field(name):
    options, before = _core.Options(), values(_core.Options())
    value = before[name]
    if isinstance(value, (bool, int, float)):
        other = not value if isinstance(value, bool) else value + 1
    else:
        other = next(one for one in type(value).__members__.values() if one != value)
    setattr(options, name, other)
    assert values(options) == before | {name: other}


def test_threads_and_instruction_set_reach_the_core():
    scene = hc.Scene()
    scene.add_mesh("triangle", [[0, 1, 2]])
    for threads in (1, 2):
        core = hc.Detector(scene, threads=threads, simd="scalar")._core
        assert (core.threads, core.simd) == (threads, "scalar")
