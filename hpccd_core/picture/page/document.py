# SPDX-License-Identifier: Apache-2.0
"""The HTML file: viewer, data, and three.js, with which the page draws: trimesh carries a released build of it."""

import base64
import dataclasses
import hashlib
import html
import importlib.metadata
import importlib.resources
import io
import json
import re
import string
import zipfile

_BUILD = re.compile(r"/\*\*\n \* @license\n \* Copyright [^\n]*Three\.js Authors\n( \*[^\n]*\n)+!function[^\n]+")
_REVISION = re.compile(r'"use strict";const \w+="(\d+)"')


class LibraryError(Exception):
    """There is no three.js to put into a page. The message names the remedy."""


@dataclasses.dataclass(frozen=True)
class Library:
    """script: defines THREE. revision: of three.js. source: the package that brought it, with its version."""

    script: str
    revision: str
    source: str


def three() -> Library:
    """Raises LibraryError where trimesh is missing, or holds no such build."""
    try:
        source = f"trimesh {importlib.metadata.version('trimesh')}"
    except importlib.metadata.PackageNotFoundError:
        raise LibraryError("an HTML page needs the Python package trimesh; pip install trimesh") from None
    archive = importlib.resources.files("trimesh") / "resources" / "templates" / "viewer.zip"
    try:
        with zipfile.ZipFile(io.BytesIO(archive.read_bytes())) as files:
            text = "".join(files.read(name).decode() for name in files.namelist())
    except (OSError, zipfile.BadZipFile) as error:
        raise LibraryError(f"an HTML page needs the three.js that trimesh carries: {source}: {error}") from error
    build = _BUILD.search(text)
    revision = build and _REVISION.search(build[0])
    if build is None or revision is None:
        raise LibraryError(f"an HTML page needs the three.js that trimesh carries: {source} has none, 5.2.0 has it")
    return Library(build[0], revision[1], source)


# In the order in which they use each other.
SCRIPTS = (
    *("unpack", "recording", "camera", "tint", "surfaces", "contacts", "ribbons", "curves"),
    *("chart", "times", "viewer"),
)
# JSON may hold these escaped; so nothing of a recording can end the element that holds it, or begin another.
_ESCAPES = {ord(c): f"\\u{ord(c):04x}" for c in "<>&"}


def document(description: dict, blobs: dict[str, bytes], library: Library) -> str:
    """The page of what RecordingPage.described() gives.

    All that comes from the recording is in the JSON of one element and in base64; the viewer shows it as text. The page
    forbids itself every address and every script but its own two.
    """
    description = {**description, "library": {"revision": library.revision, "source": library.source}}
    viewer = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    for script in (library.script, viewer):
        if "</script" in script.lower() or "<!--" in script:
            raise ValueError("a script of the page would end its element")
    data = "\n".join(
        f'<script type="application/octet-stream" id="{name}">{base64.b64encode(blob).decode()}</script>'
        for name, blob in blobs.items()
    )
    return string.Template(_asset("page.html")).substitute(
        hashes=" ".join(map(_hash, (library.script, viewer))),
        style=_asset("style.css"),
        licence=html.escape(_asset("three_licence.txt")),
        content=json.dumps(description, allow_nan=False, separators=(",", ":")).translate(_ESCAPES),
        data=data,
        library=library.script,
        viewer=viewer,
    )


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _asset(name: str) -> str:
    return (importlib.resources.files("hpccd_core.picture.page") / "assets" / name).read_text(encoding="utf-8")
