# SPDX-License-Identifier: Apache-2.0
"""`hpccd view` for Rerun: what its own reader finds in the file is what the replay found."""

import sys

import numpy as np
import pytest

from hpccd_ros.bag.reader import Recording
from hpccd_ros.base.errors import UserError
from hpccd_ros.picture.rerun_recording import need_rerun
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay


def test_missing_rerun_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)  # as if it were not installed
    with pytest.raises(UserError, match=r"needs the Python package rerun .* extra 'rerun'"):
        need_rerun()


def _batches(path):
    """{entity: [record batch]} of an .rrd file."""
    chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed: make venv EXTRAS='test rerun'")
    found = {}
    for part in chunk.RrdReader(path).stream().to_chunks():
        found.setdefault(str(part.entity_path), []).append(part.to_record_batch())
    return found


def _by_step(batches, component):
    """{step: (N,k) array} of the rows that hold `component`."""
    values = {}
    for batch in batches:
        if component in batch.schema.names:
            for step, value in zip(batch.column("step").to_pylist(), batch.column(component).to_pylist(), strict=True):
                if value is not None:
                    assert step not in values, f"two rows of {component} at step {step}"
                    values[step] = np.array(value)
    return values


def test_what_rerun_reads_is_what_was_found(hpccd, small_bag, tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed: make venv EXTRAS='test rerun'")
    done = hpccd("view", small_bag, "--every", "4", "-o", "run.rrd")
    assert done.returncode == 0, done.stderr
    assert "run.rrd: 23 steps" in done.stdout
    entities = _batches(tmp_path / "run.rrd")
    with Recording(small_bag) as recording:
        replay = Replay(recording, recorded_setup.of_recording(recording), outputs=("points", "normals"))
        steps = {step.step: step for number, step in enumerate(replay.steps()) if number % 4 == 0}
    cloth = _by_step(entities["/meshes/cloth"], "Mesh3D:vertex_positions")
    triangles = _by_step(entities["/meshes/cloth"], "Mesh3D:triangle_indices")
    kinds = ("vertex_face", "edge_edge")
    points = {kind: _by_step(entities[f"/contacts/{kind}"], "Points3D:positions") for kind in kinds}
    counts = _by_step(entities["/curves/contacts"], "Scalars:scalars")
    assert set(cloth) == set(counts) == set(steps) and len(triangles) == 1
    for number, step in steps.items():
        assert counts[number][0] == step.total
        found = np.concatenate([points[kind][number].reshape(-1, 3) for kind in kinds])
        assert np.allclose(found, np.asarray(step.contacts.points).reshape(-1, 3), atol=1e-5)
        middle = 0.5 * (step.start_frame.vertices[0].astype(float) + step.end_frame.vertices[0])
        assert np.allclose(cloth[number], middle, atol=1e-5)
    (faces,) = triangles.values()
    assert np.array_equal(faces, steps[1].end_frame.topologies[0].faces)
    assert sum(step.total for step in steps.values()) > 1000


def test_steps_that_are_not_there(hpccd, small_bag):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed: make venv EXTRAS='test rerun'")
    done = hpccd("view", small_bag, "--rerun", "--step", "900", "-o", "x.rrd")
    assert done.returncode == 2 and "no step 900" in done.stderr
    done = hpccd("view", small_bag, "-o", "no/folder/x.rrd")
    assert done.returncode == 2 and "--output no/folder/x.rrd: there is no folder no/folder" in done.stderr
