# SPDX-License-Identifier: Apache-2.0
"""A motion without contacts, made of a given one."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .worlds import ComparedByRows


@dataclasses.dataclass(frozen=True, eq=False)
class CollisionFreeMotion(ComparedByRows):
    """How much of its own motion each vertex keeps, so that nothing touches.

    :meth:`Detector.collision_free_motion` returns it.

    Attributes
    ----------
    vertices : ndarray, shape (V, 3) or (W, V, 3)
        Positions at the end, in the common dtype of both ends. The straight motion to exactly these numbers has no
        contact, except between vertices in `stuck`. A factor of 1 gives the given end itself.
    factors : ndarray, shape (V,) or (W, V), float64
        How much of its own motion each vertex keeps, in [0, 1]. Take the positions from `vertices`: start + factors
        * displacement rounds differently, and has not been tested.
    stuck : ndarray, shape (K,), uint32
        Vertices of pairs in contact at t = 0; their factor is 0. With worlds: indices into ``factors.ravel()``.
    """

    vertices: NDArray[Any]
    factors: NDArray[np.float64]
    stuck: NDArray[np.uint32]

    def __repr__(self) -> str:
        mean = f"{self.factors.mean():.6g}" if self.factors.size else "none"
        return f"CollisionFreeMotion({self.factors.size} vertices, mean factor {mean}, {len(self.stuck)} stuck)"
