# SPDX-License-Identifier: Apache-2.0
"""Results that stay in a GPU's memory (results="device")."""

from __future__ import annotations

import dataclasses
import functools
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from . import arguments
from ._core import DeviceArray, integers_on_device
from .contacts import Contacts
from .mesh_layout import MeshLayout
from .proximity import Intersections, Proximity
from .results import INTERSECTION_ARRAYS, OutputNotComputed, output, with_outputs
from .worlds import Slices


def _floats_on_device(numbers: list[float], device: int) -> DeviceArray:
    """float64 there: their bits, which the core takes as integers."""
    return integers_on_device(np.array(numbers, np.float64).view(np.int64).tolist(), device).seen_as("f")


class ComparedOnHost:
    """Base of results on a device."""

    def to_host(self) -> Any:
        """A copy in numpy arrays."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return self is other or bool(self.to_host() == other.to_host())

    __hash__ = None  # type: ignore[assignment]


@dataclasses.dataclass(frozen=True, eq=False)
class _OnDevice(ComparedOnHost):
    """Fields that results with rows share. slices: with worlds, by name as in worlds.Slices."""

    hash: int
    slices: dict[str, DeviceArray | None] | None = dataclasses.field(repr=False)
    layout: MeshLayout | None = dataclasses.field(repr=False)

    def _offsets(self, kind: str, rows: DeviceArray) -> DeviceArray:
        if self.slices is None:
            return integers_on_device([0, len(rows)], rows.device)
        offsets = self.slices[kind]
        assert offsets is not None
        return offsets

    @functools.cached_property
    def _slices_on_host(self) -> Slices | None:
        if self.slices is None:
            return None
        empty = np.empty(0, np.int64)
        arrays: dict[str, Any] = {name: empty if a is None else a.to_host() for name, a in self.slices.items()}
        return Slices(**arrays)

    def read_slices(self) -> None:
        """Read where the rows of each world begin now, not at the first access."""
        _ = self._slices_on_host

    def _world_number(self, k: int) -> int:
        of_worlds = self._slices_on_host
        return arguments.whole_number("world", k, 0, 0 if of_worlds is None else len(of_worlds.hashes) - 1)


@dataclasses.dataclass(frozen=True, eq=False)
class _PairsOnDevice(_OnDevice):
    vf: DeviceArray
    ee: DeviceArray
    outputs: dict[str, DeviceArray]

    @property
    def closest(self) -> DeviceArray:
        """(N+M, 2, 3) float64, as in Contacts and Proximity."""
        return output(self.outputs, "closest")

    @property
    def normals(self) -> DeviceArray:
        """(N+M, 3) float64, as in Contacts and Proximity."""
        return output(self.outputs, "normals")

    @property
    def vertices(self) -> DeviceArray:
        """(N+M, 4) uint32, as in Contacts and Proximity."""
        return output(self.outputs, "vertices")

    @property
    def weights(self) -> DeviceArray:
        """(N+M, 4) float64, as in Contacts and Proximity."""
        return output(self.outputs, "weights")

    @property
    def vf_offsets(self) -> DeviceArray:
        """(W+1,) int64: the vertex-face pairs of world k are the rows vf_offsets[k] to vf_offsets[k + 1]."""
        return self._offsets("vf", self.vf)

    @property
    def ee_offsets(self) -> DeviceArray:
        """(W+1,) int64: the edge-edge pairs of world k are the rows ee_offsets[k] to ee_offsets[k + 1]."""
        return self._offsets("ee", self.ee)

    def _of_world(self, k: int, of_vf: str, of_ee: str) -> dict[str, Any]:
        """The fields of one world."""
        of_worlds = self._slices_on_host
        assert of_worlds is not None
        vf, ee = ([int(x) for x in offsets[k : k + 2]] for offsets in (of_worlds.vf, of_worlds.ee))
        n = len(self.vf)
        fields = {name: getattr(self, name).rows(*vf) for name in ("vf", of_vf)}
        fields |= {name: getattr(self, name).rows(*ee) for name in ("ee", of_ee)}
        outputs = {}
        for name, rows in self.outputs.items():  # rows of all vertex-face pairs, then of all edge-edge pairs
            outputs[name] = rows.rows(*vf).joined(rows.rows(n + ee[0], n + ee[1])) if len(rows) else rows
        return fields | {
            "hash": int(of_worlds.hashes[k]),
            "slices": None,
            "layout": self.layout,
            "outputs": outputs,
        }

    def __len__(self) -> int:
        return len(self.vf) + len(self.ee)


@dataclasses.dataclass(frozen=True, eq=False)
class DeviceContacts(_PairsOnDevice):
    """Contacts in a GPU's memory: names, shapes, dtypes and order as in :class:`Contacts`.

    Arrays are :class:`DeviceArray`: CUDA array interface and DLPack, without a copy (``cupy.asarray(c.vf)``,
    ``torch.from_dlpack(c.vf_toc)``). Their memory is reused only after all of them are released. `first_toc` and
    `hash` are on the host. :meth:`world` returns rows of these arrays in place, except for outputs, which are copied.
    """

    vf_toc: DeviceArray
    ee_toc: DeviceArray
    first_toc: float

    @property
    def points(self) -> DeviceArray:
        """(N+M, 3) float64, as in Contacts."""
        return output(self.outputs, "points")

    @property
    def approach(self) -> DeviceArray:
        """(N+M,) float64, as in Contacts."""
        return output(self.outputs, "approach")

    @property
    def first_tocs(self) -> DeviceArray:
        """(W,) float64: the earliest time of each world, +inf where nothing touches."""
        if self.slices is None:
            return _floats_on_device([self.first_toc], self.vf.device)
        times = self.slices["first_tocs"]
        assert times is not None
        return times

    def world(self, k: int) -> DeviceContacts:
        """The contacts of world k, 0 <= k < W."""
        k = self._world_number(k)
        if (of_worlds := self._slices_on_host) is None:
            return self
        fields = self._of_world(k, "vf_toc", "ee_toc")
        return DeviceContacts(**fields, first_toc=float(of_worlds.first_tocs[k]))

    def without_rows(self) -> DeviceContacts:
        """No contacts at all, of as many worlds, on the same device."""
        rows = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        none = {name: a.rows(0, 0) for name, a in rows.items() if isinstance(a, DeviceArray)}
        slices = self.slices
        if slices is not None and (hashes := slices["hashes"]) is not None:
            worlds, device = len(hashes), hashes.device
            begins = integers_on_device([0] * (worlds + 1), device)
            times = _floats_on_device([np.inf] * worlds, device)
            hashes = integers_on_device([0] * worlds, device).seen_as("u")
            slices = {"vf": begins, "ee": begins, "ef": None, "hashes": hashes, "first_tocs": times}
        outputs = {name: array.rows(0, 0) for name, array in self.outputs.items()}
        return DeviceContacts(
            **none, first_toc=float("inf"), hash=0, slices=slices, layout=self.layout, outputs=outputs
        )

    def to_host(self) -> Contacts:
        """A copy in numpy arrays."""
        return Contacts(**_on_host(self), outputs=_outputs_on_host(self), first_toc=self.first_toc)

    def __repr__(self) -> str:
        return f"DeviceContacts({len(self.vf)} vertex-face, {len(self.ee)} edge-edge, first at {self.first_toc:.6g})"


@dataclasses.dataclass(frozen=True, eq=False)
class DeviceProximity(_PairsOnDevice):
    """Proximity in a GPU's memory: names, shapes, dtypes and order as in :class:`Proximity`."""

    vf_distance: DeviceArray
    ee_distance: DeviceArray

    def world(self, k: int) -> DeviceProximity:
        """The pairs of world k, 0 <= k < W."""
        k = self._world_number(k)
        if self._slices_on_host is None:
            return self
        return DeviceProximity(**self._of_world(k, "vf_distance", "ee_distance"))

    def to_host(self) -> Proximity:
        """A copy in numpy arrays."""
        return Proximity(**_on_host(self), outputs=_outputs_on_host(self))

    def __repr__(self) -> str:
        return f"DeviceProximity({len(self.vf)} vertex-face, {len(self.ee)} edge-edge)"


