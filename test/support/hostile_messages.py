# SPDX-License-Identifier: Apache-2.0
"""Hostile content, order and times of messages."""

import math
import struct

import numpy as np
from bag_tools import typestore
from hostile_kinds import KINDS, LARGE, NUMBERS, decoded, info_of, kind, set_info, topic_of

from hpccd_core.results import OUTPUT_ARRAYS


@kind
def payload(rng, bag):
    message = rng.choice(rng.choice([bag.of_topic(channel.topic) for channel in bag.channels]))
    data = bytearray(message.data)
    change = rng.randrange(8)
    if change == 0:
        del data[rng.randrange(len(data)) :]
    elif change == 1:
        data += rng.randbytes(rng.choice((1, 3, 4, 1000)))
    elif change == 2:
        data = bytearray(rng.randbytes(rng.choice((0, 1, 4, 5, 100))))
    elif change == 3:
        at = 4 * rng.randrange(len(data) // 4)
        data[at : at + 4] = struct.pack("<I", rng.choice(NUMBERS))
    elif change == 4:
        data[rng.randrange(4)] = rng.randrange(256)
    elif change == 5:
        data[rng.randrange(min(200, len(data)))] ^= 1 << rng.randrange(8)
    elif change == 6:
        for _ in range(20):
            data[rng.randrange(len(data))] = rng.randrange(256)
    else:
        data = bytearray(rng.choice(bag.messages).data)
    message.data = bytes(data)


@kind
def payload_lengths(rng, bag):
    """The lengths of arrays and strings, wherever they may stand."""
    message = rng.choice(rng.choice([bag.of_topic(channel.topic) for channel in bag.channels]))
    data = bytearray(message.data)
    for _ in range(rng.choice((1, 4))):
        at = 4 * rng.randrange(1, min(40, len(data) // 4))
        data[at : at + 4] = struct.pack("<I", rng.choice((*NUMBERS, len(data), len(data) // 8)))
    message.data = bytes(data)


@kind
def changed_result(rng, bag):
    def change(put, result):
        name = rng.choice(
            (
                "kind",
                "mesh_a",
                "mesh_b",
                "features_a",
                "features_b",
                "toc",
                *OUTPUT_ARRAYS,
                "first_toc",
                "total",
                "truncated",
                "hash",
                "accuracy",
                "mesh_names",
                "step",
                "tested_features",
            )
        )
        value = getattr(result, name)
        if name in ("first_toc", "total", "truncated", "hash", "step"):
            put(
                name,
                {"first_toc": rng.choice((math.nan, -1.0, 0.0, math.inf)), "truncated": not value}.get(
                    name, rng.choice((0, 1, 2**63, 2**64 - 1))
                ),
            )
        elif name == "tested_features":
            put(name, rng.choice((0, 1, 2, 3, 4, 255)))
        elif name == "accuracy":
            put(name, rng.choice(("", "fast", "wrong", "balanced", "conservative", "\n", "x" * 1000, "exact ")))
        elif name == "mesh_names":
            put(name, rng.choice(([], ["cloth"], ["cloth", "ball", "x"], ["", ""], value[::-1], ["a" * 100_000])))
        else:
            value = value.copy()
            how = rng.randrange(6)
            if how == 0:
                value = value[: rng.randrange(len(value) + 1)]
            elif how == 1:
                value = np.concatenate([value, value])
            elif how == 2:
                value = value[:0]
            elif how == 3 and len(value):
                value[rng.randrange(len(value))] = rng.choice((0, 1, 2, 255) if value.dtype == np.uint8 else NUMBERS)
            elif how == 4 and value.dtype.kind == "f" and len(value):
                value[rng.randrange(len(value))] = rng.choice((math.nan, math.inf, -1.0, 2.0, -0.0, 5e-324))
            else:
                value = value[::-1].copy()
            put(name, value)

    decoded(bag, topic_of(bag, "contacts"), rng, change)


@kind
def changed_separation(rng, bag):
    """Other separations than those used for the contacts, or invalid ones."""

    def change(put, result):
        name = rng.choice(("minimum_separation", "separation_mesh_a", "separation_mesh_b", "separations", "all"))
        length = rng.choice((0.0, -0.0, 5e-324, 1e-3, 0.002, 0.5, 1e150, 1e300, -1.0, math.nan, math.inf))
        if name == "minimum_separation":
            put(name, length)
        elif name == "all":
            put("separation_mesh_a", np.array([0, 1], np.uint32))
            put("separation_mesh_b", np.array([1, rng.choice((0, 1))], np.uint32))
            put("separations", np.array([length, rng.choice((0.0, 1e-3))]))
        else:
            value = getattr(result, name)
            count = rng.choice((0, len(value), len(value) + 1, 1000))
            wrong = length if name == "separations" else rng.choice(NUMBERS)
            put(name, np.full(count, wrong, value.dtype))

    decoded(bag, topic_of(bag, "contacts"), rng, change)


@kind
def changed_distances(rng, bag):
    """Changed distances, if the recording has any; otherwise contacts of meshes that do not exist."""

    def change(put, result):
        name = rng.choice(("kind", "mesh_a", "mesh_b", "features_a", "features_b", "distance", "points"))
        value = getattr(result, name).copy()
        if rng.random() < 0.5 and len(value):
            value[rng.randrange(len(value))] = rng.choice((0, 1, 2, 255) if value.dtype == np.uint8 else NUMBERS)
        else:
            value = value[: rng.randrange(len(value) + 1)]
        put(name, value)

    topic = next((channel.topic for channel in bag.channels if channel.topic.endswith("distances")), None)
    if topic is None:
        return decoded(bag, topic_of(bag, "contacts"), rng, lambda put, result: put("mesh_names", ["cloth", ""]))
    return decoded(bag, topic, rng, change)


@kind
def contact_under_another_name(rng, bag):
    """A contact with another mesh and feature that have the same scene-wide index."""
    store, name = typestore(), "hpccd/msg/MeshTopology"
    topology = bag.of_topic(f"/meshes/{info_of(bag)['parameters']['meshes'][0]}/topology")[0]
    first = store.deserialize_cdr(topology.data, name).n_vertices

    def change(put, result):
        mesh, features = result.mesh_a.copy(), result.features_a.copy()
        of_edges = result.kind == 1
        for row in np.flatnonzero(of_edges | True)[:5]:
            shift = first if mesh[row] == 1 else -first
            mesh[row] = 1 - min(1, mesh[row])
            columns = (2 * row, 2 * row + 1) if of_edges[row] else (2 * row,)
            for column in columns:
                features[column] = np.uint32((int(features[column]) + shift) % 2**32)
        put("mesh_a", mesh)
        put("features_a", features)

    decoded(bag, topic_of(bag, "contacts"), rng, change)


@kind
def unused_entry_used(rng, bag):
    def change(put, result):
        if len(result.kind) and result.kind[0] == 0:
            features = result.features_a.copy()
            features[1] = 5
            put("features_a", features)

    decoded(bag, topic_of(bag, "contacts"), rng, change)


@kind
def no_contacts_claimed(rng, bag):
    def change(put, result):
        for name in ("kind", "mesh_a", "mesh_b", "features_a", "features_b", "toc", *OUTPUT_ARRAYS):
            put(name, getattr(result, name)[:0])
        put("truncated", rng.random() < 0.5)
        if rng.random() < 0.5:
            put("total", 0)
            put("first_toc", math.inf)

    decoded(bag, topic_of(bag, "contacts"), rng, change)
    if rng.random() < 0.3:
        set_info(bag, (lambda info: info | {"parameters": info["parameters"] | {"report": "any"}})(info_of(bag)))


@kind
def stamps(rng, bag):
    topic = rng.choice([c.topic for c in bag.channels if not c.topic.endswith("topology")])

    def change(put, message):
        for place in ("header", "start"):
            stamp = getattr(message, place, None)
            stamp = getattr(stamp, "stamp", stamp)
            if stamp is not None and rng.random() < 0.7:
                object.__setattr__(stamp, "sec", rng.choice((-(2**31), -1, 0, 1, 2**31 - 1)))
                object.__setattr__(stamp, "nanosec", rng.choice((0, 1, 10**9, 2**32 - 1)))

    decoded(bag, topic, rng, change, all_of_them=rng.random() < 0.3)


@kind
def steps_of_frames(rng, bag):
    topic = rng.choice((topic_of(bag, "vertices"), topic_of(bag, "contacts")))
    decoded(
        bag, topic, rng, lambda put, m: put("step", rng.choice((0, 2**63 - 1, 2**63, 2**64 - 1))), rng.random() < 0.5
    )


@kind
def coordinates(rng, bag):
    values = rng.choice(
        (
            (math.nan,),
            (math.inf,),
            (1e308, -1e308),
            (3e38, -3e38),
            (1e-320,),
            (0.0,),
            (1e300, 0.0, 1e-300),
            (-0.0, 0.0),
            (1e154,),
            (1e30, 1.0),
            (1e19, -1e19, 0.0),
        )
    )

    def change(put, message):
        for name in ("vertices_f32", "vertices_f64"):
            old = getattr(message, name)
            if len(old):
                with np.errstate(over="ignore"):
                    new = np.array(rng.choices(values, k=len(old))).astype(old.dtype)
                # Not a whole mesh across the scene: 600,000 contacts, each at the core's slowest, take a minute.
                if len(values) > 1 or rng.random() < 0.5:
                    new = np.where(np.arange(len(old)) < 9, new, old)
                put(name, new)

    decoded(bag, topic_of(bag, "vertices"), rng, change, all_of_them=rng.random() < 0.6)


@kind
def vertices_of_a_frame(rng, bag):
    def change(put, message):
        name = "vertices_f32" if len(message.vertices_f32) else "vertices_f64"
        old = getattr(message, name)
        how = rng.randrange(6)
        if how == 0:
            put(name, old[: rng.choice((0, 1, 2, 3, 6, len(old) - 3))])
        elif how == 1:
            put("vertices_f64", old.astype(np.float64))
            put("vertices_f32", old.astype(np.float32))
        elif how == 2:
            put("topology_version", rng.choice(NUMBERS))
        elif how == 3:
            other = {"vertices_f32": "vertices_f64", "vertices_f64": "vertices_f32"}[name]
            put(other, old.astype(np.float64 if other.endswith("64") else np.float32))
            put(name, old[:0])
        elif how == 4:
            object.__setattr__(message.header, "frame_id", rng.choice(("", "elsewhere", "\0x", "a" * 10_000)))
        else:
            put(name, np.concatenate([old, old]))

    decoded(bag, topic_of(bag, "vertices"), rng, change, all_of_them=rng.random() < 0.4)


@kind
def topology(rng, bag):
    def change(put, message):
        faces = message.faces.copy()
        how = rng.randrange(8)
        if how == 0:
            faces[rng.randrange(len(faces))] = rng.choice(NUMBERS)
        elif how == 1:
            faces[1] = faces[0]
        elif how == 2:
            faces = faces[:0]
        elif how == 3:
            faces = faces[: rng.choice((1, 2, 3, 4))]
        elif how == 4:
            put("n_vertices", rng.choice(NUMBERS))
        elif how == 5:
            put("version", rng.choice(NUMBERS))
        elif how == 6:
            faces = np.concatenate([faces, faces])
        else:
            faces = faces.reshape(-1, 3)[:, ::-1].reshape(-1).copy()
        put("faces", faces)

    decoded(bag, rng.choice([c.topic for c in bag.channels if c.topic.endswith("topology")]), rng, change)


@kind
def cloud(rng, bag):
    if not any(channel.topic.endswith("points") for channel in bag.channels):
        return coordinates(rng, bag)

    def change(put, message):
        name = rng.choice(
            ("height", "width", "point_step", "row_step", "is_bigendian", "data", "fields", "fields", "fields")
        )
        if name == "is_bigendian":
            put(name, True)
        elif name == "data":
            put(name, message.data[: rng.randrange(len(message.data))])
        elif name == "fields":
            field = rng.choice(message.fields)
            object.__setattr__(
                field,
                *rng.choice(
                    (
                        ("name", rng.choice("xyz")),
                        ("name", ""),
                        ("offset", rng.choice(NUMBERS)),
                        ("offset", rng.randrange(12)),
                        ("datatype", rng.randrange(12)),
                        ("count", rng.choice(NUMBERS)),
                    )
                ),
            )
            if rng.random() < 0.3:
                put("fields", rng.choice(([], message.fields[:2], message.fields * 2, message.fields[::-1])))
        else:
            put(name, rng.choice(NUMBERS))

    decoded(bag, topic_of(bag, "points"), rng, change, all_of_them=rng.random() < 0.5)


@kind
def transforms(rng, bag):
    if not any(channel.topic.startswith("/transforms") for channel in bag.channels):
        return stamps(rng, bag)

    def change(put, message):
        how = rng.randrange(4)
        value = rng.choice((0.0, math.nan, math.inf, 1e308, -1.0, 1e-320))
        if how == 0:
            object.__setattr__(message.transform.rotation, rng.choice("xyzw"), value)
        elif how == 1:
            object.__setattr__(message.transform.translation, rng.choice("xyz"), value)
        elif how == 2:
            put("child_frame_id", rng.choice(("", "world", "arm", "hand", "/", "a" * 1000, "ü")))
        else:
            object.__setattr__(message.header, "frame_id", rng.choice(("", "world", "arm", "hand", "/", "a" * 1000)))

    decoded(bag, rng.choice(("/transforms", "/transforms_static")), rng, change, all_of_them=rng.random() < 0.5)


@kind
def times_of_messages(rng, bag):
    how = rng.randrange(7)
    for message in bag.messages if how < 5 else [rng.choice(bag.messages)]:
        message.log_time = (
            0,
            2**64 - 1,
            rng.choice(LARGE),
            2**64 - 1 - message.log_time,
            rng.randrange(2**64),
            0,
            2**64 - 1,
        )[how]
        message.publish_time = rng.choice((0, 2**64 - 1, message.publish_time))


@kind
def order_of_messages(rng, bag):
    how = rng.randrange(5)
    if how == 0:
        rng.shuffle(bag.messages)
    elif how == 1:
        bag.messages = bag.messages * rng.choice((2, 3))
    elif how == 2:
        bag.messages = rng.sample(bag.messages, rng.randrange(len(bag.messages)))
    elif how == 3:
        bag.messages = []
    else:
        times = [message.log_time for message in bag.messages]
        rng.shuffle(times)
        for message, time in zip(bag.messages, times, strict=True):
            message.log_time = time


@kind
def numbers_of_messages(rng, bag):
    for message in bag.messages:
        message.sequence = rng.choice((0, 1, 2**32 - 1, rng.randrange(100)))


@kind
def messages_of_another_topic(rng, bag):
    for message in rng.sample(bag.messages, rng.choice((1, 2, len(bag.messages)))):
        message.channel_id = rng.choice([*(channel.id for channel in bag.channels), 99, 0])


@kind
def outside_of_chunks(rng, bag):
    bag.chunk_bytes = 0
    bag.summary = rng.random() < 0.7
    again = KINDS[
        rng.choice(("payload", "channel_twice", "order_of_messages", "messages_of_another_topic", "times_of_messages"))
    ]
    return again(rng, bag)
