# SPDX-License-Identifier: Apache-2.0
"""Meshes, and which pairs of them matter."""

from collections.abc import Iterable

from numpy.typing import ArrayLike

from . import _core, arguments
from .options import ACCURACIES, Accuracy, Feature


class Scene:
    """Meshes of triangles and of edges alone, with fixed topology; their vertices are concatenated in the order added.

    Model only what the scene requires: ``self_collision=False`` for bodies that keep their shape, ``static=True`` for
    meshes that never move, :meth:`ignore_pair` for pairs that cannot or may touch.
    """

    def __init__(self) -> None:
        self._core = _core.Scene()
        self._ids: dict[str, int] = {}

    def add_mesh(
        self,
        name: str,
        faces: ArrayLike = (),
        *,
        edges: ArrayLike = (),
        n_vertices: int | None = None,
        self_collision: bool = True,
        static: bool = False,
    ) -> int:
        """Add a mesh and return its number.

        name: unique string. faces: (F, 3) integers, indices into this mesh's own vertices. edges: (E, 2) integers,
        likewise: edges beside those of the faces, as of a rope or a rod. They are tested as all edges are, their
        vertices as all vertices. One that is given twice, or is a face's too, counts once. n_vertices: how many
        vertices the mesh has; by default the largest index + 1; give it where trailing vertices are in no face and no
        edge (such vertices are tested against faces too). self_collision: whether contacts within the mesh matter.
        static: a promise that the mesh does not move during a step (detect() refuses one that does); pairs of static
        meshes are never tested.

        Raises TypeError or ValueError naming the argument, also where an index is out of range.
        """
        name = arguments.text("name", name)
        self_collision, static = arguments.flag("self_collision", self_collision), arguments.flag("static", static)
        indices, segments = arguments.faces(faces), arguments.edges(edges)
        used = max(int(array.max()) + 1 if array.size else 0 for array in (indices, segments))
        n_vertices = used if n_vertices is None else arguments.whole_number("n_vertices", n_vertices, 0, 2**32 - 2)
        number = self._core.add_mesh(name, indices, n_vertices, self_collision, static, segments)
        self._ids[name] = number
        return number

    def ignore_pair(self, mesh_a: str | int, mesh_b: str | int) -> None:
        """Never report contacts between these two meshes (names or numbers); the same mesh twice: within it."""
        self._core.ignore_pair(self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b))

    def set_accuracy(self, mesh_a: str | int, mesh_b: str | int, accuracy: Accuracy) -> None:
        """Test this pair of meshes (names or numbers) at another accuracy than the detector's."""
        arguments.choice("accuracy", accuracy, ACCURACIES)
        self._core.set_accuracy(
            self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b), getattr(_core.Accuracy, accuracy)
        )

    def set_separation(self, mesh_a: str | int, mesh_b: str | int, separation: float) -> None:
        """Report pairs of these two meshes (names or numbers) that come within this distance, Euclidean and in units of
        the coordinates, instead of the detector's minimum_separation; the same mesh twice: within it; 0: that touch."""
        self._core.set_separation(
            self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b), arguments.length("separation", separation)
        )

    def set_features(self, mesh_a: str | int, mesh_b: str | int, features: Feature | Iterable[Feature]) -> None:
        """Test only these pairs of features between two meshes (names or numbers), instead of the detector's features.

        features: "vertex_face", "edge_edge" or both; the same mesh twice: within it. What is left out costs nothing.
        Intersections and smallest distances look at whole surfaces all the same. To test nothing: ignore_pair.
        """
        names = arguments.feature_names(features)
        tested = _core.TestedFeatures("vertex_face" in names, "edge_edge" in names)
        self._core.set_features(self._number("mesh_a", mesh_a), self._number("mesh_b", mesh_b), tested)

    def _number(self, name: str, mesh: str | int) -> int:
        return arguments.mesh_number(name, mesh, self._ids)

    @property
    def n_vertices(self) -> int:
        """Vertices of all meshes together."""
        return self._core.n_vertices

    @property
    def n_faces(self) -> int:
        """Triangles of all meshes together."""
        return self._core.n_faces

    @property
    def mesh_names(self) -> list[str]:
        """Names in the order added."""
        return list(self._ids)

    def vertex_offset(self, mesh: str | int) -> int:
        """The scene-wide index of the mesh's first vertex."""
        return self._core.first_vertex(self._number("mesh", mesh))

    def face_offset(self, mesh: str | int) -> int:
        """The scene-wide index of the mesh's first face."""
        return self._core.first_face(self._number("mesh", mesh))

    def __repr__(self) -> str:
        n_edges = self._core.n_edges
        edges = f", {n_edges} edges beside" if n_edges else ""
        return f"Scene({', '.join(self._ids)}: {self.n_vertices} vertices, {self.n_faces} faces{edges})"
