# SPDX-License-Identifier: Apache-2.0
"""Optional dependencies: an error that names the extra of the package where one is missing."""

import importlib

from hpccd_ros.base.errors import UserError


def require(module: str, extra: str, purpose: str):
    """The imported `module`. Raises UserError where it is not installed, with what brings it."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise UserError(
            f"{purpose} needs the Python package {module.partition('.')[0]} ({error}): it comes with the extra "
            f"{extra!r}: pip install '.[{extra}]', or in the checkout make venv EXTRAS='test lint interop {extra}'"
        ) from error
