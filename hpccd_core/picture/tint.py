# SPDX-License-Identifier: Apache-2.0
"""Surfaces around contacts are tinted in the colour of the time of impact, so that contacts between layers show on the
outside of the layers."""

import numpy as np

# Beyond this distance from a contact nothing is tinted: a part of the scene's largest extent, whatever the size of the
# faces.
RADIUS = 0.025
# Cells of the grid per radius; and the largest share of the tint in a colour.
CELLS = 5
STRENGTH = 0.6


class Tint:
    """places: (N,3) of contacts; colours: (N,3) of their times, linear RGB; vertices: (V,3) of all surfaces."""

    def __init__(self, places: np.ndarray, colours: np.ndarray, vertices: np.ndarray):
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        radius = RADIUS * float((high - low).max())
        # In a fast step, contacts may lie far from where the surfaces are drawn.
        near = ((places >= low - radius) & (places <= high + radius)).all(axis=1)
        places, colours = places[near], colours[near]
        self._any = len(places) > 0 and radius > 0
        if not self._any:
            return
        self._cell = radius / CELLS
        self._low = places.min(axis=0) - CELLS * self._cell
        self._shape = np.ceil(np.ptp(places, axis=0) / self._cell).astype(int) + 2 * CELLS + 2
        # Offset zero, as an index behind the first cell.
        centre = np.ravel_multi_index((CELLS, CELLS, CELLS), self._shape)
        at = np.rint((places - self._low) / self._cell).astype(int)
        cells, number = np.unique(np.ravel_multi_index(tuple(at.T), self._shape), return_inverse=True)
        values = np.stack([np.bincount(number, v) for v in (*colours.T, np.ones(len(places)))], axis=1)
        grid = np.zeros((int(np.prod(self._shape)), 4), np.float32)
        for offset, part in _kernel():
            grid[cells + np.ravel_multi_index(tuple(CELLS + offset), self._shape) - centre] += part * values
        # A single contact has weight 0.8 where it is; many have nearly 1.
        density = grid[:, 3]
        weight = 1.0 - np.exp(-1.6 * density)
        grid[:, :3] *= (weight / np.maximum(density, np.float32(1e-9)))[:, None]
        grid[:, 3] = weight
        self._grid = grid

    def applied(self, places: np.ndarray, own: np.ndarray) -> np.ndarray:
        """The colours `own` (N,3), linear RGB, of surfaces at `places` (N,3), tinted."""
        if not self._any:
            return own
        at = (places - self._low) / self._cell
        near = np.flatnonzero((at >= 0).all(axis=1) & (at < self._shape - 1).all(axis=1))
        at = at[near]
        corner = at.astype(int)
        part = (at - corner).astype(np.float32)
        found = np.zeros((len(near), 4), np.float32)
        for offset in np.ndindex(2, 2, 2):
            share = np.prod(np.where(offset, part, 1 - part), axis=1)
            found += share[:, None] * self._grid[np.ravel_multi_index(tuple((corner + offset).T), self._shape)]
        tinted = np.array(own, dtype=np.result_type(own, np.float32))
        tinted[near] = (1 - STRENGTH * found[:, 3:]) * tinted[near] + STRENGTH * found[:, :3]
        return tinted


def _kernel():
    """(offset (3,), part) of the cells around a contact. A place is up to one cell from those that it is interpolated
    from, and a contact up to 0.87 from the middle of its cell: with both, nothing is tinted beyond the radius."""
    reach = CELLS - 1.87
    offsets = np.array(list(np.ndindex(*3 * (2 * CELLS + 1,)))) - CELLS
    away = np.linalg.norm(offsets, axis=1) / reach
    return [(offset, np.float32((1 - far**2) ** 2)) for offset, far in zip(offsets, away, strict=True) if far < 1]
