# SPDX-License-Identifier: Apache-2.0
"""Each mistake gets an error that names the argument and says what to do; the detector goes on afterwards."""

import importlib
import sys
from collections import UserList, deque

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core import arguments
from hpccd_core.parts import contacts_of_step

FACES = np.array([[0, 1, 2], [1, 3, 2]], np.uint32)
VERTICES = np.random.default_rng(0).normal(size=(4, 3))


@pytest.fixture
def scene():
    scene = hc.Scene()
    scene.add_mesh("cloth", FACES)
    return scene


@pytest.fixture
def detector(scene):
    return hc.Detector(scene)


def changed(vertices, row, column, value):
    vertices = vertices.copy()
    vertices[row, column] = value
    return vertices


@pytest.mark.parametrize(
    ("faces", "error", "text"),
    [
        ([[0.0, 1.0, 2.0]], TypeError, r"faces.*integers.*float64.*astype"),
        ([["a", "b", "c"]], TypeError, r"faces.*integers"),
        ([[True, False, True]], TypeError, r"faces.*integers.*bool"),
        ([0, 1, 2], ValueError, r"faces.*\(F, 3\).*\(3,\)"),
        ([[0, 1]], ValueError, r"faces.*\(F, 3\).*\(1, 2\)"),
        ([[[0, 1, 2]]], ValueError, r"faces.*\(F, 3\).*\(1, 1, 3\)"),
        ([[0, 1, 2], [0, -1, 2]], ValueError, r"faces\[1, 1\] is -1"),
        ([[0, 1, 2**32 - 1]], ValueError, r"faces\[0, 2\] is 4294967295"),
        ([[0, 1, 2**40]], ValueError, r"faces\[0, 2\] is 1099511627776"),
        ([[0, 1, 2j]], TypeError, r"faces.*integers.*complex128; give indices"),
        (b"abc", TypeError, r"faces.*integers.*indices"),
    ],
)
def test_faces(faces, error, text):
    with pytest.raises(error, match=text):
        hc.Scene().add_mesh("cloth", np.array(faces))


@pytest.mark.parametrize(
    ("index", "text"),
    [(2**63, "is 9223372036854775808"), (2**70, "is 1e21"), pytest.param(10**5000, "is 1e5000", id="huge")],
)
def test_faces_beyond_what_numpy_holds(index, text):
    for row in ([0, 1, index], [0, -1, -index]):
        with pytest.raises(ValueError, match=r"faces\[0, [12]\] is") as raised:
            hc.Scene().add_mesh("cloth", [row])
    with pytest.raises(ValueError, match=f"faces\\[0, 2\\] {text}, which is beyond"):
        hc.Scene().add_mesh("cloth", [[0, 1, index]])
    assert len(str(raised.value)) < 200


def test_ragged_faces():
    with pytest.raises((TypeError, ValueError), match="faces"):
        hc.Scene().add_mesh("cloth", [[0, 1, 2], [0, 1]])


def test_face_index_beyond_n_vertices():
    with pytest.raises(ValueError, match=r"faces\[1, 1\] is 3.*'cloth' has 3 vertices"):
        hc.Scene().add_mesh("cloth", FACES, n_vertices=3)


@pytest.mark.parametrize(
    ("n_vertices", "error"),
    [
        (-1, ValueError),
        (2**32, ValueError),
        pytest.param(10**5000, ValueError, id="huge"),
        (4.0, TypeError),
        ("4", TypeError),
        (True, TypeError),
    ],
)
def test_n_vertices(n_vertices, error):
    with pytest.raises(error, match="n_vertices"):
        hc.Scene().add_mesh("cloth", FACES, n_vertices=n_vertices)


def test_more_vertices_than_indices_can_name():
    scene = hc.Scene()
    scene.add_mesh("first", np.empty((0, 3), int), n_vertices=2**32 - 2)
    with pytest.raises(ValueError, match="n_vertices"):
        scene.add_mesh("second", np.empty((0, 3), int), n_vertices=2)


