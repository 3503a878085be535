# SPDX-License-Identifier: Apache-2.0
"""How a recording names the mesh files that it carries along."""

from pathlib import Path


def attachment_name(mesh: str, path: str) -> str:
    """Name of the attachment with the file `path` of a mesh; its suffix tells the format."""
    return f"mesh/{mesh}/{Path(path).name}"
