# SPDX-License-Identifier: Apache-2.0
"""Contacts in a window of PyVista or Polyscope."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import arguments
from .array_types import ArrayLike, Positions
from .contacts import Contacts

_OF_CONTACTS = ("contacts", "normals")
_COLOURS = ((0.62, 0.7, 0.8), (0.85, 0.75, 0.6), (0.68, 0.78, 0.66), (0.8, 0.68, 0.74))


def plot(
    contacts: Contacts,
    vertices: Positions,
    faces: ArrayLike | None = None,
    *,
    backend: Literal["pyvista", "polyscope"] = "pyvista",
) -> Any:
    """Meshes and contacts as a scene of PyVista or Polyscope: points coloured by time of impact, normals as arrows.

    Parameters
    ----------
    contacts : Contacts
        Those of one step, from a detector with outputs=("points",), or ("points", "normals") for arrows. With many
        worlds, give those of one: ``contacts.world(k)``.
    vertices : Positions, shape (V, 3)
        Positions at which the meshes are drawn, such as those at the end of the step.
    faces : ArrayLike, shape (F, 3), integers, optional
        Faces of the scene, as of `Detector.faces`. Without them, vertices are drawn as points.
    backend : {"pyvista", "polyscope"}
        Library that draws.

    Returns
    -------
    pyvista.Plotter, or the module polyscope
        Call its ``show()``. Before that, add what you like. Each mesh has its name, or "mesh contacts" where
        that is taken; the points of contact are "contacts", arrows "normals".

    Raises
    ------
    TypeError, ValueError
        If an argument is invalid.
    OutputNotComputed
        If the contacts have no points.
    ModuleNotFoundError
        If PyVista or Polyscope is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> import hpccd_core as hc
    >>> (sheet, sheet_faces), (ball, ball_faces) = hc.shapes.grid(20, 20), hc.shapes.icosphere(6)
    >>> scene = hc.Scene()
    >>> _ = scene.add_mesh("sheet", sheet_faces), scene.add_mesh("ball", ball_faces, static=True)
    >>> detector = hc.Detector(scene, outputs=("points", "normals"))
    >>> start, end = (np.concatenate([sheet + [0, 0, z], ball]) for z in (1.1, 0.9))
    >>> plotter = hc.plot(detector.detect(start, end), end, detector.faces)
    >>> sorted(plotter.actors)[:4]  # plotter.show() opens a window
    ['ball', 'contacts', 'normals', 'sheet']
    """
    arguments.choice("backend", backend, ("pyvista", "polyscope"))
    if not isinstance(contacts, Contacts):
        remedy = "; copy it first, with to_host()" if hasattr(contacts, "to_host") else ""
        raise TypeError(f"contacts: expected hpccd_core.Contacts, got {type(contacts).__name__}{remedy}")
    if contacts.slices is not None:
        raise ValueError("contacts: expected those of one world; give contacts.world(k) and vertices[k]")
    if contacts.layout is None:
        raise ValueError("contacts: has no layout of meshes; use a result of a detector")
    n = int(contacts.layout.vertex_offsets[-1])
    x = arguments.vertices("vertices", vertices, (n, 3), contacts.layout).astype(np.float64)
    triangles = np.empty((0, 3), np.int64) if faces is None else arguments.faces(faces).astype(np.int64)
    if triangles.size and triangles.max() >= n:
        raise ValueError(f"faces: names vertex {triangles.max()}, and there are {n}; give those of the scene")
    return (_in_pyvista if backend == "pyvista" else _in_polyscope)(contacts, x, triangles)


def _meshes(
    contacts: Contacts, triangles: NDArray[np.int64]
) -> Iterator[tuple[str, tuple[float, float, float], slice, NDArray[np.int64]]]:
    """Name, colour, vertices and own faces of each mesh that has vertices."""
    layout = contacts.layout
    assert layout is not None
    offsets = layout.vertex_offsets.tolist()
    for k, (name, begin, end) in enumerate(zip(layout.mesh_names, offsets, offsets[1:], strict=False)):
        own = triangles[(triangles[:, 0] >= begin) & (triangles[:, 0] < end)] - begin
        if own.size and not 0 <= own.min() <= own.max() < end - begin:
            bad = own[(own < 0).any(axis=1) | (own >= end - begin).any(axis=1)][0] + begin
            raise ValueError(f"faces: {bad.tolist()} belongs to several meshes; give those of the scene")
        if begin < end:
            name = f"mesh {name}" if name in _OF_CONTACTS else name  # libraries replace what has the same name
            yield name, _COLOURS[k % len(_COLOURS)], slice(begin, end), own


def _in_pyvista(contacts: Contacts, x: NDArray[np.float64], triangles: NDArray[np.int64]) -> Any:
    pv = _imported("pyvista")
    plotter = pv.Plotter()
    for name, colour, of_mesh, own in _meshes(contacts, triangles):
        mesh = pv.PolyData.from_regular_faces(x[of_mesh], own) if len(own) else pv.PolyData(x[of_mesh])
        plotter.add_mesh(mesh, name=name, color=colour, opacity=0.7 if len(own) else 1.0, point_size=4.0)
    if not len(contacts.points):
        return plotter
    toc, look = "time of impact", {"cmap": "turbo", "clim": (0.0, 1.0)}
    cloud = pv.PolyData(contacts.points)
    cloud[toc] = contacts._values("toc")
    plotter.add_mesh(cloud, name="contacts", scalars=toc, point_size=9.0, render_points_as_spheres=True, **look)
    if hasattr(contacts, "normals") and (some := contacts.normals.any(axis=1)).any():  # zero normals have no direction
        tails = pv.PolyData(contacts.points[some])
        tails[toc], tails["normals"] = contacts._values("toc")[some], contacts.normals[some]
        arrows = tails.glyph(orient="normals", scale=False, factor=_length(x))
        plotter.add_mesh(arrows, name="normals", scalars=toc, show_scalar_bar=False, **look)
    return plotter


def _in_polyscope(contacts: Contacts, x: NDArray[np.float64], triangles: NDArray[np.int64]) -> Any:
    ps = _imported("polyscope")
    if not ps.is_initialized():
        ps.init()
        ps.set_up_dir("z_up")
    for name, colour, of_mesh, own in _meshes(contacts, triangles):
        if len(own):
            ps.register_surface_mesh(name, x[of_mesh], own, color=colour, transparency=0.7)
        else:
            ps.register_point_cloud(name, x[of_mesh], color=colour)
    if len(contacts.points):
        cloud = ps.register_point_cloud("contacts", contacts.points)
        toc = contacts._values("toc")
        cloud.add_scalar_quantity("time of impact", toc, vminmax=(0.0, 1.0), cmap="turbo", enabled=True)
        if hasattr(contacts, "normals"):
            cloud.add_vector_quantity("normals", contacts.normals, enabled=True)
    elif ps.has_point_cloud("contacts"):
        ps.remove_point_cloud("contacts")
    return ps


def _length(x: NDArray[np.float64]) -> float:
    """The length of arrows."""
    return 0.04 * float(np.linalg.norm(np.ptp(x, axis=0))) or 1.0


def _imported(library: str) -> Any:
    try:
        return __import__(library)
    except ModuleNotFoundError as error:
        package = "'hpccd-core[plot]'" if library == "pyvista" else library
        raise ModuleNotFoundError(
            f"hpccd_core.plot: cannot import {library} ({error}); pip install {package}", name=error.name
        ) from None