@pytest.mark.parametrize(
    ("name", "error"), [("", ValueError), (3, TypeError), (None, TypeError), (b"a", TypeError), ("\ud800", ValueError)]
)
def test_mesh_name(name, error):
    with pytest.raises(error, match="name"):
        hc.Scene().add_mesh(name, FACES)


@pytest.mark.parametrize("option", ["self_collision", "static"])
@pytest.mark.parametrize("value", ["no", "", None, 2, 0.0, np.array([True, False]), np.ma.masked])
def test_flags_of_a_mesh(option, value):
    with pytest.raises(TypeError, match=f"{option}: expected True or False, got"):
        hc.Scene().add_mesh("cloth", FACES, **{option: value})
    for good in (np.bool_(True), 0):
        hc.Scene().add_mesh("cloth", FACES, **{option: good})


def test_mesh_name_twice(scene):
    with pytest.raises(ValueError, match="name.*'cloth'.*another"):
        scene.add_mesh("cloth", FACES)


def test_a_rejected_mesh_leaves_the_scene_as_it_was(scene):
    with pytest.raises(ValueError):
        scene.add_mesh("ball", [[0, 1, 9]], n_vertices=3)
    assert scene.mesh_names == ["cloth"] and scene.n_vertices == 4 and scene.n_faces == 2
    scene.add_mesh("ball", [[0, 1, 2]])
    assert scene.vertex_offset("ball") == 4


@pytest.mark.parametrize(
    ("pair", "error", "text"),
    [
        (("cloth", "floor"), ValueError, r"mesh_b.*'floor'.*cloth"),
        (("floor", "cloth"), ValueError, r"mesh_a.*'floor'.*cloth"),
        ((0, 1), ValueError, r"mesh_b.*\[0, 0\].*1"),
        ((-1, 0), ValueError, r"mesh_a"),
        ((0, 0.0), TypeError, r"mesh_b"),
        ((None, 0), TypeError, r"mesh_a"),
    ],
)
def test_pairs_of_meshes(scene, pair, error, text):
    with pytest.raises(error, match=text):
        scene.ignore_pair(*pair)
    with pytest.raises(error, match=text):
        scene.set_accuracy(*pair, "exact")


def test_pairs_in_an_empty_scene():
    with pytest.raises(ValueError, match="add_mesh"):
        hc.Scene().ignore_pair(0, 0)


def test_accuracy_of_a_pair(scene):
    with pytest.raises(ValueError, match="accuracy.*'precise'.*exact"):
        scene.set_accuracy("cloth", "cloth", "precise")


def test_offset_of_an_unknown_mesh(scene):
    for offset in (scene.vertex_offset, scene.face_offset):
        with pytest.raises(ValueError, match="'floor'.*cloth"):
            offset("floor")


@pytest.mark.parametrize(
    ("option", "value", "error"),
    [
        ("accuracy", "precise", ValueError),
        ("accuracy", None, TypeError),
        ("backend", "cuda", ValueError),
        ("backend", 0, TypeError),
        ("hybrid_segments", 0, ValueError),
        ("hybrid_segment_pairs", 2.5, TypeError),
        ("hybrid_segment_pairs", 1 << 21, ValueError),
        ("gpus", -1, ValueError),
        ("gpus", 1000, ValueError),
        ("report", "last", ValueError),
        ("report", True, TypeError),
        ("simd", "sse2", ValueError),
        ("threads", -1, ValueError),
        ("threads", 10**9, ValueError),
        pytest.param("threads", 10**5000, ValueError, id="threads-huge"),
        ("threads", 2.0, TypeError),
        ("threads", "all", TypeError),
        ("outputs", ("colours",), ValueError),
        ("outputs", (1,), TypeError),
        ("outputs", 1, TypeError),
        ("restructure", "no", TypeError),
        pytest.param("minimum_separation", 10**400, ValueError, id="minimum_separation-huge"),
        pytest.param("minimum_separation", -(10**5000), ValueError, id="minimum_separation-negative"),
        ("minimum_separation", "1", TypeError),
        ("minimum_separation", 1j, TypeError),
    ],
)
def test_options_of_a_detector(scene, option, value, error):
    with pytest.raises(error, match=f"^{option}: ") as raised:
        hc.Detector(scene, **{option: value})
    assert len(str(raised.value)) < 200


