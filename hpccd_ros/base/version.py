# SPDX-License-Identifier: Apache-2.0
"""The version of the installed package, from pyproject.toml."""

import functools
from importlib.metadata import PackageNotFoundError, version


@functools.cache  # asked for each file of a recording; the distribution's metadata take 2 ms to be read
def package_version() -> str:
    """Version of the installed distribution, or "not installed" if the code runs from a checkout."""
    try:
        return version("hpccd")
    except PackageNotFoundError:
        return "not installed"
