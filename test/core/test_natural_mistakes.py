# SPDX-License-Identifier: Apache-2.0
"""Mistakes that users make in their first hour, and the words that help them on."""

import copy
import pickle
import warnings

import numpy as np
import pytest

import hpccd_core as hc

CLOTH, CLOTH_FACES = hc.shapes.grid(2, 2)  # 9 vertices
BALL, BALL_FACES = hc.shapes.icosphere(1)  # 12 vertices
BOTH = np.concatenate([CLOTH, BALL])
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])


class Mesh:
    """What trimesh has."""

    vertices, faces = BALL, BALL_FACES


class DlpackOnly:
    """An array on the host that only DLPack exports."""

    def __dlpack__(self, **_):
        return BOTH.__dlpack__()

    def __dlpack_device__(self):
        return BOTH.__dlpack_device__()


class Gradient:
    """What a PyTorch tensor that requires a gradient does."""

    def __array__(self, *args, **kwargs):
        raise RuntimeError("Can't call numpy() on Tensor that requires grad. Use tensor.detach().numpy() instead.")


def scene():
    scene = hc.Scene()
    scene.add_mesh("cloth", CLOTH_FACES)
    scene.add_mesh("ball", BALL_FACES, static=True)
    return scene


def with_floor():
    added = scene()
    added.add_plane("floor")
    return added


def one_based():
    scene = hc.Scene()
    scene.add_mesh("cloth", CLOTH_FACES + 1)
    return scene


def add(*args, **options):
    return lambda: hc.Scene().add_mesh(*args, **options)


def detector(**options):
    return lambda: hc.Detector(scene(), **options)


def detect(*args, **options):
    return lambda: hc.Detector(scene(), **options).detect(*args)


def changed(row, value):
    vertices = BOTH.copy()
    vertices[row] = value
    return vertices


