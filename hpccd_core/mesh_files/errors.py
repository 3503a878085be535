# SPDX-License-Identifier: Apache-2.0
"""The error of files that cannot be read as meshes."""

# Of a path or of a library's message: longer ones are cut in the middle.
LONGEST = 200


class MeshFileError(ValueError):
    """A mesh file cannot be used. The message names the file, the problem and the remedy."""


def shortened(text: object) -> str:
    """Beginning and end of a text that is longer than LONGEST, and its length."""
    whole = str(text)
    if len(whole) <= LONGEST:
        return whole
    half = LONGEST // 2
    return f"{whole[:half]}... ({len(whole)} characters) ...{whole[-half:]}"
