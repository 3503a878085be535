# SPDX-License-Identifier: Apache-2.0
"""The error for files that cannot be read as meshes."""

# Characters of a path or of a library's message; longer ones are cut in the middle.
LONGEST = 200


def printable(text: str) -> str:
    """The text with control characters, line ends and characters without an encoding escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class MeshFileError(ValueError):
    """A mesh file cannot be used. The message names the file, the problem and the remedy, in one printable line: it may
    quote the file."""

    def __init__(self, text: str) -> None:
        super().__init__(printable(text))


def shortened(text: object, longest: int = LONGEST) -> str:
    """The text; only its beginning, its length and its end if it has more than `longest` characters."""
    whole = str(text)
    if len(whole) <= longest:
        return whole
    half = longest // 2
    return f"{whole[:half]}... ({len(whole)} characters) ...{whole[-half:]}"
