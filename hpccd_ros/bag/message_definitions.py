# SPDX-License-Identifier: Apache-2.0
"""Text and hash of ROS message definitions, as rosbag2 stores them in an MCAP file (schema encoding `ros2msg`)."""

import functools
import json
import os
import sys
from pathlib import Path

from hpccd_ros.middleware.message_types import split_type_name

# rosbag2's LocalMessageDefinitionSource separates a type from the types of its fields by exactly this line.
SEPARATOR = "=" * 80


@functools.cache
def definition_text(type_name: str) -> str:
    """Full definition of `type_name` ("pkg/msg/Name"): its own text, then the types of its fields.

    Raises LookupError if the message package is not installed.
    """
    own, *nested = _type_hashes(type_name)
    texts = [_message_file(own, ".msg").read_text(encoding="utf-8")]
    for name in nested:
        package, _, short = split_type_name(name)
        text = _message_file(name, ".msg").read_text(encoding="utf-8")
        texts.append(f"MSG: {package}/{short}\n{text}")
    return f"\n{SEPARATOR}\n".join(texts)


def type_hash(type_name: str) -> str:
    """The REP-2011 hash ("RIHS01_...") of `type_name`, as announced by DDS endpoints of the type."""
    return _type_hashes(type_name)[type_name]


@functools.cache
def _type_hashes(type_name: str) -> dict[str, str]:
    # The generated type description lists the type itself first, then every type it refers to, at any depth.
    description = json.loads(_message_file(type_name, ".json").read_text(encoding="utf-8"))
    return {entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]}


def _message_file(type_name: str, suffix: str) -> Path:
    package, folder, short = split_type_name(type_name)
    # The wheels install into sys.prefix and never set AMENT_PREFIX_PATH; a sourced workspace sets it.
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p] + [sys.prefix]
    for prefix in prefixes:
        path = Path(prefix) / "share" / package / folder / (short + suffix)
        if path.is_file():
            return path
    raise LookupError(
        f"definition of {type_name} not found: {package}/{folder}/{short}{suffix} is in the share folder of none of "
        f"{prefixes}; install the package or source the workspace that holds it"
    )
