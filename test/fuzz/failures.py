# SPDX-License-Identifier: Apache-2.0
"""A file of queries that violated a guarantee, to run them again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .differential import Tallies
from .questions import Batch


def save_failing(path: Path, tallies: Tallies) -> bool:
    """Write the queries; returns whether there are any. Keys: question|accuracy|kind, and the same with |distances."""
    arrays = {}
    for key, tally in tallies.items():
        if tally.failing:
            arrays["|".join(key)] = np.concatenate([batch.queries for batch in tally.failing])
            arrays["|".join((*key, "distances"))] = np.concatenate([batch.distances for batch in tally.failing])
    if arrays:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, **arrays)
    return bool(arrays)


def load_batches(path: Path) -> Iterator[Batch]:
    with np.load(path) as file:
        for key in file.files:
            if not key.endswith("|distances"):
                question, _, kind = key.split("|")
                yield Batch(question, kind, key, file[key], file[key + "|distances"])
