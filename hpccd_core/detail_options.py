# SPDX-License-Identifier: Apache-2.0
"""The option `detail` of a detector: how coarse each mesh may be."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import arguments

_KEYS = ("ratio", "error", "rest_vertices")


@dataclasses.dataclass(frozen=True, eq=False)
class MeshDetail:
    """How coarse one mesh is: a ratio of its faces, or an error in the unit of the coordinates."""

    ratio: float | None
    error: float | None
    rest_vertices: NDArray[np.float64] | None


def of_meshes(detail: object, names: tuple[str, ...], n_vertices: list[int], n_faces: list[int]) -> list[Any]:
    """A MeshDetail, or None, for each mesh of the scene.

    Raises
    ------
    TypeError, ValueError
        If a mesh is unknown or has no faces, or a number is invalid.
    """
    if not isinstance(detail, Mapping):
        _of_mesh("detail", detail, 0)
        detail = {name: detail for name, n in zip(names, n_faces, strict=True) if n}
    numbers = {name: number for number, name in enumerate(names)}
    found: list[MeshDetail | None] = [None] * len(names)
    for key, value in detail.items():
        mesh = arguments.mesh_number("detail", key, numbers)
        name = f"detail[{names[mesh]!r}]"
        if not n_faces[mesh]:
            raise ValueError(f"{name}: the mesh has no faces; leave it out")
        found[mesh] = _of_mesh(name, value, n_vertices[mesh])
    return found


def _of_mesh(name: str, value: object, n_vertices: int) -> MeshDetail:
    given = value if isinstance(value, Mapping) else {"ratio": value}
    for key in given:
        arguments.choice(name, key, _KEYS)
    if ("ratio" in given) == ("error" in given):
        raise ValueError(f"{name}: give either a ratio, as in {{'ratio': 0.1}}, or an error, as in {{'error': 0.002}}")
    rest = given.get("rest_vertices")
    if rest is not None:
        rest = arguments.reals(f"{name}['rest_vertices']", rest)
        if rest.shape != (n_vertices, 3):
            raise ValueError(f"{name}['rest_vertices']: expected shape ({n_vertices}, 3), got {rest.shape}")
        arguments.usable(f"{name}['rest_vertices']", rest)
        rest = rest.copy()
    if "error" in given:
        return MeshDetail(None, arguments.length(f"{name}['error']", given["error"]), rest)
    ratio = arguments.real(f"{name}", given["ratio"])
    if not 0 < ratio <= 1:
        raise ValueError(f"{name}: must be in (0, 1], the part of the faces that stays; got {ratio}")
    return MeshDetail(ratio, None, rest)
