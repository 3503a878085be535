# SPDX-License-Identifier: Apache-2.0
"""Meshes, and which pairs of them are tested."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from . import _core, arguments
from .array_types import ArrayLike, MeshName
from .mesh_layout import MeshLayout, mesh_of
from .options import ACCURACIES, Accuracy, Feature

# Most vertices or faces of a scene.
_MOST = 2**32 - 2

_NOT_GIVEN: ArrayLike = ()


class Scene:
    """Meshes of triangles, segments and points with fixed topology, planes, and which pairs of them are tested.

    Vertices and faces are numbered across the scene, in the order in which meshes were added. Model only what the
    application requires: ``self_collision=False`` for bodies that keep their shape, ``static=True`` for meshes that
    never move, :meth:`add_plane` for floors and walls, :meth:`ignore_pair` and :meth:`ignore_within` for pairs that
    cannot or may touch. A scene can be pickled and copied.

    Examples
    --------
    >>> import hpccd_core as hc
    >>> scene = hc.Scene()
    >>> cloth = scene.add_mesh("cloth", hc.shapes.grid(10, 10)[1])
    >>> floor = scene.add_mesh("floor", [[0, 1, 2], [0, 2, 3]], static=True)
    >>> scene
    Scene(cloth, floor: 125 vertices, 202 faces)
    >>> scene.locate(123)
    ('floor', 2)
    """

    def __init__(self) -> None:
        self._core = _core.Scene()
        self._ids: dict[str, int] = {}
        self._planes: set[int] = set()  # their numbers
        self._calls: list[tuple[str, tuple[Any, ...]]] = []  # of the core, in order: a copy repeats them
        self._layout: MeshLayout | None = None  # None: not known since a mesh was added

    def add_mesh(
        self,
        name: str,
        faces: ArrayLike = _NOT_GIVEN,
        *unnamed: Any,
        edges: ArrayLike = _NOT_GIVEN,
        n_vertices: int | None = None,
        self_collision: bool = True,
        static: bool = False,
        thickness: ArrayLike = 0.0,
        shape: ArrayLike | None = None,
    ) -> int:
        """Add a mesh and return its number.

        Parameters
        ----------
        name : str
            Unique name.
        faces : ArrayLike, shape (F, 3), integers
            Triangles, as indices into this mesh's own vertices.
        edges : ArrayLike, shape (E, 2), integers
            Segments beside the edges of the faces, as of a rope. A segment that occurs twice counts once.
        n_vertices : int, optional
            Number of vertices; by default the largest index + 1. Give it if trailing vertices are in no face and no
            edge; such vertices are tested against faces only (:meth:`add_points`: against each other, too).
        self_collision : bool
            Whether contacts within the mesh are reported.
        static : bool
            A promise that the mesh does not move during a step; pairs of static meshes are never tested.
        thickness : ArrayLike, scalar or shape (F,)
            Distance of the surface from the triangles, in the unit of the coordinates: the separation of two features
            is that of their meshes plus the thickness of both. One number, or one for each face; edges and vertices
            have the greatest of their faces. For a mesh without faces, one for each edge.
        shape : ArrayLike, shape (n_vertices, 3), optional
            Positions of the mesh in its own frame, if it keeps its shape: then queries of one frame take its pose
            (:meth:`Detector.distances`) and compute only the positions that they need. With ``static=True`` the mesh
            has no pose: the shape is where it is. Give ``self_collision=False`` too, unless the mesh may intersect
            itself.

        Returns
        -------
        int
            The number of the mesh, 0 for the first one.

        Raises
        ------
        TypeError, ValueError
            If an argument has the wrong type or shape, an index is out of range, or the name is taken.
        """
        if unnamed and isinstance(unnamed[0], (bool, np.bool_, int)):
            raise TypeError(f"add_mesh: options are given by name, as in static=True; got {unnamed[0]} without a name")
        if unnamed:
            raise TypeError(
                "add_mesh: takes a name and faces; vertices are given to detect() and the other queries: write "
                "add_mesh(name, faces, n_vertices=len(vertices))"
            )
        name = arguments.text("name", name)
        if faces is edges is _NOT_GIVEN and n_vertices is None:
            raise TypeError(f"add_mesh: mesh {name!r} has no vertices; give faces, edges or, for particles, n_vertices")
        self_collision, static = arguments.flag("self_collision", self_collision), arguments.flag("static", static)
        indices, segments = arguments.faces(faces), arguments.edges(edges)
        used = max(int(array.max()) + 1 if array.size else 0 for array in (indices, segments))
        positions = None if shape is None else arguments.shape(shape, used, n_vertices)
        if positions is not None:
            n_vertices = len(positions)
        n_vertices = used if n_vertices is None else arguments.whole_number("n_vertices", n_vertices, 0, _MOST)
        numbers = arguments.thickness(thickness)
        n_elements = len(indices) or len(segments) or n_vertices
        if len(numbers) not in (1, n_elements):
            raise ValueError(f"thickness: expected one number or {n_elements}, one for each face, got {len(numbers)}")
        # Copies, because the caller may write to these arrays later.
        self._repeat("add_mesh", (name, indices.copy(), n_vertices, self_collision, static, segments.copy()))
        if numbers.any():
            self._repeat("set_thickness", (self._ids[name], numbers.copy()))
        if positions is not None:
            self._repeat("set_shape", (self._ids[name], positions.copy()))
        return self._ids[name]

    def add_points(
        self,
        name: str,
        n: int,
        *,
        thickness: ArrayLike = 0.0,
        edges: ArrayLike = _NOT_GIVEN,
        self_collision: bool = True,
        static: bool = False,
    ) -> int:
        """Add points or, with a thickness, spheres, and return the number of their mesh.

        Points are tested against faces (`Contacts.vf`), against edges that are in no face (`ve`) and against each other
        (`vv`), of all meshes.

        Parameters
        ----------
        name : str
            Unique name.
        n : int
            Number of vertices.
        thickness : ArrayLike, scalar or shape (n,)
            Radius of the spheres. With edges, one number or one for each edge.
        edges : ArrayLike, shape (E, 2), integers
            Segments between them: with a thickness, capsules. Vertices in an edge are no points: the edge is tested.
        self_collision : bool
            Whether contacts of these points with each other are reported.
        static : bool
            As in :meth:`add_mesh`.

        Returns
        -------
        int

        Raises
        ------
        TypeError, ValueError
            As :meth:`add_mesh`.

        Notes
        -----
        Without a thickness or a separation two points touch only where they coincide.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_points("grains", 2, thickness=0.25)
        >>> start, end = [[0.0, 0, 0], [2, 0, 0]], [[0.0, 0, 0], [0, 0, 0]]
        >>> contacts = hc.Detector(scene).detect(start, end)
        >>> contacts.vv.tolist(), contacts.vv_toc.round(6).tolist()
        ([[0, 1]], [0.75])
        """
        name = arguments.text("name", name)
        if np.ndim(n):
            raise TypeError("n: expected a number of points; give len(points), and the positions to detect()")
        n, segments = arguments.whole_number("n", n, 0, _MOST), arguments.edges(edges)
        self_collision, static = arguments.flag("self_collision", self_collision), arguments.flag("static", static)
        numbers = arguments.thickness(thickness)
        n_elements = len(segments) or n
        if len(numbers) not in (1, n_elements):
            each = f"each edge ({n_elements})" if len(segments) else f"each point ({n_elements})"
            raise ValueError(f"thickness: expected one number, or one for {each}, got {len(numbers)}")
        none = np.empty((0, 3), np.uint32)
        self._repeat("add_mesh", (name, none, n, self_collision, static, segments.copy(), True))
        if numbers.any():
            self._repeat("set_thickness", (self._ids[name], numbers.copy()))
        return self._ids[name]

    def add_plane(
        self, name: str, normal: ArrayLike = (0.0, 0.0, 1.0), offset: float = 0.0, *, static: bool = True
    ) -> int:
        """Add the half-space ``normal . x >= offset``, in which all vertices should stay, and return its number.

        Vertices outside it, or within the separation of its border, are in contact with it: `Contacts.vp`.

        Parameters
        ----------
        name : str
            Unique name; planes are numbered together with the meshes, so every method that takes a mesh for a pair
            takes a plane too.
        normal : ArrayLike, shape (3,)
            Points into the half-space; of any length except 0.
        offset : float
            ``normal . x`` on the plane.
        static : bool
            A static plane is not tested against static meshes.

        Returns
        -------
        int

        Raises
        ------
        TypeError, ValueError
            If an argument has the wrong type or shape, is not finite, or the name is taken.

        Notes
        -----
        Tested by rational arithmetic at every accuracy, whatever `features` says. A plane has no vertices: positions
        are those of the meshes only.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("falling", [[0, 1, 2]])
        >>> _ = scene.add_plane("floor")
        >>> start = [[0.0, 0, 1], [1, 0, 3], [0, 1, 3]]
        >>> end = [[0.0, 0, -1], [1, 0, 1], [0, 1, 1]]
        >>> contacts = hc.Detector(scene).detect(start, end)
        >>> contacts.vp.tolist(), contacts.vp_toc.tolist()
        ([[0, 0]], [0.5])
        """
        name = arguments.text("name", name)
        static, numbers = arguments.flag("static", static), tuple(arguments.vector("normal", normal))
        self._repeat("add_plane", (name, numbers, arguments.real("offset", offset), static))
        return self._ids[name]

    def ignore_pair(self, mesh_a: MeshName, mesh_b: MeshName) -> None:
        """Never report contacts between two meshes.

        Parameters
        ----------
        mesh_a, mesh_b : str or int
            Names or numbers of the meshes; the same mesh twice means its self-contact.
        """
        self._call("ignore_pair", mesh_a, mesh_b)

    def set_accuracy(self, mesh_a: MeshName, mesh_b: MeshName, accuracy: Accuracy) -> None:
        """Test a pair of meshes at another accuracy than the detector's.

        Parameters
        ----------
        mesh_a, mesh_b : str or int
            Names or numbers of the meshes; the same mesh twice means its self-contact.
        accuracy : {"exact", "conservative", "balanced", "fast"}
        """
        arguments.choice("accuracy", accuracy, ACCURACIES)
        self._call("set_accuracy", mesh_a, mesh_b, accuracy)

    def set_separation(self, mesh_a: MeshName, mesh_b: MeshName, separation: float) -> None:
        """Report features of a pair of meshes that come within a distance, instead of the detector's.

        Parameters
        ----------
        mesh_a, mesh_b : str or int
            Names or numbers of the meshes; the same mesh twice means its self-contact.
        separation : float
            Euclidean distance in the unit of the coordinates; 0 reports only contact.

        Notes
        -----
        A detector that was made before keeps its separations: use :meth:`Detector.set_separation`.
        """
        self._call("set_separation", mesh_a, mesh_b, arguments.separation(separation))

    def set_features(self, mesh_a: MeshName, mesh_b: MeshName, features: Feature | Iterable[Feature]) -> None:
        """Test only some kinds of features between two meshes, instead of the detector's.

        Parameters
        ----------
        mesh_a, mesh_b : str or int
            Names or numbers of the meshes; the same mesh twice means its self-contact.
        features : {"vertex_face", "edge_edge"} or both
            Kinds that are left out cost nothing. Intersections and distances always consider whole surfaces.
        """
        names = arguments.feature_names(features)
        self._call("set_features", mesh_a, mesh_b, ("vertex_face" in names, "edge_edge" in names))

    def ignore_within(
        self,
        mesh: MeshName,
        *,
        rings: int | None = None,
        rest_vertices: ArrayLike | None = None,
        distance: float | None = None,
    ) -> None:
        """Never report contacts between neighbouring features of one mesh.

        For cloth whose separation and thickness exceed the smallest gap between its neighbours, which are then always
        in contact. Give `rings`, or `rest_vertices` and `distance`; several calls add up.

        Parameters
        ----------
        mesh : str or int
            Name or number of the mesh.
        rings : int
            Two features are ignored if a vertex of one is joined to a vertex of the other by at most this many edges,
            those of faces and those given as `edges`. 0: features that share a vertex, which are always ignored.
        rest_vertices : ArrayLike, shape (V, 3)
            Positions of the mesh at rest, in the unit of the coordinates.
        distance : float
            Two features are ignored if their distance at rest is at most this: a vertex and a face, two edges, or, for
            intersections, an edge and a face. It is decided exactly, on the given numbers.

        Raises
        ------
        TypeError, ValueError
            If an argument has the wrong type or shape, is negative or not finite, or if neither or both of the filters
            are given.

        Notes
        -----
        Ignored pairs count nowhere: not in contacts, proximity, intersections, steps and motions. `Detector.distances`
        returns the smallest distance of the pairs that remain: with the positions at rest it shows whether a filter is
        wide enough. Doubled vertices are not joined by an edge: join them with :func:`hpccd_core.weld`, or use a rest
        filter with distance 0. :class:`Detector` searches for the pairs of rest filters once, when it is made.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.grid(4, 4)
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("cloth", faces)
        >>> len(hc.Detector(scene).proximity(vertices, 0.6).vf)
        176
        >>> scene.ignore_within("cloth", rings=1)
        >>> len(hc.Detector(scene).proximity(vertices, 0.6).vf)
        0
        """
        number = self._number_of_mesh("mesh", mesh)
        if rings is not None and rest_vertices is None and distance is None:
            self._repeat("ignore_rings", (number, arguments.whole_number("rings", rings, 0, _MOST)))
            return
        if rings is not None or rest_vertices is None or distance is None:
            raise TypeError("ignore_within: give either rings, or rest_vertices and distance")
        positions, n = arguments.reals("rest_vertices", rest_vertices), self._n_vertices_of(number)
        if positions.shape != (n, 3):
            raise ValueError(
                f"rest_vertices: expected shape ({n}, 3), the vertices of this mesh alone, got {positions.shape}"
            )
        self._repeat("ignore_at_rest", (number, positions.copy(), arguments.length("distance", distance)))

    def ignore_faces(self, mesh: MeshName, faces: ArrayLike, other: MeshName) -> None:
        """Never report contacts between some faces of a mesh and another mesh, or the mesh itself.

        Parameters
        ----------
        mesh : str or int
            Name or number of the mesh.
        faces : ArrayLike, shape (K,), integers
            Numbers of its faces. Their edges and vertices are ignored too, unless they are in a face that is not
            listed. Several calls add up.
        other : str or int
            Name or number of the other mesh. The mesh itself: then against all of its features.

        Raises
        ------
        TypeError, ValueError
            If an argument has the wrong type or shape, or a face is out of range.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("cloth", hc.shapes.grid(10, 10)[1])
        >>> _ = scene.add_mesh("robot", [[0, 1, 2]])
        >>> scene.ignore_faces("cloth", [0, 1], "robot")  # where the robot holds it
        """
        pair = self._number_of_mesh("mesh", mesh), self._number("other", other)
        numbers = arguments.integers("faces", faces)
        if numbers.size == 0:
            numbers = np.empty(0, np.uint32)
        elif numbers.ndim != 1:
            raise ValueError(f"faces: expected shape (K,), numbers of faces of the mesh, got {numbers.shape}")
        n = self._n_faces_of(pair[0])
        if numbers.size and not (0 <= numbers.min() and numbers.max() < n):
            least, greatest = (arguments.shown(int(end)) for end in (numbers.min(), numbers.max()))
            raise ValueError(f"faces: numbers of this mesh's faces lie below {n}, got {least} to {greatest}")
        self._repeat("ignore_faces", (pair[0], numbers.astype(np.uint32), pair[1]))

    def ignore_features(
        self, vf: ArrayLike = _NOT_GIVEN, ee: ArrayLike = _NOT_GIVEN, ef: ArrayLike = _NOT_GIVEN
    ) -> None:
        """Never report single pairs of features. Several calls add up.

        Parameters
        ----------
        vf : ArrayLike, shape (N, 2), integers
            Vertex and face, in scene-wide indices, as rows of ``contacts.vf``.
        ee : ArrayLike, shape (M, 4), integers
            The vertices of two edges, in scene-wide indices, as rows of ``contacts.ee``. The order of the edges, and of
            the vertices of each, does not matter. A point of :meth:`add_points` is an edge with its vertex twice:
            ``[v, v, w, w]`` for a row of ``contacts.vv``, ``[v, v, a, b]`` of ``ve``.
        ef : ArrayLike, shape (K, 3), integers
            The vertices of an edge, and a face, in scene-wide indices, as rows of ``intersections.ef``.

        Raises
        ------
        TypeError, ValueError
            If an argument has the wrong type or shape, or an index is out of range. :class:`Detector` raises ValueError
            if the vertices of a row are not joined by an edge.

        Examples
        --------
        Ignore everything that is near at the start:

        >>> import hpccd_core as hc
        >>> vertices, faces = hc.shapes.grid(4, 4)
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("cloth", faces)
        >>> near = hc.Detector(scene).proximity(vertices, 0.6)
        >>> scene.ignore_features(near.vf, near.ee)
        >>> len(hc.Detector(scene).proximity(vertices, 0.6).ee)
        0
        """
        rows = arguments.index_rows("vf", vf, 2), arguments.index_rows("ee", ee, 4), arguments.index_rows("ef", ef, 3)
        self._repeat("ignore_features", tuple(array.copy() for array in rows))

    # Not from the layout: filters that are added between meshes would each make another one.
    def _n_vertices_of(self, number: int) -> int:
        last = number + 1 == len(self._ids)
        return (self.n_vertices if last else self._core.first_vertex(number + 1)) - self._core.first_vertex(number)

    def _n_faces_of(self, number: int) -> int:
        last = number + 1 == len(self._ids)
        return (self.n_faces if last else self._core.first_face(number + 1)) - self._core.first_face(number)

    def _call(self, name: str, mesh_a: MeshName, mesh_b: MeshName, *values: Any) -> None:
        pair = self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b)
        self._repeat(name, (*pair, *values))

    def _repeat(self, name: str, values: tuple[Any, ...]) -> None:
        """A call of the core, whose arguments are kept in a form that can be pickled."""
        given = values
        if name == "set_accuracy":
            given = (*values[:2], getattr(_core.Accuracy, values[2]))
        elif name == "set_features":
            given = (*values[:2], _core.TestedFeatures(*values[2]))
        number = getattr(self._core, name)(*given)
        if name in ("add_mesh", "add_plane"):
            self._ids[values[0]], self._layout = number, None
        if name == "add_plane":
            self._planes.add(number)
        self._calls.append((name, values))

    def __getstate__(self) -> dict[str, Any]:
        """The calls, and attributes that a user or a derived class added."""
        made = ("_core", "_ids", "_planes", "_layout")
        return {name: value for name, value in vars(self).items() if name not in made}

    def __setstate__(self, state: dict[str, Any]) -> None:
        Scene.__init__(self)
        vars(self).update(state, _calls=[])
        for name, values in state["_calls"]:
            self._repeat(name, values)

    def _has_shapes(self) -> bool:
        return any(name == "set_shape" for name, _ in self._calls)

    def _vertices_without_shape(self) -> int:
        """Number of vertices of the meshes that have no shape."""
        return self.n_vertices - sum(len(values[1]) for name, values in self._calls if name == "set_shape")

    def _posed_meshes(self) -> list[str]:
        """Names of the meshes that take a pose, in the order added: with a shape, and not static."""
        names = self.mesh_names
        static = {values[0] for name, values in self._calls if name == "add_mesh" and values[4]}
        shaped = [names[values[0]] for name, values in self._calls if name == "set_shape"]
        return [name for name in shaped if name not in static]

    def _has_points(self) -> bool:
        return any(name == "add_mesh" and len(values) > 6 for name, values in self._calls)

    def _n_enabled_pairs(self) -> int:
        """How many pairs of meshes are tested, a mesh with itself included: by the rules of the core."""
        moves: list[bool] = []
        by_itself: list[bool] = []
        planes: list[bool] = []
        for name, values in self._calls:
            if name in ("add_mesh", "add_plane"):
                planes.append(name == "add_plane")
                moves.append(not values[-1] if planes[-1] else not values[4])
                by_itself.append(not planes[-1] and values[3] and not values[4])
        ignored = {tuple(sorted(values)) for name, values in self._calls if name == "ignore_pair"}
        n_ignored: int = sum(
            by_itself[a] if a == b else (moves[a] or moves[b]) and not (planes[a] and planes[b]) for a, b in ignored
        )
        at_rest = [plane for plane, moving in zip(planes, moves, strict=True) if not moving]
        pairs, between = math.comb(len(moves), 2) - math.comb(len(at_rest), 2), math.comb(sum(planes), 2)
        return pairs - (between - math.comb(sum(at_rest), 2)) + sum(by_itself) - n_ignored

    def _number(self, name: str, mesh: MeshName) -> int:
        return arguments.mesh_number(name, mesh, self._ids)

    def _number_of_mesh(self, name: str, mesh: MeshName) -> int:
        number = self._number(name, mesh)
        if number in self._planes:
            plane = self.mesh_names[number]
            raise ValueError(f"{name}: {plane!r} is a plane, which has no faces; use ignore_pair")
        return number

    @property
    def n_vertices(self) -> int:
        """Number of vertices of all meshes."""
        return self._core.n_vertices

    @property
    def n_faces(self) -> int:
        """Number of triangles of all meshes."""
        return self._core.n_faces

    @property
    def mesh_names(self) -> list[str]:
        """Names in the order added."""
        return list(self._ids)

    @property
    def layout(self) -> MeshLayout:
        """Names of the meshes, and where their vertices and faces begin in the numbering of the scene."""
        if self._layout is None:
            firsts = [(self._core.first_vertex(k), self._core.first_face(k)) for k in self._ids.values()]
            offsets = np.array([*firsts, (self.n_vertices, self.n_faces)], np.int64)
            planes = np.array(sorted(self._planes), np.uint32)
            self._layout = MeshLayout(tuple(self._ids), offsets[:, 0].copy(), offsets[:, 1].copy(), planes)
        return self._layout

    @overload
    def locate(self, vertex: NDArray[np.integer[Any]]) -> tuple[NDArray[np.intp], NDArray[np.intp]]: ...

    @overload
    def locate(self, *, face: NDArray[np.integer[Any]]) -> tuple[NDArray[np.intp], NDArray[np.intp]]: ...

    @overload
    def locate(self, vertex: int | np.integer[Any]) -> tuple[str, int]: ...

    @overload
    def locate(self, *, face: int | np.integer[Any]) -> tuple[str, int]: ...

    def locate(self, vertex: Any = None, *, face: Any = None) -> tuple[Any, Any]:
        """The mesh of a scene-wide index, and the index within that mesh.

        Parameters
        ----------
        vertex : int or ndarray of int, shape (N,) or (N, 4)
            Scene-wide index of a vertex, as in ``contacts.vf[:, 0]`` and ``contacts.ee``. A row of ``contacts.vf`` is a
            vertex and a face: give each by itself.
        face : int or ndarray of int, shape (N,)
            Scene-wide index of a face, as in ``contacts.vf[:, 1]``. Give one of both.

        Returns
        -------
        mesh : str, or ndarray of int for an array
            Name of the mesh; for an array of indices the number of the mesh of each, see `mesh_names`.
        index : int, or ndarray of int for an array
            Index within that mesh.

        Raises
        ------
        TypeError, ValueError
            If an index is not an integer, or beyond the scene.

        Examples
        --------
        >>> import hpccd_core as hc
        >>> scene = hc.Scene()
        >>> _ = scene.add_mesh("a", [[0, 1, 2]]), scene.add_mesh("b", [[0, 1, 2], [0, 2, 3]])
        >>> scene.locate(3), scene.locate(face=2)
        (('b', 0), ('b', 1))
        """
        if (vertex is None) == (face is None):
            raise TypeError("locate: give either vertex or face")
        name, value, total = ("vertex", vertex, self.n_vertices) if face is None else ("face", face, self.n_faces)
        indices = arguments.integers(name, value)
        if total == 0 and indices.size:
            raise ValueError(f"{name}: the scene has no {name}; add_mesh comes first")
        offsets = self.layout.vertex_offsets if face is None else self.layout.face_offsets
        if indices.ndim == 0:
            index = arguments.whole_number(name, value, 0, total - 1)
            mesh = int(mesh_of(np.array(index), offsets))
            return self.layout.mesh_names[mesh], index - int(offsets[mesh])
        if indices.ndim > 1 and not (vertex is not None and indices.shape[1:] == (4,)):
            raise ValueError(
                f"{name}: expected shape (N,), or (N, 4) as contacts.ee has, got {indices.shape}; of contacts.vf give "
                "vertex=contacts.vf[:, 0] or face=contacts.vf[:, 1]"
            )
        if indices.size and not (0 <= indices.min() and indices.max() < total):
            least, greatest = (arguments.shown(int(end)) for end in (indices.min(), indices.max()))
            row = "; of a row of contacts.vf give vertex=row[0] or face=row[1]" if indices.shape == (2,) else ""
            raise ValueError(f"{name}: indices must lie in [0, {total - 1}], got {least} to {greatest}{row}")
        meshes = mesh_of(indices, offsets)
        return meshes, indices.astype(np.intp) - offsets[meshes]

    def vertex_offset(self, mesh: MeshName) -> int:
        """The scene-wide index of the first vertex of a mesh, given by name or number."""
        return self._core.first_vertex(self._number("mesh", mesh))

    def face_offset(self, mesh: MeshName) -> int:
        """The scene-wide index of the first face of a mesh, given by name or number."""
        return self._core.first_face(self._number("mesh", mesh))

    def __repr__(self) -> str:
        n_edges = self._core.n_edges
        edges = f", {n_edges} edges in no face" if n_edges else ""
        return f"Scene({', '.join(self._ids)}: {self.n_vertices} vertices, {self.n_faces} faces{edges})"


arguments.hide_unnamed(Scene.add_mesh)
