# SPDX-License-Identifier: Apache-2.0
"""Pairs of a scene that the core found, against the oracle's; and the same scene under other names."""

import dataclasses

import numpy as np

# A time, or a distance as a part of the scene's size.
TOLERANCE = 1e-12


def rows(array):
    return list(map(tuple, np.asarray(array).tolist()))


def assert_pairs(found, truth, value, accuracy="exact", size=1.0):
    """Vertex-face and edge-edge pairs with their values ("toc" or "distance"): as the accuracy promises."""
    for kind in ("vf", "ee"):
        pairs, true_pairs = (np.asarray(getattr(result, kind)) for result in (found, truth))
        in_order = np.lexsort(true_pairs.T[::-1])
        if not np.array_equal(pairs, true_pairs[in_order]):
            listed, true = rows(pairs), set(rows(true_pairs))
            assert listed == sorted(set(listed)), "in order, each once"
            missed, invented = true - set(listed), set(listed) - true
            assert not missed, f"{kind}: {len(missed)} missed, such as {min(missed)}"
            assert not invented, f"{kind}: {len(invented)} invented, such as {min(invented)}"
        errors = getattr(found, f"{kind}_{value}") - np.asarray(getattr(truth, f"{kind}_{value}"))[in_order]
        if accuracy == "conservative" and value == "toc":  # may be early
            assert errors.max(initial=0.0) <= 1e-15 * size
        else:
            assert np.abs(errors).max(initial=0.0) <= TOLERANCE * size


def size_of(*positions):
    return max(float(np.abs(p).max(initial=0.0)) for p in positions)


@dataclasses.dataclass
class Renamed:
    """A scene of random_scenes.py with its vertices and faces in another order, and the corners of faces too.

    vertex, face: for each new scene-wide index the old one.
    """

    meshes: object
    vertex: np.ndarray
    face: np.ndarray

    def vf(self, pairs, values):
        """Pairs and values of the renamed scene, as those of the original, in its order."""
        return self._sorted([(int(self.vertex[v]), int(self.face[f])) for v, f in pairs.tolist()], values)

    def ee(self, pairs, values):
        old = [tuple(sorted(e)) for e in self.vertex[pairs.reshape(-1, 2)].tolist()]
        return self._sorted([sum(sorted(pair), ()) for pair in zip(old[::2], old[1::2], strict=True)], values)

    def ef(self, pairs):
        return sorted((*sorted(self.vertex[[a, b]].tolist()), int(self.face[f])) for a, b, f in pairs.tolist())

    @staticmethod
    def _sorted(pairs, values):
        return sorted(zip(pairs, values.tolist(), strict=True))


def renamed(rng, meshes):
    faces, edges, vertex, face = [], [], [], []
    first_vertex = first_face = 0
    for of_mesh, edges_of_mesh, n in zip(meshes.faces, meshes.edges, meshes.n_vertices, strict=True):
        order, face_order = rng.permutation(n), rng.permutation(len(of_mesh))
        place = np.argsort(order)
        faces.append(rng.permuted(place[of_mesh[face_order]].reshape(-1, 3), axis=1))
        edges.append(rng.permuted(place[rng.permutation(edges_of_mesh)].reshape(-1, 2), axis=1))
        vertex.append(order + first_vertex)
        face.append(face_order + first_face)
        first_vertex, first_face = first_vertex + n, first_face + len(of_mesh)
    vertex, face = np.concatenate(vertex), np.concatenate(face)
    same = dataclasses.replace(
        meshes, faces=faces, edges=edges, vertices_t0=meshes.vertices_t0[vertex], vertices_t1=meshes.vertices_t1[vertex]
    )
    return Renamed(same, vertex, face)