def test_choices_are_listed(scene):
    with pytest.raises(ValueError, match="fast, balanced, conservative, exact"):
        hc.Detector(scene, accuracy="precise")


def test_unusable_backend_is_rejected(scene):
    unusable = {"hybrid", "gpu"} - set(hc.backends())
    if not unusable:
        pytest.skip("every backend can be used here")
    for backend in unusable:
        with pytest.raises(ValueError, match=f"backend.*'{backend}'.*cpu"):
            hc.Detector(scene, backend=backend)


@pytest.mark.parametrize("not_a_scene", [None, "cloth", FACES])
def test_scene_of_a_detector(not_a_scene):
    with pytest.raises(TypeError, match="scene.*Scene"):
        hc.Detector(not_a_scene)


@pytest.mark.parametrize("argument", [0, 1])
@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        (VERTICES[:3], ValueError, r"\(4, 3\).*\(3, 3\)"),
        (np.concatenate([VERTICES, VERTICES]), ValueError, r"\(4, 3\).*\(8, 3\)"),
        (VERTICES.ravel(), ValueError, r"\(4, 3\).*\(12,\)"),
        (VERTICES.T, ValueError, r"\(4, 3\).*\(3, 4\)"),
        (VERTICES[None], ValueError, r"\(4, 3\).*\(1, 4, 3\)"),
        (VERTICES.astype(int), TypeError, r"float32 or float64.*int64.*astype"),
        (VERTICES.astype(np.float16), TypeError, r"float32 or float64.*float16"),
        (VERTICES.astype(complex), TypeError, r"float32 or float64.*complex128; coordinates are real"),
        (VERTICES.astype(object), TypeError, r"float32 or float64.*object; give an array of numbers"),
        (VERTICES.astype("S20"), TypeError, r"float32 or float64.*S20; give an array of numbers"),
        (VERTICES > 0, TypeError, r"float32 or float64.*bool; give an array of numbers"),
        (b"1234", TypeError, r"float32 or float64.*bytes; give an array of numbers"),
        ([[10**400, 0.5, 0]] * 4, (TypeError, ValueError), r"number"),
        (np.ma.masked_array(VERTICES, mask=VERTICES > 1), TypeError, r"masked.*filled"),
        ([np.ma.masked_array(row, mask=row > 0) for row in VERTICES], TypeError, r"masked.*filled"),
        (None, TypeError, r"float32 or float64"),
        (changed(VERTICES, 2, 1, np.nan), ValueError, r"\[2, 1\] is NaN"),
        (changed(VERTICES, 3, 0, np.inf), ValueError, r"\[3, 0\] is infinite"),
        (changed(VERTICES, 0, 2, -np.inf), ValueError, r"\[0, 2\] is infinite"),
        (changed(VERTICES.astype(np.float32), 1, 2, np.nan), ValueError, r"\[1, 2\] is NaN"),
        (changed(VERTICES, 1, 1, 1e200), ValueError, r"\[1, 1\] is 1e\+200,.*scale"),
    ],
)
def test_vertices(detector, argument, bad, error, text):
    arguments = [VERTICES, VERTICES + 1]
    if isinstance(bad, np.ndarray) and bad.dtype == np.float32:
        arguments = [a.astype(np.float32) for a in arguments]
    good = detector.detect(*arguments)
    arguments[argument] = bad
    with pytest.raises(error, match=f"vertices_t{argument}.*{text}"):
        detector.detect(*arguments)
    arguments[argument] = [VERTICES, VERTICES + 1][argument].astype(arguments[1 - argument].dtype)
    assert detector.detect(*arguments).hash == good.hash, "goes on as before"


