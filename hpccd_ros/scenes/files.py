# SPDX-License-Identifier: Apache-2.0
"""Scenes as files: MCAP recordings, numpy archives, parameter files for the node."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from hpccd_core.progress import track
from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.qos_yaml import INFINITE
from hpccd_ros.bag.writer import BagWriter, Topic
from hpccd_ros.base.version import package_version
from hpccd_ros.scenes import messages
from hpccd_ros.scenes.scene import Scene

# Frame 0 of a file is stamped with this second, so that the same scene makes the same bytes at any time.
FIRST_STAMP_NS = 1_000_000_000


def write_mcap(scene: Scene, path: str | Path, rate: float, compression: str = "none", progress: bool = False) -> None:
    """Write all frames, `rate` a second, as `hpccd record` would have recorded them: topologies and vertices, of robots
    the description and the joint states.

    Raises FileExistsError where `path` exists, OSError where the disk rejects, LookupError where the package hpccd is
    not installed.
    """
    info = {
        "format": 1,
        "hpccd": package_version(),
        "node": "/hpccd",
        "parameters": messages.node_parameters(scene),
        "topics": {},
        "scene": scene.name,
    }
    topics = []
    for topic in messages.topics(scene):
        topics.append(Topic("/" + topic.name, topic.type_name, [_offered(topic.latched)], topic.latched))
        info["topics"]["/" + topic.name] = topic.name
    with whole_file(path) as draft:
        bag = BagWriter(draft, info=info, compression=compression)
        try:
            for topic in topics:
                bag.add_topic(topic)
            player = messages.Player(scene)
            for frame in track(scene.frames(), f"writing {path}", progress, scene.n_frames):
                stamp = FIRST_STAMP_NS + round(frame.index * 1e9 / rate)
                for message in player.messages(frame, stamp):
                    bag.write("/" + message.topic, message.data, stamp, stamp)
        finally:
            bag.close()
        if bag.write_errors:
            raise OSError(f"{path}: {bag.last_error.partition(':')[0]}")


def _offered(latched: bool) -> dict:
    return {
        "history": "keep_last",
        "depth": 1 if latched else 10,
        "reliability": "reliable",
        "durability": "transient_local" if latched else "volatile",
        "deadline": INFINITE,
        "lifespan": INFINITE,
        "liveliness": "automatic",
        "liveliness_lease_duration": INFINITE,
        "avoid_ros_namespace_conventions": False,
    }


def write_npz(scene: Scene, path: str | Path, progress: bool = False) -> None:
    """Write all frames for `numpy.load`. For each mesh and each version v of its topology, from 0:

    MESH/v/faces (F,3) uint32, MESH/v/first_frame, and MESH/v/vertices (frames of this version, V, 3) float32;
    beside them `meshes` (names in order; those of a robot's links are ROBOT/LINK), `frame_period` (s) and `scene`.
    """
    arrays: dict[str, np.ndarray] = {
        "meshes": np.array(scene.mesh_names),
        "frame_period": np.float64(scene.frame_period),
        "scene": np.array(scene.name),
    }
    version = dict.fromkeys(scene.mesh_names, 0)
    rows: dict[str, list[np.ndarray]] = {}
    for mesh in scene.meshes:
        arrays[f"{mesh.name}/0/faces"], arrays[f"{mesh.name}/0/first_frame"] = mesh.faces, np.int64(0)
    for frame in track(scene.frames(), f"writing {path}", progress, scene.n_frames):
        for name, change in frame.topologies.items():
            version[name] = change.version
            arrays[f"{name}/{change.version}/faces"] = change.faces
            arrays[f"{name}/{change.version}/first_frame"] = np.int64(frame.index)
        for mesh, xyz in zip(scene.meshes, frame, strict=True):
            rows.setdefault(f"{mesh.name}/{version[mesh.name]}/vertices", []).append(xyz)
    arrays |= {key: np.stack(frames) for key, frames in rows.items()}
    _save(path, arrays)


def write_step(scene: Scene, index: int, path: str | Path) -> None:
    """Write the motion from frame index - 1 to frame `index`, all meshes in one.

    vertices_t0, vertices_t1 (V,3) float32 and faces (F,3) uint32: one step to be tested, without its scene.
    """
    frame = scene.frame(index)
    before = frame.start if frame.start is not None else scene.frame(index - 1)
    faces, offset = [], 0
    for mesh_faces, xyz in zip(scene.faces(index), frame, strict=True):
        faces.append(mesh_faces.astype(np.int64) + offset)
        offset += len(xyz)
    step = {
        "vertices_t0": np.concatenate(before),
        "vertices_t1": frame.stacked(),
        "faces": np.concatenate(faces).astype(np.uint32),
    }
    _save(path, step)


def _save(path, arrays):
    # numpy appends .npz to a name without it; an open file keeps the name that was asked for.
    with whole_file(path) as draft, open(draft, "wb") as file:
        np.savez(file, **arrays)


def write_parameters(scene: Scene, path: str | Path) -> None:
    """Write a parameter file for `hpccd_node --ros-args --params-file PATH`."""
    tree: dict = {}
    for name, value in messages.node_parameters(scene).items():
        *folders, last = name.split(".")
        branch = tree
        for folder in folders:
            branch = branch.setdefault(folder, {})
        branch[last] = value
    text = yaml.safe_dump({"/**": {"ros__parameters": tree}}, sort_keys=False)
    with whole_file(path) as draft:
        draft.write_text(f"# The meshes of the scene {scene.name}.\n{text}", encoding="utf-8")
