# SPDX-License-Identifier: Apache-2.0
"""Mutations of messages as CDR."""

import struct
from random import Random

from .mutations import NUMBERS


def with_number(rng: Random, payload: bytes) -> bytes:
    """Another number at a place where CDR may have one."""
    if len(payload) < 12:
        return payload
    code = rng.choice("BIIIdf")
    size = struct.calcsize(code)
    at = 4 + rng.randrange((len(payload) - 4 - size) // size + 1) * size
    old = struct.unpack_from(f"<{code}", payload, at)[0]
    if code in "df":
        new = rng.choice((0.0, -0.0, 1.0, -1.0, float("nan"), float("inf"), 1e30, 1e-30, 1e150, 3e38, -old))
    else:
        new = rng.choice((*NUMBERS, old + 1, old - 1, 2 * old, old // 2)) % 256**size
    try:
        return payload[:at] + struct.pack(f"<{code}", new) + payload[at + size :]
    except OverflowError:  # no float32
        return payload
