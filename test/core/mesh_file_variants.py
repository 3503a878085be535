# SPDX-License-Identifier: Apache-2.0
"""Mesh files as programs write them, with their content: (name of the file, bytes, vertices, polygons).

The content is not read from the files: the files are made from it.
"""

import itertools
import struct

import numpy as np

# Vertex 4 is in no face; 5 repeats the position of 0, with another zero.
VERTICES = [[0.0, 0, 0], [1, 0, 0], [1, 1, 0.25], [0.1, 1, 0], [7, 7, 7], [-0.0, 0, 0]]
FACES = [[0, 1, 2], [5, 2, 3]]
QUADS = [[0, 1, 2, 3], [5, 1, 2, 3]]
MIXED = [[0, 1, 2, 3], [3, 2, 1], [5, 1, 2], [0, 1, 4, 2, 3]]
# Not convex: the fan of its first corner leaves it.
ELL = [[2.0, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0], [0, 0, 0], [2, 0, 0]]


def _v(vertices=VERTICES, after=""):
    return "".join("v {} {} {}{}\n".format(*p, after) for p in vertices)


def _f(faces=FACES, form="{}"):
    return "".join("f " + " ".join(form.format(c + 1) for c in face) + "\n" for face in faces)


_PLAIN = _v() + _f()
_LOOKS = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0 1 0\n"

_OBJ = {
    "plain": _PLAIN,
    "no-end-of-line": _PLAIN.rstrip(),
    "two-materials": _v() + "usemtl a\n" + _f(FACES[:1]) + "usemtl b\n" + _f(FACES[1:]),
    "materials-in-turn": "mtllib none.mtl\n" + _v() + "usemtl b\n" + _f(FACES[:1]) + "usemtl a\n" + _f(FACES[1:]),
    "objects-and-groups": "o one\n" + _v() + "g a\ns 1\n" + _f(FACES[:1]) + "o two\ng b c\ns off\n" + _f(FACES[1:]),
    "vertices-of-each-object": _v(VERTICES[:3]) + _f(FACES[:1]) + "o b\n" + _v(VERTICES[3:]) + _f(FACES[1:]),
    "faces-before-vertices": _f() + _v(),
    "texture": _v() + _LOOKS + _f(form="{}/1"),
    "textures-that-differ": _v() + _LOOKS + "f 1/1 2/2 3/3\nf 6/4 3/2 4/1\n",
    "normals": _v() + _LOOKS + _f(form="{}//2"),
    "texture-and-normals": _v() + _LOOKS + "f 1/1/1 2/2/2 3/3/1\nf 6/1/2 3/3/2 4/4/1\n",
    "mixed-references": _v() + _LOOKS + "f 1 2/2 3//1\nf 6/1/2 3 4//\n",
    "colours": _v(after=" 0.5 0.25 1") + _f(),
    "weights": _v(after=" 1.0") + _f(),
    "some-colours": _v(VERTICES[:2], " 1 0 0") + _v(VERTICES[2:]) + _f(),
    "comments": "# v 9 9 9\n" + _v(after=" # v") + "f 1 2 3# first\nf 6 3 4 # second \\\n#f 1 2 3\n",
    "comment-with-backslash": "# C:\\models\\\n" + _PLAIN,
    "name-with-backslash": "mtllib C:\\\\\ng x\\\n" + _PLAIN.replace("f 6", "usemtl D:\\\nf 6"),
    "continued": _PLAIN.replace("v 1 0 0\n", "v 1 \\\n 0 0\n").replace("f 1 2", "f 1 2 \\\n\\\n"),
    "continued-at-the-end": _PLAIN[:-2] + "\\\n4",
    "blanks": "\n\n" + _PLAIN.replace(" ", " \t ").replace("\n", " \n\n").replace("v", "\t v"),
    "negative": _v() + "f -6 -5 -4\nf -1 -4 -3\n",
    "negative-in-between": _v(VERTICES[:3]) + "f -3 -2 -1\n" + _v(VERTICES[3:]) + "f -1 -4 -3\n",
    "numbers": "v 0 +0.0 0e0\nv 1. 0 -0\nv 1E0 10e-1 .25\nv 0.1 1 0\nv 7 7 7\nv -0 0 0\n" + _f(),
    "lines-and-points": _v() + "p 1\nl 1 2 3\nf 1 2\n" + _f() + "f 1\n",
    "curves": "deg 3\ncstype bspline\n" + _v() + "vp 0.1\nparm u 0 1\nend\n" + _f(),
    "quads": (_v() + _f(QUADS), QUADS),
    "mixed": (_v() + _f(MIXED), MIXED),
}


def _obj():
    for name, made in _OBJ.items():
        text, faces = made if isinstance(made, tuple) else (made, FACES)
        yield name, text.encode(), VERTICES, faces
    yield "bom", b"\xef\xbb\xbf" + _PLAIN.encode(), VERTICES, FACES
    yield "cr", _PLAIN.replace("\n", "\r").encode(), VERTICES, FACES
    yield "crlf", _PLAIN.replace("\n", "\r\n").encode(), VERTICES, FACES
    yield "latin-1", b"# Gr\xf6\xdfe\no K\xf6rper\n" + _PLAIN.encode(), VERTICES, FACES
    yield "not-convex", (_v(ELL) + _f([range(6)])).encode(), ELL, [list(range(6))]


FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CODES = {
    "char": "b",
    "uchar": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "uint": "I",
    "int64": "q",
    "uint8": "B",
    "float": "f",
    "float32": "f",
    "double": "d",
    "int32": "i",
}


def ply(form, elements, end="\n", comments=()):
    """elements: (name, properties, rows); a property is a type, or (type of the length, type of the items)."""
    header = ["ply", f"format {form} 1.0", *comments]
    body = b""
    for name, properties, rows in elements:
        header.append(f"element {name} {len(rows)}")
        for key, kind in properties.items():
            header.append(f"property {kind if isinstance(kind, str) else 'list ' + ' '.join(kind)} {key}")
        for row in rows:
            values = []
            for kind, value in zip(properties.values(), row, strict=True):
                values += [(kind, value)] if isinstance(kind, str) else [(kind[0], len(value))]
                values += [] if isinstance(kind, str) else [(kind[1], item) for item in value]
            if form == "ascii":
                body += (" ".join(f"{value}" for _, value in values) + end).encode()
            else:
                body += b"".join(struct.pack(FORMS[form] + _CODES[kind], value) for kind, value in values)
    return (end.join([*header, "end_header", ""])).encode() + body


_XYZ = {"x": "float", "y": "float", "z": "float"}
_LIST = {"vertex_indices": ("uchar", "int")}
_EDGES = ("edge", {"vertex1": "int", "vertex2": "int"}, [(0, 1), (1, 2)])


def _rows(faces, *more):
    return [(face, *more) for face in faces]


def _ply_elements():
    """name -> (elements, polygons)"""
    points = [tuple(p) for p in VERTICES]
    vertex, face = ("vertex", _XYZ, points), ("face", _LIST, _rows(FACES))
    corners = [([0, 1, 2], [0, 0, 1, 0, 1, 1]), ([5, 2, 3], [0.5, 0, 1, 0.25, 0, 1])]
    more = {"flags": "uchar", "quality": "double"}
    strips = ("strip", {"points": ("ushort", "short"), "kind": "int"}, [([1, 2], 3), ([], 4), ([5], 6)])
    return {
        "plain": ([vertex, face], FACES),
        "double": ([("vertex", dict.fromkeys("xyz", "double"), points), face], FACES),
        "int-positions": (
            [
                ("vertex", dict.fromkeys("xyz", "int"), [tuple(map(int, p)) for p in ELL]),
                ("face", _LIST, _rows([range(6)])),
            ],
            [list(range(6))],
        ),
        "colours": (
            [("vertex", {**_XYZ, "red": "uchar", "alpha": "uchar"}, [(*p, 1, 2) for p in points]), face],
            FACES,
        ),
        "other-order": (
            [
                ("vertex", {"s": "float", "z": "float", "y": "double", "x": "float"}, [(9, *p[::-1]) for p in points]),
                face,
            ],
            FACES,
        ),
        "texture-of-faces": ([vertex, ("face", {**_LIST, "texcoord": ("uchar", "float")}, corners)], FACES),
        "texture-before": (
            [vertex, ("face", {"texcoord": ("uchar", "float"), **_LIST}, [r[::-1] for r in corners])],
            FACES,
        ),
        "quads": ([vertex, ("face", _LIST, _rows(QUADS))], QUADS),
        "mixed": ([vertex, ("face", _LIST, _rows(MIXED))], MIXED),
        "mixed-and-more": ([vertex, ("face", {"a": "short", **_LIST, **more}, [(5, f, 7, 0.5) for f in MIXED])], MIXED),
        "not-convex": ([("vertex", _XYZ, ELL), ("face", _LIST, _rows([range(6)]))], [list(range(6))]),
        "edges": ([vertex, face, _EDGES], FACES),
        "edges-first": ([_EDGES, vertex, face], FACES),
        "faces-first": ([face, vertex], FACES),
        "lists-of-others": ([strips, vertex, face], FACES),
        "no-edges": ([vertex, face, ("edge", _EDGES[1], [])], FACES),
        "vertex_index": ([vertex, ("face", {"vertex_index": ("int", "uint")}, _rows(FACES))], FACES),
        "short-lists": ([vertex, ("face", {"vertex_indices": ("ushort", "short")}, _rows(FACES))], FACES),
        "long-lists": ([vertex, ("face", {"vertex_indices": ("char", "int64")}, _rows(FACES))], FACES),
        "float-lists": ([vertex, ("face", {"vertex_indices": ("float", "float")}, _rows(MIXED))], MIXED),
        "other-name": ([vertex, ("face", {"corners": ("uint8", "int32")}, _rows(FACES))], FACES),
        "points-and-lines": ([vertex, ("face", _LIST, _rows([[0], *FACES, [1, 2], []]))], FACES),
        "any-lists-of-vertices": (
            [
                (
                    "vertex",
                    {
                        "a": "uchar",
                        "x": "float",
                        "near": ("uchar", "short"),
                        "y": "float",
                        "more": ("int", "double"),
                        "z": "float",
                    },
                    [(9, x, [1] * (k % 3), y, [2.5] * (k % 2), z) for k, (x, y, z) in enumerate(points)],
                ),
                face,
            ],
            FACES,
        ),
        "lists-of-vertices": (
            [("vertex", {"near": ("uchar", "int"), **_XYZ}, [([1, 2], *p) for p in points]), face],
            FACES,
        ),
    }