MISTAKES = {
    "quads as faces": (add("cloth", QUADS), r"faces: expected shape \(F, 3\), got \(2, 4\); triangulate quad.*reshape"),
    "VTK's faces": (add("cloth", [3, 0, 1, 2, 3, 0, 2, 3]), r"VTK's format.*faces.reshape\(-1, 4\)\[:, 1:\]"),
    "polygons as faces": (add("cloth", [[0, 1, 2, 3, 4]]), "triangulate polygons first"),
    "edges as faces": (add("rope", [[0, 1], [1, 2]]), r"faces: .*got \(2, 2\); give segments as edges="),
    "faces as edges": (add("rope", edges=[[0, 1, 2]]), r"edges: .*got \(1, 3\); give triangles as faces"),
    "faces in columns": (add("cloth", CLOTH_FACES.T), r"faces: .*got \(3, 8\); transpose it: faces\.T"),
    "flat faces": (add("cloth", CLOTH_FACES.ravel()), r"faces: .*got \(24,\); reshape it: faces\.reshape\(-1, 3\)"),
    "vertices, then faces": (add("cloth", CLOTH, CLOTH_FACES), r"takes a name and faces; vertices are given to detect"),
    "vertices as faces": (add("ball", BALL), "faces: expected integers.*look like positions.*detect"),
    "faces as floats": (add("cloth", CLOTH_FACES.astype(float)), r"convert with faces\.astype\(numpy\.uint32\)"),
    "faces from 1": (add("cloth", CLOTH_FACES + 1, n_vertices=9), "is 9, but mesh 'cloth' has 9 vertices"),
    "a mesh object as faces": (add("ball", Mesh()), "faces: expected integers, got Mesh; give mesh.faces$"),
    "no faces": (add("ball", None), "faces: expected integers, got NoneType; give indices of vertices$"),
    "an option without its name": (
        add("ball", BALL_FACES, True),
        "options are given by name, as in static=True; got True",
    ),
    "a name alone": (add("ball"), "mesh 'ball' has no vertices; give faces, edges or, for particles, n_vertices"),
    "number as name": (add(3, CLOTH_FACES), "name: expected a string, got int"),
    "unnamed option": (lambda: hc.Detector(scene(), "fast"), "options are given by name, as in accuracy='exact'"),
    "another option's name": (detector(min_separation=0.1), "no option 'min_separation'.*did you mean minimum_sep"),
    "an output as option": (detector(normals=True), r"no option 'normals'; write outputs=\('normals',\)$"),
    "an array of an output as option": (detector(approach=True), r"'approach'; write outputs=\('weights',\)$"),
    "gradients as option": (detector(gradients=True), r"'gradients'; write outputs=\('normals', 'weights'\)$"),
    "d-hat as option": (
        detector(d_hat=0.1),
        r"no option 'd_hat'; .*minimum_separation= .*proximity\(vertices, distance\)",
    ),
    "thickness as option": (detector(thickness=0.1), "no option 'thickness'; write minimum_separation="),
    "tier": (detector(tier="exact"), "no option 'tier'; write accuracy=$"),
    "device": (detector(device="cuda"), "no option 'device'; write backend="),
    "unknown option": (detector(colour=1), r"no option 'colour'; help\(hpccd_core.Detector\) lists them$"),
    "misspelled choice": (detector(accuracy="Exakt"), "'Exakt' is not known.*did you mean exact[?]"),
    "output in singular": (detector(outputs="normal"), "outputs: 'normal' is not known.*did you mean normals[?]"),
    "an array that is no output": (detector(outputs="vertices"), "'vertices' is not .*did you mean weights[?]"),
    "gradients without their outputs": (
        lambda: detect(BOTH, BOTH)().toc_gradients(),
        r"^weights: not computed; make the detector with outputs=\('weights', 'normals'\)$",
    ),
    "hyphen for underscore": (detector(features="vertex-face"), "did you mean vertex_face[?]"),
    "misspelled mesh": (lambda: scene().ignore_pair("cloth", "Ball"), "no mesh is named 'Ball'.*did you mean ball[?]"),
    "faces for a scene": (
        lambda: hc.Detector(CLOTH_FACES),
        r"scene: expected hpccd_core.Scene.*Scene\(\) and",
    ),
    "both ends to step": (lambda: detector()().step(BOTH, BOTH), "step: takes one array .*for two call detect"),
    "a separation to detect": (
        detect(BOTH, BOTH, 0.01),
        "detect: takes two arrays of positions; a separation is an opt",
    ),
    "a stream by position": (detect(BOTH, BOTH, 0), "detect: takes two arrays .*by name, as stream=$"),
    "both ends to intersections": (
        lambda: detector()().intersections(BOTH, BOTH),
        "intersections: takes the positions of one frame; for a motion call detect",
    ),
    "both ends to distances": (
        lambda: detector()().distances(BOTH, BOTH),
        "distances: takes the positions of one frame",
    ),
    "both ends to proximity": (
        lambda: detector()().proximity(BOTH, BOTH, 0.1),
        "proximity: takes the positions of one frame, and a distance",
    ),
    "two separations": (
        lambda: detector()().collision_free_step(BOTH, BOTH, 0.1),
        "collision_free_step: takes two arrays of positions",
    ),
    "one end": (detect(BOTH), r"^Detector\.detect\(\) missing 1 required positional argument: 'vertices_t1'$"),
    "an option to a query": (lambda: detector()().proximity(BOTH, d=1), r"^Detector\.proximity\(\) "),
    "one mesh of two": (detect(CLOTH, CLOTH), r"vertices_t0: expected shape \(21, 3\).*may be of mesh 'cloth' alone"),
    "too many rows": (detect(BOTH, np.vstack([BOTH, CLOTH])), r"vertices_t1: .*got \(30, 3\); .*n_vertices="),
    "(3, V)": (detect(BOTH.T, BOTH.T), r"vertices_t0: .*got \(3, 21\); transpose it: vertices_t0\.T"),
    "two coordinates": (detect(BOTH[:, :2], BOTH), r"got \(21, 2\); add a third coordinate: numpy\.pad\(vertices_t0,"),
    "four coordinates": (detect(BOTH, BOTH[:, [0, 1, 2, 0]]), r"vertices_t1: .*leave out the fourth coordinate"),
    "flat positions": (detect(BOTH.ravel(), BOTH), r"got \(63,\); reshape it: vertices_t0\.reshape\(21, 3\)"),
    "worlds without worlds=": (detect(BOTH[None], BOTH[None]), r"got \(1, 21, 3\); .*worlds="),
    "one world of two": (detect(BOTH, BOTH, worlds=2), r"got \(21, 3\); give the positions of every world"),
    "integers": (
        detect(BOTH.astype(int), BOTH),
        r"int64; convert with vertices_t0\.astype\(numpy\.float64\)",
    ),
    "lists of integers": (detect([[0, 0, 0]] * 21, BOTH), r"convert with numpy\.asarray\(vertices_t0, float\)"),
    "a tensor with a gradient": (detect(Gradient(), BOTH), r"vertices_t0: .*tensor\.detach\(\)"),
    "a mesh object": (detect(Mesh(), BOTH), "vertices_t0: expected float32 or float64, got Mesh; give mesh.vertices$"),
    "a mesh object in a dict": (
        detect({"cloth": CLOTH, "ball": Mesh()}, BOTH),
        r"_t0\['ball'\]: .*; give mesh.vertices$",
    ),
    "a DLPack object": (
        detect(BOTH, DlpackOnly()),
        r"vertices_t1: .* DlpackOnly; give numpy\.from_dlpack\(vertices_t1\)$",
    ),
    "a list of meshes": (
        detect([CLOTH, BALL], BOTH),
        r"vertices_t0: .*list of 2; .*numpy\.concatenate\(vertices_t0\), or",
    ),
    "meshes of one size": (detect((BALL, BALL), BOTH), r"vertices_t0: .*list of 2; .*or a dict \{mesh: array\}"),
    "NaN": (detect(changed(2, np.nan), BOTH), r"vertices_t0\[2, 0\] is NaN"),
    "infinity in a static mesh": (detect(BOTH, changed(9, np.inf)), r"vertices_t1\[9, 0\] is infinite"),
    "far away in a static mesh": (detect(BOTH, changed(9, 1e200)), r"vertices_t1\[9, 0\] is 1e\+200, .*scale"),
    "displacements": (detect(BOTH, BOTH * 0), r"vertices_t1\[9\]: moves, .*positions at the end, not displacements"),
    "a static mesh that moves": (detect(BOTH, BOTH + 1), r"vertices_t1\[9\]: .*mesh 'ball'.*static"),
    "dict, misspelled mesh": (
        detect({"Cloth": CLOTH, "ball": BALL}, BOTH),
        "no mesh is named 'Cloth'.*you mean cloth[?]",
    ),
    "dict, missing mesh": (detect(BOTH, {"cloth": CLOTH}), "vertices_t1: has no positions of mesh 'ball'; give"),
    "dict, missing mesh beside a plane": (
        lambda: hc.Detector(with_floor()).detect({}, {}),
        "has no positions of mesh 'cloth'; give those of every mesh: cloth, ball$",
    ),
    "positions of a plane": (
        lambda: hc.Detector(with_floor()).proximity({"cloth": CLOTH, "ball": BALL, "floor": CLOTH}, 0.1),
        r"vertices\['floor'\]: is a plane, which has no vertices; leave it out",
    ),
    "faces as a mask": (
        lambda: scene().ignore_faces("cloth", CLOTH[CLOTH_FACES[:, 0], 0] > 0, "ball"),
        r"faces: expected integers, got dtype bool; of a mask give numpy\.flatnonzero\(faces\)",
    ),
    "positions for a number of points": (
        lambda: scene().add_points("grains", CLOTH),
        r"n: expected a number of points; give len\(points\)",
    ),
    "a thickness for each vertex": (
        lambda: detector()().set_thickness("ball", np.ones(12)),
        r"thickness: 'ball' .*each face \(20\), but 12 were given; .*thickness\[faces\]\.max\(axis=1\)",
    ),
    "a radius for each end of a rod": (
        lambda: scene().add_points("rod", 2, edges=[[0, 1]], thickness=[0.1, 0.1]),
        r"thickness: expected one number, or one for each edge \(1\), got 2",
    ),
    "dict, swapped meshes": (
        detect({"cloth": BALL, "ball": CLOTH}, BOTH),
        r"vertices_t0\['cloth'\]: expected .*\(9, 3\)",
    ),
    "a separation in the middle": (
        lambda: detector()().set_separation("cloth", 0.1, "ball"),
        r"separation: .*got str; write set_separation\(mesh_a, mesh_b, separation\)",
    ),
    "a scene's separation in the middle": (
        lambda: scene().set_separation("cloth", 0.1, "ball"),
        r"separation: .*got str; write set_separation\(mesh_a, mesh_b, separation\)",
    ),
    "normals that were not asked for": (
        lambda: detect(BOTH, BOTH)().normals,
        r"normals: not computed; make the detector with outputs=\('normals',\)",
    ),
    "a pickled detector": (lambda: pickle.dumps(detector()()), "cannot be pickled.*pickle its Scene"),
    "a copied detector": (lambda: copy.deepcopy(detector()()), "cannot be pickled or copied"),
    "an option that is assigned": (
        lambda: setattr(detector()(), "minimum_separation", 0.1),
        "minimum_separation: a detector's options do not change; make another.*set_separation",
    ),
    "contacts.vf as vertices": (
        lambda: scene().locate([[0, 1], [2, 3]]),
        r"vertex: expected shape \(N,\).*got \(2, 2\).*face=contacts.vf\[:, 1\]",
    ),
    "a row of contacts.vf": (
        lambda: scene().locate(np.array([3, 27])),
        r"vertex: .*got 3 to 27; of a row of contacts.vf give vertex=row\[0\] or face=row\[1\]",
    ),
    "contacts by number": (
        lambda: detect(BOTH, BOTH)()[0],
        "^Contacts: not a sequence; its rows are in the arrays vf, vf_toc, ee, ee_toc, .*ve, ve_toc$",
    ),
    "a loop over contacts": (lambda: list(detect(BOTH, BOTH)()), "^Contacts: not a sequence"),
    "proximity by number": (lambda: detector()().proximity(BOTH, 1)[0], "^Proximity: .*ve_distance$"),
    "intersections by number": (lambda: detector()().intersections(BOTH)[0], "^Intersections: .*arrays ef$"),
    "positions of faces from 1": (
        lambda: hc.Detector(one_based()).detect(CLOTH, CLOTH),
        r"got \(9, 3\); one row is missing: from faces that count vertices from 1, subtract 1",
    ),
    "an index in an empty scene": (
        lambda: hc.Scene().locate(0),
        "vertex: the scene has no vertex; add_mesh comes first",
    ),
    "an index beyond": (lambda: scene().locate(21), r"vertex: must lie in \[0, 20\], got 21"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_error_names_the_remedy(mistake):
    call, words = MISTAKES[mistake]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises((TypeError, ValueError, AttributeError), match=words) as raised:
            call()
    assert len(str(raised.value)) < 300


@pytest.mark.parametrize("kind", (np.int64, np.float32, np.float64, ">f8"))
def test_arrays_without_dimensions_are_numbers(kind):
    one = np.ones((), kind)
    assert detector()().proximity(BOTH, one) == detector()().proximity(BOTH, 1.0)
    assert detect(BOTH, BOTH, minimum_separation=one)() == detect(BOTH, BOTH, minimum_separation=1.0)()
    with pytest.raises(TypeError, match="expected a number, got ndarray"):
        detector(minimum_separation=one[None])()
    with pytest.raises(TypeError, match="expected a number, got ndarray"):
        detector(minimum_separation=np.True_[...])()


def test_object_arrays_hold_results():
    found = detect(BOTH, BOTH)()
    held = np.array([found, found], object)
    assert held.shape == (2,) and held[1] is found and np.asarray(found).shape == ()
