# SPDX-License-Identifier: Apache-2.0
"""Decodes CDR bytes of a recording to message objects of the installed packages."""

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.reader import RecordedTopic, RecordingError
from hpccd_ros.middleware.message_types import message_class


def _has_installed_layout(topic: RecordedTopic) -> bool:
    """Whether ``topic`` was recorded with the fields of the installed type.

    Raises LookupError if the type is not installed.
    """
    installed = message_definitions.definition_text(topic.type_name)
    # The hash is equal if the fields are; the text also contains comments.
    if topic.type_hash:
        return topic.type_hash == message_definitions.type_hash(topic.type_name)
    return _fields(topic.definition) == _fields(installed)


def _fields(definition: str) -> dict[str, list[str]]:
    """Name of the type ("" for the first one) -> its fields in order, which determine the layout of the CDR.

    Other parts differ between recorders: comments, spaces, default values, constants (which the hash does not cover
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

    Raises RecordingError if the type is not installed, or was recorded with another definition: its bytes would be
    misread silently.
    """
    from rclpy.serialization import deserialize_message

    cls = checked_type(topic)

    def decode(message):
        try:
            return deserialize_message(message.data, cls)
        except Exception as error:  # rclpy raises RMWError, RCLError or MemoryError for invalid bytes
            raise RecordingError(
                f"message of {topic.name} received at {message.log_time} ns is no valid {topic.type_name}: {error}"
            ) from error

    return decode


def checked_type(topic: RecordedTopic):
    """The installed class of the messages of ``topic``.

    Raises RecordingError if the type is not installed, or was recorded with another definition.
    """
    try:
        cls, same = message_class(topic.type_name), _has_installed_layout(topic)
    except LookupError as error:
        remedy = "install the package that defines it, or record without this topic"
        raise RecordingError(f"topic {topic.name} cannot be decoded: {error}; {remedy}") from error
    if not same:
        raise RecordingError(
            f"topic {topic.name} was recorded with another definition of {topic.type_name} "
            f"(recorded {topic.type_hash or 'without a hash'}, "
            f"installed {message_definitions.type_hash(topic.type_name)}): "
            "replay it with the version of the package that recorded it"
        )
    return cls
