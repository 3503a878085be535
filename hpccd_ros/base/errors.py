# SPDX-License-Identifier: Apache-2.0
"""Errors that a command reports to its user as one line, without a traceback."""


class UserError(Exception):
    """A problem and its remedy, as a sentence for the user of a command."""


def require_utf8(*words: str | None) -> None:
    """Raises UserError for a word of a command line that ROS cannot take."""
    for word in words:
        try:
            (word or "").encode()
        except UnicodeEncodeError as error:
            raise UserError(f"{word!r}: not UTF-8, as ROS requires; write it in UTF-8") from error
