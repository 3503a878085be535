# SPDX-License-Identifier: Apache-2.0
"""Simulated motions are kept, and a bad cache costs time only."""

import numpy as np
import pytest

from hpccd_ros.scenes import cache, exactmath


class Simulation:
    """Counts how often it is run."""

    def __init__(self):
        self.runs = 0

    def __call__(self):
        self.runs += 1
        return {"x": np.arange(5.0) + self.runs}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "hpccd" / "scenes"


def test_second_call_reads_the_file(folder):
    simulation = Simulation()
    first, second = (cache.cached("test", (1,), [exactmath], simulation)["x"] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert simulation.runs == 1
    assert [f.suffix for f in folder.iterdir()] == [".npz"]


def test_another_key_is_another_entry(folder):
    simulation = Simulation()
    cache.cached("test", (1,), [exactmath], simulation)
    cache.cached("test", (2,), [exactmath], simulation)
    assert simulation.runs == 2 and len(list(folder.iterdir())) == 2


@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 no archive", None])
def test_damaged_file_is_replaced_with_a_warning(folder, damage):
    simulation = Simulation()
    cache.cached("test", (1,), [exactmath], simulation)
    file = next(folder.iterdir())
    file.write_bytes(file.read_bytes()[:-40] if damage is None else damage)
    with pytest.warns(UserWarning, match="damaged scene cache"):
        cache.cached("test", (1,), [exactmath], simulation)
    cache.cached("test", (1,), [exactmath], simulation)
    assert simulation.runs == 2


def test_folder_that_cannot_be_made_costs_a_warning(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.warns(UserWarning, match="scene test is not cached"):
        arrays = cache.cached("test", (1,), [exactmath], Simulation())
    np.testing.assert_array_equal(arrays["x"], np.arange(5.0) + 1)
