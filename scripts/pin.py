# SPDX-License-Identifier: Apache-2.0
"""Print the exact versions installed in this environment as a pip constraints file.

Reads *.dist-info only: the ROS wheels also contain *.egg-info folders, and `pip freeze` lists those under names that do
not exist on the package index.
"""

import platform
import sysconfig
from importlib.metadata import Distribution
from pathlib import Path

NOT_PINNED = {"hpccd", "pip"}


def pins(site_packages: Path) -> list[str]:
    """Return `name==version` lines, sorted, for each *.dist-info folder in `site_packages`."""
    found = {}
    for folder in site_packages.glob("*.dist-info"):
        metadata = Distribution.at(folder).metadata
        found[metadata["Name"].lower().replace("_", "-")] = f"{metadata['Name']}=={metadata['Version']}"
    return [line for name, line in sorted(found.items()) if name not in NOT_PINNED]


def main() -> None:
    print(f"# Python {platform.python_version()}, {platform.machine()}; written by scripts/pin.py")
    print("\n".join(pins(Path(sysconfig.get_path("purelib")))))


if __name__ == "__main__":
    main()
