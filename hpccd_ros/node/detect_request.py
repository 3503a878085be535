# SPDX-License-Identifier: Apache-2.0
"""Check meshes, topologies and positions of a request to ``~/detect`` (service or action) and compute its query."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hpccd.msg import MeshVertices

from hpccd_core.options import ACCURACIES, REPORTS
from hpccd_ros.base.quoting import counted, listed, quoted, repeated, shortened
from hpccd_ros.detect.core import Cancellation, Options, make_detector
from hpccd_ros.detect.kept_detectors import DetectorOf, KeptDetectors
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware import fields, mesh_messages
from hpccd_ros.node.detect_query import (
    BUILDING,
    DETECTING,
    QUERIES,
    READING,
    Asked,
    QueryResult,
    Request,
    RequestError,
    requested_query,
)


@dataclass(frozen=True)
class NodeScene:
    """The state of the node at the time of a request: its meshes and their current topologies."""

    builder: SceneBuilder
    topologies: dict[str, Topology | None]


def compute(
    request: Request,
    scene: NodeScene,
    options: Options,
    limits: dict[str, Any],
    kept: KeptDetectors,
    cancellation: Cancellation,
    enter: Callable[[str], None] = lambda stage: None,
) -> QueryResult:
    """limits: max_meshes, max_vertices, max_faces, max_edges, max_contacts. kept: of earlier requests; this one adds to
    them. enter: told of each stage of the work when it begins. Raises RequestError, and what the core raises.
    """
    enter(READING)
    query = requested_query(request)
    names, planes = _names(request, scene, limits["max_meshes"])
    for field in ("topologies", "end") if query.of_snapshot else ("topologies", "start", "end"):
        given = len(getattr(request, field))
        if given != len(names) and not (field == "topologies" and given == 0):
            raise RequestError(
                f"{field}: {counted(given, 'entry', 'entries')} for {counted(len(names), 'mesh', 'meshes')} "
                f"({listed(names)})"
            )
    topologies = tuple(_topology(request, scene, limits, i, name) for i, name in enumerate(names))
    end = _vertices("end", names, request.end, topologies, limits["max_vertices"])
    start = end
    if not query.of_snapshot:
        start = _vertices("start", names, request.start, topologies, limits["max_vertices"])
    options = replace(
        options,
        accuracy=_choice("accuracy", request.accuracy or options.accuracy, ACCURACIES),
        report=_choice("report", request.report or "all", REPORTS),
        separation=query.separation or options.separation.among([*names, *planes]),
        thickness=tuple(entry for entry in options.thickness if entry[0] in names),
        features=query.features or options.features,
    )
    enter(BUILDING)
    builder = scene.builder.among(names, planes)
    used = kept.take(builder, topologies, options) or DetectorOf(
        builder, topologies, options, make_detector(builder.build(topologies), options)
    )
    detector = cancellation.guard(used.detector)
    layout = builder.layout(topologies)
    asked = Asked(start, end, detector, layout, options, limits["max_contacts"], enter)
    enter(DETECTING)
    result = QUERIES[query.name](asked, query)
    backend = detector.backend
    if cancellation.release():
        kept.keep(used)
    for message in (result.contacts, result.distances):
        if message is not None:
            message.header, message.step = request.end[0].header, request.end[0].step
            message.accuracy, message.backend = options.accuracy, backend
    if result.contacts is not None:
        first = request.end if query.of_snapshot else request.start
        result.contacts.start = first[0].header.stamp
    return result


def _choice(field: str, value: str, choices: tuple[str, ...]) -> str:
    if value not in choices:
        raise RequestError(f"{field}: {quoted(value)} is not known; use one of {', '.join(choices)}")
    return value


def _names(request: Request, scene: NodeScene, most: int) -> tuple[list[str], list[str]]:
    """Of the meshes and of the planes; by default all of the node."""
    planes = [name for name in scene.builder.plane_names if not request.mesh_names or name in request.mesh_names]
    names = [name for name in request.mesh_names or scene.topologies if name not in planes]
    if not names and request.mesh_names:
        raise RequestError(f"mesh_names: {listed(planes)} have no positions; name meshes that are tested against them")
    if not names:
        raise RequestError("mesh_names: empty, and the node has no meshes of its own")
    if len(names) > most:
        raise RequestError(
            f"mesh_names: {counted(len(names), 'mesh', 'meshes')}, at most {most} are taken (parameter max_meshes)"
        )
    if len(set(request.mesh_names)) != len(request.mesh_names):
        raise RequestError(f"mesh_names: names must differ, {repeated(request.mesh_names)} occurs twice")
    return names, planes


def _topology(request: Request, scene: NodeScene, limits: dict[str, Any], index: int, name: str) -> Topology:
    if request.topologies:
        try:
            return mesh_messages.topology_from_message(request.topologies[index], limits)
        except fields.InvalidMessageError as error:
            raise RequestError(f"topologies[{index}] ({shortened(name)}): {error}") from error
    if name not in scene.topologies:
        raise RequestError(
            f"mesh_names: unknown mesh {quoted(name)}; the node has "
            f"{listed(scene.topologies) or 'none'}, or send topologies"
        )
    topology = scene.topologies[name]
    if topology is None:
        raise RequestError(f"mesh {name}: the node has no topology yet; publish it or send topologies")
    return topology


def _vertices(
    field: str, names: list[str], messages: list[MeshVertices], topologies: tuple[Topology, ...], max_vertices: int
) -> np.ndarray:
    parts = []
    for i, (name, message, topology) in enumerate(zip(names, messages, topologies, strict=True)):
        where = f"{field}[{i}] ({shortened(name)})"
        try:
            fields.stamp_to_ns(message.header.stamp)
            vertices = mesh_messages.vertices_from_message(message, max_vertices)
        except fields.InvalidMessageError as error:
            raise RequestError(f"{where}: {error}") from error
        if message.topology_version != topology.version:
            raise RequestError(
                f"{where}: topology_version {message.topology_version}, the topology has version {topology.version}"
            )
        if len(vertices) != topology.n_vertices:
            raise RequestError(
                f"{where}: {counted(len(vertices), 'vertex', 'vertices')}, the topology has {topology.n_vertices}"
            )
        parts.append(vertices)
    return parts[0] if len(parts) == 1 else np.concatenate(parts)
