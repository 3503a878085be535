# SPDX-License-Identifier: Apache-2.0
"""Hostile set-up of the node in a recording: parameters, topics, roles."""

import json
import math

from hostile_kinds import KINDS, info_of, kind, set_info
from mcap.records import Metadata


def junk(rng):
    """A random value of JSON."""
    deep = []
    for _ in range(rng.choice((3, 400))):
        deep = [deep] if rng.random() < 0.5 else {"a": deep}
    return rng.choice(
        (
            None,
            True,
            False,
            0,
            -1,
            1,
            3,
            2**31,
            2**63,
            2**64,
            -(2**63) - 1,
            10**400,
            0.0,
            -1.5,
            0.5,
            math.nan,
            math.inf,
            -math.inf,
            1e308,
            "",
            "x",
            "exact",
            "a" * 100_000,
            "\0",
            "\ud800",
            "../../etc/passwd",
            "/",
            "..",
            "%s%n",
            "a\nb",
            "\x1b[31m",
            "cloth",
            "tf",
            "any",
            [],
            [[]],
            [None],
            [1, 2],
            ["a", 1],
            ["cloth", "cloth"],
            ["cloth"],
            {},
            {"a": 1},
            {"": {}},
            deep,
            [0.0] * 7,
            [0, 0, 0, 0, 0, 0, 1],
            [math.nan] * 7,
            [0.0] * 100_000,
        )
    )


def rows():
    from hpccd_ros.params.table import MESH_ROWS, NODE_ROWS

    return NODE_ROWS, MESH_ROWS


@kind
def parameter_of_another_kind(rng, bag):
    info = info_of(bag)
    node_rows, mesh_rows = rows()
    for _ in range(rng.choice((1, 1, 3))):
        name = rng.choice(node_rows).name
        if rng.random() < 0.4:
            name = f"mesh.{rng.choice(info['parameters']['meshes'])}.{rng.choice(mesh_rows).name}"
        if name != "meshes" or rng.random() < 0.2:
            info["parameters"] |= {name: junk(rng)}
        if not isinstance(info["parameters"].get("meshes"), list):
            break
    set_info(bag, info)


@kind
def parameter_that_a_replay_uses(rng, bag):
    info = info_of(bag)
    names = [
        "meshes",
        "ignored_pairs",
        "pair_accuracy",
        "pair_features",
        "accuracy",
        "features",
        "report",
        "frame_id",
        "frame_queue",
        "stamp_match",
        "pending_frames",
        "stamp_tolerance",
        "restart_after",
        "max_vertices",
        "max_faces",
        "max_edges",
    ]
    names += [f"mesh.{mesh}.{row.name}" for mesh in info["parameters"]["meshes"] for row in rows()[1]]
    info["parameters"][rng.choice(names)] = junk(rng)
    set_info(bag, info)


@kind
def parameter_lost(rng, bag):
    info = info_of(bag)
    for name in rng.sample(sorted(info["parameters"]), rng.randrange(1, len(info["parameters"]))):
        del info["parameters"][name]
    set_info(bag, info)


@kind
def parameter_unknown(rng, bag):
    info = info_of(bag)
    info["parameters"][
        rng.choice(("", ".", "mesh..", "mesh.cloth", "mesh.nobody.file", "qos_overrides./x", "a" * 9999))
    ] = junk(rng)
    set_info(bag, info)


@kind
def parameters_of_another_kind(rng, bag):
    set_info(bag, info_of(bag) | {rng.choice(("parameters", "topics")): junk(rng)})


@kind
def setup_of_another_kind(rng, bag):
    set_info(bag, junk(rng))


@kind
def setup_is_no_json(rng, bag):
    text = bag.metadata[0].metadata["json"]
    bag.metadata[0].metadata["json"] = rng.choice(
        (
            "",
            "{",
            text[: rng.randrange(len(text))],
            text + text,
            "[" * 100_000,
            '{"a":' * 50_000,
            "nan",
            "1e999",
            "9" * 5000,
            "\0",
            "".join(map(chr, rng.choices(range(0xD000), k=200))),
            text.replace(":", ";", 1),
            '{"parameters": {"meshes": ["a"',
        )
    )


@kind
def setup_record_changed(rng, bag):
    record = bag.metadata[0]
    change = rng.randrange(5)
    if change == 0:
        record.metadata = {}
    elif change == 1:
        record.metadata = {"yaml": "x"}
    elif change == 2:
        bag.metadata.append(Metadata(record.name, {"json": json.dumps(junk(rng))}))
    elif change == 3:
        bag.metadata.insert(0, Metadata(record.name, {"json": json.dumps(junk(rng))}))
    else:
        bag.metadata = [Metadata(f"x{k}", {"json": "{"}) for k in range(1000)]


