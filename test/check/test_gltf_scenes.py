# SPDX-License-Identifier: Apache-2.0
"""glTF: accessors, nodes, animations, morph targets, skins, and vertices that seams have doubled."""

import base64
import json

import numpy as np
import planted
import pytest

from hpccd_core.sequences import open_sequence

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
FACES = np.array([[0, 1, 2], [0, 2, 3]], np.uint16)
COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Document:
    """A glTF file in the making."""

    def __init__(self):
        self.binary = bytearray()
        self.json = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "nodes": [], "meshes": []}

    def view(self, data, **options):
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **options}
        )
        self.binary += data + bytes(-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values, dtype="float32", **options):
        values = np.asarray(values, dtype)
        kind = KINDS[values.size // len(values)]
        described = {"count": len(values), "type": kind, "componentType": COMPONENTS[dtype], **options}
        described.setdefault("bufferView", self.view(values.tobytes()))
        self.json["accessors"].append(described)
        return len(self.json["accessors"]) - 1

    def mesh(self, points=SQUARE, faces=FACES, targets=(), attributes=None, **options):
        attributes = {"POSITION": self.accessor(points), **(attributes or {})}
        primitive = {"attributes": attributes, "indices": self.accessor(faces.reshape(-1), "uint16"), **options}
        if targets:
            primitive["targets"] = [{"POSITION": self.accessor(target)} for target in targets]
        self.json["meshes"].append({"primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def node(self, **described):
        self.json["nodes"].append(described)
        return len(self.json["nodes"]) - 1

    def animate(self, node, path, times, values, interpolation="LINEAR"):
        animation = self.json.setdefault("animations", [{"samplers": [], "channels": []}])[0]
        sampler = {"input": self.accessor(times), "output": self.accessor(values), "interpolation": interpolation}
        animation["channels"].append({"sampler": len(animation["samplers"]), "target": {"node": node, "path": path}})
        animation["samplers"].append(sampler)

    def write(self, path):
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        path.write_bytes(planted.glb(self.json, bytes(self.binary)))
        return path


def frames(path):
    sequence = open_sequence(path)
    return sequence, [sequence.frame(k) for k in range(len(sequence))]


@pytest.fixture
def document():
    return Document()


def test_a_static_scene_is_one_frame(document, tmp_path):
    document.node(mesh=document.mesh(), name="cloth")
    sequence, (frame,) = frames(document.write(tmp_path / "a.glb"))
    assert sequence.up == "y" and frame.name == "a.glb" and [mesh.name for mesh in frame.meshes] == ["cloth"]
    assert np.array_equal(frame.vertices, SQUARE) and np.array_equal(frame.meshes[0].faces, FACES)
    assert sequence.notes == ("units: 1 unit = 1 m", "the Y axis points up; transforms of the scene are applied")


@pytest.mark.parametrize("place", ["data", "file"])
def test_buffers_of_gltf(place, document, tmp_path):
    document.node(mesh=document.mesh())
    document.write(tmp_path / "a.glb")
    if place == "data":
        uri = "data:application/octet-stream;base64," + base64.b64encode(document.binary).decode()
    else:
        (tmp_path / "a b.bin").write_bytes(document.binary)
        uri = "a%20b.bin"
    document.json["buffers"][0]["uri"] = uri
    (tmp_path / "a.gltf").write_text(json.dumps(document.json))
    _, (frame,) = frames(tmp_path / "a.gltf")
    assert np.array_equal(frame.vertices, SQUARE) and frame.meshes[0].name == "node 0"


def test_sparse_normalized_and_interleaved_accessors(document, tmp_path):
    interleaved = np.zeros((4, 5), np.float32)
    interleaved[:, :3] = SQUARE
    view = document.view(interleaved.tobytes(), byteStride=20)
    of_view = document.mesh()
    described = document.json["meshes"][of_view]["primitives"][0]["attributes"]
    described["POSITION"] = document.accessor(SQUARE, bufferView=view)
    document.node(mesh=of_view, name="interleaved")

    indices, values = document.view(np.array([1, 3], np.uint16).tobytes()), document.view(SQUARE[[1, 3]].tobytes())
    sparse = {"count": 2, "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}}
    for name in ("sparse on a view", "sparse on zeros"):
        base = SQUARE.copy()
        base[[1, 3]] = 9
        mesh = document.mesh()
        accessor = document.accessor(base, sparse=sparse)
        if name == "sparse on zeros":
            del document.json["accessors"][accessor]["bufferView"]
        document.json["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"] = accessor
        document.node(mesh=mesh, name=name)

    quantized = document.mesh()
    integers = document.accessor(np.pad(SQUARE * 127, ((0, 0), (0, 1))).astype(np.int8)[:, :3], "int8", normalized=True)
    document.json["meshes"][quantized]["primitives"][0]["attributes"]["POSITION"] = integers
    document.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    document.node(mesh=quantized, name="normalized")
    _, (frame,) = frames(document.write(tmp_path / "a.glb"))
    parts = {mesh.name: frame.vertices[4 * k : 4 * k + 4] for k, mesh in enumerate(frame.meshes)}
    assert np.array_equal(parts["interleaved"], SQUARE) and np.array_equal(parts["normalized"], SQUARE)
    assert np.array_equal(parts["sparse on a view"], SQUARE)
    assert np.array_equal(parts["sparse on zeros"], SQUARE[[0, 1, 3]])  # two are at the origin, and joined


@pytest.mark.parametrize(
    "interpolation, values, between",
    [
        ("LINEAR", [[0, 0, 0], [4, 0, 0]], 1.0),
        ("STEP", [[0, 0, 0], [4, 0, 0]], 0.0),
        # In-tangent, value, out-tangent of each key frame; at u = 1/4 of 2 s: 9/64 of 2 * 8 and 10/64 of 4.
        ("CUBICSPLINE", [[7, 7, 7], [0, 0, 0], [8, 0, 0], [0, 0, 0], [4, 0, 0], [5, 5, 5]], 16 * 9 / 64 + 4 * 10 / 64),
    ],
)
def test_interpolation(interpolation, values, between, document, tmp_path):
    node = document.node(mesh=document.mesh(), name="a")
    other = document.node(mesh=document.mesh(), name="b")
    document.animate(node, "translation", [1, 3], values, interpolation)
    document.animate(other, "translation", [1.5, 4], [[0, 0, 0], [0, 0, 1]])
    _, found = frames(document.write(tmp_path / "a.glb"))
    assert [frame.name for frame in found] == [f"a.glb @ {time} s" for time in ("1", "1.5", "3", "4")]
    assert [frame.vertices[0, 0] for frame in found] == [0, between, 4, 4]


def test_rotations_follow_the_arc(document, tmp_path):
    node = document.node(mesh=document.mesh())
    half = np.sqrt(0.5)
    document.animate(node, "rotation", [0, 2], [[0, 0, 0, 1], [0, 0, half, half]])  # by a quarter turn about z
    tick = document.node(mesh=document.mesh(), name="tick")
    document.animate(tick, "scale", [1, 2], [[1, 1, 1], [2, 3, 4]])
    _, found = frames(document.write(tmp_path / "a.glb"))
    assert np.allclose(found[1].vertices[1], [half, half, 0], rtol=0, atol=1e-7)
    assert np.allclose(found[2].vertices[1], [0, 1, 0], rtol=0, atol=1e-7)
    assert found[2].vertices[4:].tolist() == (SQUARE * [2, 3, 4]).tolist()


def test_morph_targets(document, tmp_path):
    targets = [SQUARE * 0 + [0, 0, 1], SQUARE * [[1], [0], [0], [0]] + [2, 0, 0]]
    mesh = document.mesh(targets=targets)
    document.json["meshes"][mesh]["weights"] = [0.5, 0]
    document.node(mesh=mesh, name="default")
    document.node(mesh=mesh, name="own", weights=[0, 1])
    moved = document.node(mesh=mesh, name="to be moved")
    document.animate(moved, "weights", [0, 1], [0, 0, 1, 0.5])
    _, found = frames(document.write(tmp_path / "a.glb"))
    first, last = (frame.vertices.reshape(3, 4, 3) for frame in found)
    assert np.array_equal(first[0], SQUARE + [0, 0, 0.5]) and np.array_equal(first[1], SQUARE + targets[1])
    assert np.array_equal(first[2], SQUARE) and np.array_equal(last[2], SQUARE + targets[0] + 0.5 * targets[1])


def test_a_skin(document, tmp_path):
    joints = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0]]
    weights = [[1, 0, 0, 0], [1, 0, 0, 0], [0.5, 0.5, 0, 0], [1, 0, 0, 0]]
    attributes = {"JOINTS_0": document.accessor(joints, "uint8"), "WEIGHTS_0": document.accessor(weights)}
    root = document.node(name="root", translation=[0, 0, 3])
    tip = document.node(name="tip", translation=[0, 1, 0])
    document.json["nodes"][root]["children"] = [tip]
    inverse = np.stack([np.eye(4), np.eye(4)])
    inverse[0, 2, 3], inverse[1, :3, 3] = -3, [0, -1, -3]  # the rest pose
    matrices = document.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))
    document.json["skins"] = [{"joints": [root, tip], "inverseBindMatrices": matrices}]
    # The transform of a node with a skin has no effect.
    document.node(mesh=document.mesh(attributes=attributes), skin=0, name="skin", translation=[100, 0, 0])
    document.animate(tip, "translation", [0, 1], [[0, 1, 0], [4, 1, 0]])
    _, found = frames(document.write(tmp_path / "a.glb"))
    assert np.array_equal(found[0].vertices, SQUARE)
    assert np.array_equal(found[1].vertices, SQUARE + [[0, 0, 0], [0, 0, 0], [2, 0, 0], [4, 0, 0]])


