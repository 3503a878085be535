# SPDX-License-Identifier: Apache-2.0
"""The first difference between a recorded result of the node and the contacts computed again, in words."""

import math

import numpy as np

from hpccd_core.options import ACCURACIES
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros.detect.layout import Layout
from hpccd_ros.detect.separation import NO_BOUNDS, MotionBounds
from hpccd_ros.middleware import contact_messages
from hpccd_ros.middleware.result_fields import read_bounds, read_rest, read_separation, read_thickness


def difference(
    recorded, contacts, layout: Layout, any_one: bool = False, bounds: MotionBounds = NO_BOUNDS
) -> str | None:
    """None if `recorded` (ContactArray) is the message that the node would send for `contacts` (of the core) and
    `bounds`.

    Pairs, times, their order, totals, first time, hash and the outputs that `recorded` has must be bit-identical;
    `contacts` must have these outputs. any_one: the node stopped at the first contact found (report "any"), which
    depends on the timing of its threads: there must be one if there is any, and it must be one of all `contacts`;
    outputs are not compared.
    """
    total = len(contacts)
    then, now = list(recorded.topology_versions), list(layout.topology_versions)
    if len(then) != len(now):
        return f"meshes {', '.join(recorded.mesh_names)} were recorded, now they are {', '.join(layout.mesh_names)}"
    if then != now:
        return f"topology versions {then} were recorded, now they are {now}"
    if problem := _malformed(recorded, layout):
        return f"the recorded result is malformed: {problem}"
    if (then := read_bounds(recorded)) != bounds:
        return f"motion was bounded by {_bounded(then)}, now it is by {_bounded(bounds)}"
    if any_one:
        return _not_any(recorded, contacts, layout)
    count = len(recorded.kind)
    expected = type(recorded)()
    sent = count if recorded.truncated else 0
    contact_messages.fill_contacts(expected, contacts, layout, max_contacts=sent)
    then, now = contact_messages.read_contacts(recorded, layout), contact_messages.read_contacts(expected, layout)
    for kind, describe in _DESCRIBED.items():
        first = _first_difference(
            getattr(then, kind), getattr(then, kind + "_toc"), getattr(now, kind), getattr(now, kind + "_toc")
        )
        if first is not None:
            return _explain(first, then, now, kind, lambda pair, d=describe: d(pair, layout))
    if recorded.total != total:
        return _count(recorded.total, total)
    if recorded.truncated != expected.truncated:
        return f"{count:,} of {total:,} contacts are marked as {'' if recorded.truncated else 'not '}truncated"
    if recorded.first_toc != contacts.first_toc:
        return f"first time of contact: recorded {recorded.first_toc!r}, now {contacts.first_toc!r}"
    if recorded.hash != contacts.hash:
        where = "among the contacts that were cut off" if recorded.truncated else "although all contacts are equal"
        return f"hash {recorded.hash:#018x} was recorded, now it is {contacts.hash:#018x}, {where}"
    return next(filter(None, (_other_output(name, recorded, expected) for name in _recorded_arrays(recorded))), None)


def recorded_outputs(recorded) -> set[str]:
    """The values of parameter ``outputs`` that ask for the outputs in the message."""
    return {OUTPUT_ARRAYS[name].asked for name in _recorded_arrays(recorded)}


def _recorded_arrays(recorded) -> list[str]:
    return [name for name in OUTPUT_ARRAYS if len(getattr(recorded, name))]


def _other_output(name, recorded, expected) -> str | None:
    array = OUTPUT_ARRAYS[name]
    then, now = (
        np.frombuffer(getattr(message, name), array.dtype).reshape(len(recorded.kind), -1)
        for message in (recorded, expected)
    )
    unequal = (then.view(np.uint8) != now.view(np.uint8)).any(axis=1)
    if not unequal.any():
        return None
    row = int(np.argmax(unequal))
    return f"{name} of contact {row}: {then[row].tolist()} was recorded, now it is {now[row].tolist()}"


def _bounded(bounds: MotionBounds) -> str:
    return f"{list(bounds.of_meshes)} in {bounds.parts} parts"


def _count(recorded, now):
    return f"{recorded:,} contacts were recorded, now there are {now:,}"


