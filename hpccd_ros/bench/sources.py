# SPDX-License-Identifier: Apache-2.0
"""From a word on the command line to steps: a generated scene, a file with one step, a recording."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.steps import Source, Step
from hpccd_ros.scenes.scene import Mesh

# Of Table 1, in its order: generated scenes of the same size and character.
TABLE_1 = ("cloth-ball-like", "breaking-like", "n-body-like-lr", "n-body-like-hr")


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

    A word is "data" (every step file of the data folder), the name of one of them, a path of an .npz or .mcap file
    (or of a folder of the latter), or the name of a generated scene, made with `size`.
    """
    found = []
    for word in words or default:
        if word == "data":
            if data is None:
                if words:
                    raise UserError("data: set HPCCD_DATA, or give the folder with --data DIR")
                continue
            found += [of_npz(path) for path in data_files(data)]
        else:
            found.append(_one(word, data, size))
    found = _told_apart(words or default, found)
    if not found:
        raise UserError(
            "nothing to measure: name a scene (see `hpccd scene --list`), an .npz or .mcap file, or set HPCCD_DATA"
        )
    return found


def _told_apart(words, found):
    """Files of one name in several folders get names of their own: results are kept by name."""
    names = [source.name for source in found]
    if len(words) != len(found) or len(set(names)) == len(names):
        return found
    return [
        dataclasses.replace(source, name=str(Path(word).with_suffix(""))) if names.count(source.name) > 1 else source
        for word, source in zip(words, found, strict=True)
    ]


def _one(word, data, size):
    from hpccd_ros import scenes

    if word in scenes.names():
        return of_scene(word, size)
    path = Path(word)
    if path.suffix == ".npz" and path.is_file():
        return of_npz(path)
    if path.exists():
        return of_recording(path)
    if data and (data / f"{word}.npz").is_file():
        return of_npz(data / f"{word}.npz")
    files = ", ".join(p.stem for p in data_files(data)) or "none (HPCCD_DATA is not set)"
    raise UserError(
        f"{word}: neither a file, nor a generated scene ({', '.join(scenes.names())}), nor a data file ({files})"
    )


def of_scene(name: str, size: float = 1.0) -> Source:
    """A scene that hpccd_ros.scenes generates."""
    from hpccd_ros import scenes

    try:
        scene = scenes.make(name, size, progress=True)
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
    except (OSError, ValueError) as error:
        raise UserError(f"{path}: cannot be read: {error}") from error
    if not {"vertices_t0", "vertices_t1", "faces"} <= arrays.keys():
        raise UserError(f"{path}: holds {', '.join(arrays)}; a step has vertices_t0, vertices_t1 and faces")
    truth = {key: arrays[key] for key in ("vf", "vf_toc", "ee", "ee_toc") if key in arrays}
    mesh = Mesh("scene", arrays["faces"], len(arrays["vertices_t0"]))
    known = truth if len(truth) == 4 else None
    step = Step((mesh,), 0, arrays["vertices_t0"], arrays["vertices_t1"], truth=known)
    return Source(path.stem, 1, lambda k: step)


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
            Mesh(m.name, t.faces, t.n_vertices, m.static, m.self_collision)
            for m, t in zip(builder.meshes, after.topologies, strict=True)
        )
        return Step(
            meshes,
            tuple(map(id, after.topologies)),
            builder.concatenate(before, after),
            builder.concatenate(after, after),
            builder.ignored_pairs,
        )

    return Source(path.stem, len(frames) - 1, step)


def _holds_step(path):
    with np.load(path, allow_pickle=False) as archive:
        return {"vertices_t0", "vertices_t1", "faces"} <= set(archive.files)
