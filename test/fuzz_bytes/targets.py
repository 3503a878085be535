# SPDX-License-Identifier: Apache-2.0
"""The names of all targets, MODULE.TARGET, and the stored inputs of each."""

import importlib
from pathlib import Path

from .target import Target

CORPUS = Path(__file__).with_name("corpus")
MODULES = ("messages", "recordings", "robots", "mesh_files", "sequences", "parameters")


def load(module: str) -> dict[str, Target]:
    """The targets of a module, by their full names."""
    found = importlib.import_module(f"{__package__}.{module}").TARGETS
    return {f"{module}.{name}": target for name, target in found.items()}


def everything() -> dict[str, Target]:
    return {name: target for module in MODULES for name, target in load(module).items()}


def stored(name: str) -> list[Path]:
    """The inputs in the repository, in the order of their names."""
    return sorted(path for path in (CORPUS / name).glob("*") if path.is_file())
