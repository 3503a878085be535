# SPDX-License-Identifier: Apache-2.0
"""Motion steps to measure: of a generated scene, a recording, a mesh file, or a file with one step."""

from __future__ import annotations

import dataclasses
import os
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

import hpccd_core as hc
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import suggestion
from hpccd_ros.scenes.scene import Mesh

# Table 1 of Kim et al. 2009, in its order: generated scenes of the same size and character.
TABLE_1 = ("cloth-ball-like", "breaking-like", "n-body-like-lr", "n-body-like-hr")
MESH_FILES = (".obj", ".ply", ".stl", ".dae")
MESH_STEPS = 32  # of a mesh file
STEP = {"vertices_t0", "vertices_t1", "faces"}  # of an .npz file
TRUTH = {"vf": (2,), "ee": (4,), "vf_toc": (), "ee_toc": ()}  # and of its contacts, each row
TRUTH_SHAPES = "vf (N,2), vf_toc (N,), ee (M,4), ee_toc (M,)"
# TypeError: an array alone, which is no archive. The others: what zipfile and numpy raise of damaged files and of files
# packed in ways that they do not know.
UNREADABLE = (
    *(OSError, ValueError, TypeError, EOFError, NotImplementedError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError),
)


@dataclasses.dataclass(frozen=True, eq=False)
class Step:
    """Motion of all meshes from vertices_t0 to vertices_t1, each (V,3), meshes one after the other.

    topology   equal for steps between which no mesh changes its faces
    truth      {"vf", "vf_toc", "ee", "ee_toc"} as in hpccd_core.Contacts where it is known, else None
    """

    meshes: tuple[Mesh, ...]
    topology: object
    vertices_t0: np.ndarray
    vertices_t1: np.ndarray
    ignored_pairs: tuple[tuple[str, str], ...] = ()
    truth: dict[str, np.ndarray] | None = None

    @property
    def triangles(self) -> int:
        return sum(len(mesh.faces) for mesh in self.meshes)

    def scene(self) -> hc.Scene:
        scene = hc.Scene()
        for mesh in self.meshes:
            how = {"n_vertices": mesh.n_vertices, "static": mesh.static, "self_collision": mesh.self_collision}
            scene.add_mesh(mesh.name, mesh.faces, edges=mesh.edges, **how)
        for a, b in self.ignored_pairs:
            scene.ignore_pair(a, b)
        return scene

    def faces(self) -> np.ndarray:
        """Faces of all meshes (F,3) int64, scene-wide indices."""
        offsets = np.cumsum([0] + [mesh.n_vertices for mesh in self.meshes])
        return np.concatenate([m.faces.astype(np.int64) + o for m, o in zip(self.meshes, offsets, strict=False)])

    def as_one_mesh(self) -> Step:
        """The same triangles, everything tested against everything: what a peer without such options tests."""
        whole = Mesh("all", self.faces().astype(np.uint32), len(self.vertices_t0))
        return dataclasses.replace(self, meshes=(whole,), ignored_pairs=(), truth=None)


@dataclasses.dataclass(frozen=True)
class Source:
    """A named sequence of steps. `step(k)`, 0 <= k < n_steps, in any order; None where step k has no motion that
    could be tested (a topology that changes without saying where its new vertices came from)."""

    name: str
    n_steps: int
    step: Callable[[int], Step | None]

    def first(self) -> Step:
        """The first step with a motion."""
        return next(step for step in map(self.step, range(self.n_steps)) if step is not None)

    def spread(self, count: int) -> list[int]:
        """`count` steps evenly spread over the sequence, its last among them; all where count is 0."""
        if count <= 0 or count >= self.n_steps:
            return list(range(self.n_steps))
        return sorted({round((k + 1) * self.n_steps / count) - 1 for k in range(count)})


def data_folder(folder: str | None) -> Path | None:
    """The folder of scene files: that of the option --data, or that in the variable HPCCD_DATA, or None."""
    name = folder or os.environ.get("HPCCD_DATA")
    if not name:
        return None
    if not Path(name).is_dir():
        raise UserError(f"{'--data' if folder else 'HPCCD_DATA'}: {name} is not a folder")
    return Path(name)


def data_files(folder: Path | None) -> list[Path]:
    """Files with a motion step in `folder`."""
    return [path for path in sorted(folder.glob("*.npz")) if _holds_step(path)] if folder else []


def resolve(words: Sequence[str], data: Path | None, default: Sequence[str], size: float = 1.0) -> list[Source]:
    """Sources by name; `default` where no words are given.

    A word is "data" (every step file of the data folder), the name of one of them, the path of a recording (.mcap or
    its folder), of a mesh file or of an .npz file with one step, or the name of a generated scene, made with `size`.
    """
    if data is None and "data" in words:
        raise UserError("data: set HPCCD_DATA, or give the folder with --data DIR")
    found: list[tuple[str, Source]] = []
    for word in words or default:
        if word == "data":
            found += [(str(path), of_npz(path)) for path in data_files(data)]
        else:
            found.append((word, _one(word, data, size)))
    if not found:
        raise UserError(
            "nothing to measure: name a scene (see `hpccd scene --list`), a recording or a mesh file, or set HPCCD_DATA"
        )
    # Files with the same name get different names, because results are kept by name.
    names = [source.name for _, source in found]
    return [
        dataclasses.replace(source, name=word) if names.count(source.name) > 1 else source for word, source in found
    ]


