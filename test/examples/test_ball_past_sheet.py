# SPDX-License-Identifier: Apache-2.0
"""examples/ball_past_sheet.py as its users run it."""

import os
import re
import subprocess
import sys

import pytest
from sources import ROOT, SOURCES


def test_the_ball_just_misses_the_sheet(tmp_path):
    pytest.importorskip("torch", reason="PyTorch comes with the extra torch")
    program = ROOT / "examples" / "ball_past_sheet.py"
    environment = {**os.environ, "PYTHONPATH": SOURCES}
    done = subprocess.run(
        [sys.executable, program], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    impacts = [float(time) for time in re.findall(r"first impact at ([\d.]+)", done.stdout)]
    assert len(impacts) >= 2 and impacts == sorted(impacts), "each step makes the impact later"
    assert 0 < float(re.search(r"missed by ([\d.]+)", done.stdout)[1]) < 0.01, done.stdout
