# SPDX-License-Identifier: Apache-2.0
"""Mesh files: every format that `hpccd_core.load_mesh` reads."""

import struct

import hpccd_core as hc
from hpccd_core import MeshFileError

from .target import Target, file_of

_OBJ = b"# a\nmtllib a.mtl\nv 0 0 0\nv 1 0 0 1\nv 1 1 0\nv 0 1 .5\nvn 0 0 1\nf 1 2 3 4\nf -4//1 -3/1/1 -2\n"
_CONCAVE = b"v 0 0 0\nv 2 0 0\nv .5 .5 0\nv 0 2 0\nv 1 1 1\nf 1 2 3 4\nf 1 2 3 4 5\n"
_PLY_TEXT = (
    b"ply\nformat ascii 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty float y\nproperty double z\n"
    b"property uchar red\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n3 0 1 2\n4 0 1 2 3\n"
)


def _ply(order: str) -> bytes:
    name = {"<": b"little", ">": b"big"}[order]
    head = (
        b"ply\nformat binary_" + name + b"_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        b"property float z\nproperty list uchar short l\nelement edge 1\nproperty int a\nelement face 2\n"
        b"property list uchar int vertex_index\nproperty uchar flag\nend_header\n"
    )
    rows = b"".join(
        struct.pack(f"{order}3fB{len(more)}h", *xyz, len(more), *more)
        for xyz, more in (((0, 0, 0), ()), ((1, 0, 0), (1,)), ((1, 1, 0), ()), ((0, 1, 0), (2, 3)))
    )
    faces = struct.pack(f"{order}iB3iBB4iB", 7, 3, 0, 1, 2, 1, 4, 0, 1, 2, 3, 2)
    return head + rows + faces


_FACET = (
    b"facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    b"facet normal 0 0 1\nouter loop\nvertex 0 0 1\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
)


def _stl() -> bytes:
    corners = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    return b"binary".ljust(80) + struct.pack("<I", 2) + 2 * struct.pack("<12fH", 0.0, 0.0, 1.0, *corners, 0)


_DAE = b"""<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
<unit meter="0.01" name="c"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id="g"><mesh><source id="s">
<float_array id="a" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common><accessor source="#a" count="4"
stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#s"/></vertices>%s</mesh></geometry>
</library_geometries><library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
<library_visual_scenes><visual_scene id="w"><node id="m"><translate>1 2 3</translate><rotate>0 0 1 90</rotate>
<scale>1 2 1</scale><instance_geometry url="#g"/><instance_node url="#n"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#w"/></scene></COLLADA>"""
_INPUT = b'<input semantic="VERTEX" source="#v" offset="0"/>'
_PRIMITIVES = (
    b'<triangles count="2">' + _INPUT + b"<p>0 1 2 0 2 3</p></triangles>",
    b'<polylist count="2">' + _INPUT + b"<vcount>3 4</vcount><p>0 1 2 0 1 2 3</p></polylist>",
    b'<polygons count="1">' + _INPUT + b'<p>0 1 2 3</p></polygons><lines count="1">' + _INPUT + b"<p>0 1</p></lines>",
)
_OBJ_WORDS = (b"v ", b"f ", b"vt ", b"\nl 1 2\n", b"\\\n", b"//", b"\r\n", b"\nf 1 1 2\n", b"\nv nan 0 0\n")
_PLY_WORDS = (
    b"element face 1\n", b"element x 9\n", b"property list int64 double x\n", b"property list uchar uchar a\n",
    b"property int y\n", b"binary_big_endian", b"ascii", b"end_header\n", b"obj_info", b"tristrips", b"uint64",
)  # fmt: skip
_DAE_WORDS = (
    b"<p>", b"</p>", b"<ph>", b"<h>", b"polylist", b"polygons", b"triangles", b"tristrips", b"trifans", b"<matrix>",
    b"<skew>", b"<lookat>", b'offset="9"', b'stride="2"', b"instance_node", b"#n", b"#w", b"<extra>", b"&amp;", b"<!--",
    b"<!DOCTYPE a>", b"<vcount>", b'count="1"', b"instance_controller", b'meter="0"', b"<![CDATA[",
)  # fmt: skip


def _loader(suffix: str, seeds: list[bytes], words: tuple[bytes, ...], **options) -> Target:
    def read(data: bytes) -> None:
        vertices, faces = hc.load_mesh(file_of(data, f"input{suffix}"))
        assert len(faces) and faces.max() < len(vertices)

    return Target(read, lambda: seeds, (MeshFileError,), words=words, **options)


TARGETS = {
    "obj": _loader(".obj", [_OBJ, _CONCAVE], _OBJ_WORDS, largest=500),
    "ply": _loader(".ply", [_PLY_TEXT, _ply("<"), _ply(">")], _PLY_WORDS, largest=800),
    "stl": _loader(
        ".stl", [_stl(), b"solid a\n" + _FACET + b"endsolid\n"], (b"facet", b"endfacet", b"vertex "), largest=800
    ),
    "dae": _loader(
        ".dae", [_DAE % primitive for primitive in _PRIMITIVES], _DAE_WORDS, largest=3000, needs=("collada",)
    ),
}
