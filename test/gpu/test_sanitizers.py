# SPDX-License-Identifier: Apache-2.0
"""compute-sanitizer finds no bad or uninitialized memory accesses, no races and no wrong barriers in the kernels."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import hpccd_core as hc


@pytest.mark.parametrize("tool", ("memcheck", "racecheck", "initcheck", "synccheck"))
def test_clean(tool):
    program = shutil.which("compute-sanitizer") or shutil.which("compute-sanitizer", path="/usr/local/cuda/bin")
    if not program:
        pytest.skip("compute-sanitizer is not installed: it comes with the CUDA toolkit")
    folder = Path(hc.__file__).resolve().parents[1]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    frames = Path(__file__).with_name("sanitized.py")
    result = subprocess.run(
        [program, "--tool", tool, "--error-exitcode", "9", sys.executable, str(frames)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=500,
        check=False,
    )
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-2000:]
