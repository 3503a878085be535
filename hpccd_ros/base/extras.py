# SPDX-License-Identifier: Apache-2.0
"""Optional dependencies: if one is missing, the error names the extra that contains it."""

import importlib

from hpccd_ros.base.errors import UserError


def require(module: str, extra: str, purpose: str):
    """Import `module`. Raises UserError with the remedy if it is not installed."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise UserError(
            f"{purpose} needs the Python package {module.partition('.')[0]} ({error}): it comes with the extra "
            f"{extra!r}: pip install '.[{extra}]', or in the checkout make venv EXTRAS='test lint interop {extra}'"
        ) from error
