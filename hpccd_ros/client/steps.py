# SPDX-License-Identifier: Apache-2.0
"""Requests to the node, from numpy arrays, and what their responses hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from hpccd.action import Detect as DetectAction
from hpccd.msg import MeshTopology, MeshVertices
from hpccd.srv import Detect
from numpy.typing import NDArray

from hpccd_core import arguments
from hpccd_core.options import ACCURACIES
from hpccd_ros.client.meshes import vertices_message

_QUERY = "collision_free_step"


def collision_free_step_request(
    start: Mapping[str, NDArray[Any]],
    end: Mapping[str, NDArray[Any]],
    *,
    topologies: Mapping[str, MeshTopology] | None = None,
    topology_versions: Mapping[str, int] | None = None,
    accuracy: str = "",
    minimum_separation: float | None = None,
    features: str | Iterable[str] = (),
    time_limit: float = 0.0,
) -> Detect.Request:
    """The request for the largest fraction of a motion that is free of contacts.

    Parameters
    ----------
    start, end : mapping of str to ndarray, shape (n, 3), float32 or float64
        Positions by mesh name, in the unit of the scene; the same meshes in both.
    topologies : mapping of str to MeshTopology, optional
        :func:`topology_message` of each mesh. None: those that the node has for these names.
    topology_versions : mapping of str to int, optional
        Versions of the node's topologies, if not 0.
    accuracy : str
        Accuracy tier; "": the node's parameter.
    minimum_separation : float, optional
        Of all pairs of meshes, in the unit of the scene; None: the node's parameters.
    features : str or iterable of str
        "vertex_face", "edge_edge" or both; (): the node's parameter.
    time_limit : float
        Seconds until the node gives up; 0: its parameter ``detect_time_limit``.

    Returns
    -------
    hpccd.srv.Detect.Request

    Raises
    ------
    TypeError, ValueError
        If an argument has the wrong type, shape or range, or meshes differ.
    """
    names = list(start)
    if not names:
        raise ValueError("start: no meshes; give the positions of one at least")
    _check_meshes("end", end, names)
    versions = dict.fromkeys(names, 0)
    if topologies is not None:
        if topology_versions is not None:
            raise ValueError("topology_versions: the topologies have their own versions; give only one of the two")
        _check_meshes("topologies", topologies, names)
        versions = {name: topologies[name].version for name in names}
    elif topology_versions is not None:
        if beyond := [name for name in topology_versions if name not in versions]:
            raise ValueError(f"topology_versions: start has no mesh {', '.join(beyond)}; name those of start only")
        versions |= topology_versions
    if accuracy:
        arguments.choice("accuracy", accuracy, ACCURACIES)
    tested = (features,) if isinstance(features, str) else tuple(features)
    return Detect.Request(
        mesh_names=names,
        topologies=[] if topologies is None else [topologies[name] for name in names],
        start=_snapshot("start", start, names, versions),
        end=_snapshot("end", end, names, versions),
        query=_QUERY,
        accuracy=accuracy,
        minimum_separation=(
            [] if minimum_separation is None else [arguments.length("minimum_separation", minimum_separation)]
        ),
        features=list(arguments.feature_names(tested)) if tested else [],
        time_limit=arguments.length("time_limit", time_limit),
    )


def collision_free_step_from_response(response: Detect.Response | DetectAction.Result) -> float:
    """The largest fraction of the motion that is certainly free of contacts.

    Parameters
    ----------
    response : hpccd.srv.Detect.Response or hpccd.action.Detect.Result

    Returns
    -------
    float
        In [0, 1]; 1.0 if there is no contact.

    Raises
    ------
    RuntimeError
        With the node's message, if it computed nothing (rejected, busy, out of time, stopped).
    ValueError
        If the request was for another query.
    """
    if not response.success:
        raise RuntimeError(f"the node computed nothing: {response.message}")
    step = float(response.collision_free_step)
    if not 0 <= step <= 1:
        raise ValueError(f"response: collision_free_step is {step}; it is the result of query {_QUERY} only")
    return step


def _check_meshes(argument: str, given: Mapping[str, object], names: list[str]) -> None:
    if set(given) != set(names):
        raise ValueError(
            f"{argument}: of meshes {', '.join(given) or 'none'}, start is of {', '.join(names)}; give the same ones"
        )


def _snapshot(
    argument: str, positions: Mapping[str, NDArray[Any]], names: list[str], versions: Mapping[str, int]
) -> list[MeshVertices]:
    messages = []
    for name in names:
        try:
            messages.append(vertices_message(positions[name], 0, topology_version=versions[name]))
        except (TypeError, ValueError) as error:
            raise type(error)(f"{argument}[{name!r}]: {error}") from None
    return messages


def goal_from_request(request: Detect.Request) -> DetectAction.Goal:
    """Convert a request to the service into a goal of the action.

    Parameters
    ----------
    request : hpccd.srv.Detect.Request
        The goal refers to its fields.

    Returns
    -------
    hpccd.action.Detect.Goal
        Its result has the fields of the service's response.

    Raises
    ------
    TypeError
        If it is no request.
    """
    if not isinstance(request, Detect.Request):
        raise TypeError(f"request: expected hpccd.srv.Detect.Request, got {type(request).__name__}")
    return DetectAction.Goal(**{name: getattr(request, name) for name in request.get_fields_and_field_types()})
