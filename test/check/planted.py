# SPDX-License-Identifier: Apache-2.0
"""A sequence of 200 frames with ten planted defects, and writers of it in the formats that hpccd check reads.

All coordinates are multiples of 1/64 below 16: float32 holds them exactly, so every format has the same frames.
"""

import dataclasses
import json
import struct

import numpy as np
from sources import ROOT

N_FRAMES = 200
NAMES = ("body", "cloth", "probe", "sheet")
STATIC = "body"


@dataclasses.dataclass(frozen=True)
class Defect:
    """frames: where surfaces intersect or touch. inside: frames in which the probe is inside the body. steps: steps,
    by the index of the frame at their start, in which surfaces touch or pass through each other."""

    name: str
    frames: tuple[int, ...]
    inside: tuple[int, ...]
    steps: tuple[int, ...]


DEFECTS = (
    Defect("the cloth passes through the body within a step, and back", (), (), (9, 10)),
    Defect("the cloth stays in the body", tuple(range(25, 35)), (), (24, 34)),
    Defect("a vertex of the cloth touches the body at a frame", (50,), (), (49, 50)),
    Defect("a vertex of the cloth goes through the body", (70,), (), (69, 70)),
    Defect("an edge of the cloth passes over an edge of the body", (90,), (), (89, 90)),
    Defect("the sheet intersects itself for a while", tuple(range(105, 113)), (), (104, 112)),
    Defect("the sheet passes through itself within a step, and back", (), (), (129, 130)),
    Defect("the probe is inside the body", (), (145, 146, 147), (144, 147)),
    Defect("the probe grazes an edge of the body in the middle of a step", (), (), (165,)),
    Defect("the probe passes through the cloth within a step", (), (), (185,)),
)


def faces():
    """(F, 3) uint32 by mesh, in the order of NAMES."""
    box = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4)]
    box += [(2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]
    meshes = {
        "body": box,
        "cloth": _grid(7, 7),
        "probe": [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)],
        "sheet": _grid(9, 2),
    }
    return {name: np.array(of_mesh, np.uint32) for name, of_mesh in meshes.items()}


def _grid(n, m):
    corners = [
        (i * m + j, i * m + j + 1, (i + 1) * m + j, (i + 1) * m + j + 1) for i in range(n - 1) for j in range(m - 1)
    ]
    return [face for a, b, c, d in corners for face in ((a, c, b), (b, c, d))]


def positions(defects=DEFECTS):
    """(200, V, 3) float64 by mesh. Only the given defects are planted; without any, the sequence is clean."""
    planted = {DEFECTS.index(defect) for defect in defects}
    frames = [_frame(k, planted) for k in range(N_FRAMES)]
    return {name: np.array([frame[name] for frame in frames]) for name in NAMES}


def _frame(k, planted):
    wave = (0, 1, 2, 1)[k % 4] / 64
    body = np.array([(x, y, z) for z in (-1, 0.5) for y in (-1, 1) for x in (-1, 1)], float)
    cloth = np.array([(-1.25 + i / 2, -1.5 + j / 2, 1.5 + wave) for i in range(7) for j in range(7)])
    strip = [(8 + min(s, 8 - s), 0.5 if s == 4 else float(s > 4)) for s in range(9)]
    sheet = np.array([(x, y, z + wave) for x, z in strip for y in (0, 1)], float)
    probe = np.array([(0, 0, -4)]) + _PROBE
    if 0 in planted and k == 10:
        cloth[:, 2] = -2.5
    if 1 in planted and 25 <= k < 35:
        cloth[:, 2] = wave
    if 2 in planted and k == 50:
        cloth[_AT_TOP, 2] = 0.5
    if 3 in planted and k == 70:
        cloth[_AT_TOP, 2] = 0.25
    if 4 in planted and k == 90:
        cloth[_BESIDE, 2] = -1
    if 5 in planted and 105 <= k < 113:
        sheet[-2:, 2] = -1
    if 6 in planted and k == 130:
        sheet[8:10, 2] = -0.5
        sheet[10:, 2] = -1
    if 7 in planted and 145 <= k < 148:
        probe = np.array([(0, 0, 0)]) + _PROBE
    if 8 in planted and k in (165, 166):
        probe = np.array([(1.5, 0, -0.5) if k == 165 else (0.5, 0, -1.5)]) + _PROBE
    if 9 in planted and 183 <= k < 188:
        way = [(6, 0, -4), (6, 0, 4), (0.375, 0.125, 3), (0.375, 0.125, 1), (6, 0, 1)]
        probe = np.array([way[k - 183]]) + _PROBE
    return {"body": body, "cloth": cloth, "probe": probe, "sheet": sheet}


