# SPDX-License-Identifier: Apache-2.0
"""Untrusted input quoted in messages, shortened to a readable length."""

import difflib
from collections import Counter
from collections.abc import Iterable, Sequence

# Characters of one value: a path of usual length is shown whole.
LONGEST = 200
# Characters of a whole message, which may quote several values.
LONGEST_MESSAGE = 1000
# Names in a list.
MOST = 10


def shortened(text: object, longest: int = LONGEST) -> str:
    """Beginning and end of a text that is longer than ``longest``, and how long it is."""
    text = str(text)
    if len(text) <= longest:
        return text
    half = longest // 2
    return f"{text[:half]}... ({len(text)} characters) ...{text[-half:]}"


def quoted(value: object) -> str:
    """A value as Python writes it, with quotes around a text."""
    return shortened(repr(value))


def listed(names: Iterable[str]) -> str:
    """Names with commas between them: the first, and how many more there are."""
    names = list(names)
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return ", ".join(shortened(name, 80) for name in names[:MOST]) + more


def repeated(names: Iterable[str]) -> str:
    """The name that is there most often."""
    return quoted(Counter(names).most_common(1)[0][0])


def nearest(word: str, names: Iterable[str], similarity: float = 0.6) -> str:
    """The name nearest to ``word``; "": none has this similarity (difflib, 0 .. 1)."""
    near = len(word) <= LONGEST and difflib.get_close_matches(word, list(names), n=1, cutoff=similarity)
    return near[0] if near else ""


def begun(word: str, options: Iterable[str]) -> str:
    """The first option that ``word`` abbreviates, as --sep does --separation; "": there is none."""
    return next((option for option in options if len(word) > 3 and option.startswith(word)), "")


def suggestion(word: str, names: Iterable[str], similarity: float = 0.6) -> str:
    """ "; did you mean NAME?" with the `nearest` name; "": there is none."""
    near = nearest(word, names, similarity)
    return f"; did you mean {near}?" if near else ""


def not_one_of(value: object, choices: Sequence[str]) -> str:
    """That ``value`` is not one of the allowed texts, and which those are."""
    return f"{quoted(value)} is not valid; use one of {', '.join(choices)}{suggestion(str(value), choices)}"


def counted(count: int, one: str, many: str = "") -> str:
    """``1 frame``, ``2 frames``; many: the plural where it is not ``one`` with an s."""
    return f"{count:,} {one if count == 1 else many or f'{one}s'}"


def printable(text: str) -> str:
    """`text` for a terminal: what is not printable is escaped, and the middle of a long one left out."""
    plain = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    half = LONGEST_MESSAGE // 2
    return plain if len(plain) <= LONGEST_MESSAGE else f"{plain[:half]} ... {plain[-half:]}"