@kind
def mesh_names(rng, bag):
    info = info_of(bag)
    info["parameters"]["meshes"] = rng.choice(
        (
            [],
            [""],
            ["cloth"],
            ["cloth", "cloth"],
            ["cloth/../ball"],
            [" "],
            ["cloth", ""],
            ["1"],
            ["a" * 10_000],
            ["clo\0th"],
            [f"m{k}" for k in range(3000)],
            [*info["parameters"]["meshes"], "other"],
            info["parameters"]["meshes"][::-1],
            ["CLOTH"],
            ["cloth:ball"],
            "cloth",
            {"cloth": 1},
            [["cloth"]],
        )
    )
    set_info(bag, info)


@kind
def pairs(rng, bag):
    info = info_of(bag)
    one, *_, two = info["parameters"]["meshes"]
    info["parameters"][rng.choice(("ignored_pairs", "pair_accuracy", "pair_features"))] = [
        rng.choice(
            (
                f"{one}:{two}",
                f"{one}:{one}",
                f"{one}:{two}:fast",
                f"{one}:{two}:wrong",
                f"{one}:x",
                ":",
                "::",
                one,
                f"{one}:{one}:exact",
                f"{one}:{two}:vertex_face",
                f"{two}:{one}:balanced",
            )
        )
        for _ in range(rng.choice((1, 2)))
    ]
    set_info(bag, info)


@kind
def scene_that_cannot_be(rng, bag):
    info = info_of(bag)
    for mesh in info["parameters"]["meshes"]:
        info["parameters"][f"mesh.{mesh}.{rng.choice(('static', 'static', 'self_collision'))}"] = True
        if rng.random() < 0.5:
            info["parameters"][f"mesh.{mesh}.transform"] = rng.choice(("none", "pose", "tf"))
            info["parameters"][f"mesh.{mesh}.frame"] = rng.choice(("", "hand", "world"))
            info["parameters"]["frame_id"] = rng.choice(("", "hand", "world", "\0"))
    set_info(bag, info)


@kind
def another_pose(rng, bag):
    info = info_of(bag)
    mesh = rng.choice(info["parameters"]["meshes"])
    info["parameters"][f"mesh.{mesh}.transform"] = "pose"
    info["parameters"][f"mesh.{mesh}.pose"] = rng.choice(
        (
            [],
            [0.0] * 7,
            [0.0] * 6 + [1.0],
            [1e308] * 3 + [0.0, 0.0, 0.0, 1.0],
            [math.inf] * 7,
            [0.0] * 8,
            [0, 0, 0, 0, 0, 0, 1],
            ["0"] * 7,
            [1e-320] * 3 + [0.0, 0.0, 0.0, 1.0],
        )
    )
    set_info(bag, info)


@kind
def another_question(rng, bag):
    """Other options that affect contacts, or how they are compared."""
    info = info_of(bag)
    name, values = rng.choice(
        (
            ("report", ("any", "first", "all")),
            ("accuracy", ("fast", "balanced", "conservative")),
            ("features", ([], ["vertex_face"], ["edge_edge"], ["edges"])),
            ("max_vertices", (1, 10)),
            ("max_faces", (1, 10)),
            ("stamp_match", ("nearest",)),
            ("frame_id", ("elsewhere",)),
            ("pending_frames", (1, 10_000)),
            ("frame_queue", (100_000,)),
            ("restart_after", (0, 1)),
        )
    )
    info["parameters"][name] = rng.choice(values)
    set_info(bag, info)
    if name == "report" and rng.random() < 0.5:
        KINDS["changed_result"](rng, bag)


@kind
def role_junk(rng, bag):
    info = info_of(bag)
    topic = rng.choice(sorted(info["topics"]))
    mesh = info["parameters"]["meshes"][0]
    info["topics"][topic] = rng.choice(
        (
            "",
            "/",
            "meshes",
            "meshes/",
            "meshes//vertices",
            f"meshes/{mesh}",
            f"meshes/{mesh}/",
            f"meshes/{mesh}/contacts",
            f"meshes/{mesh}/vertices/vertices",
            "meshes/nobody/vertices",
            "contacts",
            "/contacts",
            "transforms",
            "/tf",
            "a" * 9999,
            "meshes/cloth/../ball/vertices",
            junk(rng),
        )
    )
    set_info(bag, info)


@kind
def roles_swapped(rng, bag):
    info = info_of(bag)
    topics = list(info["topics"])
    one, two = rng.sample(topics, 2)
    info["topics"][one], info["topics"][two] = info["topics"][two], info["topics"][one]
    if rng.random() < 0.3:
        info["topics"][one] = info["topics"][two]
    set_info(bag, info)


@kind
def roles_lost(rng, bag):
    info = info_of(bag)
    for topic in rng.sample(sorted(info["topics"]), rng.randrange(1, len(info["topics"]) + 1)):
        del info["topics"][topic]
        if rng.random() < 0.5:
            info["topics"][rng.choice(("", "/nowhere", "/contacts", topic + "/x", " "))] = rng.choice(
                ("contacts", "meshes/cloth/vertices", "transforms", "meshes/net/points")
            )
    set_info(bag, info)
