# SPDX-License-Identifier: Apache-2.0
"""Messages as text in the form of YAML, as `ros2 topic echo` prints them."""

import json
import re
from collections.abc import Iterator
from typing import Any

# Entries of an array that are shown when it is cut, and characters of a text.
SHORT_ARRAY = 16
SHORT_TEXT = 200
# A text that YAML reads as this text without quotes.
_PLAIN = re.compile(r"[A-Za-z_/][\w/.:-]*(?<!:)")
_WORDS = ("true", "false", "yes", "no", "on", "off", "null", "y", "n")


def lines(message: Any, full: bool = False, indent: str = "") -> Iterator[str]:
    """Of a ROS message, one field after the other. full: arrays and texts whole."""
    for name in message.get_fields_and_field_types():
        value = getattr(message, name)
        if _is_message(value):
            nested = list(lines(value, full, f"{indent}  "))
            yield f"{indent}{name}:{'' if nested else ' {}'}"
            yield from nested
        elif _is_array(value) and any(_is_message(entry) for entry in value[:1]):
            yield f"{indent}{name}:"
            shown = value if full else value[:SHORT_ARRAY]
            for entry in shown:
                first, *rest = lines(entry, full, f"{indent}  ")
                yield f"{indent}- {first.lstrip()}"
                yield from rest
            if len(shown) < len(value):
                yield f"{indent}# {_cut(len(shown), len(value))}"
        else:
            yield f"{indent}{name}: {_plain(value, full)}"


def _plain(value: Any, full: bool) -> str:
    """Of a number, a text, or an array of them, on one line."""
    if isinstance(value, bytes) and len(value) == 1:  # rclpy's form of the type byte
        return str(value[0])
    if _is_array(value):
        shown = value if full else value[:SHORT_ARRAY]
        cut = f"  # {_cut(len(shown), len(value))}" if len(shown) < len(value) else ""
        return f"[{', '.join(_plain(_python(entry), full) for entry in shown)}]{cut}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _text(value, full)
    return repr(value)


def _text(value: str, full: bool) -> str:
    if not full and len(value) > SHORT_TEXT:
        return f"{json.dumps(value[:SHORT_TEXT])}  # {SHORT_TEXT} of {len(value):,} characters; --full shows all"
    plain = _PLAIN.fullmatch(value) and value.lower() not in _WORDS
    return value if plain else json.dumps(value, ensure_ascii=False)


def _cut(shown: int, total: int) -> str:
    return f"{shown} of {total:,} entries; --full shows all"


def _is_message(value: Any) -> bool:
    return hasattr(value, "get_fields_and_field_types")


def _is_array(value: Any) -> bool:
    return hasattr(value, "__getitem__") and not isinstance(value, (str, bytes))


def _python(entry: Any) -> Any:
    """numpy's numbers, as fixed arrays have them, as Python's."""
    return entry.item() if hasattr(entry, "item") else entry
