# SPDX-License-Identifier: Apache-2.0
"""Run CMake, compilers and built programs in tests of installed packages."""

import os
import subprocess
import sys
from pathlib import Path

# CMake and Ninja lie beside this Python.
ENVIRONMENT = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def run(*command, environment=ENVIRONMENT) -> str:
    """The output; a failure shows it."""
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