# A vertex of the cloth above the inside of a face of the body, and one beside the body.
_AT_TOP, _BESIDE = 3 * 7 + 4, 5 * 7 + 3
# The first vertex is the one that grazes an edge of the body, which is above and to the left of it.
_PROBE = np.array([(0, 0, 0), (0.25, 0.125, 0), (0.25, -0.125, 0), (0.125, 0, -0.25)])


def write_obj(folder, shape):
    """A folder; the body is one file, which is static."""
    for name, of_mesh in shape.items():
        for k, vertices in enumerate(of_mesh[: 1 if name == STATIC else None]):
            lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
            lines += [f"f {a} {b} {c}" for a, b, c in (faces()[name] + 1).tolist()]
            file = folder / (f"{name}.obj" if name == STATIC else f"{name}_{k:04}.obj")
            file.write_text("\n".join(lines) + "\n")
    return [folder], {}


def write_npz(folder, shape):
    arrays = {f"{name}_vertices": of_mesh.astype(np.float32) for name, of_mesh in shape.items()}
    arrays |= {f"{name}_faces": of_mesh for name, of_mesh in faces().items()}
    np.savez_compressed(folder / "planted.npz", **arrays)
    return [folder / "planted.npz"], {}


def write_vtk(folder, shape):
    """A folder of binary POLYDATA, all meshes in frames of their own."""
    for name, of_mesh in shape.items():
        cells = np.insert(faces()[name].astype(">i4"), 0, 3, axis=1)
        for k, vertices in enumerate(of_mesh):
            head = f"# vtk DataFile Version 3.0\nplanted\nBINARY\nDATASET POLYDATA\nPOINTS {len(vertices)} float\n"
            middle = f"\nPOLYGONS {len(cells)} {cells.size}\n"
            data = head.encode() + vertices.astype(">f4").tobytes() + middle.encode() + cells.tobytes() + b"\n"
            (folder / f"{name}_{k:04}.vtk").write_bytes(data)
    return [folder], {}


def write_usd(folder, shape):
    from pxr import Usd, UsdGeom, Vt

    stage = Usd.Stage.CreateNew(str(folder / "planted.usdc"))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, "Z")
    for name, of_mesh in shape.items():
        mesh = UsdGeom.Mesh.Define(stage, f"/planted/{name}")
        mesh.GetFaceVertexCountsAttr().Set([3] * len(faces()[name]))
        mesh.GetFaceVertexIndicesAttr().Set(faces()[name].reshape(-1).tolist())
        mesh.GetSubdivisionSchemeAttr().Set("none")
        for k, vertices in enumerate(of_mesh):
            points = Vt.Vec3fArray.FromNumpy(vertices.astype(np.float32))
            mesh.GetPointsAttr().Set(points, *([] if name == STATIC else [float(k)]))
            if name == STATIC:
                break
    stage.Save()
    return [folder / "planted.usdc"], {}


def write_glb(folder, shape):
    """Each frame is a morph target of each mesh."""
    document, binary = gltf_of(shape)
    (folder / "planted.glb").write_bytes(glb(document, binary))
    return [folder / "planted.glb"], {}


def gltf_of(shape, morph=True):
    """(document, bytes of its buffer)."""
    binary, views, accessors = bytearray(), [], []

    def accessor(values, component, kind):
        data = np.ascontiguousarray(values).tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        binary.extend(data + bytes(-len(data) % 4))
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": len(values), "type": kind})
        return len(accessors) - 1

    n = len(next(iter(shape.values())))
    nodes, meshes, channels = [], [], []
    if morph:
        times = accessor(np.arange(n, dtype=np.float32) / 25, 5126, "SCALAR")
        weights = accessor(np.eye(n, dtype=np.float32).reshape(-1), 5126, "SCALAR")
    for node, (name, of_mesh) in enumerate(shape.items()):
        primitive = {
            "attributes": {"POSITION": accessor(of_mesh[0].astype(np.float32), 5126, "VEC3")},
            "indices": accessor(faces()[name].astype(np.uint16).reshape(-1), 5123, "SCALAR"),
        }
        if morph and name != STATIC:
            deltas = (of_mesh - of_mesh[0]).astype(np.float32)
            primitive["targets"] = [{"POSITION": accessor(delta, 5126, "VEC3")} for delta in deltas]
            channels.append({"sampler": 0, "target": {"node": node, "path": "weights"}})
        nodes.append({"name": name, "mesh": node})
        meshes.append({"primitives": [primitive]})
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    if morph:
        document["animations"] = [{"samplers": [{"input": times, "output": weights}], "channels": channels}]
    return document, bytes(binary)


