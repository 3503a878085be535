# SPDX-License-Identifier: Apache-2.0
"""The package comes with two distributions: hpccd-core (the core alone) and hpccd (with the ROS node).

If both are installed into one folder, the later one has overwritten the other; with two folders, the order of Python's
path decides which one is imported. Both deserve a warning.
"""

import sys
import warnings
from pathlib import Path

REMEDY = "Remedy: keep one of them; pip uninstall hpccd-core hpccd, then install the one you want"


def folders() -> list[Path]:
    """The folders on Python's path that hold a compiled hpccd_core; the first one is imported.

    A build folder does not count, because it holds no package: colcon puts it on the path of its tests.
    """
    found = [Path(entry or ".").resolve() / "hpccd_core" for entry in sys.path]
    return [folder for folder in dict.fromkeys(found) if is_whole(folder)]


def is_whole(folder: Path) -> bool:
    return (folder / "__init__.py").is_file() and any(folder.glob("_core.*.so"))


def distributions() -> list[str]:
    """Which of hpccd-core and hpccd are installed, with version and folder. Only their file names are read: reading
    importlib.metadata would take longer than importing this package."""
    return [
        f"{info.name.removesuffix('.dist-info')} in {folder.parent}"
        for folder in folders()
        for name in ("hpccd_core", "hpccd")
        for info in sorted(folder.parent.glob(f"{name}-*.dist-info"))
    ]


def warn_of_several() -> None:
    """Issue a RuntimeWarning if more than one is installed."""
    names = distributions()
    places = folders()
    if len(names) > 1:
        warnings.warn(f"hpccd_core is installed more than once: {', '.join(names)}. {REMEDY}", RuntimeWarning, 3)
    elif len(places) > 1:
        found = ", ".join(map(str, places))
        text = f"hpccd_core is installed more than once: {found}; the first is used. {REMEDY}"
        warnings.warn(text, RuntimeWarning, 3)