def _one(word, data, size):
    from hpccd_ros import scenes

    if word in scenes.names():
        return of_scene(word, size)
    path = Path(word)
    try:
        path.exists()
    except OSError as error:  # a name that is too long
        raise UserError(f"{word[:40]}...: {error.strerror}; name a file or a scene") from error
    if path.suffix == ".npz" and path.is_file():
        return of_npz(path)
    if path.suffix.lower() in MESH_FILES and path.is_file():
        return of_mesh(path)
    if path.exists():
        return of_recording(path)
    if data and (data / f"{word}.npz").is_file():
        return of_npz(data / f"{word}.npz")
    files = [path.stem for path in data_files(data)]
    near = suggestion(word, [*scenes.names(), *files])
    raise UserError(
        f"{word}: neither a file, nor a generated scene ({', '.join(scenes.names())}), nor a data file "
        f"({', '.join(files) or 'none (HPCCD_DATA is not set)'}){near}"
    )


def of_scene(name: str, size: float = 1.0, make: Callable | None = None) -> Source:
    """A generated scene. make: by default hpccd_ros.scenes.make."""
    from hpccd_ros import scenes

    try:
        scene = (make or scenes.make)(name, size, progress=True)
    except ValueError as error:
        raise UserError(str(error)) from error
    changes: dict[int, int] = {}

    def topology(frame):
        # The number of the last frame up to this one at which a mesh changed its faces.
        if frame not in changes:
            changes[frame] = frame if frame == 0 or scene.frame(frame).topologies else topology(frame - 1)
        return changes[frame]

    @lru_cache(maxsize=2)
    def step(k):
        frame = scene.frame(k + 1)
        before = frame.start if frame.start is not None else scene.frame(k)
        meshes = tuple(
            Mesh(mesh.name, faces, len(xyz), mesh.static, mesh.self_collision)
            for mesh, faces, xyz in zip(scene.meshes, scene.faces(k + 1), frame, strict=True)
        )
        return Step(meshes, topology(k + 1), np.concatenate(before), np.concatenate(frame), scene.ignored_pairs)

    shown = name if size == 1 else f"{name} x {size:g}"
    return Source(shown, scene.n_frames - 1, step)


def of_npz(path: Path) -> Source:
    """A file with one step: vertices_t0, vertices_t1 (V,3), faces (F,3), and its contacts where they are known."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {key: archive[key] for key in archive.files}
    except UNREADABLE as error:
        raise UserError(f"{path}: not an .npz file of numbers ({error}); write it with numpy.savez") from error
    if not STEP <= arrays.keys():
        raise UserError(f"{path}: holds {', '.join(arrays)}; a step has {', '.join(sorted(STEP))}")
    t0, t1, faces = arrays["vertices_t0"], arrays["vertices_t1"], arrays["faces"]
    try:
        scene = hc.Scene()
        scene.add_mesh("scene", faces, n_vertices=len(t0))
        hc.Detector(scene, backend="cpu", threads=1, report="any").detect(t0, t1)
    except (TypeError, ValueError) as error:
        raise UserError(f"{path}: not a step: {error}") from error
    if not len(faces):
        raise UserError(f"{path}: there are no faces to measure")
    known = None
    if TRUTH.keys() <= arrays.keys():
        known = {key: arrays[key] for key in TRUTH}
        for key, width in TRUTH.items():
            if known[key].shape != (*known[key[:2]].shape[:1], *width) or known[key].dtype.kind not in "iuf":
                raise UserError(f"{path}: {key} has shape {known[key].shape}; contacts are {TRUTH_SHAPES}")
    step = Step((Mesh("scene", faces, len(t0)),), 0, t0, t1, truth=known)
    return Source(path.stem, 1, lambda k: step)


def of_mesh(path: Path) -> Source:
    """A mesh file and a copy of it, which starts beside the mesh, moves through it along x and turns about x by a
    quarter on the way."""
    try:
        xyz, faces = hc.load_mesh(path)
    except hc.MeshFileError as error:
        raise UserError(str(error)) from error
    meshes = tuple(Mesh(name, faces, len(xyz)) for name in ("mesh", "copy"))
    low, high = xyz.min(axis=0), xyz.max(axis=0)

    def copy(part):
        cos, sin = np.cos(0.5 * np.pi * part), np.sin(0.5 * np.pi * part)
        turned = (xyz - (low + high) / 2) @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]])
        return turned + (low + high) / 2 + [1.05 * (high[0] - low[0]) * (1 - 2 * part), 0, 0]

    def step(k):
        ends = (np.concatenate([xyz, copy(n / MESH_STEPS)]) for n in (k, k + 1))
        return Step(meshes, 0, *ends)

    return Source(path.stem, MESH_STEPS, step)


def of_recording(path: Path) -> Source:
    """The steps from each recorded frame of all meshes to the next, read as `hpccd replay` reads them."""
    from hpccd_ros.bag.reader import Recording
    from hpccd_ros.replay import recorded_setup
    from hpccd_ros.replay.frames import FrameSource

    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        source = FrameSource(setup, recording.topics)
        frames = [f for message in recording.messages(source.topics) for f in source.push(message)]
    if len(frames) < 2:
        raise UserError(f"{path}: holds {len(frames)} frames of all meshes; a step needs two")
    builder = setup.builder

    def step(k):
        before, after = frames[k], frames[k + 1]
        if not before.same_scene(after):
            return None
        meshes = tuple(
            Mesh(m.name, t.faces, t.n_vertices, m.static, m.self_collision, t.edges)
            for m, t in zip(builder.meshes, after.topologies, strict=True)
        )
        ends = builder.concatenate(before, after), builder.concatenate(after, after)
        return Step(meshes, tuple(map(id, after.topologies)), *ends, builder.ignored_pairs)

    return Source(path.stem, len(frames) - 1, step)


def _holds_step(path):
    """Whether it is the file of a step; one that cannot be read is taken for one, so that its error is not lost."""
    try:
        with np.load(path, allow_pickle=False) as archive:
            return STEP <= set(archive.files)
    except UNREADABLE:
        return True
