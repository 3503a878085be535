# SPDX-License-Identifier: Apache-2.0
"""examples/untangle.py as its users run it."""

import os
import re
import subprocess
import sys

import pytest
from matplotlib.image import imread
from sources import ROOT, SOURCES


def run(folder, *words):
    program = ROOT / "examples" / "untangle.py"
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    return subprocess.run(
        [sys.executable, program, *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )


@pytest.mark.parametrize(("scene", "most"), [("cloth", 200), ("sleeve", 400)])
def test_cloth_is_untangled(tmp_path, scene, most):
    done = run(tmp_path, scene)
    assert done.returncode == 0, done.stdout + done.stderr
    found = re.search(rf"{scene}: (\d+) intersections, none left after (\d+) iterations", done.stdout)
    assert int(found[1]) > 50 and int(found[2]) < most
    lengths = [float(length) for length in re.findall(r"length ([\d.]+)", done.stdout)]
    assert lengths == sorted(lengths, reverse=True)


def test_it_says_where_it_fails(tmp_path):
    done = run(tmp_path, "speared", "cloth", "--iterations", "3", "--picture")
    assert done.returncode == 1 and "not untangled: speared, cloth" in done.stderr
    assert re.search(r"speared: still \d+ intersections of 104 after 3 iterations", done.stdout)
    for scene in ("speared", "cloth"):
        red, green, blue, *_ = imread(tmp_path / f"{scene}.png").transpose(2, 0, 1)
        assert ((red > 0.7) & (green < 0.5) & (blue < 0.45)).sum() > 100, "the curves"
