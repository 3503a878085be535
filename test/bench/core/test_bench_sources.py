# SPDX-License-Identifier: Apache-2.0
"""What benchmarks are given to measure."""

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_ros.bench import sources


def _write(path):
    path.parent.mkdir()
    x = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)
    np.savez(path, vertices_t0=x, vertices_t1=x + 1, faces=np.array([[0, 1, 2]]))
    return str(path)


def test_files_of_one_name_are_told_apart(tmp_path):
    """Results are kept by name: of two the second would count for nothing."""
    here, there = (_write(tmp_path / folder / "run.npz") for folder in ("a", "b"))
    names = [source.name for source in sources.resolve([here, there, "folding-strip"], None, ())]
    assert names == [str(tmp_path / "a" / "run"), str(tmp_path / "b" / "run"), "folding-strip"]
    assert [source.name for source in sources.resolve([here], None, ())] == ["run"]


def test_no_backend_that_works_is_said(bench, capsys):
    if "gpu" in hc.backends():
        pytest.skip("a GPU works here")
    assert bench("accuracy", "folding-strip", "--size", "0.1", "--backend", "gpu", "--sweep-queries", "0")[0] == 2
    assert "--backend gpu: none of these works here" in capsys.readouterr().err
