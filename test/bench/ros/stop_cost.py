# SPDX-License-Identifier: Apache-2.0
"""What a look at a step costs beside its contacts and its smallest distances, in this process and without DDS."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from hpccd_ros.bench import sources
from hpccd_ros.bench.sources import Source
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.nearness import Nearness
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, SceneFrame, Topology

SCENES = ("cloth-drop", "cloth-ball-like")
DISTANCES_EACH = 30  # steps


def rows(done: Callable[[], None]) -> Iterator[dict[str, Any]]:
    """Of each scene two, for a distance of a median edge: as it is, near in nearly all steps; and with its first mesh
    moved so far up that nothing is near."""
    for source in sources.resolve(SCENES, None, SCENES):
        for apart in (False, True):
            yield _of_source(source, apart)
        done()


def _of_source(source: Source, apart: bool) -> dict[str, Any]:
    builder, frames = _frames(source, apart)
    options = Options(backend="cpu")
    look, detector = Nearness(builder, options, _median_edge(frames[0])), StepDetector(builder, options)
    taken: dict[str, list[float]] = {"look": [], "contacts": [], "distances": []}
    near = 0
    for k, (start, end) in enumerate(zip(frames, frames[1:], strict=False)):
        began = time.perf_counter()
        near += look.within(start, end)[0]
        taken["look"].append(time.perf_counter() - began)
        taken["contacts"].append(1e-3 * detector.detect(start, end).detect_ms)
        if k % DISTANCES_EACH == 1:
            began = time.perf_counter()
            detector.distances(end)
            taken["distances"].append(time.perf_counter() - began)
    ms = {what: 1e3 * float(np.median(times)) for what, times in taken.items()}
    return {
        "what": "cost",
        "scene": source.name + (", moved apart" if apart else ""),
        "triangles": sum(len(t.faces) for t in frames[0].topologies),
        "steps": len(frames) - 1,
        "near": near,
        **{f"{what}_ms": median for what, median in ms.items()},
    }


def _frames(source: Source, apart: bool) -> tuple[SceneBuilder, list[SceneFrame]]:
    """The end of each step; of the first its start too. Its topologies do not change."""
    steps = [source.step(k) for k in range(source.n_steps)]
    meshes = steps[0].meshes
    builder = SceneBuilder(tuple(MeshSettings(m.name, m.static, m.self_collision) for m in meshes))
    topologies = tuple(Topology(0, m.n_vertices, m.faces) for m in meshes)
    ends = np.cumsum([m.n_vertices for m in meshes])[:-1]
    positions = [steps[0].vertices_t0.copy(), *(step.vertices_t1.copy() for step in steps)]
    for xyz in positions:
        xyz[: ends[0]] += apart * 2 * np.ptp(positions[0])
    names = tuple(m.name for m in meshes)
    return builder, [
        SceneFrame(k, k, "", topologies, tuple(np.split(xyz, ends)), names, 0.0) for k, xyz in enumerate(positions)
    ]


def _median_edge(frame: SceneFrame) -> float:
    lengths = [
        np.linalg.norm(xyz[t.faces] - xyz[np.roll(t.faces, 1, axis=1)], axis=2).ravel()
        for t, xyz in zip(frame.topologies, frame.vertices, strict=True)
    ]
    return float(np.median(np.concatenate(lengths)))
