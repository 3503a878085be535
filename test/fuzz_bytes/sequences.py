# SPDX-License-Identifier: Apache-2.0
"""Files of sequences, as `hpccd-check` reads them: VTK, VTU, glTF, GLB, arrays, point caches, USD."""

import base64
import importlib
import io
import itertools
import json
import struct

import numpy as np

from hpccd_core import MeshFileError
from hpccd_core.sequences.opening import open_sequence

from .json_mutations import mutate_json
from .target import Target, file_of, missing

_MOST_FRAMES = 3
_POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
_FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
_OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 3 4\n"


def _vtk() -> list[bytes]:
    head = "# vtk DataFile Version {}\nx\n{}\nDATASET {}\n"
    text = head.format("3.0", "ASCII", "POLYDATA") + "POINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 2\n"
    solid = (
        head.format("2.0", "ASCII", "UNSTRUCTURED_GRID")
        + "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        + "CELLS 2 9\n4 0 1 2 3\n3 0 1 2\nCELL_TYPES 2\n10 5\nCELL_DATA 2\n"
    )
    new = (head.format("5.1", "BINARY", "POLYDATA") + "POINTS 4 float\n").encode() + _POINTS.astype(">f4").tobytes()
    new += b"\nMETADATA\nx\n\nPOLYGONS 3 6\nOFFSETS vtktypeint64\n" + np.array([0, 3, 6], ">i8").tobytes()
    new += b"\nCONNECTIVITY vtktypeint64\n" + _FACES.astype(">i8").tobytes()
    field = b"FIELD FieldData 1\nTIME 1 1 double\n0.5\n"
    return [text.encode(), solid.encode(), new, text.encode().replace(b"POINTS", field + b"POINTS")]


def _vtu() -> list[bytes]:
    raw = struct.pack("<I", 24) + np.array([0, 1, 2, 0, 2, 3], "<i4").tobytes()
    form = (
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid><Piece '
        'NumberOfPoints="4" NumberOfCells="2"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">'
        '0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray type="Int32" Name="connectivity" {}</DataArray>'
        '<DataArray type="Int32" Name="offsets" format="ascii">3 6</DataArray><DataArray type="UInt8" Name="types" '
        'format="ascii">5 5</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>'
    )
    binary = base64.b64encode(raw).decode()
    return [form.format(part).encode() for part in ('format="ascii">0 1 2 0 2 3', f'format="binary">{binary}')]


def _gltf(uri: bool) -> tuple[dict, bytes]:
    parts = [
        _POINTS.tobytes(),
        _FACES.astype("<u2").tobytes(),
        np.array([0, 1], "<f4").tobytes(),
        np.array([[0, 0, 0], [0, 0, 1]], "<f4").tobytes(),
        np.array([[0, 0, 0.7, 0.7], [0, 0, 0, 1]], "<f4").tobytes(),
        np.zeros(16, "<u1").tobytes(),
        np.tile(np.array([1, 0, 0, 0], "<f4"), 4).tobytes(),
        np.eye(4, dtype="<f4").tobytes(),
    ]
    starts = [0, *itertools.accumulate(map(len, parts))]
    kinds = (
        (5126, 4, "VEC3"), (5123, 6, "SCALAR"), (5126, 2, "SCALAR"), (5126, 2, "VEC3"), (5126, 2, "VEC4"),
        (5121, 4, "VEC4"), (5126, 4, "VEC4"), (5126, 1, "MAT4"),
    )  # fmt: skip
    data = b"".join(parts)
    buffer = {"byteLength": len(data)}
    if uri:
        buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    attributes = {"POSITION": 0, "JOINTS_0": 5, "WEIGHTS_0": 6}
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"mesh": 0, "skin": 0, "children": [1]},
            {"mesh": 0, "scale": [1, 2, 1], "weights": [0.5]},
            {"rotation": [0, 0, 0, 1]},
        ],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 1, "targets": [{"POSITION": 0}]}]}],
        "skins": [{"joints": [2], "inverseBindMatrices": 7}],
        "animations": [
            {
                "channels": [
                    {"sampler": 0, "target": {"node": 0, "path": "translation"}},
                    {"sampler": 1, "target": {"node": 2, "path": "rotation"}},
                ],
                "samplers": [{"input": 2, "output": 3}, {"input": 2, "output": 4, "interpolation": "STEP"}],
            }
        ],
        "buffers": [buffer],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
            for start, part in zip(starts, parts, strict=False)
        ],
        "accessors": [
            {"bufferView": k, "componentType": component, "count": count, "type": kind}
            for k, (component, count, kind) in enumerate(kinds)
        ],
    }
    return document, data


def _gltf_texts() -> list[bytes]:
    return [json.dumps(_gltf(uri=True)[0], separators=(",", ":")).encode()]


def _glb() -> list[bytes]:
    document, data = _gltf(uri=False)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return [struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks]


def _saved(save, *args, **arrays) -> bytes:
    stream = io.BytesIO()
    save(stream, *args, **arrays)
    return stream.getvalue()


def _npz() -> list[bytes]:
    frames = np.stack([_POINTS, _POINTS + 1])
    named = {"a_vertices": frames, "a_faces": _FACES, "b_vertices": _POINTS.astype(np.float64), "b_faces": _FACES}
    return [
        _saved(np.savez, vertices=frames, faces=_FACES),
        _saved(np.savez_compressed, **named),
        _saved(np.savez, v=np.asfortranarray(frames), f=_FACES.astype(np.int64)),
    ]


