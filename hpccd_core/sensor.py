# SPDX-License-Identifier: Apache-2.0
"""Contact sensors for learning: what groups of vertices touch, as arrays with one row for each world."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import arguments
from .array_types import Positions, Stream
from .derivatives import NEEDED
from .detector import Detector
from .device_results import DeviceProximity
from .mesh_layout import MeshLayout
from .proximity import Proximity

_UNIT = 2.0**-32  # of sums of pressures: sums of integers do not depend on their order
_MOST = 1024  # of a pair: two million of them fit into int64


@dataclasses.dataclass(frozen=True, eq=False)
class ContactReading:
    """The measurements of a sensor, for W worlds and G groups; W is 1 for a detector without worlds.

    numpy arrays, or PyTorch tensors on the device for a detector with results="device"; the numbers are the same.

    Attributes
    ----------
    counts : ndarray or Tensor, shape (W, G), int64
        Number of pairs of features within the distance.
    distances : ndarray or Tensor, shape (W, G), float64
        Distance of the nearest pair, in the unit of the coordinates; +inf where there is none.
    normals : ndarray or Tensor, shape (W, G, 3), float64
        Unit vector from the other surface to the group at the nearest pair; zero where there is none, or where the
        distance is 0. Of several nearest pairs the first in canonical order counts.
    pressures : ndarray or Tensor, shape (W, G), float64
        Sum over all pairs of max(0, 1 - distance / max_distance), in steps of 2**-32: a continuous measure of
        how much surface is near. It is not a force: it does not depend on mass, stiffness or impulse. Deep inside a
        plane or a thick surface, where distances are negative, a pair adds at most 1,024.
    """

    counts: Any
    distances: Any
    normals: Any
    pressures: Any


class ContactSensor:
    """Measures which groups of vertices are near other surfaces, in all worlds at once.

    A pair of features counts for each group that has a vertex of it. Pairs that the scene ignores do not count: leave
    out contacts within a body with ``self_collision=False``, those of neighbours in a cloth with `ignore_within`.

    Parameters
    ----------
    detector : Detector
        With outputs=("normals", "weights").
    groups : mapping of str to str, ArrayLike or tuple
        By name of the group: the name of a mesh, scene-wide indices of vertices, or a mesh and indices in it:
        ``{"hand": "hand", "tip": ("hand", [4, 5, 6])}``. Groups may overlap.
    max_distance : float
        Pairs within this distance count; in the unit of the coordinates, greater than 0.

    Raises
    ------
    TypeError, ValueError
        If an argument is invalid.
    ModuleNotFoundError
        If results stay on the device and PyTorch is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> from hpccd_core.sensor import ContactSensor
    >>> scene, (vertices, faces) = hc.Scene(), hc.shapes.box((1.0, 1.0, 1.0))
    >>> _ = scene.add_mesh("foot", faces, self_collision=False), scene.add_plane("floor")
    >>> detector = hc.Detector(scene, worlds=2, outputs=("normals", "weights"))
    >>> lower = np.flatnonzero(vertices[:, 2] < 0)
    >>> sensor = ContactSensor(detector, {"sole": lower, "foot": "foot"}, max_distance=0.25)
    >>> reading = sensor.read(np.stack([vertices + [0, 0, 0.625], vertices + [0, 0, 2]]))
    >>> reading.counts.tolist(), reading.distances.tolist()
    ([[4, 4], [0, 0]], [[0.125, 0.125], [inf, inf]])
    >>> reading.normals[0, 0].tolist(), reading.pressures[0].tolist()
    ([0.0, 0.0, 1.0], [2.0, 2.0])
    """

    def __init__(
        self,
        detector: Detector[Any, Any, Any, Any, Any],
        groups: Mapping[str, str | ArrayLike | tuple[str, ArrayLike]],
        max_distance: float,
    ) -> None:
        if not isinstance(detector, Detector):
            raise TypeError(f"detector: expected hpccd_core.Detector, got {type(detector).__name__}")
        if not set(NEEDED) <= set(detector._outputs):
            asked = tuple(dict.fromkeys((*detector._outputs, *NEEDED)))
            raise ValueError(f"detector: the sensor needs its normals and weights; create it with outputs={asked!r}")
        if not isinstance(groups, Mapping) or not groups:
            raise TypeError("groups: expected {name: vertices} with at least one group")
        self.max_distance = arguments.length("max_distance", max_distance)
        if self.max_distance == 0:
            raise ValueError("max_distance: must be greater than 0; give the distance at which pairs begin to count")
        self.detector = detector
        self.names = tuple(groups)
        self._members: Any = np.zeros((len(groups), detector.n_vertices), bool)
        for row, (name, group) in zip(self._members, groups.items(), strict=True):
            row[_vertices(f"groups[{name!r}]", group, detector._layout)] = True
        self._torch: Any = None
        if detector.results == "device":
            try:
                import torch
            except ModuleNotFoundError as error:
                raise ModuleNotFoundError(
                    f"hpccd_core.sensor: results on the device need PyTorch ({error}); "
                    "pip install 'hpccd-core[torch]', or use results='host'",
                    name=error.name,
                ) from None
            self._torch = torch

    def read(self, vertices: Positions, *, stream: Stream = None) -> ContactReading:
        """Measure one frame.

        Parameters
        ----------
        vertices : Positions, shape (V, 3) or (W, V, 3)
            As in :meth:`Detector.proximity`.
        stream : Stream, optional
            PyTorch's current stream, if it also computes the positions; by default all work on the device comes first.

        Returns
        -------
        ContactReading

        Raises
        ------
        TypeError, ValueError
            As :meth:`Detector.proximity`.
        """
        near = self.detector.proximity(vertices, self.max_distance, stream=stream)
        return self._of_pairs(*(self._on_device(near) if self._torch is not None else _on_host(near)))

    def _on_device(self, near: DeviceProximity) -> tuple[Any, ...]:
        torch = self._torch
        vf, ee, normals, weighted, *begins = (
            torch.from_dlpack(x)
            for x in (near.vf_distance, near.ee_distance, near.normals, near.vertices, near.vf_offsets, near.ee_offsets)
        )
        if isinstance(self._members, np.ndarray):
            self._members = torch.from_numpy(self._members).to(vf.device)
        rows = [torch.arange(len(values), device=vf.device) for values in (vf, ee)]
        # Not repeat_interleave, which makes the host wait for the device.
        world = torch.cat([torch.searchsorted(b, r, right=True) - 1 for b, r in zip(begins, rows, strict=True)])
        is_vf = torch.arange(len(world), device=vf.device) < len(vf)
        return torch, torch.cat([vf, ee]), weighted.view(torch.int32).long(), normals, world, is_vf

    def _of_pairs(self, xp: Any, distance: Any, vertices: Any, normals: Any, world: Any, one_a: Any) -> ContactReading:
        """Sums over pairs, by numpy or PyTorch (xp). one_a: whether side a has one vertex, and normals lead to it."""
        worlds, groups = self.detector.worlds or 1, len(self.names)
        first, second, *others = (self._members[:, vertices[:, k]] for k in range(4))
        on_a = first | (second & ~one_a)
        group, pair = xp.where(on_a | (second & one_a) | others[0] | others[1])
        cell = world[pair] * groups + group
        stable = {"kind": "stable"} if xp is np else {"stable": True}
        order = xp.argsort(distance[pair], **stable)
        order = order[xp.argsort(cell[order], **stable)]  # by cell, then by distance, then by row
        group, pair = group[order], pair[order]
        counts = xp.bincount(cell, minlength=worlds * groups)
        last = xp.cumsum(counts, 0)
        (some,) = xp.where(counts > 0)
        nearest = last[some] - counts[some]
        terms = xp.clip(1 - distance[pair] / self.max_distance, 0, _MOST) / _UNIT
        sums = xp.cumsum(xp.asarray(xp.round(terms), dtype=xp.int64), 0)
        distances = xp.full_like(counts, np.inf, dtype=xp.float64)
        distances[some] = distance[pair[nearest]]
        pressures = xp.zeros_like(counts, dtype=xp.float64)
        sums = sums[last[some] - 1]
        sums[1:] -= sums[:-1] * 1  # of each cell alone
        pressures[some] = xp.asarray(sums, dtype=xp.float64) * _UNIT
        directions = xp.stack([xp.zeros_like(pressures)] * 3, 1)
        leads_to_group = on_a[group[nearest], pair[nearest]] == one_a[pair[nearest]]
        directions[some] = normals[pair[nearest]] * (2.0 * leads_to_group - 1)[:, None]
        shape = (worlds, groups)
        return ContactReading(
            counts.reshape(shape), distances.reshape(shape), directions.reshape(*shape, 3), pressures.reshape(shape)
        )


def _on_host(near: Proximity) -> tuple[Any, ...]:
    lengths = [len(getattr(near, kind)) for kind in near._kinds()]
    one_a = np.repeat([kind in ("vf", "vp") for kind in near._kinds()], lengths)
    return np, near._values("distance"), near.vertices, near.normals, near._worlds_of_rows(), one_a


def _vertices(name: str, group: object, layout: MeshLayout) -> NDArray[np.int64]:
    """Scene-wide indices of the vertices of a group."""
    mesh, indices = (group, None) if isinstance(group, str) else (None, group)
    if isinstance(group, tuple) and group and isinstance(group[0], str):
        if len(group) != 2:
            raise ValueError(f"{name}: expected a mesh and indices of its vertices, got a tuple of {len(group)}")
        mesh, indices = group
    begin, end = 0, int(layout.vertex_offsets[-1])
    if mesh is not None:
        k = arguments.mesh_number(name, mesh, {m: i for i, m in enumerate(layout.mesh_names)})
        begin, end = (int(x) for x in layout.vertex_offsets[k : k + 2])
    if mesh is not None and begin == end:
        raise ValueError(f"{name}: {mesh!r} is a plane, which has no vertices; give the mesh that it touches")
    if isinstance(group, str):
        return np.arange(begin, end)
    given = arguments.integers(name, indices)
    if given.ndim != 1:
        raise TypeError(f"{name}: expected a list of vertices, got {arguments.shown(indices)}; write [0, 1, 2]")
    found = given.astype(np.int64)
    bad = np.flatnonzero((found < 0) | (found >= end - begin))
    if bad.size:
        where = "scene" if mesh is None else f"mesh {mesh!r}"
        raise ValueError(f"{name}: {found[bad[0]]} is no vertex of the {where}, which has {end - begin} vertices")
    return begin + found
