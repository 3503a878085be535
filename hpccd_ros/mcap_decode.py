# SPDX-License-Identifier: Apache-2.0
"""CDR bytes of a recording -> message objects of the packages that are installed here."""

import importlib

from hpccd_ros import mcap_schema
from hpccd_ros.mcap_reader import RecordedTopic, RecordingError


def message_class(type_name: str):
    """The Python class of "pkg/msg/Name". Raises LookupError where the package is not installed."""
    package, folder, short = type_name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{folder}"), short)
    except (ImportError, AttributeError) as error:
        raise LookupError(f"message type {type_name} is not installed here: {error}") from error


def make_decoder(topic: RecordedTopic):
    """Function (RecordedMessage -> message object) for `topic`.

    Raises RecordingError where the type is not installed here, or was recorded with another definition: its bytes
    would be misread silently.
    """
    from rclpy.serialization import deserialize_message

    try:
        cls = message_class(topic.type_name)
        installed = (mcap_schema.type_hash(topic.type_name), mcap_schema.definition_text(topic.type_name))
    except LookupError as error:
        raise RecordingError(f"topic {topic.name} cannot be decoded: {error}") from error
    # The hash says whether two definitions have the same fields; the text would also differ by a comment.
    same = topic.type_hash == installed[0] if topic.type_hash else topic.definition.split() == installed[1].split()
    if not same:
        raise RecordingError(
            f"topic {topic.name} was recorded with another definition of {topic.type_name} "
            f"(recorded {topic.type_hash or 'without a hash'}, installed {installed[0]}): "
            "replay it with the version of the package that recorded it"
        )

    def decode(message):
        try:
            return deserialize_message(message.data, cls)
        except Exception as error:  # rclpy raises RMWError, RCLError or MemoryError, by what is wrong in the bytes
            raise RecordingError(
                f"message of {topic.name} received at {message.log_time} ns is no valid {topic.type_name}: {error}"
            ) from error

    return decode
