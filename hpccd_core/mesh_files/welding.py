# SPDX-License-Identifier: Apache-2.0
"""Join vertices at equal or nearly equal positions."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from .. import _core, arguments
from ..array_types import ArrayLike

_PAIRS_AT_ONCE = 1 << 20  # candidates held in memory
_LEAF = 8  # most points of a leaf
_NODES_AT_ONCE = _PAIRS_AT_ONCE // _LEAF**2
_DENSE = 16  # candidates per point from which cells are joined first
_ODD = tuple(np.uint64(number) for number in (0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9))


def weld(
    vertices: ArrayLike, faces: ArrayLike, distance: SupportsFloat = 0.0
) -> tuple[NDArray[Any], NDArray[np.uint32], NDArray[np.intp]]:
    """Join doubled vertices, so that faces that only touch at a seam share its vertices.

    Parameters
    ----------
    vertices : ArrayLike, shape (V, 3), float32 or float64
        Positions of the mesh at rest.
    faces : ArrayLike, shape (F, 3), integers
        As for :meth:`Scene.add_mesh`.
    distance : float, default 0
        Vertices at most this far apart become one, in the unit of the coordinates. The decision is exact; 0 joins equal
        positions. Keep it well below the shortest edge.

    Returns
    -------
    vertices : ndarray, shape (W, 3)
        One vertex for each group of joined ones, in the order of its first vertex and at the position of that one. The
        type is that of the argument.
    faces : ndarray, shape (G, 3), uint32
        The faces in their order, without those that name a vertex twice.
    index : ndarray, shape (V,), intp
        The new number of each vertex. ``frame[numpy.unique(index, return_index=True)[1]]`` are the new vertices of
        another frame of the same mesh.

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type or shape, a coordinate or the distance is not finite, or a face names a vertex
        that does not exist.

    Notes
    -----
    Chains join: if a is within `distance` of b, and b of c, all three become one vertex, however far a is from c.
    Vertices in no face are kept. Faces that become equal to another face are kept too.

    Examples
    --------
    Two triangles that each have vertices of their own:

    >>> import hpccd_core as hc
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]
    >>> vertices, faces, index = hc.weld(corners, [[0, 1, 2], [3, 4, 5]])
    >>> faces.tolist(), index.tolist()
    ([[0, 1, 2], [1, 3, 2]], [0, 1, 2, 1, 3, 2])
    """
    there = arguments.points("vertices", vertices, None)
    arguments.usable("vertices", there)
    triangles = arguments.faces(faces)
    if triangles.size and (largest := int(triangles.max())) >= len(there):
        row, column = np.argwhere(triangles == largest)[0]
        raise ValueError(
            f"faces[{row}, {column}] is {largest}, but there are {len(there)} vertices; indices count from 0"
        )
    within = arguments.length("distance", distance)
    with _core.StandardArithmetic():  # numpy rounds in the mode of the thread
        first, index = joined(arguments.widened(there), within)
    welded = index.astype(np.uint32)[triangles]
    a, b, c = welded.T
    return there[first], welded[(a != b) & (b != c) & (c != a)], index


def joined(points: NDArray[np.float64], distance: float = 0.0) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Join points at most ``distance`` apart, and chains of them, in order of first use.

    Parameters
    ----------
    points : (n, 3) float64
        Finite. With distance 0, points with equal coordinates become one vertex; -0 equals 0.

    Returns
    -------
    first : (v,) intp
        The first point of each vertex, increasing.
    vertex_of : (n,) intp
        The vertex of each point.

    Notes
    -----
    Every step that takes long runs without the interpreter lock. ``numpy.unique(axis=0)`` would hold the lock, and so
    block all other threads, for seconds with millions of points.
    """
    points = np.ascontiguousarray(points + 0.0)  # + 0.0 makes 0 of -0
    if distance > 0:
        return _numbered(_roots_within(points, distance))
    bits = points.view(np.uint64)
    order = np.lexsort(bits.T)  # stable: equal points stay in order
    ordered = bits[order]
    starts = np.ones(len(order), bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    roots = np.empty_like(order)
    roots[order] = order[starts][np.cumsum(starts) - 1]
    return _numbered(roots)


def components(pairs: NDArray[np.integer], n: int) -> NDArray[np.intp]:
    """The lowest of the n nodes that each node is connected to by pairs (k, 2), itself included."""
    roots = np.arange(n)
    _connect(roots, pairs[:, 0].astype(np.intp), pairs[:, 1].astype(np.intp))
    return roots


def _numbered(roots: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The nodes that are their own root, and for each node the number of its root among them."""
    is_first = roots == np.arange(len(roots))
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[roots]


def _connect(roots: NDArray[np.intp], a: NDArray[np.intp], b: NDArray[np.intp]) -> None:
    """Join the components of a[k] and b[k], in place. The root of a component is its lowest node."""
    while True:
        root_a, root_b = roots[a], roots[b]
        apart = root_a != root_b
        if not apart.any():
            return
        a, b, root_a, root_b = a[apart], b[apart], root_a[apart], root_b[apart]
        np.minimum.at(roots, np.maximum(root_a, root_b), np.minimum(root_a, root_b))
        while True:
            above = roots[roots]
            if np.array_equal(above, roots):
                break
            roots[:] = above


def _roots_within(points: NDArray[np.float64], distance: float) -> NDArray[np.intp]:
    """The lowest point that each point is joined to."""
    distance = min(distance, 1e152)  # beyond the extent of any usable points
    roots = np.arange(len(points))
    # Eight times the distance: most points are far from the sides of their cell, and then near points share it.
    cells = _Cells(points, 8 * distance, distance)
    if cells.n_candidates > _DENSE * len(points):
        # The diagonal of two cells of this size is sqrt(6) * 0.4 < 1 times the distance: all points of such cells, and
        # of cells with a common side, join. One test for each is enough.
        small = _Cells(points, 0.4 * distance, 0.0)
        for a, b in (small.with_first_of_cell(), *small.with_first_beyond_side()):
            near = _within(points, a, b, distance)
            _connect(roots, a[near], b[near])
    if cells.n_open(roots) > _DENSE * len(points):
        found = _Halves(points).candidates(roots, distance)  # clusters side by side, which remain apart
    else:
        found = cells.candidates(roots)
    for a, b in found:
        apart = roots[a] != roots[b]
        a, b = a[apart], b[apart]
        near = _within(points, a, b, distance)
        _connect(roots, a[near], b[near])
    return roots


class _Cells:
    """Points sorted by the cubic cell that they lie in. Cells have hashed keys: different cells may share one, which
    only adds candidates.

    A float q with |q - x| <= distance has floor((x - distance) / size) <= floor(q / size) <= floor((x + distance) /
    size) after rounding too, because q is a float and rounding is monotonic. With a size of at least eight times the
    distance these are at most two different numbers. Where quotients are so large that all are integers, the three are
    equal, or the next float above or below.
    """

    def __init__(self, points: NDArray[np.float64], size: float, distance: float) -> None:
        self._size = max(size, 1e-157)  # quotients are finite, as coordinates are at most 1e150
        self._home = np.floor(points.T / self._size) + 0.0
        home_keys = _key(self._home)
        self._order = np.argsort(home_keys, kind="stable")
        self._keys = home_keys[self._order]
        starts = np.ones(len(points), bool)
        starts[1:] = self._keys[1:] != self._keys[:-1]
        self._run_of = np.cumsum(starts) - 1
        self._starts = np.append(np.flatnonzero(starts), len(points))
        self._reaching: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []  # points, runs that they reach
        size_of_run = np.diff(self._starts)
        self.n_candidates = int((size_of_run * (size_of_run - 1) // 2).sum())
        if distance > 0:
            below = np.floor((points.T - distance) / self._size) + 0.0
            above = np.floor((points.T + distance) / self._size) + 0.0
            for side in np.ndindex(3, 3, 3):
                # A pair of cells is found from both sides; one is enough.
                if next((s for s in side if s), 2) == 1:
                    self._reach(side, below, above)
            self.n_candidates += sum(int(size_of_run[runs].sum()) for _, runs in self._reaching)

    def _reach(self, side: tuple[int, ...], below: NDArray[np.float64], above: NDArray[np.float64]) -> None:
        """Remember the points that reach the cells on one side. side: 0, 1 (above) or 2 (below) for each axis."""
        ends = (self._home, above, below)
        reaches = np.ones(self._home.shape[1], bool)
        for axis, s in enumerate(side):
            if s:
                reaches &= ends[s][axis] != self._home[axis]
        near = np.flatnonzero(reaches)
        if len(near):
            keys = _key(np.stack([ends[s][axis][near] for axis, s in enumerate(side)]))
            self._reaching.append(self._found(near, keys))

    def _found(self, near: NDArray[np.intp], keys: NDArray[np.uint64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Those of the points ``near`` for which a cell with their key exists, and its run."""
        place = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        there = self._keys[place] == keys
        return near[there], self._run_of[place[there]]

    def with_first_of_cell(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Each point, and the first one in its cell."""
        return self._order, self._order[self._starts[self._run_of]]

    def with_first_beyond_side(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """The first point of each cell, and the first one in the next cell along each axis."""
        first = self._order[self._starts[:-1]]
        for axis in range(3):
            beyond = self._home[:, first].copy()
            beyond[axis] += 1
            near, runs = self._found(first, _key(beyond))
            yield near, self._order[self._starts[runs]]

    def n_open(self, roots: NDArray[np.intp]) -> int:
        """How many candidates there are now."""
        return sum(int(self._open(*ranges, roots)[2].sum()) for ranges in self._ranges())

    def candidates(self, roots: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Pairs of points that may be near each other, in blocks. Omits pairs with a cell whose points all have the
        root of the other point; ``roots`` may change between two blocks."""
        for ranges in self._ranges():
            points, begin, count = self._open(*ranges, roots)
            total = np.cumsum(count)
            at = 0
            while at < len(points):
                done = total[at - 1] if at else 0
                until = max(at + 1, int(np.searchsorted(total, done + _PAIRS_AT_ONCE, side="right")))
                counts = count[at:until]
                offsets = np.arange(counts.sum()) - np.repeat(total[at:until] - counts - done, counts)
                yield np.repeat(points[at:until], counts), self._order[np.repeat(begin[at:until], counts) + offsets]
                at = until

    def _ranges(self) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]]:
        """Points, and the runs that they reach: those from a begin to an end in the order of cells."""
        yield self._order, self._run_of, np.arange(len(self._order)) + 1, self._starts[self._run_of + 1]
        for points, runs in self._reaching:
            yield points, runs, self._starts[runs], self._starts[runs + 1]

    def _open(
        self,
        points: NDArray[np.intp],
        runs: NDArray[np.intp],
        begin: NDArray[np.intp],
        end: NDArray[np.intp],
        roots: NDArray[np.intp],
    ) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Those that have not joined all of the run: point, begin, and the number up to the end."""
        of_run = roots[self._order]
        low = np.minimum.reduceat(of_run, self._starts[:-1])
        one_root = low == np.maximum.reduceat(of_run, self._starts[:-1])
        wanted = (end > begin) & ~(one_root[runs] & (low[runs] == roots[points]))
        return points[wanted], begin[wanted], (end - begin)[wanted]


class _Halves:
    """A tree of boxes: points are halved along the longest side of their box until few are left. Node k of a level has
    nodes 2 k and 2 k + 1 of the next."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        self._order = np.arange(len(points))
        self._starts: list[NDArray[np.intp]] = []  # by level: where nodes begin in the order, and its end
        self._low: list[NDArray[np.float64]] = []  # boxes
        self._high: list[NDArray[np.float64]] = []
        while True:
            n_nodes = 2 ** len(self._starts)
            starts = len(points) * np.arange(n_nodes + 1) // n_nodes
            ordered = points[self._order]
            self._starts.append(starts)
            self._low.append(np.minimum.reduceat(ordered, starts[:-1]))
            self._high.append(np.maximum.reduceat(ordered, starts[:-1]))
            if np.diff(starts).max() <= _LEAF:
                break
            node = np.repeat(np.arange(n_nodes), np.diff(starts))
            axis = (self._high[-1] - self._low[-1]).argmax(axis=1)[node]
            self._order = self._order[np.lexsort((ordered[np.arange(len(points)), axis], node))]

    def candidates(
        self, roots: NDArray[np.intp], distance: float
    ) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """As those of _Cells: pairs whose boxes are near each other and do not have one root."""
        limit = distance * distance * (1 + 1e-14) + 1e-300  # as in _within
        last = len(self._starts) - 1
        waiting = [(0, np.zeros(1, np.intp), np.zeros(1, np.intp))]
        while waiting:
            level, a, b = waiting.pop()
            low, high, starts = self._low[level], self._high[level], self._starts[level]
            gap = np.maximum(np.maximum(low[b] - high[a], low[a] - high[b]), 0.0)
            of_node = roots[self._order]
            least = np.minimum.reduceat(of_node, starts[:-1])
            most = np.maximum.reduceat(of_node, starts[:-1])
            one_root = (least[a] == most[a]) & (least[b] == most[b]) & (least[a] == least[b])
            near = (np.einsum("ij,ij->i", gap, gap) <= limit) & ~one_root
            a, b = a[near], b[near]
            if level == last:
                place = np.arange(_LEAF)
                x, y = (starts[k][:, None] + place for k in (a, b))
                there = (x < starts[a + 1][:, None])[:, :, None] & (y < starts[b + 1][:, None])[:, None, :]
                x, y = np.broadcast_arrays(x[:, :, None], y[:, None, :])
                yield self._order[x[there]], self._order[y[there]]
                continue
            a, b = np.tile(2 * a, 4), np.tile(2 * b, 4)
            a[len(a) // 2 :] += 1
            b.reshape(4, -1)[1::2] += 1
            once = a <= b
            a, b = a[once], b[once]
            for at in range(0, len(a), _NODES_AT_ONCE):
                waiting.append((level + 1, a[at : at + _NODES_AT_ONCE], b[at : at + _NODES_AT_ONCE]))


def _key(cells: NDArray[np.float64]) -> NDArray[np.uint64]:
    """(3, n) whole numbers, 0 never negative -> (n,): equal for equal cells."""
    key = np.zeros(cells.shape[1], np.uint64)
    for axis, odd in zip(np.ascontiguousarray(cells).view(np.uint64), _ODD, strict=True):
        key = (key ^ axis ^ (axis >> np.uint64(31))) * odd
    return key


def _within(
    points: NDArray[np.float64], a: NDArray[np.intp], b: NDArray[np.intp], distance: float
) -> NDArray[np.bool_]:
    """Whether points a[k] and b[k] are at most ``distance`` apart, exactly.

    Differences, squares and sums of at most six roundings have a relative error below 7 * 2**-53 < 1e-15 each, apart
    from underflow, which adds less than 1e-320. Pairs nearer to the limit than 1e-14 of it are decided by fractions, if
    they do not differ in one coordinate only, by an exact difference.
    """
    difference = points[b] - points[a]
    squares = np.einsum("ij,ij->i", difference, difference)
    limit = distance * distance
    slack = limit * 1e-14 + 1e-300
    near: NDArray[np.bool_] = squares < limit - slack
    open_ = np.flatnonzero(~near & (squares <= limit + slack))
    if len(open_):
        d, p, q = difference[open_], points[a[open_]], points[b[open_]]
        # The rounding error of a difference is a float (Knuth's TwoSum), 0 if the difference is exact.
        back = d - q
        exact = ((q - (d - back)) + (-p - back) == 0).all(axis=1)
        one = exact & (np.count_nonzero(d, axis=1) <= 1)
        near[open_[one]] = np.abs(d[one]).max(axis=1) <= distance
        limit_exactly = Fraction(distance) ** 2
        for k in np.flatnonzero(~one):
            apart = (Fraction(y) - Fraction(x) for x, y in zip(p[k].tolist(), q[k].tolist(), strict=True))
            near[open_[k]] = sum(x * x for x in apart) <= limit_exactly
    return near
