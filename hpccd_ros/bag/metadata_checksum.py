# SPDX-License-Identifier: Apache-2.0
"""A checksum in the metadata records that this package writes. MCAP has none for them, and a changed parameter or mesh
name would not be noticed. A checksum of the whole data (DataEnd) would cost the recorder 0.4 ms of CPU time a MB."""

import itertools
import zlib

from mcap.exceptions import McapError
from mcap.records import Metadata

# Name of the metadata record with the parameters and topic names that a replay needs.
HPCCD_RECORD = "hpccd"
ROSBAG2_RECORD = "rosbag2"
_KEY = "crc32"


def with_checksum(name: str, values: dict[str, str]) -> dict[str, str]:
    """The values of the metadata record ``name``, and their checksum."""
    return values | {_KEY: _checksum(name, values)}


def check(record: Metadata) -> None:
    """Raises McapError if the record does not match its checksum. Other and earlier recorders write none."""
    if record.name not in (HPCCD_RECORD, ROSBAG2_RECORD):
        return
    values = dict(record.metadata)
    stored = values.pop(_KEY, None)
    if stored is None and (record.name == ROSBAG2_RECORD or set(values) <= {"json"}):
        return
    if stored != _checksum(record.name, values):
        raise McapError(f"the metadata record {record.name} does not match its checksum")


def _checksum(name: str, values: dict[str, str]) -> str:
    text = "\0".join([name, *itertools.chain.from_iterable(sorted(values.items()))])
    return f"{zlib.crc32(text.encode()):08x}"