@pytest.mark.parametrize("query", ["proximity", "intersections", "distances"])
def test_queries_of_one_time_take_larger_coordinates(detector, query):
    def ask(vertices):
        return getattr(detector, query)(vertices, *((1.0,) if query == "proximity" else ()))

    ask(changed(VERTICES, 1, 1, 1e300))
    with pytest.raises(ValueError, match=r"^vertices\[1, 1\] is 1.1e\+300, beyond 1e\+300.*scale"):
        ask(changed(VERTICES, 1, 1, 1.1e300))


BAD_STEPS = [
    (VERTICES[:3], ValueError, r"vertices: .*\(4, 3\).*\(3, 3\)"),
    (VERTICES.astype(int), TypeError, r"vertices: .*float32 or float64"),
    (changed(VERTICES, 2, 1, np.nan), ValueError, r"vertices\[2, 1\] is nan"),
    (changed(VERTICES, 2, 1, np.inf), ValueError, r"vertices\[2, 1\] is inf"),
    (changed(VERTICES, 2, 1, 1e200), ValueError, r"vertices\[2, 1\] is 1e\+200.*scale"),
    (changed(VERTICES.astype(np.float32), 2, 1, np.nan), ValueError, r"vertices\[2, 1\] is nan"),
    (changed(VERTICES.astype(np.float32), 2, 1, -np.inf), ValueError, r"vertices\[2, 1\] is -?inf"),
]


@pytest.mark.parametrize(("bad", "error", "text"), BAD_STEPS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.filterwarnings("error")
def test_a_rejected_step_does_not_count(detector, bad, error, text, dtype):
    start, moved = VERTICES.astype(dtype), VERTICES[::-1].astype(dtype)
    with pytest.raises(error, match=f"(?i)^{text}"):
        detector.step(bad)
    assert len(detector.step(start)) == 0
    with pytest.raises(error, match=f"(?i)^{text}"):
        detector.step(bad)
    assert detector.step(moved).hash == detector.detect(start, moved).hash


def test_a_step_of_a_static_mesh():
    scene = hc.Scene()
    scene.add_mesh("floor", FACES, static=True)
    detector = hc.Detector(scene)
    detector.step(VERTICES)
    with pytest.raises(ValueError, match=r"^vertices\[1\]: moves.*'floor'"):
        detector.step(changed(VERTICES, 1, 0, 9.0))
    detector.step(VERTICES)


@pytest.mark.parametrize("test", [hc.test_vertex_face, hc.test_edge_edge])
@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        (np.zeros((8, 3)), ValueError, r"queries.*\(Q, 8, 3\).*\(8, 3\)"),
        (np.zeros((1, 4, 6)), ValueError, r"queries.*\(Q, 8, 3\).*\(1, 4, 6\)"),
        (np.zeros((1, 8, 3), int), TypeError, r"queries.*float32 or float64.*int64"),
        (np.zeros((1, 8, 3), complex), TypeError, r"queries.*float32 or float64.*complex128; coordinates are real"),
        (np.ma.masked_equal(np.zeros((1, 8, 3)), 0), TypeError, r"queries.*masked"),
        (np.full((2, 8, 3), np.nan), ValueError, r"queries\[0, 0, 0\] is NaN.*finite"),
        (np.full((2, 8, 3), np.inf), ValueError, r"queries\[0, 0, 0\] is infinite.*finite"),
        (np.full((2, 8, 3), 1e300), ValueError, r"queries\[0, 0, 0\].*scale"),
    ],
)
def test_queries(test, bad, error, text):
    with pytest.raises(error, match=text):
        test(bad)


class _OnDevice:
    def __init__(self, interface):
        self.__cuda_array_interface__ = interface


GOOD_INTERFACE = {"shape": (4, 3), "typestr": "<f8", "data": (4096, False), "version": 3}