def _malformed(message, layout) -> str | None:
    count = len(message.kind)
    sizes = {"mesh_a": 1, "mesh_b": 1, "features_a": 2, "features_b": 2, "toc": 1}
    for name, per_contact in sizes.items():
        if len(getattr(message, name)) != count * per_contact:
            return f"{name} has {len(getattr(message, name))} entries for {count} contacts"
    try:
        read_separation(message)
        read_thickness(message, [layout.mesh_names[k] for k in layout.planes])
        read_rest(message)
        read_bounds(message)
    except ValueError as error:
        return str(error)
    if message.accuracy not in ACCURACIES:
        return f"its accuracy is {message.accuracy[:20]!r}, none of {', '.join(ACCURACIES)}"
    if list(message.mesh_names) != list(layout.mesh_names):
        return f"its meshes are {list(message.mesh_names)}, those of the recording {list(layout.mesh_names)}"
    for name, array in OUTPUT_ARRAYS.items():
        if len(getattr(message, name)) not in (0, math.prod(array.row) * count):
            return f"{name} has {len(getattr(message, name))} entries for {count} contacts"
    sent = recorded_outputs(message)
    for name, array in OUTPUT_ARRAYS.items():
        if array.asked in sent and not len(getattr(message, name)):
            return f"{name} is empty, though other arrays of the output {array.asked} are not"
    if len(message.distance):
        return f"distance has {len(message.distance)} entries; contacts of a step have none"
    kind = np.frombuffer(message.kind, np.uint8)
    known = [contact_messages.KINDS[name][0] for name in contact_messages.TIMED]
    if not np.isin(kind, known).all() or (np.diff(kind.astype(np.int16)) < 0).any():
        return "kind has other values than those of contacts of a step, or is not ascending"
    return contact_messages.beyond_meshes(message, layout)


def _not_any(recorded, contacts, layout) -> str | None:
    count, total = len(recorded.kind), len(contacts)
    if bool(count) != bool(total):
        return _count(count, total)
    if recorded.total < count or (recorded.total > count and not recorded.truncated):
        return f"{recorded.total:,} contacts in total, but {count:,} were recorded"
    first = min(recorded.toc, default=float("inf"))
    if recorded.first_toc != first:
        return f"first time of contact: recorded {recorded.first_toc!r}, that of the recorded contacts is {first!r}"
    then = contact_messages.read_contacts(recorded, layout)
    for kind, describe in _DESCRIBED.items():
        toc_of = dict(zip(map(tuple, getattr(contacts, kind)), getattr(contacts, kind + "_toc"), strict=True))
        for pair, toc in zip(map(tuple, getattr(then, kind)), getattr(then, kind + "_toc"), strict=True):
            if pair not in toc_of:
                return f"{describe(pair, layout)}: recorded at t = {float(toc)!r}, now not found"
            if toc_of[pair] != toc:
                return f"{describe(pair, layout)}: recorded at t = {float(toc)!r}, now at t = {float(toc_of[pair])!r}"
    return None


def _first_difference(pairs, toc, other_pairs, other_toc) -> int | None:
    common = min(len(pairs), len(other_pairs))
    unequal = (pairs[:common] != other_pairs[:common]).any(axis=1) | (toc[:common] != other_toc[:common])
    if unequal.any():
        return int(np.argmax(unequal))
    return None if len(pairs) == len(other_pairs) else common


def _explain(index, then, now, kind, describe) -> str:
    pairs, toc = getattr(then, kind), getattr(then, kind + "_toc")
    other, other_toc = getattr(now, kind), getattr(now, kind + "_toc")
    if index < len(pairs) and index < len(other) and tuple(pairs[index]) == tuple(other[index]):
        times = f"recorded at t = {float(toc[index])!r}, now at t = {float(other_toc[index])!r}"
        return f"{describe(pairs[index])}: {times}"
    # Pairs are sorted: of two different ones at the same position, the smaller is missing on the other side.
    if index >= len(other) or (index < len(pairs) and tuple(pairs[index]) < tuple(other[index])):
        return f"{describe(pairs[index])}: recorded at t = {float(toc[index])!r}, now not found"
    return f"{describe(other[index])}: found now at t = {float(other_toc[index])!r}, not recorded"


def _vertex_face(pair, layout) -> str:
    vertex, face = _local(pair[0], layout.vertex_offsets, layout), _local(pair[1], layout.face_offsets, layout)
    return f"vertex {vertex} - face {face}"


def _edge_edge(pair, layout) -> str:
    a, b, c, d = (_local(v, layout.vertex_offsets, layout) for v in pair)
    return f"edge ({a}, {b}) - edge ({c}, {d})"


def _vertex_plane(pair, layout) -> str:
    plane = layout.mesh_names[layout.planes[pair[1]]]
    return f"vertex {_local(pair[0], layout.vertex_offsets, layout)} - plane {plane}"


def _points(pair, layout) -> str:
    a, b = (_local(v, layout.vertex_offsets, layout) for v in pair)
    return f"point {a} - point {b}"


def _point_edge(pair, layout) -> str:
    v, a, b = (_local(v, layout.vertex_offsets, layout) for v in pair)
    return f"point {v} - edge ({a}, {b})"


_DESCRIBED = {"vf": _vertex_face, "ee": _edge_edge, "vp": _vertex_plane, "vv": _points, "ve": _point_edge}


def _local(index, offsets, layout) -> str:
    mesh = min(int(np.searchsorted(offsets, index, side="right")) - 1, len(layout.mesh_names) - 1)
    return f"{layout.mesh_names[mesh]}:{int(index) - int(offsets[mesh])}"
