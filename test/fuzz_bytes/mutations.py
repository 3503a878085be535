# SPDX-License-Identifier: Apache-2.0
"""Mutations of bytes, without Atheris: for the stored inputs in the test suite, and inside structured mutations."""

import struct
from collections.abc import Callable, Sequence
from random import Random

#: (bytes, most bytes of the result) -> changed bytes. Under Atheris it is libFuzzer's.
Mutate = Callable[[bytes, int], bytes]

NUMBERS = (0, 1, 2, 3, 7, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**63 - 1, 2**63, 2**64 - 1)
_CODES = "BHIQ"
_TEXTS = (b"nan", b"inf", b"-1", b"1e999", b"9" * 25, b"0", b"\xff", b"\0", b"", b"\n", b"\xe2\x80\xa8", b"a" * 300)


def anywhere(rng: Random, data: bytes, mutate: Mutate) -> bytes:
    """For formats without lengths and checksums."""
    return mutate(data, max(2 * len(data), 64))


def mutation(rng: Random, words: Sequence[bytes] = (), largest: int = 1 << 20) -> Mutate:
    """A function that makes one to three random changes. words: of the format."""

    def mutate(data: bytes, most: int) -> bytes:
        changed = bytearray(data)
        for _ in range(rng.choice((1, 1, 2, 3))):
            rng.choice(_CHANGES)(rng, changed, words)
        return bytes(changed[: min(most, largest)])

    return mutate


def _place(rng, data):
    return rng.randrange(len(data) + 1)


def _flip(rng, data, words):
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _replace(rng, data, words):
    if data:
        data[rng.randrange(len(data))] = rng.randrange(256)


def _delete(rng, data, words):
    at = _place(rng, data)
    del data[at : at + rng.choice((1, 2, 4, 16, 100))]


def _cut(rng, data, words):
    del data[_place(rng, data) :]


def _repeat(rng, data, words):
    at = _place(rng, data)
    piece = data[at : at + rng.choice((1, 4, 16, 100))]
    at = _place(rng, data)
    data[at:at] = piece * rng.choice((1, 1, 2, 10))


def _number(rng, data, words):
    code = rng.choice(_CODES)
    size = struct.calcsize(code)
    at = _place(rng, data) // size * size if rng.random() < 0.7 else _place(rng, data)
    value = rng.choice((*NUMBERS, len(data), len(data) - 1)) % 256**size
    data[at : at + size] = struct.pack(rng.choice("<>") + code, value)


def _word(rng, data, words):
    at, word = _place(rng, data), rng.choice((*words, *_TEXTS))
    data[at : at + (0 if rng.random() < 0.5 else len(word))] = word


_CHANGES = (_flip, _replace, _delete, _cut, _repeat, _number, _word)