@pytest.mark.parametrize(
    ("interface", "error", "text"),
    [
        (3, TypeError, "__cuda_array_interface__.*protocol"),
        ({"shape": (4, 3)}, TypeError, "__cuda_array_interface__.*protocol.*typestr"),
        (GOOD_INTERFACE | {"data": None}, TypeError, "__cuda_array_interface__.*protocol"),
        (GOOD_INTERFACE | {"strides": 24}, TypeError, "__cuda_array_interface__.*protocol"),
        (GOOD_INTERFACE | {"strides": (8,)}, TypeError, r"protocol.*strides \(8,\)"),
        (GOOD_INTERFACE | {"data": ("4096", False)}, TypeError, "protocol.*str"),
        (GOOD_INTERFACE | {"data": (-8, False)}, TypeError, "protocol.*address -8"),
        (GOOD_INTERFACE | {"data": (1 << 70, False)}, TypeError, "protocol.*address"),
        (GOOD_INTERFACE | {"data": (4100, False)}, ValueError, "address must be a multiple of 8 bytes.*copy"),
        (GOOD_INTERFACE | {"data": (0, False)}, ValueError, "null"),
        (GOOD_INTERFACE | {"mask": object()}, TypeError, "mask"),
        (GOOD_INTERFACE | {"shape": (3, 4)}, ValueError, r"\(4, 3\).*\(3, 4\)"),
        (GOOD_INTERFACE | {"typestr": "<i4"}, TypeError, "float32 or float64"),
        (GOOD_INTERFACE, ValueError, "is in a GPU's memory.*copy it to the host"),
    ],
)
def test_device_arrays(scene, interface, error, text):
    detector = hc.Detector(scene, backend="cpu")
    with pytest.raises(error, match=f"^vertices: .*{text}"):
        detector.step(_OnDevice(interface))
    with pytest.raises(error, match=f"^vertices_t0(, vertices_t1)?: .*{text}"):
        detector.detect(_OnDevice(interface), _OnDevice(GOOD_INTERFACE))
    assert len(detector.step(VERTICES)) == 0


@pytest.mark.parametrize(
    "bad", [np.ma.masked_array(FACES, mask=FACES == 2), [np.ma.masked_array([0, 1, 2], [0, 0, 1])]]
)
def test_masked_faces(bad):
    with pytest.raises(TypeError, match="^faces: .*masked"):
        hc.Scene().add_mesh("cloth", bad)


def test_a_mask_over_nothing_is_no_mistake(detector):
    unmasked = np.ma.masked_array(VERTICES, mask=np.zeros(VERTICES.shape))
    assert detector.detect(unmasked, VERTICES).hash == detector.detect(VERTICES, VERTICES).hash
    hc.Scene().add_mesh("cloth", np.ma.masked_array(FACES))


@pytest.mark.parametrize("test", [hc.test_vertex_face, hc.test_edge_edge])
def test_options_of_queries(test):
    with pytest.raises(ValueError, match="accuracy.*'precise'.*exact"):
        test(np.zeros((1, 8, 3)), accuracy="precise")
    with pytest.raises(ValueError, match="simd.*'sse2'.*scalar"):
        test(np.zeros((1, 8, 3)), simd="sse2")


def test_errors_have_one_kind_to_catch(detector):
    with pytest.raises(hc.InvalidArgument):
        detector.detect(changed(VERTICES, 0, 0, np.nan), VERTICES)
    assert issubclass(hc.InvalidArgument, ValueError)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_static_mesh_that_moves(dtype):
    scene = hc.Scene()
    scene.add_mesh("cloth", [[0, 1, 2]])
    scene.add_mesh("floor", [[0, 1, 2]], static=True)
    detector = hc.Detector(scene)
    start = np.zeros((6, 3), dtype)
    end = start.copy()
    end[1] = 1
    detector.detect(start, end)  # the cloth may move
    end[4, 2] = 1
    with pytest.raises(ValueError, match=r"vertices_t1\[4\].*'floor'.*static"):
        detector.detect(start, end)


class GradientOnHost:
    """As a PyTorch tensor that requires a gradient, in the host's memory."""

    def __array__(self, *args, **kwargs):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")


