# SPDX-License-Identifier: Apache-2.0
"""Lets a source checkout find the extension modules that were built and installed elsewhere.

With the checkout as current folder, Python finds this folder before the installed package, but the compiled
modules lie only in the latter. Their folder is appended to the package's search path.
"""

import importlib.util
import sys
from pathlib import Path

import hpccd_core


def _compiled_folder() -> Path:
    own = Path(__file__).resolve().parent
    for folder in [own, *(Path(entry or ".").resolve() / "hpccd_core" for entry in sys.path)]:
        if any(folder.glob("_core.*.so")):
            return folder
    raise ImportError(
        "hpccd_core: the compiled module _core is not installed for this Python "
        f"({sys.executable}); run `make venv` in the checkout, `pip install .`, or `pip install ./hpccd_core` (the "
        "core alone, Python 3.10 to 3.13), and use that environment"
    )


if importlib.util.find_spec("hpccd_core._core") is None:
    hpccd_core.__path__.append(str(_compiled_folder()))
