# SPDX-License-Identifier: Apache-2.0
"""Import paths of the package for the tests and the processes that they start."""

import os
from pathlib import Path

import hpccd_ros

SUPPORT = Path(__file__).resolve().parent
ROOT = SUPPORT.parents[1]

# The documentation, but for what docs/generate.py writes.
PAGES = sorted(
    page
    for pattern in ("*.md", "bags/*.md", "hpccd_core/*.md", "docs/**/*.md")
    for page in ROOT.glob(pattern)
    if page.parent.name != "generated"
)

# PYTHONPATH of processes: the package from where the tests import it, and the rest from where this process finds it:
# the messages of a colcon workspace lie on PYTHONPATH.
SOURCES = os.pathsep.join([str(Path(hpccd_ros.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
