# SPDX-License-Identifier: Apache-2.0
"""A mesh that keeps its shape: what its motions need to know of it, computed once."""

from dataclasses import dataclass

import numpy as np

from hpccd_core.rigid import rounding


@dataclass(frozen=True, eq=False)
class Body:
    """A mesh that keeps its shape, and bounds on its size.

    Attributes
    ----------
    vertices : ndarray, shape (n, 3), float64
        Positions in the frame of the body.
    radius : float
        Upper bound on the distance of a vertex from the origin of that frame.
    centre : ndarray, shape (3,), float64
    girth : float
        Radius of a ball around `centre` that holds all vertices.
    """

    vertices: np.ndarray
    radius: float
    centre: np.ndarray
    girth: float

    @classmethod
    def of(cls, vertices: np.ndarray) -> "Body":
        """The body with these vertices.

        Parameters
        ----------
        vertices : ndarray, shape (n, 3), float32 or float64
            Positions in the frame of the body; n may be 0.

        Raises
        ------
        ValueError
            If the shape is wrong or a coordinate is not finite.
        """
        exact = np.array(vertices, np.float64)
        if exact.ndim != 2 or exact.shape[1] != 3:
            raise ValueError(f"vertices: expected (n,3), got {exact.shape}")
        if not np.isfinite(exact).all():
            raise ValueError("vertices: coordinates must be finite")
        centre = (exact.min(axis=0) / 2 + exact.max(axis=0) / 2) if len(exact) else np.zeros(3)
        radius = rounding.longest(exact)
        # The difference is rounded where it is much smaller than what it is taken of.
        girth = rounding.up(rounding.longest(exact - centre) + 4 * rounding.U * radius)
        return cls(exact, radius, centre, girth)
