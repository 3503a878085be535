# SPDX-License-Identifier: Apache-2.0
"""``ContactArray.tested_features`` in answers recorded before it existed: the byte lay unused then and may hold
anything."""

from typing import Literal

# CDR of the fields before it, as (size of an item, whether it is a sequence); a sequence of strings is "strings".
_HEADER = 4
_BEFORE: tuple[str | tuple[int, bool], ...] = (
    "stamp",
    "string",
    "stamp",
    (8, False),
    "strings",
    (1, True),
    (4, True),
    (4, True),
    (4, True),
    (4, True),
    (8, True),
    (8, True),
    (8, True),
    (8, False),
    (8, False),
    (1, False),
)


def without_features(data: bytes) -> bytes:
    """The CDR of a ContactArray that tells none. Bytes that are no ContactArray come back as they are."""
    try:
        at = _HEADER + _end_of(data)
    except IndexError:
        return data
    return data[:at] + b"\0" + data[at + 1 :] if at < len(data) else data


def _end_of(data: bytes) -> int:
    """Where the fields before end, counted from behind the header. Raises IndexError beyond the end of the data."""
    order: Literal["little", "big"] = "little" if data[1] & 1 else "big"

    def count(at: int) -> tuple[int, int]:
        """The number that stands there, aligned, and where it ends."""
        end = at + -at % 4 + 4
        if _HEADER + end > len(data):
            raise IndexError
        return int.from_bytes(data[_HEADER + end - 4 : _HEADER + end], order), end

    at = 0
    for field in _BEFORE:
        if field == "stamp":
            at += -at % 4 + 8
        elif isinstance(field, str):
            texts = 1
            if field == "strings":
                texts, at = count(at)
            for _ in range(texts):
                length, at = count(at)
                at += length
        else:
            items, (size, many) = 1, field
            if many:
                items, at = count(at)
            at += (-at % size if items else 0) + items * size
    return at
