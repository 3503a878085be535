# SPDX-License-Identifier: Apache-2.0
"""The mesh files that a recording carries along: without them a replay elsewhere could not rebuild its scene."""

from pathlib import Path

from hpccd_ros.frames.mesh_file import MeshFileError
from hpccd_ros.middleware.resources import local_path


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
            found.append((attachment_name(mesh, path), Path(local_path(path)).expanduser().read_bytes()))
        except (OSError, MeshFileError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            missing.append(f"mesh file {path} is not in the recording ({why}): a replay will need it at that place")
    return found, missing
