# SPDX-License-Identifier: Apache-2.0
"""Which flexes and geoms MuJoCo tests against each other, and at which distance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

#: "flex" or "geom", and its number in the model.
Part = tuple[str, int]


def ignored_pairs(model: Any, parts: Sequence[Part]) -> Iterator[tuple[int, int]]:
    """Pairs of different parts, as numbers in `parts`, that MuJoCo never tests."""
    type_, affinity = (_of_parts(model, parts, name) for name in ("contype", "conaffinity"))
    tested = (type_[:, None] & affinity) != 0
    tested |= tested.T
    tested &= ~_filtered(model, parts)
    number = {part: k for k, part in enumerate(parts)}
    for pair in _predefined(model):
        if pair[0] in number and pair[1] in number:
            a, b = number[pair[0]], number[pair[1]]
            tested[a, b] = tested[b, a] = True
    yield from zip(*(k.tolist() for k in np.nonzero(np.triu(~tested, 1))), strict=True)


def margins(model: Any, parts: Sequence[Part]) -> Iterator[tuple[int, int, float]]:
    """Pairs of different parts whose contacts begin at a distance that is not 0, and that distance."""
    each = _of_parts(model, parts, "margin")
    both = each[:, None] + each
    number = {part: k for k, part in enumerate(parts)}
    for k, (a, b) in enumerate(_predefined(model)):
        if a in number and b in number:
            both[number[a], number[b]] = both[number[b], number[a]] = model.pair_margin[k]
    for a, b in zip(*(k.tolist() for k in np.nonzero(np.triu(both > 0.0, 1))), strict=True):
        yield a, b, float(both[a, b])


def _predefined(model: Any) -> list[tuple[Part, Part]]:
    pairs = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
    return [(("geom", a), ("geom", b)) for a, b in pairs]


def _of_parts(model: Any, parts: Sequence[Part], name: str) -> NDArray[Any]:
    return np.array([getattr(model, f"{kind}_{name}")[number] for kind, number in parts])


def _filtered(model: Any, parts: Sequence[Part]) -> NDArray[np.bool_]:
    """(K, K): pairs of geoms that MuJoCo leaves out because of their bodies or their types."""
    geoms = np.array([number if kind == "geom" else -1 for kind, number in parts])
    of_geoms = geoms >= 0
    if not of_geoms.any():
        return np.zeros((len(parts), len(parts)), bool)
    body = model.geom_bodyid[geoms]
    weld = model.body_weldid[body]
    parent = model.body_weldid[model.body_parentid[weld]]
    still = model.body_dofnum[weld] == 0
    out = (weld[:, None] == weld) | (still[:, None] & still)
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT:
        child = (weld[:, None] == parent) & (weld[:, None] != 0) & (weld != 0)
        out |= child | child.T
    low, high = np.minimum(body[:, None], body), np.maximum(body[:, None], body)
    out |= np.isin((low << 16) + high, model.exclude_signature)
    flat = np.isin(model.geom_type[geoms], [int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)])
    out |= flat[:, None] & flat
    filtered: NDArray[np.bool_] = out & of_geoms[:, None] & of_geoms
    return filtered