def test_vertices_doubled_by_seams_are_joined_where_they_move_together(document, tmp_path):
    points = np.concatenate([SQUARE, SQUARE[[0, 2]]])
    faces = np.array([[0, 1, 2], [4, 5, 3]], np.uint16)
    apart = np.zeros((6, 3), np.float32)
    apart[5, 2] = 1  # vertex 5 leaves vertex 2
    document.node(mesh=document.mesh(points, faces), name="joined")
    document.node(mesh=document.mesh(points, faces, targets=[apart]), name="torn")
    sequence, (frame,) = frames(document.write(tmp_path / "a.glb"))
    joined, torn = frame.meshes
    assert joined.n_vertices == 4 and joined.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert torn.n_vertices == 5 and torn.faces.tolist() == [[0, 1, 2], [0, 4, 3]]
    assert np.array_equal(frame.vertices[:4], SQUARE) and np.array_equal(frame.vertices[4:], points[[0, 1, 2, 3, 5]])
    assert sequence.notes[-1] == "3 vertices coincide with another one in all frames and are joined with it"


@pytest.mark.parametrize(
    "mode, indices, expected",
    [
        (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
        (4, [0, 1, 2, 0, 2, 3, 1], [[0, 1, 2], [0, 2, 3]]),
    ],
)
def test_lists_strips_and_fans(mode, indices, expected, document, tmp_path):
    document.node(mesh=document.mesh(faces=np.array(indices), mode=mode))
    _, (frame,) = frames(document.write(tmp_path / "a.glb"))
    assert frame.meshes[0].faces.tolist() == expected


def test_animations_of_cameras_make_no_frames(document, tmp_path):
    document.node(mesh=document.mesh())
    camera = document.node(name="camera")
    document.animate(camera, "translation", [0, 1, 2], [[0, 0, 0]] * 3)
    assert len(open_sequence(document.write(tmp_path / "a.glb"))) == 1


def test_nodes_are_placed_as_trimesh_places_them(document, tmp_path):
    trimesh = pytest.importorskip("trimesh", reason="trimesh comes with the extra check")
    rng = np.random.default_rng(11)

    def place(n):
        turn = rng.normal(size=4)
        if n % 2:
            matrix = np.eye(4)
            matrix[:3] = rng.normal(size=(3, 4))
            return {"matrix": matrix.T.reshape(-1).tolist()}
        return {"rotation": (turn / np.linalg.norm(turn)).tolist(), "translation": rng.normal(size=3).tolist(),
                "scale": rng.uniform(0.5, 2, 3).tolist()}  # fmt: skip

    for n in range(8):
        document.node(mesh=document.mesh(), name=f"n{n}", **place(n))
        if n:
            document.json["nodes"][n // 3].setdefault("children", []).append(n)
    document.json |= {"scenes": [{"nodes": [0]}], "scene": 0}
    _, (frame,) = frames(document.write(tmp_path / "a.glb"))
    scene = trimesh.load(tmp_path / "a.glb", process=False)
    for k, mesh in enumerate(frame.meshes):
        matrix, geometry = scene.graph[mesh.name]
        expected = trimesh.transform_points(scene.geometry[geometry].vertices, matrix)
        assert np.allclose(frame.vertices[4 * k : 4 * k + 4], expected, rtol=0, atol=1e-9)
