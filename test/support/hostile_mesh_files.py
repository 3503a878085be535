# SPDX-License-Identifier: Apache-2.0
"""Hostile mesh files stored in a recording."""

import dataclasses
import struct

from hostile_kinds import KINDS, LARGE, NUMBERS, info_of, kind, set_info
from mcap.records import Attachment
from mcap_model import as_bytes


def ply(form, n_vertices, n_faces) -> bytes:
    """The header of a file that claims this size."""
    lines = [
        "ply",
        f"format {form} 1.0",
        f"element vertex {n_vertices}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {n_faces}",
        "property list uchar int vertex_indices",
        "end_header",
        "",
    ]
    return "\n".join(lines).encode()


@kind
def mesh_file(rng, bag):
    attachment = bag.attachments[0] if bag.attachments else None
    if attachment is None:
        bag.attachments.append(Attachment(0, 0, "mesh/cloth/x.obj", "", b"v 0 0 0\n"))
        return
    info = info_of(bag)
    data = bytes(attachment.data)
    suffix, content = rng.choice(
        (
            (".obj", data[: rng.randrange(len(data))]),
            (".obj", rng.randbytes(500)),
            (".obj", b""),
            (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99\n"),
            (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -99\n"),
            (".obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            (".obj", b"v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            (".obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\n"),
            (".obj", b"mtllib /etc/passwd\n" + data),
            (".obj", data * 3),
            (".obj", b"f " + b"1 " * 100_000 + b"\n" + data),
            (".obj", b"v 0 0\nf 1 2 3\n"),
            (".ply", data),
            (".stl", data),
            (".obj", b"\xff\xfe" + data),
            (".exe", data),
            ("", data),
            (".ply", ply("binary_little_endian", 4_000_000_000, 4_000_000_000) + data),
            (".ply", ply("ascii", 3, 1) + b"0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n"),
            (".stl", bytes(80) + struct.pack("<I", 2**32 - 1) + bytes(50)),
            (".stl", bytes(80) + struct.pack("<I", 1) + bytes(50)),
            (".stl", b"solid x\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\n"),
        )
    )
    attachment.data = content
    info["parameters"]["mesh.floor.file"] = "somewhere/floor" + suffix
    attachment.name = "mesh/floor/floor" + suffix
    set_info(bag, info)


@kind
def mesh_file_name(rng, bag):
    if not bag.attachments:
        return KINDS["role_junk"](rng, bag)
    info = info_of(bag)
    name = rng.choice(
        (
            "..",
            "/",
            ".",
            "../../../tmp/x.obj",
            "/etc/passwd",
            "~nobody9/floor.obj",
            "~/floor.obj",
            "a" * 300 + ".obj",
            "floor\0.obj",
            "floor.obj/",
            "floor.obj/..",
            "\n.obj",
            "CON.obj",
            "",
            "floor",
            "\ud800.obj",
            "/dev/zero",
            "/dev/stdin",
            "%s.obj",
            "floor.OBJ",
        )
    )
    info["parameters"]["mesh.floor.file"] = name
    set_info(bag, info)
    last = name.rstrip("/").rpartition("/")[2]
    bag.attachments[0].name = rng.choice(
        (
            "mesh/floor/" + last.encode(errors="replace").decode(),
            "mesh/floor/../../../x",
            "mesh/floor/floor.obj",
            "/etc/passwd",
            "",
            "mesh/floor/" + name.encode(errors="replace").decode(),
        )
    )
    if rng.random() < 0.2:
        bag.attachments.append(dataclasses.replace(bag.attachments[0], data=b"v 0 0 0\n"))


@kind
def attachment_lies(rng, bag):
    target = Attachment(0, 0, "mesh/floor/floor.obj", "x", b"v 0 0 0\n" * 20)
    raw = bytearray(as_bytes(target))
    change = rng.randrange(4)
    if change == 0:  # claimed size
        at = 9 + 16 + 4 + len(target.name) + 4 + 1
        struct.pack_into("<Q", raw, at, rng.choice(LARGE))
    elif change == 1:  # length of the name
        struct.pack_into("<I", raw, 9 + 16, rng.choice(NUMBERS))
    elif change == 2:  # one byte other than its check sum
        raw[-20] ^= 1
    else:
        raw[9 + 20] = 0xFF  # no UTF-8
    bag.data = lambda records: [records[0], bytes(raw), *records[1:]]
