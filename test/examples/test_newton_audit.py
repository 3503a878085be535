# SPDX-License-Identifier: Apache-2.0
"""examples/newton_audit.py as its users run it, and its rational arithmetic."""

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

pytest.importorskip("newton", reason="Newton comes with the extra newton")
sys.path.insert(0, str(ROOT / "examples"))

import newton_audit as audit


def run(folder, *words):
    environment = {**os.environ, "PYTHONPATH": SOURCES, "MPLBACKEND": "Agg"}
    program = ROOT / "examples" / "newton_audit.py"
    return subprocess.run(
        [sys.executable, program, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


def test_every_disagreement_is_decided_for_hpccd(tmp_path):
    done = run(tmp_path, "fine", "pile", "--json", "audit.json", "--png", "audit.png")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = json.loads((tmp_path / "audit.json").read_text())
    assert [(row["scene"], row["kind"]) for row in rows] == list(itertools.product(("fine", "pile"), audit.KINDS))
    for row in rows:
        assert row["hpccd_wrong"] == 0 and row["hpccd"] > 1000
        assert row["hpccd"] == row["newton"] + row["missed_by_newton"] + row["at_radius"] - row["only_newton"]
        assert row["scene"] in done.stdout
    assert all(row["buffer_full"] > 0 for row in rows[2:]), "more than 32 and 64 pairs of one vertex and one edge"
    red, green, blue, *_ = imread(tmp_path / "audit.png").transpose(2, 0, 1)
    assert ((red > 0.8) & (green < 0.3) & (blue < 0.3)).sum() > 200, "the missed pairs"


def test_unknown_scenes_are_rejected(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["newton_audit.py", "flat"])
    with pytest.raises(SystemExit, match="2"):
        audit.main()
    assert "SCENE: 'flat' is not known; use some of folded, fine, pile, level" in capsys.readouterr().err


def test_rational_distances():
    """Against distances of many points of both features: never larger, and hardly smaller."""
    rng = np.random.default_rng(46)
    ticks = np.linspace(0, 1, 61)
    s, t = np.meshgrid(ticks, ticks)
    corner = np.stack([s * (1 - t), s * t, 1 - s], axis=-1).reshape(-1, 3)
    for _ in range(30):
        x = rng.integers(-8, 9, (4, 3)) / 8
        exact = [[Fraction(c) for c in row] for row in x.tolist()]
        face = np.linalg.norm(x[0] - corner @ x[1:], axis=1).min()
        a, b = x[0] + ticks[:, None] * (x[1] - x[0]), x[2] + ticks[:, None] * (x[3] - x[2])
        edges = np.linalg.norm(a[:, None] - b[None], axis=2).min()
        for sampled, found in ((face, audit.point_triangle(*exact)), (edges, audit.segment_segment(*exact))):
            assert np.sqrt(float(found)) <= sampled + 1e-12 and sampled**2 - float(found) < 0.02


def test_pairs_of_hpccd_are_all_pairs():
    """Against rational arithmetic on each pair of a small scene."""
    scene = audit.Scene(*audit.folded(4, 2, edge=0.02, gap=0.006, tilt=0.2), radius=float(np.float32(0.013)))
    model = scene.model()
    vertex_triangle, edge_edge = audit.pairs_of_hpccd(model, scene.radius)
    faces = [set(face) for face in scene.faces.tolist()]
    edges = sorted({tuple(sorted(pair)) for face in faces for pair in itertools.combinations(face, 2)})
    joined = {(v, v) for v in range(len(scene.vertices))} | set(edges) | {(b, a) for a, b in edges}
    apart = lambda a, b: not any((v, w) in joined for v in a for w in b)  # noqa: E731
    expected = {
        (v, k)
        for v, (k, face) in itertools.product(range(len(scene.vertices)), enumerate(faces))
        if apart([v], face) and audit.beyond_radius(scene, "vertex-triangle", (v, k)) <= 0
    }
    assert vertex_triangle == expected and len(expected) > 50
    expected = {
        (*a, *b)
        for a, b in itertools.combinations(edges, 2)
        if apart(a, b) and audit.beyond_radius(scene, "edge-edge", (*a, *b)) <= 0
    }
    assert edge_edge == expected and len(expected) > 100
