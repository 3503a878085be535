# SPDX-License-Identifier: Apache-2.0
"""Run CMake, compilers and what they made, in tests of packages that are built and installed."""

import os
import subprocess
import sys
from pathlib import Path

# CMake and Ninja lie beside this Python.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def run(*command, environment=ENVIRONMENT) -> str:
    """What it printed; a failure shows it."""
    done = subprocess.run(
        [str(part) for part in command],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=500,
        env=environment,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout
