# SPDX-License-Identifier: Apache-2.0
"""The queries of ``~/detect``, service and action: what each takes, and its result."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from hpccd.action import Detect as DetectAction
from hpccd.msg import ContactArray, DistanceArray
from hpccd.srv import Detect

import hpccd_core as hc
from hpccd_core import arguments
from hpccd_ros.base.quoting import counted, not_one_of, printable, shortened
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.middleware import contact_messages, result_fields, snapshot_messages

# Service and action have the same fields.
Request = Detect.Request | DetectAction.Goal
Response = Detect.Response | DetectAction.Result

# Stages of a request, in this order.
WAITING = DetectAction.Feedback.WAITING
READING = DetectAction.Feedback.READING
BUILDING = DetectAction.Feedback.BUILDING
DETECTING = DetectAction.Feedback.DETECTING
WRITING = DetectAction.Feedback.WRITING


class RequestError(ValueError):
    """An invalid request; the text says what to fix, in one printable line: names in it are those of the request."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


@dataclass(frozen=True)
class Query:
    """``separation``: of the whole scene; None where the node's is to hold. ``distance``: of query proximity.
    ``features``: what is tested; empty where the node's are to be."""

    name: str
    separation: Separation | None = None
    distance: float = 0.0
    features: tuple[str, ...] = ()

    @property
    def of_snapshot(self) -> bool:
        return self.name not in OF_MOTION


# Queries that read `start` too, and that a separation has a meaning for.
OF_MOTION = ("contacts", "collision_free_step")
# Those that look at pairs of features, not at whole surfaces.
OF_FEATURES = (*OF_MOTION, "proximity")


def requested_query(request: Request) -> Query:
    """Raises RequestError: no such query, or an argument that it has no use for."""
    name = request.query or "contacts"
    if name not in QUERIES:
        raise RequestError(f"query: {not_one_of(name, list(QUERIES))}")
    separation = _length(request, "minimum_separation", name, of=OF_MOTION)
    distance = _length(request, "distance", name, of=("proximity",))
    if name != "contacts" and request.report not in ("", "all"):
        raise RequestError(f"report: only query contacts has one, leave it empty for {name}")
    features = _features(request, name)
    if name in OF_MOTION:
        return Query(name, None if separation is None else Separation(separation), features=features)
    if name == "proximity" and distance is None:
        raise RequestError("distance: empty; query proximity needs one")
    return Query(name, NONE, distance or 0.0, features)


def _features(request: Request, query: str) -> tuple[str, ...]:
    if not request.features:
        return ()
    if query not in OF_FEATURES:
        raise RequestError(f"features: only queries {', '.join(OF_FEATURES)} have some, leave them empty for {query}")
    try:
        return arguments.feature_names(map(shortened, request.features))
    except ValueError as error:
        raise RequestError(str(error)) from error


def _length(request: Request, field: str, query: str, of: tuple[str, ...]) -> float | None:
    """The number in a field that only the queries ``of`` have, None where it is empty."""
    given = getattr(request, field)
    if not len(given):
        return None
    if query not in of:
        who = f"only query {of[0]} has one" if len(of) == 1 else f"only queries {' and '.join(of)} have one"
        raise RequestError(f"{field}: {who}, leave it empty for {query}")
    if not (math.isfinite(given[0]) and given[0] >= 0):
        raise RequestError(f"{field}: {given[0]} must be finite and not negative")
    return given[0]


@dataclass(frozen=True, eq=False)
class Asked:
    """A scene and its positions; ``start`` is ``end`` where there is only one snapshot."""

    start: np.ndarray
    end: np.ndarray
    detector: hc.Detector
    layout: Layout
    options: Options
    max_contacts: int
    enter: Callable[[str], None]  # takes the stage that begins


@dataclass(frozen=True)
class QueryResult:
    """``text``: in words what was found. The rest: the fields of the response that the query fills."""

    text: str
    contacts: ContactArray | None = None
    distances: DistanceArray | None = None
    collision_free_step: float = math.nan


def _contacts(asked: Asked, query: Query) -> QueryResult:
    message = ContactArray()
    found = asked.detector.detect(asked.start, asked.end)
    asked.enter(WRITING)
    contact_messages.fill_contacts(
        message, found, asked.layout, max_contacts=asked.max_contacts, outputs=asked.options.outputs
    )
    result_fields.fill_separation(message, asked.options.separation)
    result_fields.fill_thickness(message, asked.options.thickness)
    result_fields.fill_features(message, asked.options.features)
    return QueryResult(counted(message.total, "contact"), contacts=message)


def _collision_free_step(asked: Asked, query: Query) -> QueryResult:
    step = asked.detector.collision_free_step(asked.start, asked.end)
    return QueryResult(f"{step!r} of the motion is free of contacts", collision_free_step=step)


def _proximity(asked: Asked, query: Query) -> QueryResult:
    message = ContactArray()
    near = asked.detector.proximity(asked.end, query.distance)
    asked.enter(WRITING)
    snapshot_messages.fill_proximity(
        message, near, asked.layout, max_contacts=asked.max_contacts, outputs=asked.options.outputs
    )
    result_fields.fill_thickness(message, asked.options.thickness)
    result_fields.fill_features(message, asked.options.features)
    return QueryResult(f"{counted(message.total, 'pair')} within {query.distance:g}", contacts=message)


def _intersections(asked: Asked, query: Query) -> QueryResult:
    message = ContactArray()
    hits = asked.detector.intersections(asked.end)
    asked.enter(WRITING)
    snapshot_messages.fill_intersections(message, hits, asked.layout, max_contacts=asked.max_contacts)
    return QueryResult(f"{counted(message.total, 'edge')} in faces", contacts=message)


def _distances(asked: Asked, query: Query) -> QueryResult:
    message = DistanceArray()
    gaps = asked.detector.distances(asked.end)
    asked.enter(WRITING)
    snapshot_messages.fill_distances(message, gaps, asked.layout)
    result_fields.fill_thickness(message, asked.options.thickness)
    return QueryResult(f"{counted(len(gaps), 'pair')} of meshes", distances=message)


QUERIES: dict[str, Callable[[Asked, Query], QueryResult]] = {
    "contacts": _contacts,
    "collision_free_step": _collision_free_step,
    "proximity": _proximity,
    "intersections": _intersections,
    "distances": _distances,
}
