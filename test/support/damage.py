# SPDX-License-Identifier: Apache-2.0
"""Random damage to the bytes of a file, as disks, cables and interrupted copies cause it."""

import struct

from mcap.opcode import Opcode


def flip_bits(rng, data):
    for _ in range(rng.choice((1, 1, 1, 2, 8, 100))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def flip_a_bit_near_an_end(rng, data):
    # Header, set-up and footer are small: hits there would be rare.
    at = rng.randrange(min(3000, len(data)))
    data[rng.choice((at, len(data) - 1 - at))] ^= 1 << rng.randrange(8)


def overwrite(rng, data):
    at, length = rng.randrange(len(data)), rng.choice((1, 4, 8, 50, 1000))
    data[at : at + length] = rng.randbytes(min(length, len(data) - at))


def insert(rng, data):
    at = rng.randrange(len(data))
    data[at:at] = rng.randbytes(rng.choice((1, 4, 8, 100, 5000)))


def delete(rng, data):
    at = rng.randrange(len(data))
    del data[at : at + rng.choice((1, 4, 8, 100, 5000))]


def zero_a_block(rng, data):
    at = rng.randrange(len(data)) // 512 * 512
    length = min(rng.choice((16, 512, 4096)), len(data) - at)
    data[at : at + length] = bytes(length)


def truncate(rng, data):
    del data[rng.randrange(len(data)) :]


def lose_the_beginning(rng, data):
    del data[: rng.randrange(len(data))]


def repeat_a_piece(rng, data):
    at = rng.randrange(len(data))
    data[at:at] = data[at : at + rng.choice((9, 100, 10_000))]


def reorder_records(rng, data):
    """The same records in another order, as in a file joined from parts."""
    records = whole_records(data)
    a, b = sorted(rng.sample(range(len(records)), 2))
    records[a], records[b] = records[b], records[a]
    data[8:] = b"".join(records) + data[-8:]


def lose_a_record(rng, data):
    records = whole_records(data)
    del records[rng.randrange(len(records))]
    data[8:] = b"".join(records) + data[-8:]


def large_number(rng, data):
    """A length or an offset becomes huge."""
    at = rng.randrange(len(data) - 8)
    data[at : at + 8] = struct.pack("<Q", rng.choice((0, 2**31, 2**32 - 1, 2**40, 2**63, 2**64 - 1)))


def length_of_a_record(rng, data):
    places, at = [], 8
    for record in whole_records(data):
        places.append(at + 1)
        at += len(record)
    at = rng.choice(places)
    old = struct.unpack_from("<Q", data, at)[0]
    new = rng.choice((0, 1, max(0, old - 1), old + 1, old + 1000, 2**31, 2**40, 2**64 - 1))
    struct.pack_into("<Q", data, at, new)


KINDS = (
    flip_bits,
    flip_a_bit_near_an_end,
    overwrite,
    insert,
    delete,
    zero_a_block,
    truncate,
    lose_the_beginning,
    repeat_a_piece,
    reorder_records,
    lose_a_record,
    large_number,
    length_of_a_record,
)


def whole_records(data) -> list[bytes]:
    """The records of a sound file, Header to Footer."""
    found, at = [], 8
    while not found or found[-1][0] != Opcode.FOOTER:
        end = at + 9 + struct.unpack_from("<Q", data, at + 1)[0]
        found.append(bytes(data[at:end]))
        at = end
    return found