class GradientOnDevice:
    """The same in a GPU's."""

    @property
    def __cuda_array_interface__(self):
        raise RuntimeError("Can't get __cuda_array_interface__ on Variable that requires grad. Use detach().")

    def __dlpack_device__(self):
        return (2, 0)

    def __dlpack__(self, **options):
        raise BufferError("Can't export tensors that require gradient, use tensor.detach()")


class WithoutMemory:
    """As a PyTorch tensor of device "meta"."""

    def __dlpack_device__(self):
        raise ValueError("Unknown device type meta for Dlpack")

    def __array__(self, *args, **kwargs):
        raise TypeError("can't convert meta device type tensor to numpy")


@pytest.mark.parametrize("bad", [GradientOnHost(), GradientOnDevice(), WithoutMemory(), np.ndarray])
def test_objects_that_do_not_turn_into_arrays(detector, bad):
    with pytest.raises(TypeError, match="^vertices_t0"):
        detector.detect(bad, bad)
    with pytest.raises(TypeError, match="^vertices: "):
        detector.step(bad)
    detector.step(VERTICES)
    with pytest.raises(TypeError, match="^vertices: "):
        detector.step(bad)
    assert detector.step(VERTICES).hash == detector.detect(VERTICES, VERTICES).hash


@pytest.mark.parametrize("bad", [GradientOnHost(), WithoutMemory()])
def test_faces_and_queries_that_do_not_turn_into_arrays(bad):
    with pytest.raises(TypeError, match="^faces: GradientOnHost|^faces: WithoutMemory"):
        hc.Scene().add_mesh("mesh", bad)
    with pytest.raises(TypeError, match="^queries: "):
        hc.test_vertex_face(bad)


LONG = np.longdouble("0.1")  # of more bits than float64 has, but where it is float64
BEYOND_53_BITS = [2**60 - 1, np.int64(2**53 + 1), np.uint64(2**64 - 1), -(2**60) + 1]


def lengths_asked(scene, detector):
    """Whatever takes a length, and the name that its error must begin with."""
    return {
        "minimum_separation": lambda d: hc.Detector(scene, minimum_separation=d),
        "distance": lambda d: detector.proximity(VERTICES, d),
        "separation": lambda d: detector.set_separation("cloth", "cloth", d),
        "separation:": lambda d: scene.set_separation("cloth", "cloth", d),
        "minimum_separation:": lambda d: hc.test_vertex_face(np.zeros((1, 8, 3)), minimum_separation=d),
        "of_pairs": lambda d: detector.set_separations([[d]]),
        "of_pairs[0, 0]": lambda d: detector.set_separations(np.array([[d]])),
    }


def test_lengths_that_float64_cannot_hold(scene, detector):
    for name, ask in lengths_asked(scene, detector).items():
        for bad in BEYOND_53_BITS[:3] + ([LONG] if float(LONG) != LONG else []):
            with pytest.raises(ValueError, match="float64 cannot hold .* exactly; round it first") as raised:
                ask(bad)
            assert str(raised.value).startswith(name.rstrip(":"))
        for bad in (0.5j, "0.5", None, b"1", np.array([0.5]), np.ma.masked, [0.5], True, np.complex128(1)):
            if not name.startswith("of_pairs"):
                with pytest.raises(TypeError, match=f"^{name.rstrip(':')}: expected a number"):
                    ask(bad)
        for good in (0.5, 1, 2**60, 2**200, np.float32(0.1), np.float16(0.1), np.int64(2**62), np.longdouble(0.5)):
            if type(good) is not int or good < 2**63 or not name.startswith("of_pairs"):  # numpy has none beyond
                ask(good)


class Unwilling:
    def __array__(self, *args, **kwargs):
        raise RuntimeError("no")


