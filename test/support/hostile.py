# SPDX-License-Identifier: Apache-2.0
"""Hostile recordings: files with valid checksums and content that no recorder writes."""

import hostile_container  # noqa: F401
import hostile_mesh_files  # noqa: F401
import hostile_messages  # noqa: F401
import hostile_setup  # noqa: F401
import hostile_types  # noqa: F401
from hostile_kinds import KINDS


def make(name, rng, base) -> bytes:
    """The file of one hostile recording."""
    bag = base.copy()
    bag.compression = rng.choice(("", "", "lz4", "zstd"))
    bag.check_sums = rng.random() < 0.8
    KINDS[name](rng, bag)
    return bag.bytes()
