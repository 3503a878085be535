# SPDX-License-Identifier: Apache-2.0
"""Simulated motions are kept as .npz files in the user's cache folder, so that each is computed once."""

from __future__ import annotations

import hashlib
import inspect
import os
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hpccd_core.whole_file import whole_file
from hpccd_ros.scenes import exactmath


def folder() -> Path:
    """$XDG_CACHE_HOME/hpccd/scenes, by default ~/.cache/hpccd/scenes."""
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "hpccd" / "scenes"


def cached(
    name: str, key: tuple, sources: list, simulate: Callable[[], dict[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """Arrays of `simulate()`, from the cache if it was run before with this `key` and these source modules.

    A changed line in one of the modules `sources` makes a new entry. A folder that cannot be written, or a
    damaged file, costs a warning and the time of the simulation, never the scene.
    """
    digest = hashlib.sha256(repr(key).encode())
    for module in [exactmath, *sources]:
        digest.update(inspect.getsource(module).encode())
    path = folder() / f"{name}-{digest.hexdigest()[:16]}.npz"
    if path.exists():
        try:
            with np.load(path, allow_pickle=False) as archive:
                return {k: archive[k] for k in archive.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile, KeyError) as error:
            warnings.warn(f"damaged scene cache {path} ({error}); simulating again", stacklevel=2)
    arrays = simulate()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path, overwrite=True) as draft:  # another process sees the whole file or none
            np.savez(draft, **arrays)
    except OSError as error:
        warnings.warn(f"scene {name} is not cached: {error}", stacklevel=2)
    return arrays
