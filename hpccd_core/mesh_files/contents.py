# SPDX-License-Identifier: Apache-2.0
"""Recognise files that are not a mesh, or a mesh of another format than their suffix says."""

from . import lines

_EXPORT = "export the mesh as OBJ, PLY, STL or DAE"
_UNPACK = "unpack it"

# (first bytes, description, remedy). The remedy for a supported format is its suffix.
_BEGINNINGS: tuple[tuple[bytes, str, str], ...] = (
    (b"PK\x03\x04", "a zip archive", _UNPACK),
    (b"PK\x05\x06", "an empty zip archive", "get the mesh itself"),
    (b"\x1f\x8b", "compressed (gzip)", _UNPACK),
    (b"BZh", "compressed (bzip2)", _UNPACK),
    (b"\xfd7zXZ\x00", "compressed (xz)", _UNPACK),
    (b"\x28\xb5\x2f\xfd", "compressed (zstd)", _UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", _UNPACK),
    (b"Rar!", "a RAR archive", _UNPACK),
    (b"\x89PNG", "a PNG image", _EXPORT),
    (b"\xff\xd8\xff", "a JPEG image", _EXPORT),
    (b"%PDF", "a PDF document", _EXPORT),
    (b"glTF", "a GLB file (glTF)", _EXPORT),
    (b"Kaydara FBX", "an FBX file", _EXPORT),
    (b"ISO-10303-21", "a STEP file", _EXPORT),
    (b"#VRML", "a VRML file", _EXPORT),
    (b"\x7fELF", "a program", _EXPORT),
)
_TEXTS: tuple[tuple[bytes, str, str], ...] = (
    (b"version https://git-lfs", "a Git LFS pointer, not the mesh itself", "run git lfs pull"),
    (b"<!doctype html", "a web page (HTML)", "download the file itself"),
    (b"<html", "a web page (HTML)", "download the file itself"),
    (b"<?xml", "an XML file", f"where it is COLLADA name it .dae, otherwise {_EXPORT}"),
    (b"<collada", "a COLLADA file", "name it .dae"),
    (b"ply\n", "a PLY file", "name it .ply"),
    (b"ply\r", "a PLY file", "name it .ply"),
    (b"solid", "an STL file", "name it .stl"),
    (b"off\n", "an OFF file", _EXPORT),
    (b"{", "a JSON file", _EXPORT),
)
# Beginnings that are right for a suffix.
_OWN = {".ply": (b"ply\n", b"ply\r"), ".stl": (b"solid",), ".dae": (b"<?xml", b"<collada")}


def foreign(data: bytes, suffix: str, text: bool = True) -> str | None:
    """Description and remedy if a file with this suffix is obviously something else, or None.

    text: whether it may be a text file.
    """
    # The beginning first: stripping a whole file of many megabytes copies it and blocks other threads.
    if not data[:512].strip() and not data.strip():
        return "is empty; copy or export it again"
    if not data[:512].strip(b"\0") and not data.strip(b"\0"):
        return "holds zeros only; copy or export it again"
    for beginning, what, remedy in _BEGINNINGS:
        if data.startswith(beginning):
            return f"is {what}; {remedy}"
    if data[257:262] == b"ustar":
        return f"is a tar archive; {_UNPACK}"
    if not text:
        return None
    if suffix != ".dae" and data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "is UTF-16 text; save it as UTF-8"
    start = data[:512].removeprefix(lines.BOM).lstrip().lower()
    for beginning, what, remedy in _TEXTS:
        if start.startswith(beginning) and beginning not in _OWN.get(suffix, ()):
            return f"is {what}; {remedy}"
    return None
