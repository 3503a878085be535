# SPDX-License-Identifier: Apache-2.0
"""CDR bytes of a recording -> message objects of the packages that are installed here."""

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.reader import RecordedTopic, RecordingError
from hpccd_ros.middleware.message_types import message_class

# Fields that were added behind the last one of a message, and the CDR of their value in a recording from before.
_ADDED = {"hpccd/msg/ContactArray": ("uint32[] topology_versions", b"\0\0\0\0")}


def completion(topic: RecordedTopic) -> bytes | None:
    """What must follow each recorded message of `topic`, that it be one of the type that is installed here.

    None where it was recorded with another definition. Raises LookupError where the type is not installed.
    """
    installed = message_definitions.definition_text(topic.type_name)
    # The hash says whether two definitions have the same fields; the text would also differ by a comment.
    if topic.type_hash == message_definitions.type_hash(topic.type_name):
        return b""
    then, now = _fields(topic.definition), _fields(installed)
    if not topic.type_hash and then == now:
        return b""
    added, tail = _ADDED.get(topic.type_name, (None, None))
    return tail if then == {name: [f for f in fields if f != added] for name, fields in now.items()} else None


def _fields(definition: str) -> dict[str, list[str]]:
    """Name of the type, "" for the first -> its fields and constants, without comments."""
    own, *others = definition.split(message_definitions.SEPARATOR)
    sections = {"": own} | {name: text for name, _, text in (other.lstrip().partition("\n") for other in others)}
    lines = {name: (" ".join(line.partition("#")[0].split()) for line in text.splitlines())
             for name, text in sections.items()}  # fmt: skip
    return {name: [line for line in of_type if line] for name, of_type in lines.items()}


def make_decoder(topic: RecordedTopic):
    """Function (RecordedMessage -> message object) for `topic`.

    Raises RecordingError where the type is not installed here, or was recorded with another definition: its bytes
    would be misread silently.
    """
    from rclpy.serialization import deserialize_message

    try:
        cls, tail = message_class(topic.type_name), completion(topic)
    except LookupError as error:
        raise RecordingError(f"topic {topic.name} cannot be decoded: {error}") from error
    if tail is None:
        raise RecordingError(
            f"topic {topic.name} was recorded with another definition of {topic.type_name} "
            f"(recorded {topic.type_hash or 'without a hash'}, "
            f"installed {message_definitions.type_hash(topic.type_name)}): "
            "replay it with the version of the package that recorded it"
        )

    def decode(message):
        try:
            return deserialize_message(message.data + tail if tail else message.data, cls)
        except Exception as error:  # rclpy raises RMWError, RCLError or MemoryError, by what is wrong in the bytes
            raise RecordingError(
                f"message of {topic.name} received at {message.log_time} ns is no valid {topic.type_name}: {error}"
            ) from error

    return decode
