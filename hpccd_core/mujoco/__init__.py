# SPDX-License-Identifier: Apache-2.0
"""Scenes of MuJoCo's models: all contacts of flexes and geoms. No buffer limits their number.

Each flex and each geom that can collide becomes a mesh of its name, or a plane; positions come from `mjData`:

=====================  =============================================================================
flex, `dim` 1          a rope: edges, with the flex's radius as thickness
flex, `dim` 2          triangles, with the radius as thickness
flex, `dim` 3          the surface of the tetrahedra, with all vertices and the radius as thickness
plane                  a half-space (:meth:`hpccd_core.Scene.add_plane`)
sphere, capsule        a point or an edge, with the radius as thickness
box, height field      triangles; of a height field the upper surface
cylinder, ellipsoid    a closed mesh around the shape, at most `tolerance` larger
mesh                   its triangles, or with ``hulls=True`` the convex hull, which MuJoCo collides
=====================  =============================================================================

The tested pairs are those of MuJoCo: it decides by contype and conaffinity, by excluded, welded and joined bodies, and
by predefined pairs. The margins of a pair add up to its separation.

During a step vertices move on straight lines. Where a geom rotates by the angle a, a vertex at the distance r from the
axis is at most r (1 - cos(a / 2)) from its arc; :mod:`hpccd_core.rigid` has proven bounds. Surfaces are not solids:
what is deep inside a box touches nothing.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import mujoco
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"hpccd_core.mujoco: cannot import MuJoCo ({error}); pip install 'hpccd-core[mujoco]'", name=error.name
    ) from None

from .. import arguments
from ..contacts import Contacts
from ..detector import Detector
from ..scene import Scene
from .pairs import Part, ignored_pairs, margins
from .surfaces import surface_of

__all__ = ["MujocoScene"]

_OBJECTS = {"flex": mujoco.mjtObj.mjOBJ_FLEX, "geom": mujoco.mjtObj.mjOBJ_GEOM}


class MujocoScene:
    """A scene of a MuJoCo model, with positions from its data.

    Parameters
    ----------
    model : mujoco.MjModel
    flexes, geoms : iterable of str or int, optional
        Names or numbers of those that become meshes, flexes first. None: all that can collide.
    tolerance : float
        How far the triangles of a cylinder or an ellipsoid may extend beyond it, in the unit of the model.
    hulls : bool
        Whether a mesh is replaced with its convex hull, as in MuJoCo.
    **options
        Options of :class:`hpccd_core.Detector`.

    Attributes
    ----------
    scene : Scene
        Geoms without a name are BODY/NUMBER. Rules that are added before the first use of `detector` count.
    parts : tuple of (str, int)
        "flex" or "geom", and its number in the model, of each mesh and plane of the scene.

    Raises
    ------
    TypeError, ValueError
        If an argument is wrong, a name is unknown, nothing can collide, or a plane is in a body that moves.

    Notes
    -----
    A flex collides with itself where MuJoCo's `selfcollide` is on. Features of it that are closer than twice its radius
    in the initial state are ignored, as they would always be in contact.

    Sizes, radii and rules of collision are those of the model when the scene is made. Make another one after a change.

    Examples
    --------
    A cloth falls on a ball. At the second call it has reached it:

    >>> import mujoco
    >>> from hpccd_core.mujoco import MujocoScene
    >>> model = mujoco.MjModel.from_xml_string('''<mujoco><worldbody>
    ...   <geom name="ball" size="0.3"/>
    ...   <body name="sheet" pos="0 0 1"> <freejoint/> <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/> </body>
    ... </worldbody><deformable>
    ...   <flex name="cloth" dim="2" body="sheet" radius="0.01" element="0 1 2" vertex="-1 -1 0  1 -1 0  0 1 0"/>
    ... </deformable></mujoco>''')
    >>> data = mujoco.MjData(model)
    >>> adapter = MujocoScene(model)
    >>> adapter.scene
    Scene(cloth, ball: 4 vertices, 1 faces)
    >>> for height in (1.0, 0.0):
    ...     data.qpos[2] = height
    ...     mujoco.mj_forward(model, data)
    ...     contacts = adapter.step(data)
    >>> contacts  # after 0.69 of 1 m
    Contacts(1 vertex-face, 0 edge-edge, first at 0.69)
    """

    def __init__(
        self,
        model: Any,
        *,
        flexes: Iterable[str | int] | None = None,
        geoms: Iterable[str | int] | None = None,
        tolerance: float = 1e-3,
        hulls: bool = False,
        **options: Any,
    ) -> None:
        if not isinstance(model, mujoco.MjModel):
            raise TypeError(
                f"model: expected mujoco.MjModel, got {type(model).__name__}; load one with MjModel.from_xml_path()"
            )
        tolerance, hulls = arguments.length("tolerance", tolerance), arguments.flag("hulls", hulls)
        self._model = model
        self._options = options
        self._time = -np.inf
        self.parts: tuple[Part, ...] = (*_chosen(model, "flex", flexes), *_chosen(model, "geom", geoms))
        if not self.parts:
            raise ValueError("model: nothing in it can collide; give the flexes and geoms to use")
        self.scene = Scene()
        self._initial = mujoco.MjData(model)
        mujoco.mj_fwdPosition(model, self._initial)
        rows: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
        local: list[NDArray[np.float64]] = [np.empty((0, 3))]
        geom_of: list[NDArray[np.int64]] = [np.empty(0, np.int64)]
        for kind, number in self.parts:
            name = self._new_name(kind, number)
            if kind == "flex":
                rows.append(self._add_flex(number, name))
            elif model.geom_type[number] == mujoco.mjtGeom.mjGEOM_PLANE:
                self._add_plane(number, name)
            else:
                local.append(self._add_geom(number, name, tolerance, hulls))
                geom_of.append(np.full(len(local[-1]), number))
        self._rows, self._local, self._geom_of = np.concatenate(rows), np.concatenate(local), np.concatenate(geom_of)
        for a, b in ignored_pairs(model, self.parts):
            self.scene.ignore_pair(a, b)
        for a, b, margin in margins(model, self.parts):
            self.scene.set_separation(a, b, margin)
        self._ignore_elements_of_bodies()

    @functools.cached_property
    def detector(self) -> Detector:
        """The detector of the scene, made at its first use."""
        return Detector(self.scene, **self._options)

    def vertices(self, data: Any) -> NDArray[np.float64]:
        """Positions of all vertices of the scene.

        Parameters
        ----------
        data : mujoco.MjData
            Data of the same model. After ``mj_step`` its positions are those at the start of the step, to which its
            contacts belong too; ``mj_forward`` computes those of the present state.

        Returns
        -------
        ndarray, shape (V, 3), float64

        Raises
        ------
        TypeError, ValueError
            If `data` is not the data of such a model, or has no positions yet.
        """
        if not isinstance(data, mujoco.MjData):
            raise TypeError(f"data: expected mujoco.MjData, got {type(data).__name__}; make one with MjData(model)")
        for name, n in (("flexvert_xpos", self._model.nflexvert), ("geom_xpos", self._model.ngeom)):
            if (got := len(getattr(data, name))) != n:
                raise ValueError(f"data: {name} has {got} rows, the model {n}; give data of the same model")
        if not data.xmat[0].any():  # of the world
            raise ValueError("data: has no positions yet; call mujoco.mj_forward(model, data) first")
        n = len(self._rows)
        positions = np.empty((n + len(self._local), 3))
        positions[:n] = data.flexvert_xpos[self._rows]
        turns = data.geom_xmat.reshape(-1, 3, 3)[self._geom_of]
        positions[n:] = np.einsum("vxy,vy->vx", turns, self._local) + data.geom_xpos[self._geom_of]
        return positions

    def step(self, data: Any) -> Contacts:
        """All contacts of the motion from the positions of the last call to these.

        Parameters
        ----------
        data : mujoco.MjData
            As for :meth:`vertices`.

        Returns
        -------
        Contacts
            The first call returns none, and so does one whose ``data.time`` is earlier than that of the call before, as
            after ``mj_resetData`` and where MuJoCo resets a state that is not finite: no motion leads there. Before
            other jumps call ``detector.reset()``.

        Raises
        ------
        TypeError, ValueError
            As for :meth:`vertices`, and if a position is not finite.
        """
        positions = self.vertices(data)
        if data.time < self._time:
            self.detector.reset()
        self._time = float(data.time)
        return self.detector.step(positions)

    def _new_name(self, kind: str, number: int) -> str:
        name = mujoco.mj_id2name(self._model, _OBJECTS[kind], number)
        if not name:
            body = "" if kind == "flex" else self._model.body(int(self._model.geom_bodyid[number])).name
            name = f"{body or kind}/{number}"
        return f"{kind} {name}" if name in self.scene.mesh_names else name

    def _add_flex(self, flex: int, name: str) -> NDArray[np.int64]:
        model = self._model
        dim, radius = int(model.flex_dim[flex]), float(model.flex_radius[flex])
        first, count = int(model.flex_vertadr[flex]), int(model.flex_vertnum[flex])
        selfcollide = bool(
            model.flex_selfcollide[flex]
            and not model.flex_rigid[flex]
            and model.flex_contype[flex] & model.flex_conaffinity[flex]
        )
        faces, edges = ((), self._elements(flex)) if dim == 1 else (self._faces(flex), ())
        self.scene.add_mesh(name, faces, edges=edges, n_vertices=count, self_collision=selfcollide, thickness=radius)
        if selfcollide and radius > 0.0:
            rest = self._initial.flexvert_xpos[first : first + count]
            self.scene.ignore_within(name, rest_vertices=rest, distance=2.0 * radius)
        return np.arange(first, first + count)

    def _add_plane(self, geom: int, name: str) -> None:
        body = int(self._model.geom_bodyid[geom])
        if not self._is_static(body):
            raise ValueError(f"geoms: plane {name!r} is in a body that moves; leave it out of geoms")
        normal = self._initial.geom_xmat[geom].reshape(3, 3)[:, 2]
        self.scene.add_plane(name, normal, float(normal @ self._initial.geom_xpos[geom]))

    def _add_geom(self, geom: int, name: str, tolerance: float, hulls: bool) -> NDArray[np.float64]:
        surface = surface_of(self._model, geom, name, tolerance, hulls)
        static, n = self._is_static(int(self._model.geom_bodyid[geom])), len(surface.vertices)
        if len(surface.faces):
            self.scene.add_mesh(name, surface.faces, n_vertices=n, self_collision=False, static=static)
        else:
            edges, radius = surface.edges, surface.thickness
            self.scene.add_points(name, n, edges=edges, thickness=radius, self_collision=False, static=static)
        return surface.vertices

    def _is_static(self, body: int) -> bool:
        model = self._model
        return bool(model.body_weldid[body] == 0 and model.body_mocapid[model.body_rootid[body]] < 0)

    def _elements(self, flex: int) -> NDArray[np.int32]:
        """(n, dim + 1): the vertices of each element, numbered within the flex."""
        model, corners = self._model, int(self._model.flex_dim[flex]) + 1
        first, count = int(model.flex_elemdataadr[flex]), int(model.flex_elemnum[flex])
        elements: NDArray[np.int32] = model.flex_elem[first : first + corners * count].reshape(count, corners)
        return elements

    def _faces(self, flex: int) -> NDArray[np.int32]:
        model = self._model
        if model.flex_dim[flex] == 2:
            return self._elements(flex)
        first, count = int(model.flex_shelldataadr[flex]), int(model.flex_shellnum[flex])
        shell: NDArray[np.int32] = model.flex_shell[first : first + 3 * count].reshape(count, 3)
        return shell

    def _ignore_elements_of_bodies(self) -> None:
        """MuJoCo tests no element against the geoms of a body that holds one of its vertices, except planes."""
        model = self._model
        for a, (kind, flex) in enumerate(self.parts):
            if kind != "flex" or model.flex_dim[flex] == 1:
                continue
            bodies = model.flex_vertbodyid[model.flex_vertadr[flex] :][self._faces(flex)]
            for b, (other, geom) in enumerate(self.parts):
                if other == "geom" and model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
                    faces = np.flatnonzero((bodies == model.geom_bodyid[geom]).any(axis=1))
                    if len(faces):
                        self.scene.ignore_faces(a, faces, b)


def _chosen(model: Any, kind: str, chosen: Iterable[str | int] | None) -> list[Part]:
    plural = "flexes" if kind == "flex" else "geoms"
    count = int(getattr(model, f"n{kind}"))
    if chosen is None:
        can = getattr(model, f"{kind}_contype") | getattr(model, f"{kind}_conaffinity")
        paired = {*model.pair_geom1.tolist(), *model.pair_geom2.tolist()} if kind == "geom" else set()
        return [(kind, k) for k in range(count) if can[k] or k in paired]
    if isinstance(chosen, str) or not isinstance(chosen, Iterable):
        raise TypeError(
            f"{plural}: expected a list of names or numbers, got {type(chosen).__name__}; write [{chosen!r}]"
        )
    parts: list[Part] = []
    for entry in chosen:
        if isinstance(entry, str):
            number = int(mujoco.mj_name2id(model, _OBJECTS[kind], entry))
            if number < 0:
                names = [mujoco.mj_id2name(model, _OBJECTS[kind], k) or "" for k in range(count)]
                raise ValueError(f"{plural}: there is no {kind} {entry!r}{arguments.did_you_mean(entry, names)}")
        else:
            number = arguments.whole_number(plural, entry, 0, count - 1)
        if (kind, number) in parts:
            raise ValueError(f"{plural}: {entry!r} is given twice; list each once")
        parts.append((kind, number))
    return parts