def _npy() -> list[bytes]:
    frames = np.stack([_POINTS, _POINTS + 1])
    return [_saved(np.save, frames), _saved(np.save, np.asfortranarray(frames.astype(np.float16)))]


def _pc2() -> list[bytes]:
    return [struct.pack("<12siiffi", b"POINTCACHE2\0", 1, 4, 0.0, 1.0, 2) + 2 * _POINTS.tobytes()]


def _mdd() -> list[bytes]:
    return [struct.pack(">ii2f", 2, 4, 0.0, 1.0) + 2 * _POINTS.astype(">f4").tobytes()]


_USDA = b"""#usda 1.0
(
    metersPerUnit = 0.01
    upAxis = "Z"
)
def Xform "a" {
    matrix4d xformOp:transform = ( (1,0,0,0),(0,1,0,0),(0,0,1,0),(1,2,3,1) )
    uniform token[] xformOpOrder = ["xformOp:transform"]
    def Mesh "m" {
        int[] faceVertexCounts = [3, 4]
        int[] faceVertexIndices = [0, 1, 2, 0, 1, 2, 3]
        point3f[] points.timeSamples = { 0: [(0,0,0),(1,0,0),(1,1,0),(0,1,0)], 1: [(0,0,1),(1,0,1),(1,1,1),(0,1,1)] }
        uniform token orientation = "leftHanded"
        token visibility.timeSamples = { 0: "inherited", 1: "invisible" }
    }
}
"""


def _usdc() -> list[bytes]:
    usd, target = importlib.import_module("pxr.Usd"), missing("seed.usdc")
    stage = usd.Stage.Open(str(file_of(_USDA, "seed.usda")))
    stage.GetRootLayer().Export(str(target))
    return [target.read_bytes()]


_VTK_WORDS = (
    b"POINTS ", b"POLYGONS ", b"CELLS ", b"CELL_TYPES ", b"OFFSETS vtktypeint64\n", b"CONNECTIVITY int\n", b"LINES ",
    b"VERTICES ", b"METADATA\n", b"FIELD a 1\n", b"TRIANGLE_STRIPS ", b"POINT_DATA ", b"BINARY", b" -1 ", b"double",
)  # fmt: skip
_VTU_WORDS = (
    b'format="binary"', b'format="appended"', b'offset="0"', b"<AppendedData encoding='raw'>_",
    b'compressor="vtkZLibData',
    b'header_type="UInt64"', b"Float64", b"UInt8", b"NumberOfCells=", b"<DataArray", b"BigEndian",
)  # fmt: skip
_GLTF_WORDS = (
    b'"sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}', b'"mode":5',
    b'"mode":6', b'"byteStride":9', b'"normalized":true', b'"interpolation":"CUBICSPLINE"',
    b'"extensionsRequired":["x"]',
    b'"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]', b'"uri":"a.bin"', b"null", b"[]", b"{}", b"true", b"1e99", b"-1",
    b'"targets":', b'"weights"', b'"path":"weights"', b'"EXT_meshopt_compression"', b'"MAT4"', b"5125",
    b'"count":99999999',
)  # fmt: skip
_ARRAY_WORDS = (
    b"'shape': (",
    b"'fortran_order': True",
    b"'descr': '<f8'",
    b"|O",
    b"vertices.npy",
    b"faces.npy",
    b"PK\5\6",
)
_USD_WORDS = (
    b"holeIndices", b"subdivisionScheme", b"purpose", b"instanceable", b"references = </a>", b"over", b"timeSamples",
    b"xformOp:translate", b"!resetXformStack!", b"payload = @./x.usda@", b"None", b"skel:blendShapes", b"variantSet",
)  # fmt: skip


def _reader(suffix: str, seeds, words: tuple[bytes, ...], *, faces: bool = False, **options) -> Target:
    def read(data: bytes) -> None:
        of_faces = file_of(_OBJ, "faces.obj") if faces else None
        # Another name each time: USD shares layers of one path.
        path = file_of(data, f"input{next(_numbers)}{suffix}")
        try:
            _check(open_sequence(path, faces=of_faces))
        finally:
            path.unlink()

    return Target(read, seeds, (MeshFileError,), words=words, **options)


def _check(sequence) -> None:
    for frame in itertools.islice(sequence, _MOST_FRAMES):
        assert len(frame.vertices) == sum(mesh.n_vertices for mesh in frame.meshes)
        assert all(not len(mesh.faces) or mesh.faces.max() < mesh.n_vertices for mesh in frame.meshes)


_numbers = itertools.count()


TARGETS = {
    "vtk": _reader(".vtk", _vtk, _VTK_WORDS, largest=800),
    "vtu": _reader(".vtu", _vtu, _VTU_WORDS, largest=2000, needs=("meshio",)),
    "gltf": _reader(".gltf", _gltf_texts, _GLTF_WORDS, largest=4000, mutate=mutate_json),
    "glb": _reader(".glb", _glb, _GLTF_WORDS, largest=4000),
    "npz": _reader(".npz", _npz, _ARRAY_WORDS, largest=3000),
    "npy": _reader(".npy", _npy, _ARRAY_WORDS, faces=True, largest=500),
    "pc2": _reader(".pc2", _pc2, (), faces=True, largest=300),
    "mdd": _reader(".mdd", _mdd, (), faces=True, largest=300),
    "usdc": _reader(".usdc", _usdc, (), largest=6000, needs=("pxr",), native=True),
    "usd": _reader(".usda", lambda: [_USDA], _USD_WORDS, largest=2000, needs=("pxr",)),
}