def _lists_of_coordinates():
    """(axis, format) -> a file in which that coordinate of each vertex is a list of one number, and so its length 1."""
    points = [tuple(p) for p in VERTICES]
    for column, axis in enumerate("xyz"):
        types = {**_XYZ, axis: ("uchar", "float")}
        rows = [(*p[:column], [p[column]], *p[column + 1 :]) for p in points]
        for form in FORMS:
            yield (axis, form), ply(form, [("vertex", types, rows), ("face", _LIST, _rows(FACES))])


LISTS_OF_COORDINATES = dict(_lists_of_coordinates())


def _ply():
    for name, (elements, polygons) in _ply_elements().items():
        _, types, rows = next(element for element in elements if element[0] == "vertex")
        columns = [list(types).index(axis) for axis in "xyz"]
        vertices = np.array([[row[column] for column in columns] for row in rows], np.float64)
        for axis, column in enumerate("xyz"):
            if types[column] == "float":
                vertices[:, axis] = vertices[:, axis].astype(np.float32)
        for form in FORMS:
            yield f"{name}-{form}", ply(form, elements), vertices, polygons
    elements, polygons = _ply_elements()["plain"]
    vertices = np.array(VERTICES, np.float32)
    for form, end in itertools.product(FORMS, ("\r\n", "\r")):
        comments = ("comment element vertex 9", "obj_info end_header of none", "comment TextureFile none.png")
        yield f"{'cr' if end == chr(13) else 'crlf'}-{form}", ply(form, elements, end, comments), vertices, polygons
    yield "blank-lines", ply("ascii", elements, "\n").replace(b"0\n", b"0 \n\n ") + b"\n\n", vertices, polygons
    yield "more-values", ply("ascii", elements).replace(b"3 0 1 2\n", b"3 0 1 2 255 0 0\n"), vertices, polygons
    for form in FORMS:
        yield f"trailing-{form}", ply(form, elements) + b"\n# made by none", vertices, polygons


TRIANGLES = np.array([[VERTICES[c] for c in face] for face in FACES], np.float32)
# Corners in order of first use; 5 and 0 are one.
WELDED = np.array([VERTICES[0], VERTICES[1], VERTICES[2], VERTICES[3]], np.float32)
WELDED_FACES = [[0, 1, 2], [0, 2, 3]]


def stl(header=b"", triangles=TRIANGLES, count=None):
    rows = np.zeros(len(triangles), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    rows["v"], rows["a"] = triangles, 0x8421
    return header.ljust(80, b"\0") + struct.pack("<I", len(triangles) if count is None else count) + rows.tobytes()


def text_stl(start="solid name\n", end="endsolid name\n", triangles=TRIANGLES):
    corners = ["".join(f"  vertex {x:.17g} {y:.17g} {z:.17e}\n" for x, y, z in t.tolist()) for t in triangles]
    facet = "facet normal 0 0 1\n outer loop\n{} endloop\nendfacet\n"
    return (start + "".join(facet.format(text) for text in corners) + end).encode()


def _stl():
    text = text_stl()
    half = text_stl(triangles=TRIANGLES[:1])
    found = {
        "binary": stl(),
        "header-solid": stl(b"solid made by a program"),
        "header-facet": stl(b"solid x\nfacet normal 0 0 0\nouter loop\nvertex"),
        "header-of-an-archive": stl(b"PK\x03\x04"),
        "header-of-a-pointer": stl(b"version https://git-lfs") + b"more",
        "trailing-bytes": stl() + b"colours of a program\0\xff",
        "trailing-zero": stl() + b"\0",
        "trailing-line-end": stl(b"solid") + b"\r\n",
        "text": text,
        "no-endsolid": text_stl(end=""),
        "no-name": text_stl("solid\n", "endsolid\n"),
        "no-solid": text_stl("", ""),
        "upper-case": text.upper(),
        "crlf": text.replace(b"\n", b"\r\n"),
        "cr": text.replace(b"\n", b"\r"),
        "blank-first": b"\n \n" + text,
        "bom": b"\xef\xbb\xbf" + text,
        "comment-first": b"# made by a program\n" + text,
        "latin-1-name": text.replace(b"name", b"K\xf6rper"),
        "name-with-keywords": text.replace(b"name", b"facet vertex endsolid"),
        "two-solids": half + text_stl(triangles=TRIANGLES[1:]),
        "indented": text.replace(b"\n", b"\n\t  "),
    }
    for name, data in found.items():
        yield name, data, WELDED, WELDED_FACES


VARIANTS = [
    (f"{name}.{suffix}", *rest)
    for suffix, made in (("obj", _obj()), ("ply", _ply()), ("stl", _stl()))
    for name, *rest in made
]
