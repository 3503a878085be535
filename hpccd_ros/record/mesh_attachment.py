# SPDX-License-Identifier: Apache-2.0
"""The mesh files that a recording carries along: without them a replay elsewhere could not rebuild its scene."""

from pathlib import Path


def attachment_name(mesh: str, path: str) -> str:
    """Name of the attachment with the file `path` of a mesh; its suffix tells the format."""
    return f"mesh/{mesh}/{Path(path).name}"


def mesh_files(parameters: dict) -> tuple[list[tuple[str, bytes]], list[str]]:
    """([(attachment name, content)] of the files that the node's parameters name, [what could not be read])."""
    found, missing = [], []
    for mesh in parameters["meshes"] or []:  # None: never set
        path = parameters.get(f"mesh.{mesh}.file")
        if not path:
            continue
        try:
            found.append((attachment_name(mesh, path), Path(path).expanduser().read_bytes()))
        except OSError as error:
            missing.append(
                f"mesh file {path} is not in the recording ({error.strerror}): a replay will need it at that place"
            )
    return found, missing
