# SPDX-License-Identifier: Apache-2.0
"""Which pairs of features were tested <-> the field of ContactArray that tells it."""

from hpccd.msg import ContactArray

from hpccd_core.options import FEATURES

# By the kind of contact that they make.
_BITS = {"vertex_face": 1 << ContactArray.VERTEX_FACE, "edge_edge": 1 << ContactArray.EDGE_EDGE}


def fill_features(message: ContactArray, features: tuple[str, ...]) -> None:
    """Write them into ``message``."""
    message.tested_features = sum(_BITS[name] for name in set(features))


def read_features(message: ContactArray) -> tuple[str, ...]:
    """In the order of FEATURES; both where the message does not tell."""
    told = tuple(name for name in FEATURES if message.tested_features & _BITS[name])
    return told if 0 < message.tested_features <= sum(_BITS.values()) else FEATURES
