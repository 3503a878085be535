# SPDX-License-Identifier: Apache-2.0
"""examples/mujoco_audit.py as its users run it, its rational arithmetic, and that it sees mistakes."""

import itertools
import json
import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from matplotlib.image import imread
from sources import ROOT, SOURCES

mujoco = pytest.importorskip("mujoco", reason="MuJoCo comes with the extra mujoco")
sys.path.insert(0, str(ROOT / "examples"))

import mujoco_audit  # noqa: E402

MODELS = ROOT / "examples" / "mujoco"


def run(folder, *words):
    program, environment = ROOT / "examples" / "mujoco_audit.py", {**os.environ, "PYTHONPATH": SOURCES}
    return subprocess.run(
        [sys.executable, program, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


def models(*names):
    return [word for name in names for word in ("--model", MODELS / f"{name}.xml")]


def test_every_disagreement_is_decided_for_hpccd(tmp_path):
    done = run(tmp_path, *models("mattress", "rope"), "--steps", "200", "--json", "a.json", "--png", "a.png")
    assert done.returncode == 0, done.stdout + done.stderr
    mattress, rope = json.loads((tmp_path / "a.json").read_text())["models"]
    for row in mattress, rope:
        assert row["hpccd"] >= row["both"] > 10 and row["decided"] == row["for hpccd"] > 0
        differ = ("dropped at the cap", "left out", "only MuJoCo")
        assert row["decided"] == sum(row[column] for column in (*differ, "passed through", "touched and left"))
        assert row["hpccd"] == row["both"] + row["dropped at the cap"] + row["left out"]
    assert mattress["dropped at the cap"] > 100 and rope["passed through"] > 3
    red, green, blue, *_ = imread(tmp_path / "a.png").transpose(2, 0, 1)
    assert ((red > 0.7) & (green < 0.45) & (blue > 0.5)).sum() > 20, "points of contacts late in the step"


def test_balls_pass_through_cloth(tmp_path):
    done = run(tmp_path, *models("cloth"), "--steps", "45", "--json", "a.json")
    (row,) = json.loads((tmp_path / "a.json").read_text())["models"]
    assert done.returncode == 0 and row["passed through"] > 20 and row["decided"] == row["for hpccd"]


def test_self_contacts_are_compared(tmp_path):
    done = run(tmp_path, *models("fold"), "--steps", "90", "--json", "a.json")
    (row,) = json.loads((tmp_path / "a.json").read_text())["models"]
    assert done.returncode == 0 and row["both"] > 3000 and row["decided"] == row["for hpccd"]


def test_a_model_with_a_robot_is_left_out_without_one(tmp_path):
    robot = tmp_path / "stick.xml"
    robot.write_text(
        '<mujoco><worldbody><body pos="-.08 .2 .7"> <joint name="turn" axis="0 0 1"/>'
        '<geom type="capsule" size=".05 .2" euler="90 0 0"/> </body></worldbody>'
        '<actuator> <position joint="turn" kp="1"/> </actuator></mujoco>'
    )
    done = run(tmp_path, *models("drape"), "--robot", robot, "--steps", "60", "--json", "a.json")
    (row,) = json.loads((tmp_path / "a.json").read_text())["models"]
    assert done.returncode == 0 and row["both"] > 100 and row["decided"] == row["for hpccd"]
    without = mujoco_audit.loaded(MODELS / "drape.xml", None)
    assert without is None


def test_a_model_that_cannot_be_loaded_is_named(tmp_path):
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><geom/></worldbody></mujoco>")
    for name, reason in ("bad.xml", "size 0 must be positive"), ("none.xml", "none.xml"):
        done = run(tmp_path, "--model", name)
        assert done.returncode == 2 and "Traceback" not in done.stderr
        assert f"{name}: MuJoCo {mujoco.__version__} cannot load it: " in done.stderr and reason in done.stderr


def fallen(steps):
    audit = mujoco_audit.Audit("mattress", mujoco.MjModel.from_xml_path(str(MODELS / "mattress.xml")))
    for _ in range(steps):
        audit.step()
    assert audit.counts["decided"] == audit.counts["for hpccd"]
    return audit


def test_a_missed_contact_is_seen(monkeypatch):
    audit = fallen(155)
    pairs_at = audit.pairs_at
    monkeypatch.setattr(audit, "pairs_at", lambda vertices: dict(list(pairs_at(vertices).items())[::2]))
    audit.step()
    assert audit.counts["decided"] - audit.counts["for hpccd"] > 5


def test_a_contact_too_many_is_seen(monkeypatch):
    audit = fallen(155)
    pairs_at, (flex, *_), (plane, *_) = audit.pairs_at, audit.elements, audit.planes
    top = int(np.argmax(audit.before[: len(flex), 2]))
    spurious = {frozenset({("geom", 0, -1), ("vert", 0, top)}): ((top,), plane, 0.005)}
    monkeypatch.setattr(audit, "pairs_at", lambda vertices: pairs_at(vertices) | spurious)
    audit.step()
    assert audit.counts["decided"] - audit.counts["for hpccd"] == 1


def sampled_distance(p, q):
    """Of points on a grid over both simplices."""
    ticks = np.linspace(0, 1, 41)
    s, t = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    weights = {1: [[1.0]], 2: np.stack([1 - ticks, ticks], 1), 3: np.stack([1 - s, s * (1 - t), s * t], 1)}
    points = [np.asarray(weights[len(x)]) @ np.array(x, float) for x in (p, q)]
    return min(np.linalg.norm(points[0] - point, axis=1).min() for point in points[1])


@pytest.mark.parametrize("sizes", list(itertools.combinations_with_replacement((1, 2, 3), 2)))
def test_rational_distances(sizes):
    random = np.random.default_rng(sum(sizes))
    for _ in range(12):
        p, q = (
            tuple(tuple(Fraction(int(c), 4) for c in point) for point in random.integers(-8, 9, (n, 3))) for n in sizes
        )
        distance = float(mujoco_audit.squared_distance(p, q)) ** 0.5
        assert distance - 1e-12 <= sampled_distance(p, q) <= distance + 0.1
        assert mujoco_audit.squared_distance(q, p) == mujoco_audit.squared_distance(p, q)


def test_crossing_and_parallel_features():
    corners = tuple(map(tuple, np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]]) * Fraction(1)))
    through = tuple(map(tuple, np.array([[1, 1, -1], [1, 1, 2]]) * Fraction(1)))
    above = tuple(map(tuple, np.array([[-1, 1, 3], [9, 1, 3]]) * Fraction(1)))
    assert mujoco_audit.squared_distance(corners, through) == 0
    assert mujoco_audit.squared_distance(corners, above) == 9
    assert mujoco_audit.squared_distance(above, above[::-1]) == 0
