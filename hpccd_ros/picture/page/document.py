# SPDX-License-Identifier: Apache-2.0
"""The HTML file: viewer, library and data in one."""

import base64
import hashlib
import html
import importlib.resources
import json
import string

from hpccd_ros.picture.page.library import Library

# In the order in which they use each other.
SCRIPTS = ("unpack", "recording", "camera", "surfaces", "contacts", "chart", "times", "viewer")
# JSON may hold these escaped; so nothing of a recording can end the element that holds it, or begin another.
_ESCAPES = {ord(c): f"\\u{ord(c):04x}" for c in "<>&"}


def document(said: dict, blobs: dict[str, bytes], library: Library) -> str:
    """The page of what RecordingPage.described() gives.

    All that comes from the recording is in the JSON of one element and in base64; the viewer shows it as text. The page
    forbids itself every address and every script but its own two.
    """
    said = {**said, "library": {"revision": library.revision, "source": library.source}}
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
        content=json.dumps(said, allow_nan=False, separators=(",", ":")).translate(_ESCAPES),
        data=data,
        library=library.script,
        viewer=viewer,
    )


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def _asset(name: str) -> str:
    return (importlib.resources.files("hpccd_ros.picture.page") / "assets" / name).read_text(encoding="utf-8")