def glb(document, binary):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def write_pc2(folder, shape):
    """All meshes as one, with an OBJ file for the faces; they are components of it."""
    whole = np.concatenate([shape[name] for name in NAMES], axis=1).astype("<f4")
    head = struct.pack("<12siiffi", b"POINTCACHE2\0", 1, whole.shape[1], 0.0, 1.0, len(whole))
    (folder / "planted.pc2").write_bytes(head + whole.tobytes())
    write_faces(folder / "planted.obj", whole[0])
    return [folder / "planted.pc2"], {"faces": folder / "planted.obj", "split": True}


def write_mdd(folder, shape):
    whole = np.concatenate([shape[name] for name in NAMES], axis=1).astype(">f4")
    head = struct.pack(">ii", len(whole), whole.shape[1]) + np.arange(len(whole)).astype(">f4").tobytes()
    (folder / "planted.mdd").write_bytes(head + whole.tobytes())
    write_faces(folder / "planted.obj", whole[0])
    return [folder / "planted.mdd"], {"faces": folder / "planted.obj", "split": True}


def write_faces(path, vertices):
    lines, before = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()], 1
    for name, of_mesh in faces().items():
        lines += [f"f {a} {b} {c}" for a, b, c in (of_mesh.astype(int) + before).tolist()]
        before += {"body": 8, "cloth": 49, "probe": 4, "sheet": 18}[name]
    path.write_text("\n".join(lines) + "\n")


_DEFINITIONS = """
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


def write_mcap(folder, shape):
    """As a recording; the body has one message, and is static."""
    write_recording(folder / "planted.mcap", shape)
    return [folder / "planted.mcap"], {}


def write_recording(path, shape, frame_ids=("world",), steps=None, version=0, edges=(), backwards=False, second=None):
    """second: (frame, mesh): from then on, the mesh has only its first face."""
    from mcap_ros2.writer import Writer

    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=50_000)
        topology, vertices = (
            writer.register_msgdef(f"hpccd/msg/{kind}", (ROOT / f"msg/{kind}.msg").read_text() + _DEFINITIONS)
            for kind in ("MeshTopology", "MeshVertices")
        )
        for n, (name, of_mesh) in enumerate(shape.items()):
            message = {"version": version, "n_vertices": of_mesh.shape[1]}
            message |= {"faces": faces()[name].reshape(-1).tolist(), "edges": list(edges)}
            writer.write_message(f"/meshes/{name}/topology", topology, _stamped(0, "", message), n, n)
        n_frames = len(next(iter(shape.values()), ()))
        for k in range(n_frames):
            at = n_frames - k if backwards else k
            for n, (name, of_mesh) in enumerate(shape.items()):
                if name == STATIC and k:
                    continue
                if second == (k, name):
                    message = {"version": 1, "n_vertices": of_mesh.shape[1], "faces": faces()[name][0].tolist()}
                    message = _stamped(at, "", message | {"edges": []})
                    writer.write_message(f"/meshes/{name}/topology", topology, message, 1000 * k + n, 0)
                of_version = int(second is not None and second[1] == name and second[0] <= k)
                message = {"topology_version": of_version, "step": k if steps is None else steps[k]}
                message |= {"vertices_f32": of_mesh[k].reshape(-1).tolist(), "vertices_f64": []}
                message = _stamped(at, frame_ids[n % len(frame_ids)], message)
                writer.write_message(f"/meshes/{name}/vertices", vertices, message, 1000 * k + n + 10, 0)
        writer.finish()


def _stamped(k, frame_id, message):
    return {"header": {"stamp": {"sec": k // 25, "nanosec": k % 25 * 40_000_000}, "frame_id": frame_id}, **message}


WRITERS = {
    "obj": write_obj,
    "npz": write_npz,
    "vtk": write_vtk,
    "usd": write_usd,
    "glb": write_glb,
    "mcap": write_mcap,
    "pc2": write_pc2,
    "mdd": write_mdd,
}
PACKAGES = {"usd": "pxr", "mcap": "mcap_ros2"}
