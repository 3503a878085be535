# SPDX-License-Identifier: Apache-2.0
"""Mutations of JSON that leave it JSON."""

import json
from random import Random

from .mutations import Mutate

_VALUES = (
    None,
    True,
    False,
    0,
    1,
    -1,
    2**63,
    1e308,
    -0.5,
    "",
    "a",
    "cloth",
    "tf",
    "points",
    "*",
    [],
    ["a", "cloth"],
    {},
    [0],
)


def changed_json(rng: Random, tree):
    if isinstance(tree, dict) and tree and rng.random() < 0.95:
        key = rng.choice(list(tree))
        if rng.random() < 0.1:
            return {name: value for name, value in tree.items() if name != key}
        if rng.random() < 0.1:
            return tree | {f"{key}{rng.choice('.x/ ')}": tree[key]}
        return tree | {key: changed_json(rng, tree[key])}
    if isinstance(tree, list) and tree and rng.random() < 0.8:
        at = rng.randrange(len(tree))
        changed = rng.choice(([], [tree[at]] * 2, [changed_json(rng, tree[at])]))
        return tree[:at] + changed + tree[at + 1 :]
    return rng.choice(_VALUES)


def mutate_json(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    """Half of the changes are of bytes."""
    try:
        if rng.random() < 0.5:
            return json.dumps(changed_json(rng, json.loads(data)), separators=(",", ":")).encode()
    except (ValueError, RecursionError):
        pass
    return mutate(data, len(data) + 100)
