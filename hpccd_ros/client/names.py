# SPDX-License-Identifier: Apache-2.0
"""Names of meshes, and of robots, whose links are the meshes ROBOT/LINK."""

from collections.abc import Iterable

from hpccd_core.arguments import did_you_mean


def belongs(mesh: str, name: str) -> bool:
    """Whether the mesh has this name, or is a link of the robot of this name."""
    return mesh == name or mesh.startswith(f"{name}/")


def check(argument: str, name: str, meshes: Iterable[str]) -> None:
    """Raises TypeError for what is no string, ValueError where no mesh and no robot has this name."""
    if not isinstance(name, str):
        raise TypeError(f"{argument}: expected a string, the name of a mesh or a robot, got {type(name).__name__}")
    there = list(dict.fromkeys(meshes))
    if not any(belongs(mesh, name) for mesh in there):
        known = [*there, *(mesh.partition("/")[0] for mesh in there)]
        listed = ", ".join(there) or "none"
        raise ValueError(f"{argument}: no mesh is named {name!r}; there are {listed}{did_you_mean(name, known)}")