@pytest.mark.parametrize(
    ("bad", "error", "text"),
    [
        (np.ma.masked_array([[1.0]], [[True]]), TypeError, "masked"),
        ([np.ma.masked_array([1.0], [True])], TypeError, "masked"),
        ([[np.ma.masked]], TypeError, "masked"),
        (Unwilling(), TypeError, "Unwilling cannot be converted to an array"),
        ([[1j]], TypeError, "numbers, got dtype complex128"),
        ([["1"]], TypeError, "numbers, got dtype <U1"),
        ([[None]], TypeError, "numbers, got dtype object"),
        ([[True]], TypeError, "numbers, got dtype bool"),
        ([[10**30]], TypeError, "numbers, got dtype object"),
        ([[1.0], [1.0, 2.0]], ValueError, "same length"),
    ],
)
def test_tables_that_hold_no_lengths(detector, bad, error, text):
    with pytest.raises(error, match=f"^of_pairs: .*{text}"):
        detector.set_separations(bad)


@pytest.mark.parametrize("integer", BEYOND_53_BITS)
def test_integers_among_floats_are_not_rounded(detector, integer):
    """numpy makes floats of them all."""
    rows = VERTICES.tolist()
    rows[2][1] = integer
    with pytest.raises(ValueError, match=r"^vertices_t1: float64 cannot hold -?\d+ exactly"):
        detector.detect(VERTICES, rows)
    with pytest.raises(ValueError, match=r"^vertices: float64 cannot hold"):
        detector.step(tuple(map(tuple, rows)))
    with pytest.raises(ValueError, match=r"^queries: float64 cannot hold"):
        hc.test_edge_edge([[*rows, *rows]])
    rows[2][1] = 2**60
    detector.detect(VERTICES, rows)
    with pytest.raises(TypeError, match="^vertices: .*masked"):
        detector.step([[np.ma.masked, 1.0, 2.0]] * 4)


def test_joints_take_what_float64_holds():
    from hpccd_core.joint_chains import JointBounds, JointChain, JointKind, placed

    joint = np.array([[0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0]], float)
    turn, shift = np.array([0, 0, 0, 1.0]), np.zeros(3)
    chain = JointChain([JointKind.sliding], [-1], joint)
    bounds = JointBounds(chain, np.zeros(1), np.ones(1), turn, shift)
    poses = chain.poses([1], turn.tolist(), shift.astype(np.float32))
    for name, ask in {
        "numbers": lambda x: JointChain([JointKind.sliding], [-1], np.full((1, 11), x)),
        "values": lambda x: chain.poses(np.array([x]), turn, shift),
        "shift": lambda x: chain.poses(np.zeros(1), turn, np.array([x, x, x])),
        "start": lambda x: JointBounds(chain, np.array([x]), np.ones(1), turn, shift),
        "end": lambda x: JointBounds(chain, np.ones(1), np.array([x]), turn, shift),
        "centre": lambda x: bounds.of_link(0, 1.0, 1.0, np.array([x, x, x])),
        "radius": lambda x: bounds.of_link(0, x, 1.0, shift),
        "girth": lambda x: bounds.of_link(0, 1.0, x, shift),
        "vertices": lambda x: placed(poses, [(0, 1)], np.array([[x, x, x]])),
    }.items():
        for bad in (1j, None, 2**60 - 1, *([LONG] if float(LONG) != LONG else [])):
            with pytest.raises((TypeError, ValueError), match=f"^{name}[:\\[]"):
                ask(bad)
    masked = np.ma.masked_array([1.0], [True])
    with pytest.raises(TypeError, match="^values: .*masked"):
        chain.poses(masked, turn, shift)


def nested(depth):
    rows = []
    for _ in range(depth):
        rows = [rows]
    return rows


def lists_that_hold_themselves():
    one, two = [], []
    one.append(one)
    two.extend([two, two])
    return one, two


@pytest.mark.parametrize("bad", [nested(2000), *lists_that_hold_themselves()], ids=["deep", "itself", "twice"])
def test_lists_without_an_end(scene, detector, bad):
    for ask in (
        lambda: detector.detect(bad, bad),
        lambda: detector.set_separations(bad),
        lambda: scene.add_mesh("x", bad),
        lambda: hc.test_edge_edge(bad),
    ):
        with pytest.raises(ValueError, match="lists are nested more than 7 deep; give an array"):
            ask()


