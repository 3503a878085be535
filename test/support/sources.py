# SPDX-License-Identifier: Apache-2.0
"""Where the tests and the processes that they start find the package."""

import os
from pathlib import Path

import hpccd_ros

SUPPORT = Path(__file__).resolve().parent
ROOT = SUPPORT.parents[1]

# PYTHONPATH of processes: the package from where the tests import it, and the rest from where this process finds it:
# the messages of a colcon workspace lie on PYTHONPATH.
SOURCES = os.pathsep.join([str(Path(hpccd_ros.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
