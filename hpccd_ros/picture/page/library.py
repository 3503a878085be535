# SPDX-License-Identifier: Apache-2.0
"""three.js, with which the page draws: trimesh carries a released build of it for a viewer of its own."""

import dataclasses
import importlib.metadata
import importlib.resources
import io
import re
import zipfile

from hpccd_ros.base import extras
from hpccd_ros.base.errors import UserError

_BUILD = re.compile(r"/\*\*\n \* @license\n \* Copyright [^\n]*Three\.js Authors\n( \*[^\n]*\n)+!function[^\n]+")
_REVISION = re.compile(r'"use strict";const \w+="(\d+)"')


@dataclasses.dataclass(frozen=True)
class Library:
    """script: defines THREE. revision: of three.js. source: the package that brought it, with its version."""

    script: str
    revision: str
    source: str


def three() -> Library:
    """Raises UserError where trimesh is missing, or holds no such build."""
    extras.require("trimesh", "page", "an HTML page")
    source = f"trimesh {importlib.metadata.version('trimesh')}"
    archive = importlib.resources.files("trimesh") / "resources" / "templates" / "viewer.zip"
    try:
        with zipfile.ZipFile(io.BytesIO(archive.read_bytes())) as files:
            text = "".join(files.read(name).decode() for name in files.namelist())
    except (OSError, zipfile.BadZipFile) as error:
        raise UserError(f"an HTML page needs the three.js that trimesh carries: {source}: {error}") from error
    build = _BUILD.search(text)
    revision = build and _REVISION.search(build[0])
    if build is None or revision is None:
        raise UserError(f"an HTML page needs the three.js that trimesh carries: {source} has none, 5.2.0 has it")
    return Library(build[0], revision[1], source)
