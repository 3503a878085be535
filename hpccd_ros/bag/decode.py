# SPDX-License-Identifier: Apache-2.0
"""CDR bytes of a recording -> message objects of the packages that are installed here."""

import dataclasses
import functools
from collections.abc import Callable

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.contact_padding import without_features
from hpccd_ros.bag.reader import RecordedTopic, RecordingError
from hpccd_ros.middleware.message_types import message_class

# Of CDR: a message begins behind these bytes, which tell its encoding.
_HEADER = 4


@dataclasses.dataclass(frozen=True)
class _Addition:
    """Lines that a definition has got, fields behind those it had; the CDR of their values in a recording from
    before, and to how many bytes the first of them is aligned. clear: of one that took unused bytes instead, what
    makes them empty."""

    lines: frozenset[str]
    value: bytes = b""
    alignment: int = 1
    clear: Callable[[bytes], bytes] = bytes


# Oldest first.
_ADDED = {
    "hpccd/msg/ContactArray": (
        _Addition(frozenset({"uint32[] topology_versions"}), bytes(4), 4),
        _Addition(
            frozenset(
                {
                    "float64 minimum_separation",
                    "uint32[] separation_mesh_a",
                    "uint32[] separation_mesh_b",
                    "float64[] separations",
                    "float64[] closest",
                    "float64[] distance",
                }
            ),
            bytes(8 + 5 * 4),
            8,
        ),
        _Addition(frozenset({"uint8 tested_features"}), clear=without_features),
        _Addition(frozenset({"uint32 parts", "float64[] motion_bounds"}), bytes(4 + 4), 4),
        _Addition(
            frozenset(
                {
                    "uint64 inputs_before",
                    "uint64 start_inputs",
                    "string[] input_topics",
                    "uint16[] input_topic",
                    "int64[] input_sent",
                    "uint8[] input_flags",
                    "uint32 report",
                }
            ),
            bytes(2 * 8 + 4 * 4 + 4),
            8,
        ),
    ),
    "hpccd/msg/DistanceArray": (
        _Addition(frozenset({"float64[] direction", "float64[] approach_speed"}), bytes(2 * 4), 4),
    ),
    "hpccd/msg/MeshTopology": (_Addition(frozenset({"uint32[] edges"}), bytes(4), 4),),
}


def completion(topic: RecordedTopic) -> Callable[[bytes], bytes] | None:
    """What makes of each recorded message of `topic` one of the type that is installed here, whose later fields are
    empty or 0.

    None where it was recorded with another definition. Raises LookupError where the type is not installed.
    """
    installed = message_definitions.definition_text(topic.type_name)
    # The hash says whether two definitions have the same fields; the text would also differ by a comment.
    if topic.type_hash == message_definitions.type_hash(topic.type_name):
        return bytes
    then, now = _fields(topic.definition), _fields(installed)
    if not topic.type_hash and then == now:
        return bytes
    additions = _ADDED.get(topic.type_name, ())
    for count in range(len(additions)):
        lacking = additions[count:]
        added = frozenset().union(*(addition.lines for addition in lacking))
        if then == {name: [line for line in lines if line not in added] for name, lines in now.items()}:
            return functools.partial(_completed, lacking=lacking)
    return None


def _completed(data: bytes, lacking: tuple[_Addition, ...]) -> bytes:
    for addition in lacking:
        data = addition.clear(data)
        data += bytes(-(len(data) - _HEADER) % addition.alignment) + addition.value
    return data


def _fields(definition: str) -> dict[str, list[str]]:
    """Name of the type ("" for the first one) -> its fields in order, which determine the layout of the CDR.

    The rest differs between recorders: comments, spaces, default values, constants (which the hash does not cover
    either), and whether names of types include the package.
    """
    own, *others = definition.split(message_definitions.SEPARATOR)
    sections = {"": own} | {
        name.replace("/msg/", "/"): text for name, _, text in (other.lstrip().partition("\n") for other in others)
    }
    return {
        name.rstrip(): [field for line in text.splitlines() if (field := _field(line))]
        for name, text in sections.items()
    }


def _field(line: str) -> str:
    """Type without package, and name of the field in a line of a definition; "": the line has no field."""
    words = line.partition("#")[0].split(maxsplit=2)
    if len(words) < 2 or "=" in words[1] or words[2:] and words[2].startswith("="):
        return ""
    return f"{words[0].rpartition('/')[2]} {words[1]}"


def make_decoder(topic: RecordedTopic):
    """Function (RecordedMessage -> message object) for `topic`.

    Raises RecordingError where the type is not installed here, or was recorded with another definition: its bytes
    would be misread silently.
    """
    from rclpy.serialization import deserialize_message

    cls, complete = _type_and_completion(topic)

    def decode(message):
        try:
            return deserialize_message(complete(message.data), cls)
        except Exception as error:  # rclpy raises RMWError, RCLError or MemoryError, by what is wrong in the bytes
            raise RecordingError(
                f"message of {topic.name} received at {message.log_time} ns is no valid {topic.type_name}: {error}"
            ) from error

    return decode


def make_completer(topic: RecordedTopic):
    """As `make_decoder`, for those who read the CDR bytes of the type that is installed here themselves."""
    _, complete = _type_and_completion(topic)
    return lambda message: complete(message.data)


def _type_and_completion(topic: RecordedTopic):
    try:
        cls, complete = message_class(topic.type_name), completion(topic)
    except LookupError as error:
        raise RecordingError(f"topic {topic.name} cannot be decoded: {error}") from error
    if complete is None:
        raise RecordingError(
            f"topic {topic.name} was recorded with another definition of {topic.type_name} "
            f"(recorded {topic.type_hash or 'without a hash'}, "
            f"installed {message_definitions.type_hash(topic.type_name)}): "
            "replay it with the version of the package that recorded it"
        )
    return cls, complete
