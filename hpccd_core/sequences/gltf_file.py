# SPDX-License-Identifier: Apache-2.0
"""The container of glTF: JSON, buffers and accessors."""

import base64
import json
import os
import struct
import urllib.parse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh_files.errors import shortened
from .sequence import SequenceError

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_COMPRESSIONS = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
# Required extensions that do not change positions, or that accessors cover.
_HARMLESS = ("KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "EXT_lights_")


@dataclass(frozen=True)
class _Buffer:
    """Bytes in a file or in memory. Files are not mapped: a process ends where a mapped file shrinks.

    Parameters
    ----------
    size : int
        Its bytes.
    source : Path or bytes
        Where they are.
    begin : int
        The first of them in a file.
    """

    size: int
    source: Path | bytes
    begin: int = 0

    def read(self, begin: int, size: int) -> bytes:
        if isinstance(self.source, bytes):
            return self.source[begin : begin + size]
        with open(self.source, "rb") as file:
            file.seek(self.begin + begin)
            found = file.read(size)
        if len(found) < size:
            raise SequenceError(f"{self.source}: was cut off while it was read; check it again")
        return found


class GltfFile:
    """A .gltf or .glb file, whose buffers are read when they are needed.

    Parameters
    ----------
    path : Path
        The file; buffers beside it are found by its URIs.

    Raises
    ------
    SequenceError
        It is damaged, compressed, or of another version than 2.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._binary: _Buffer | None = None
        self._buffers: dict[int, _Buffer] = {}
        self.json = self._glb() if path.suffix.lower() == ".glb" else self._parsed(path.read_bytes())
        version = str(self.json.get("asset", {}).get("version", "none"))
        if not version.startswith("2."):
            raise SequenceError(f"{path}: is glTF of version {shortened(version)}; export version 2.0")
        for name in self.json.get("extensionsRequired", []):
            if name in _COMPRESSIONS:
                raise SequenceError(f"{path}: is compressed with {_COMPRESSIONS[name]}; export it without compression")
            if not name.startswith(_HARMLESS):
                raise SequenceError(f"{path}: needs the extension {shortened(name)}; export it without")

    def _parsed(self, data: bytes) -> dict[str, Any]:
        try:
            found = json.loads(data)
        except ValueError:
            found = None
        if not isinstance(found, dict):
            raise SequenceError(f"{self._path}: is not a glTF file (it holds no JSON object); copy or export it again")
        return found

    def _glb(self) -> dict[str, Any]:
        with open(self._path, "rb") as file:
            whole = os.fstat(file.fileno()).st_size
            head = file.read(20)
            if len(head) < 20 or head[:4] != b"glTF":
                raise SequenceError(f"{self._path}: is not a GLB file (it does not begin with glTF); export it again")
            _, version, length, size, kind = struct.unpack("<4sIII4s", head)
            if version != 2:
                raise SequenceError(f"{self._path}: is GLB of version {version}; export version 2")
            if length > whole or 20 + size > length or kind != b"JSON":
                raise SequenceError(
                    f"{self._path}: is cut off or damaged: it has {whole} of {length} bytes; copy or export it again"
                )
            text, chunk = file.read(size), file.read(8)
        if 28 + size <= length and chunk[4:] == b"BIN\0":
            binary = int.from_bytes(chunk[:4], "little")
            self._binary = _Buffer(min(binary, whole - 28 - size), self._path, 28 + size)
        return self._parsed(text)

    def _buffer(self, number: int) -> _Buffer:
        if number not in self._buffers:
            described = self.json["buffers"][number]
            uri = described.get("uri")
            if uri is None:
                if self._binary is None or number:
                    raise SequenceError(f"{self._path}: buffer {number} has no data; copy or export it again")
                found = self._binary
            elif uri.startswith("data:"):
                data = base64.b64decode(uri.partition(",")[2], validate=True)
                found = _Buffer(len(data), data)
            else:
                file = self._path.parent / urllib.parse.unquote(uri)
                if not file.is_file():
                    raise SequenceError(f"{self._path}: its buffer {shortened(uri)} does not exist; copy it beside it")
                found = _Buffer(file.stat().st_size, file)
            if found.size < described["byteLength"]:
                raise SequenceError(
                    f"{self._path}: buffer {number} is cut off: it has {found.size} of {described['byteLength']} "
                    "bytes; copy or export it again"
                )
            self._buffers[number] = found
        return self._buffers[number]

    def accessor(self, number: int) -> NDArray[Any]:
        """(count, width) float64 if it holds floats or normalized integers, otherwise its integers."""
        described = self.json["accessors"][number]
        count, width = described["count"], _WIDTHS[described["type"]]
        dtype = np.dtype(_COMPONENTS[described["componentType"]])
        if "bufferView" not in described and not 0 <= count <= max(
            (self._buffer(k).size for k in range(len(self.json.get("buffers", [])))), default=0
        ):
            raise SequenceError(
                f"{self._path}: accessor {number} has {count} elements without data, more than its buffers have bytes; "
                "export it again"
            )
        if "bufferView" in described:
            values = self._view(described["bufferView"], described.get("byteOffset", 0), count, width, dtype)
        else:
            values = np.zeros((count, width), dtype)
        if sparse := described.get("sparse"):
            places, of = sparse["indices"], sparse["values"]
            kind = np.dtype(_COMPONENTS[places["componentType"]])
            at = self._view(places["bufferView"], places.get("byteOffset", 0), sparse["count"], 1, kind)[:, 0]
            values = values.copy()
            values[at] = self._view(of["bufferView"], of.get("byteOffset", 0), sparse["count"], width, dtype)
        if dtype.kind != "f" and described.get("normalized"):
            return np.maximum(values / np.iinfo(dtype).max, -1.0)
        return values.astype(np.float64) if dtype.kind == "f" else values

    def _view(self, number: int, offset: int, count: int, width: int, dtype: np.dtype[Any]) -> NDArray[Any]:
        described = self.json["bufferViews"][number]
        if set(described.get("extensions", ())) & _COMPRESSIONS.keys():
            raise SequenceError(f"{self._path}: is compressed with meshopt; export it without compression")
        begin, length = described.get("byteOffset", 0), described["byteLength"]
        buffer = self._buffer(described["buffer"])
        item = width * dtype.itemsize
        stride = described.get("byteStride", item)
        end = offset + ((count - 1) * stride + item if count else 0)
        if min(begin, offset, count) < 0 or stride < item or end > length or begin + length > buffer.size:
            raise SequenceError(f"{self._path}: an accessor ends beyond its buffer; copy or export it again")
        return np.ndarray((count, width), dtype, buffer.read(begin + offset, end - offset), 0, (stride, dtype.itemsize))
