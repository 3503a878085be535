# SPDX-License-Identifier: Apache-2.0
"""Meshes of glTF: morph targets, nodes and skins, moved by animations, in metres."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import shortened
from .gltf_animation import Channel, local_matrix
from .gltf_file import GltfFile
from .sequence import FrameSequence, SequenceError, SequenceMesh
from .topology import checked_faces

SUFFIXES = (".gltf", ".glb")
_MOVES = ("translation", "rotation", "scale", "weights")


class GltfScene(FrameSequence):
    """The nodes of the default scene that have a mesh. Its frames are the key frames of all animations.

    Parameters
    ----------
    path : Path
        A .gltf or .glb file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        file = self._file()
        self._parents = self._scene(file.json)
        nodes = file.json.get("nodes", [])
        with_mesh = [k for k in self._parents if "mesh" in nodes[k]]
        if not with_mesh:
            raise SequenceError(f"{path}: its scene has no meshes; export surfaces")
        names = [str(nodes[k].get("name") or f"node {k}") for k in with_mesh]
        self._nodes = dict(sorted(zip(_unique_names(names, with_mesh), with_mesh, strict=True)))
        self._channels = self._animations(file)
        self._times = sorted({float(t) for channel in self._channels.values() for t in channel.times})
        built = {name: self._built(name, node) for name, node in self._nodes.items()}
        self._meshes = tuple(mesh for mesh, _, _ in built.values())
        self._kept = {name: kept for name, (_, kept, _) in built.items()}
        notes = ["units: 1 unit = 1 m", "the Y axis points up; transforms of the scene are applied"]
        if joined := sum(n for _, _, n in built.values()):
            notes.append(f"{joined} vertices coincide with another one in all frames and are joined with it")
        if "EXT_mesh_gpu_instancing" in file.json.get("extensionsUsed", []):
            notes.append("instances (EXT_mesh_gpu_instancing) are left out")
        super().__init__(str(path), max(1, len(self._times)), tuple(notes), up="y")

    def _file(self) -> GltfFile:
        if "file" not in self._opened:
            self._opened["file"] = GltfFile(self._path)
        file: GltfFile = self._opened["file"]
        return file

    def _scene(self, document: dict[str, Any]) -> dict[int, int]:
        """Nodes of the scene with their parents (-1: none), parents first."""
        nodes, scenes = document.get("nodes", []), document.get("scenes", [])
        if scenes:
            roots = scenes[document.get("scene", 0)].get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [k for k in range(len(nodes)) if k not in children]
        parents: dict[int, int] = {}
        waiting = [(root, -1) for root in reversed(roots)]
        while waiting:
            node, parent = waiting.pop()
            if node in parents or not 0 <= node < len(nodes):
                raise SequenceError(f"{self._path}: node {node} has two parents or does not exist; export it again")
            parents[node] = parent
            waiting += [(child, node) for child in reversed(nodes[node].get("children", []))]
        return parents

    def _animations(self, file: GltfFile) -> dict[tuple[int, str], Channel]:
        """Channels by node and value."""
        found: dict[tuple[int, str], Channel] = {}
        moving = self._moving(file.json)
        for animation in file.json.get("animations", []):
            for channel in animation["channels"]:
                target = channel["target"]
                key = (target.get("node", -1), target["path"])
                if key[0] not in moving or key[1] not in _MOVES:
                    continue
                if key in found:
                    name = shortened(file.json["nodes"][key[0]].get("name", key[0]))
                    raise SequenceError(
                        f"{self._path}: several animations move {name}; export one animation, or one file for each"
                    )
                found[key] = self._channel(file, animation["samplers"][channel["sampler"]], key[1])
        return found

    def _moving(self, document: dict[str, Any]) -> set[int]:
        """The nodes that move a vertex: those with a mesh, joints, and the nodes above them."""
        skins = {document["nodes"][node].get("skin") for node in self._nodes.values()} - {None}
        waiting = [*self._nodes.values(), *(joint for skin in skins for joint in document["skins"][skin]["joints"])]
        found = {-1}
        while waiting:
            if (node := waiting.pop()) not in found:
                found.add(node)
                waiting.append(self._parents[node])
        return found - {-1}

    def _channel(self, file: GltfFile, sampler: dict[str, Any], value: str) -> Channel:
        times = file.accessor(sampler["input"])[:, 0].astype(np.float64)
        output = file.accessor(sampler["output"]).astype(np.float64)
        interpolation = sampler.get("interpolation", "LINEAR")
        if not len(times) or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise SequenceError(f"{self._path}: times of an animation do not increase; export it again")
        if interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
            raise SequenceError(f"{self._path}: interpolation {shortened(interpolation)!r} is unknown; use LINEAR")
        shape = (len(times), 3, -1) if interpolation == "CUBICSPLINE" else (len(times), -1)
        return Channel(times, output.reshape(shape), interpolation, value == "rotation")

    def _built(self, name: str, node: int) -> tuple[SequenceMesh, NDArray[np.intp], int]:
        """(mesh, the vertices of the file that are its vertices, number of vertices joined with another)."""
        corners, n = [], 0
        for primitive in self._primitives(node):
            if "extensions" in primitive and "KHR_draco_mesh_compression" in primitive["extensions"]:
                raise SequenceError(f"{self._path}: is compressed with Draco; export it without compression")
            count = self._file().json["accessors"][primitive["attributes"]["POSITION"]]["count"]
            indices = self._file().accessor(primitive["indices"])[:, 0] if "indices" in primitive else np.arange(count)
            if indices.size and not 0 <= indices.min() <= indices.max() < count:
                raise SequenceError(
                    f"{self._path}: {shortened(name)}: a face names vertex {indices.max()}, and the mesh has {count}; "
                    "export it again"
                )
            corners.append(_triangles(indices.astype(np.int64), primitive.get("mode", 4)) + n)
            n += count
        faces = np.concatenate(corners) if corners else np.empty((0, 3), np.int64)
        checked_faces(f"{self._path}: {shortened(name)}", faces, n)
        kept, vertex_of = self._joined(node)
        mesh = SequenceMesh(name, vertex_of[faces].astype(np.uint32), len(kept))
        return mesh, kept, n - len(kept)

    def _primitives(self, node: int) -> list[dict[str, Any]]:
        """Those of triangles."""
        document = self._file().json
        primitives = document["meshes"][document["nodes"][node]["mesh"]]["primitives"]
        return [p for p in primitives if p.get("mode", 4) in (4, 5, 6) and "POSITION" in p["attributes"]]

    def _joined(self, node: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Vertices are doubled where a texture or a normal has a seam: (one of each place, the place of each vertex).

        They are joined only if all morph targets and weights of joints are equal too.
        """
        groups = _grouped(self._attribute(node, "POSITION"))
        for target in range(self._n_targets(node)):
            if groups.max(initial=-1) == len(groups) - 1:
                break
            groups = _grouped(np.column_stack([groups, self._attribute(node, "POSITION", target)]))
        if "skin" in self._file().json["nodes"][node]:
            groups = _grouped(np.column_stack([groups, *self._joints(node)]))
        first = np.full(groups.max(initial=-1) + 1, len(groups))
        np.minimum.at(first, groups, np.arange(len(groups)))
        order = np.argsort(first)
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        return first[order], place[groups]

    def _n_targets(self, node: int) -> int:
        return max((len(p.get("targets", [])) for p in self._primitives(node)), default=0)

    def _attribute(self, node: int, name: str, target: int | None = None) -> NDArray[np.float64]:
        """(n, width) of all primitives, one after the other; 0 where a primitive has none."""
        parts = []
        for primitive in self._primitives(node):
            targets = primitive.get("targets", [])
            of = primitive["attributes"] if target is None else targets[target] if target < len(targets) else {}
            if name in of:
                parts.append(self._file().accessor(of[name]).astype(np.float64))
            else:
                count = self._file().json["accessors"][primitive["attributes"]["POSITION"]]["count"]
                parts.append(np.zeros((count, 3 if name == "POSITION" else 4)))
        return np.concatenate(parts)

    def _joints(self, node: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """((n, 4 k) numbers of joints, their weights)."""
        sets = {name[7:] for p in self._primitives(node) for name in p["attributes"] if name.startswith("JOINTS_")}
        joints, weights = (
            np.concatenate([self._attribute(node, f"{what}_{number}") for number in sorted(sets)], axis=1)
            for what in ("JOINTS", "WEIGHTS")
        )
        return joints, weights

    def _read(self, index: int) -> tuple[str, tuple[SequenceMesh, ...], NDArray[np.float64]]:
        time = self._times[index] if self._times else 0.0
        globals_ = self._global_matrices(time)
        positions = [self._positions(node, self._kept[name], time, globals_) for name, node in self._nodes.items()]
        label = f"{self._path.name} @ {time:g} s" if self._times else self._path.name
        return label, self._meshes, np.concatenate(positions)

    def _global_matrices(self, time: float) -> dict[int, NDArray[np.float64]]:
        nodes = self._file().json["nodes"]
        found: dict[int, NDArray[np.float64]] = {-1: np.eye(4)}
        for node, parent in self._parents.items():
            values = {
                name: self._channels[node, name].at(time) for name in _MOVES[:3] if (node, name) in self._channels
            }
            found[node] = found[parent] @ local_matrix(nodes[node], values)
        return found

    def _positions(
        self, node: int, kept: NDArray[np.intp], time: float, globals_: dict[int, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """(V, 3) of a mesh in the scene."""
        described = self._file().json["nodes"][node]
        vertices = self._attribute(node, "POSITION")
        if (node, "weights") in self._channels:
            weights = self._channels[node, "weights"].at(time)
        else:
            weights = np.array(
                described.get("weights", self._file().json["meshes"][described["mesh"]].get("weights", []))
            )
        for target in np.flatnonzero(weights):
            vertices = vertices + weights[target] * self._attribute(node, "POSITION", int(target))
        vertices = vertices[kept]
        if "skin" not in described:
            return _placed(globals_[node], vertices)
        skin = self._file().json["skins"][described["skin"]]
        matrices = np.stack([globals_[joint] for joint in skin["joints"]])
        if "inverseBindMatrices" in skin:
            inverse = self._file().accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            matrices = matrices @ inverse[: len(matrices)]
        joints, of_joints = (of[kept] for of in self._joints(node))
        moved = np.zeros_like(vertices)
        total = of_joints.sum(axis=1, keepdims=True)
        of_joints = of_joints / np.where(total > 0, total, 1.0)
        for joint in np.unique(joints[of_joints > 0]).astype(int):
            weight = np.where(joints == joint, of_joints, 0.0).sum(axis=1, keepdims=True)
            moved += weight * _placed(matrices[joint], vertices)
        return moved


def _unique_names(names: list[str], nodes: list[int]) -> list[str]:
    """The names; those that are not unique have the number of the node behind them."""
    counts = Counter(names)
    taken = {name for name, count in counts.items() if count == 1}
    for k, (name, node) in enumerate(zip(names, nodes, strict=True)):
        if counts[name] > 1:
            numbered = f"{name} {node}"
            while numbered in taken:
                numbered += f" {node}"
            taken.add(numbered)
            names[k] = numbered
    return names


def _placed(matrix: NDArray[np.float64], vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    if (matrix == np.eye(4)).all():
        return vertices
    return np.asarray(sum((vertices[:, k, None] * matrix[:3, k] for k in range(3)), matrix[:3, 3]))


def _triangles(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(F, 3) corners of a list (4), strip (5) or fan (6)."""
    if mode == 4:
        return indices[: len(indices) // 3 * 3].reshape(-1, 3)
    k = np.arange(max(len(indices) - 2, 0))
    if mode == 5:
        return np.asarray(indices[np.stack([k, k + 1 + k % 2, k + 2 - k % 2], axis=1)])
    return np.asarray(indices[np.stack([k + 1, k + 2, np.zeros_like(k)], axis=1)])


def _grouped(rows: NDArray[Any]) -> NDArray[np.intp]:
    """Number of each row; equal rows have the same."""
    return np.asarray(np.unique(rows, axis=0, return_inverse=True)[1]).reshape(-1)
