# SPDX-License-Identifier: Apache-2.0
"""Errors that a command reports to its user as one line, without a traceback."""


class UserError(Exception):
    """What went wrong and what to do about it, in words for the person who typed the command."""


# A sentence, even where a recording puts a megabyte into it.
_LONGEST = 1000


def sentence(text: str) -> str:
    """`text` for a terminal: what is not printable is escaped, and the middle of a long one left out."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return plain if len(plain) <= _LONGEST else f"{plain[: _LONGEST // 2]} ... {plain[-_LONGEST // 2 :]}"
