# SPDX-License-Identifier: Apache-2.0
"""Newton models as scenes, Warp arrays as positions, and results as Warp arrays.

Positions are read where they are: ``state.particle_q`` (float32) is not copied, neither on Warp's CPU device nor on a
GPU, and tests are exact on the float32 numbers. Results become Warp arrays without a copy, too.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import DeviceArray
from .contacts import Contacts
from .device_distances import DeviceDistances
from .device_results import DeviceContacts, DeviceIntersections, DeviceProximity
from .proximity import Intersections, Proximity
from .scene import Scene

try:
    import warp as wp
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"hpccd_core.warp: cannot import Warp ({error}); pip install 'hpccd-core[newton]', or warp-lang alone",
        name=error.name,
    ) from None

#: The mesh of a scene that holds the particles of a model.
PARTICLES = "particles"

_Result = (
    Contacts | Proximity | Intersections | DeviceContacts | DeviceProximity | DeviceIntersections | DeviceDistances
)


def scene_of(model: Any, *, self_collision: bool = True) -> Scene:
    """A scene with the particles of a Newton model as one mesh, "particles".

    Parameters
    ----------
    model : newton.Model
        Its triangles (`tri_indices`: cloth, surfaces of soft bodies) become faces. Springs become edges where none of
        their ends is in a triangle. Of a model with worlds, the scene is that of one world: see :func:`worlds_of`.
    self_collision : bool
        As in :meth:`Scene.add_mesh`.

    Returns
    -------
    Scene
        Vertices and faces have the numbers of particles and triangles in one world. Add other meshes and rules to it
        as to any scene.

    Raises
    ------
    TypeError, ValueError
        If it is no model, has no particles, or if its worlds differ.

    Notes
    -----
    Not included: rigid shapes, and `particle_radius`. Particles in no triangle and no spring are tested against faces
    only.

    Examples
    --------
    >>> import newton
    >>> import warp as wp
    >>> import hpccd_core as hc
    >>> from hpccd_core import warp as hcw
    >>> wp.config.log_level = wp.LOG_WARNING
    >>> builder = newton.ModelBuilder()
    >>> still = dict(rot=wp.quat_identity(), vel=wp.vec3(0, 0, 0), mass=0.1)
    >>> for height in (0.0, 0.25):
    ...     at = wp.vec3(height / 4, 0, height)
    ...     builder.add_cloth_grid(pos=at, dim_x=4, dim_y=4, cell_x=0.25, cell_y=0.25, **still)
    >>> model = builder.finalize(device="cpu")
    >>> scene = hcw.scene_of(model)
    >>> scene
    Scene(particles: 50 vertices, 64 faces)
    >>> start, end = model.state(), model.state()
    >>> hcw.positions(model, end)[25:, 2] -= 0.5  # a view: the state itself changes
    >>> contacts = hc.Detector(scene).detect(hcw.positions(model, start), hcw.positions(model, end))
    >>> contacts
    Contacts(64 vertex-face, 187 edge-edge, first at 0.5)
    >>> hcw.arrays(contacts)["vf"].shape
    (64, 2)
    """
    triangles, springs, n = _of_one_world(model)
    on_surface = np.zeros(n, bool)
    on_surface[triangles] = True
    ropes = springs[~on_surface[springs].any(1)]
    scene = Scene()
    scene.add_mesh(PARTICLES, triangles, edges=ropes, n_vertices=n, self_collision=self_collision)
    return scene


def worlds_of(model: Any) -> int | None:
    """The number of worlds for :class:`Detector`: that of the model, or None if its particles are in no world.

    Parameters
    ----------
    model : newton.Model

    Returns
    -------
    int or None

    Raises
    ------
    TypeError, ValueError
        If it is no model, has no particles, or some in worlds and others in none.
    """
    if not hasattr(model, "particle_world") or isinstance(model.particle_world, list):  # that of a builder
        raise TypeError(f"model: expected newton.Model, got {type(model).__name__}; make one with finalize()")
    if not model.particle_count:
        raise ValueError("model: has no particles; rigid shapes are not part of the scene")
    world = model.particle_world.numpy()
    if (world < 0).all():
        return None
    if (world < 0).any():
        raise ValueError("model: has particles in worlds and others in none (world -1); add the latter to each world")
    return int(model.world_count)


def positions(model: Any, state: Any) -> Any:
    """The positions of all particles as every query of a detector accepts them, without a copy.

    Parameters
    ----------
    model : newton.Model
    state : newton.State or warp.array
        A state, or its `particle_q`: an array of vec3, C-contiguous.

    Returns
    -------
    ndarray or warp.array, shape (V, 3) or (W, V, 3), float32
        A view of the same memory: a numpy array on Warp's CPU device, otherwise a Warp array on the GPU. Worlds as in
        :func:`worlds_of`.

    Raises
    ------
    TypeError, ValueError
        If `model` is no model, or the array is not that of its particles.
    """
    worlds = worlds_of(model)
    array: Any = getattr(state, "particle_q", state)
    found = f"{array.dtype.__name__} of shape {array.shape}" if isinstance(array, wp.array) else type(array).__name__
    if found != f"vec3f of shape ({model.particle_count},)":
        raise ValueError(f"state: expected an array of vec3 for {model.particle_count} particles, got {found}")
    if not array.is_contiguous:
        raise ValueError("state: must be C-contiguous; copy it first, as with array.contiguous()")
    shaped = array if worlds is None else array.reshape((worlds, model.particle_count // worlds))
    return shaped.numpy() if array.device.is_cpu else shaped


def arrays(result: _Result) -> dict[str, Any]:
    """The arrays of a result as Warp arrays, by name, without a copy.

    Parameters
    ----------
    result : Contacts, Proximity or Intersections, or one whose name begins with Device
        The result of :meth:`Detector.detect`, :meth:`Detector.proximity` or :meth:`Detector.intersections`, or that of
        :meth:`Detector.distances` on the device.

    Returns
    -------
    dict of str to warp.array
        Names, shapes and dtypes of the result: `vf` (N, 2) uint32, `vf_toc` (N,) float64, and so on; the outputs that
        the detector was asked for; with worlds the offsets too, such as `vf_offsets` (W+1,) int64. They are on Warp's
        CPU device for results on the host. Each array keeps its memory alive.

    Raises
    ------
    TypeError
        If it is none of these results.
    """
    if not isinstance(result, _Result):
        raise TypeError(
            "result: expected that of detect, proximity, intersections or, on the device, distances, got "
            f"{type(result).__name__}"
        )
    found = {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}
    found |= getattr(result, "outputs", {})
    if getattr(result, "slices", None) is not None:
        kinds = [kind for kind in ("vf", "ee", "ef") if len(found.get(kind, ()))]
        found |= {f"{kind}_offsets": getattr(result, f"{kind}_offsets") for kind in kinds}
    return {name: _shared(a) for name, a in found.items() if isinstance(a, np.ndarray | DeviceArray)}


def _shared(array: NDArray[Any] | DeviceArray) -> Any:
    """A Warp array of the same memory."""
    if isinstance(array, DeviceArray):
        return wp.from_dlpack(array)
    return wp.array(array, device="cpu", copy=False)


def _of_one_world(model: Any) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Triangles (T, 3), springs (S, 2) and the number of particles of a world. Raises ValueError if worlds differ."""
    worlds = worlds_of(model) or 1
    n, rest = divmod(model.particle_count, worlds)
    found = []
    for name, columns in (("tri_indices", 3), ("spring_indices", 2)):
        array = getattr(model, name)
        rows = np.empty((0, columns), np.int64) if array is None else array.numpy().astype(np.int64)
        rows = rows.reshape(-1, columns)
        alike = not rest and len(rows) % worlds == 0
        if alike:
            of_worlds = rows.reshape(worlds, -1, columns) - n * np.arange(worlds)[:, None, None]
            alike = bool((of_worlds == of_worlds[:1]).all())
        if not alike:
            raise ValueError(f"model: its worlds differ in particles or {name}; make a model of equal worlds")
        found.append(of_worlds[0])
    return found[0], found[1], n