@dataclasses.dataclass(frozen=True, eq=False)
class DeviceIntersections(_OnDevice):
    """Intersections in a GPU's memory: names, shapes, dtypes and order as in :class:`Intersections`."""

    ef: DeviceArray

    def __getattr__(self, name: str) -> NoReturn:
        if name in INTERSECTION_ARRAYS or name in ("contours", "regions"):
            raise OutputNotComputed(f"{name}: not computed in a GPU's memory; make the detector with results='host'")
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    @property
    def ef_offsets(self) -> DeviceArray:
        """(W+1,) int64: the pairs of world k are the rows ef_offsets[k] to ef_offsets[k + 1]."""
        return self._offsets("ef", self.ef)

    def world(self, k: int) -> DeviceIntersections:
        """The pairs of world k, 0 <= k < W."""
        k = self._world_number(k)
        if (of_worlds := self._slices_on_host) is None:
            return self
        rows = self.ef.rows(*(int(x) for x in of_worlds.ef[k : k + 2]))
        return DeviceIntersections(ef=rows, hash=int(of_worlds.hashes[k]), slices=None, layout=self.layout)

    def to_host(self) -> Intersections:
        """A copy in numpy arrays."""
        return Intersections(**_on_host(self))

    def __len__(self) -> int:
        return len(self.ef)

    def __repr__(self) -> str:
        return f"DeviceIntersections({len(self.ef)} edge-face)"


def _on_host(found: _OnDevice) -> dict[str, Any]:
    """The fields that all results share, their arrays in the host's memory."""
    values = ((f.name, getattr(found, f.name)) for f in dataclasses.fields(found))
    arrays = {name: value.to_host() for name, value in values if isinstance(value, DeviceArray)}
    return arrays | {"hash": found.hash, "slices": found._slices_on_host, "layout": found.layout}


def _outputs_on_host(found: _PairsOnDevice) -> dict[str, NDArray[Any]]:
    return {name: array.to_host() for name, array in found.outputs.items()}


def contacts_of(found: dict[str, Any], outputs: tuple[str, ...], layout: MeshLayout | None) -> DeviceContacts:
    """Contacts from what the core returns."""
    del found["ef"]
    vf_toc, ee_toc = found.pop("vf_values"), found.pop("ee_values")
    return DeviceContacts(vf_toc=vf_toc, ee_toc=ee_toc, **with_outputs(found, outputs), layout=layout)


def proximity_of(found: dict[str, Any], outputs: tuple[str, ...], layout: MeshLayout | None) -> DeviceProximity:
    """Proximity from what the core returns."""
    for name in ("ef", "points", "approach", "first_toc"):
        del found[name]
    vf, ee = found.pop("vf_values"), found.pop("ee_values")
    return DeviceProximity(vf_distance=vf, ee_distance=ee, **with_outputs(found, outputs), layout=layout)


def intersections_of(found: dict[str, Any], layout: MeshLayout | None) -> DeviceIntersections:
    """Intersections from what the core returns."""
    return DeviceIntersections(ef=found["ef"], hash=found["hash"], slices=found["slices"], layout=layout)
