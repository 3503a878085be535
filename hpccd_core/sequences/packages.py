# SPDX-License-Identifier: Apache-2.0
"""Import packages that only some formats need."""

import importlib
from pathlib import Path
from typing import Any

from .sequence import SequenceError


def needed(module: str, package: str, path: Path) -> Any:
    """The module.

    Raises
    ------
    SequenceError
        Its package is not installed.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError:
        raise SequenceError(
            f"{path}: reading it needs the Python package {package}; pip install {package} (it is part of the extra "
            "'check': pip install 'hpccd-core[check]')"
        ) from None