@pytest.mark.parametrize("scale", [1.0, 2.0**60])
def test_the_numbers_of_a_list_are_not_visited_one_by_one(scale):
    rows = (np.random.default_rng(0).normal(size=(1000, 3)) * scale).tolist()
    calls = []
    sys.setprofile(lambda frame, event, of: calls.append(event))
    try:
        arguments.reals("rows", rows)
    finally:
        sys.setprofile(None)
    assert len(calls) < 300


@pytest.mark.parametrize(
    "row",
    [
        [np.array(2**60 - 1), 0.5, 0.0],
        UserList([2**60 - 1, 0.5, 0.0]),
        deque([0.5, 2**60 - 1, 0.0]),
        np.array([0, 2**60 - 1, 0]),
    ],
    ids=["array", "UserList", "deque", "integers"],
)
def test_integers_in_other_sequences_are_not_rounded(detector, row):
    for rows in ([[0.5] * 3, row] * 2, UserList([[0.5] * 3, row] * 2)):
        with pytest.raises(ValueError, match="^vertices: float64 cannot hold 1152921504606846975 exactly"):
            detector.step(rows)


def test_masked_rows_of_other_sequences(detector):
    with pytest.raises(TypeError, match="^vertices: .*masked"):
        detector.step(UserList([np.ma.masked_array([1.0, 2.0, 3.0], [True, False, False])] * 4))


@pytest.mark.parametrize("truth", [True, np.True_, np.array(False), np.array([True, True, False])])
def test_truths_among_numbers(scene, detector, truth):
    row = truth if np.ndim(truth) else [truth, 0, 2]
    for ask in (
        lambda: detector.step([row, [0.5] * 3, row, row]),
        lambda: detector.set_separations([[row[0], 0.5]]),
        lambda: scene.add_mesh("x", [row, [0, 1, 2]]),
    ):
        with pytest.raises(TypeError, match="expected numbers, got True or False among them"):
            ask()


def test_durations_are_no_lengths(scene):
    with pytest.raises(TypeError, match="^minimum_separation: expected a number, got timedelta64"):
        hc.Detector(scene, minimum_separation=np.timedelta64(1))
    with pytest.raises(TypeError, match="static: expected True or False, got timedelta64"):
        scene.add_mesh("x", FACES, static=np.timedelta64(1))


@pytest.mark.skipif(np.finfo(np.longdouble).maxexp <= 1024, reason="long doubles are float64 here")
@pytest.mark.filterwarnings("error")
def test_long_doubles_beyond_float64(scene, detector):
    with np.errstate(all="raise"):
        for text in ("1e400", "1e-400", "0.1"):
            long = np.longdouble(text)
            beyond = "must lie within float64, got 1e\\+400" if text == "1e400" else "float64 cannot hold"
            with pytest.raises(ValueError, match=f"^minimum_separation: {beyond}") as raised:
                hc.Detector(scene, minimum_separation=long)
            assert str(long) in str(raised.value)
            with pytest.raises(ValueError, match=r"^of_pairs\[0, 0\]: float64 cannot hold") as raised:
                detector.set_separations(np.array([[long]]))
            assert str(long) in str(raised.value)
        detector.set_separations(np.array([[np.longdouble(0.5)]]))


@pytest.mark.parametrize("bad", [None, 3])
def test_contacts_of_step_takes_a_list(bad):
    with pytest.raises(TypeError, match=r"^results: expected a list of \(contacts, part, parts\), got"):
        contacts_of_step(bad)


@pytest.mark.parametrize("package, name", [("torch", "PyTorch"), ("jax", "JAX")])
def test_an_extra_that_is_absent(monkeypatch, package, name):
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.delitem(sys.modules, f"hpccd_core.{package}", raising=False)
    with pytest.raises(
        ModuleNotFoundError, match=rf"^hpccd_core.{package}: cannot import {name} .*; pip install {package}$"
    ):
        importlib.import_module(f"hpccd_core.{package}")
