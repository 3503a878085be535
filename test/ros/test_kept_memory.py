# SPDX-License-Identifier: Apache-2.0
"""Memory of large messages is kept between them: fresh pages cost more than the copy of a message."""

import os
import subprocess
import sys
from pathlib import Path

import hpccd_ros

MEGABYTES, ROUNDS = 8, 50
FAULTS = f"""
import resource
from hpccd_ros import _env
_env.prepare()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
bytearray({MEGABYTES} << 20)
before = faults()
for _ in range({ROUNDS}):
    bytearray({MEGABYTES} << 20)
print((faults() - before) / {ROUNDS})
"""


def faults_per_message(**environment):
    """Page faults of a buffer of 8 MB that is taken and given back."""
    root = Path(hpccd_ros.__file__).resolve().parents[1]
    env = {key: value for key, value in os.environ.items() if not key.startswith("MALLOC_")}
    command = [sys.executable, "-c", FAULTS]
    done = subprocess.run(command, env=env | environment, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return float(done.stdout)


def test_freed_memory_is_kept():
    assert faults_per_message() < 100, "2048 pages of 4 KB in each message"


def test_a_threshold_of_the_user_wins():
    own = {"MALLOC_MMAP_THRESHOLD_": "131072", "MALLOC_TRIM_THRESHOLD_": "131072", "MALLOC_TOP_PAD_": "0"}
    assert faults_per_message(**own) > 1000
