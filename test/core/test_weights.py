# SPDX-License-Identifier: Apache-2.0
"""Weights, approach and derivatives of times: against their definition, and against 80-digit arithmetic."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
import random_scenes
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core.parts import contacts_of_step

OUTPUTS = ("normals", "weights")
SCENES = pytest.mark.parametrize("generate", random_scenes.ALL)


def contacts_of(meshes, **options):
    detector = hc.Detector(meshes.scene(), outputs=OUTPUTS, backend="cpu", **options)
    return detector.detect(meshes.vertices_t0, meshes.vertices_t1)


def whole_faces(meshes):
    before = np.cumsum([0, *meshes.n_vertices[:-1]])
    return np.concatenate([np.reshape(f, (-1, 3)) + b for f, b in zip(meshes.faces, before, strict=True)])


def times(contacts):
    return np.concatenate([contacts.vf_toc, contacts.ee_toc])


def gaps(contacts, start, end):
    """The weighted sums at the times of impact, the size of the features and of their motion, and the motion.

    Positions at a time are rounded coordinates, so far from the origin these count, by a few 2**-53.
    """
    x0, x1 = np.asarray(start, float)[contacts.vertices], np.asarray(end, float)[contacts.vertices]
    far = 1e-15 * np.abs(np.concatenate([x0, x1], 1)).max((1, 2), initial=0)
    x0, x1 = x0 - x0[:, :1], x1 - x1[:, :1]
    way = x1 - x0
    x = x0 + times(contacts)[:, None, None] * way
    size = 1e-9 * np.abs(np.concatenate([x, way], 1)).max((1, 2), initial=0) + far
    return (contacts.weights[:, :, None] * x).sum(1), size, way


def assert_in_range(found, faces):
    n = len(found.vf)
    expected = np.concatenate([np.concatenate([found.vf[:, :1], faces[found.vf[:, 1]]], 1), found.ee])
    assert found.vertices.dtype == np.uint32 and np.array_equal(found.vertices, expected)
    vf, ee = np.split(found.weights, [n])
    assert (vf[:, 0] == 1).all() and ((-1 <= vf[:, 1:]) & (vf[:, 1:] <= 0)).all()
    assert ((-1 <= ee[:, :2]) & (ee[:, :2] <= 0) & (0 <= ee[:, 2:]) & (ee[:, 2:] <= 1)).all()
    assert np.abs(found.weights.sum(1)).max(initial=0) < 1e-15


@SCENES
@pytest.mark.parametrize("separation", [0.0, 0.03125])
def test_by_their_definition(generate, separation):
    for seed in range(4):
        meshes = generate(np.random.default_rng([43, seed]))
        found = contacts_of(meshes, minimum_separation=separation)
        assert_in_range(found, whole_faces(meshes))
        gap, size, way = gaps(found, meshes.vertices_t0, meshes.vertices_t1)
        along = (gap * found.normals).sum(1)
        if separation == 0:
            assert (np.abs(gap).max(1, initial=0) <= size).all()
        else:
            has = found.normals.any(1)
            assert (np.abs(gap - along[:, None] * found.normals)[has].max(1, initial=0) <= size[has]).all()
            late = times(found) > 0
            assert (np.abs(along - separation)[late] <= (size + 1e-12)[late]).all()
        speed = (found.normals * (found.weights[:, :, None] * way).sum(1)).sum(1)
        assert (np.abs(found.approach - speed) <= 1e-3 * size).all()
        assert (found.approach[times(found) > 0] <= 0).all(), "they approach each other"


def decimals(array):
    return [[Decimal(float(x)) for x in row] for row in array]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


def minus(a, b):
    return [x - y for x, y in zip(a, b, strict=True)]


def exact_gradients(vertex_face, x0, x1, toc):
    """d toc / d x0 and d x1 at the root of p . (a x b) nearest to toc, by the implicit function theorem. No weights."""
    x0, x1, t = decimals(x0), decimals(x1), Decimal(float(toc))
    spans = ((1, 0), (1, 2), (1, 3)) if vertex_face else ((0, 2), (0, 1), (2, 3))
    m0, m1 = ([minus(x[to], x[start]) for start, to in spans] for x in (x0, x1))
    steps = [minus(b, a) for a, b in zip(m0, m1, strict=True)]

    def at(t):
        p, a, b = ([u + t * v for u, v in zip(x, s, strict=True)] for x, s in zip(m0, steps, strict=True))
        by = cross(a, b), cross(b, p), cross(p, a)  # derivatives by p, a and b
        return dot(p, by[0]), sum(dot(d, s) for d, s in zip(by, steps, strict=True)), by

    for _ in range(60):
        f, slope, by = at(t)
        if not slope:
            return None
        step = f / slope
        t -= step
        if abs(step) < Decimal(10) ** -60:
            break
    else:
        return None
    _, slope, by = at(t)
    scale = sum(abs(dot(d, s)) for d, s in zip(by, steps, strict=True))
    if abs(t - Decimal(float(toc))) > Decimal("1e-12") or abs(slope) < Decimal("1e-3") * scale:
        return None  # not simple by a margin
    of = [[Decimal(0)] * 3 for _ in range(4)]
    for (start, to), d in zip(spans, by, strict=True):
        of[to] = [x + y for x, y in zip(of[to], d, strict=True)]
        of[start] = minus(of[start], d)
    return [[[float(-part * x / slope) for x in v] for v in of] for part in (1 - t, t)]


@SCENES
def test_derivatives_of_times(generate):
    """Relative to the largest of the pair; where its features are degenerate, errors of the normal are larger."""
    compared = 0
    for seed in range(3):
        meshes = generate(np.random.default_rng([44, seed]))
        found = contacts_of(meshes)
        toc, (g0, g1) = times(found), found.toc_gradients()
        assert g0.shape == g1.shape == (len(found), 4, 3)
        undefined = (toc == 0) | (found.approach == 0)
        for gradient in (g0, g1):
            assert np.array_equal(np.isnan(gradient).any((1, 2)), undefined)
        with localcontext() as context:
            context.prec = 80
            for row in np.random.default_rng(seed).permutation(np.flatnonzero(~undefined))[:60]:
                v = found.vertices[row]
                exact = exact_gradients(row < len(found.vf), meshes.vertices_t0[v], meshes.vertices_t1[v], toc[row])
                if exact is None:
                    continue
                compared += 1
                for ours, theirs in zip((g0[row], g1[row]), np.array(exact), strict=True):
                    assert np.abs(ours - theirs).max() <= 1e-6 * np.abs(np.array(exact)).max(), (seed, row)
    assert compared > 20 or generate is random_scenes.huge_and_tiny, compared


def distance(vertex_face, x):
    """The distance at rest, of a detector of one pair."""
    scene = hc.Scene()
    faces, edges = ([[1, 2, 3]], ()) if vertex_face else (np.empty((0, 3), int), [[0, 1], [2, 3]])
    scene.add_mesh("pair", faces, n_vertices=4, edges=edges)
    (gap,) = hc.Detector(scene, backend="cpu", threads=1).distances(x)
    return gap.distance


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_distances(seed):
    rng = np.random.default_rng(seed)
    meshes = random_scenes.single_mesh(rng)
    near = hc.Detector(meshes.scene(), outputs=OUTPUTS, backend="cpu").proximity(meshes.vertices_t0, 0.2)
    assert_in_range(near, whole_faces(meshes))
    x = meshes.vertices_t0.astype(float)
    gap = (near.weights[:, :, None] * x[near.vertices]).sum(1)
    d = np.concatenate([near.vf_distance, near.ee_distance])
    np.testing.assert_allclose(gap, d[:, None] * near.normals, atol=1e-12)
    h = 1e-6
    for row in rng.permutation(np.flatnonzero(d > 1e-3))[:20]:
        pair, vf = x[near.vertices[row]], row < len(near.vf)
        for _ in range(3):
            direction = rng.normal(size=(4, 3))
            slope = (distance(vf, pair + h * direction) - distance(vf, pair - h * direction)) / (2 * h)
            ours = (near.weights[row][:, None] * near.normals[row] * direction).sum()
            assert slope == pytest.approx(ours, abs=1e-4)


def detector_of_pair(faces=((1, 2, 3),), edges=(), **options):
    scene = hc.Scene()
    scene.add_mesh("pair", faces, n_vertices=4, edges=edges)
    return hc.Detector(scene, outputs=OUTPUTS, backend="cpu", **options)


def pair(start, end, **options):
    return detector_of_pair(**options).detect(np.array(start, float), np.array(end, float))


FACE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
EDGES = {"faces": np.empty((0, 3), int), "edges": [[0, 1], [2, 3]]}
# Start and end of the vertex on FACE, weights, approach.
ON_FACE = {
    "inside": ([0.25, 0.5, 1], [0.25, 0.5, -1], [1, -0.25, -0.25, -0.5], -2),
    "on a side": ([0.5, 0, 1], [0.5, 0, -3], [1, -0.5, -0.5, 0], -4),
    "at a corner": ([0, 1, 1], [0, 1, -1], [1, 0, 0, -1], -2),
    "only at the end": ([0.25, 0.5, 1], [0.25, 0.5, 0], [1, -0.25, -0.25, -0.5], -1),
    "at the start": ([0.25, 0.5, 0], [0.25, 0.5, 1], [1, -0.25, -0.25, -0.5], -1),  # as if it had come from below
    "in the plane throughout": ([-1, 0.5, 0], [1, 0.5, 0], [1, -0.5, 0, -0.5], 0),
}


@pytest.mark.parametrize("name", ON_FACE)
def test_vertices_on_a_face(name):
    start, end, weights, approach = ON_FACE[name]
    found = pair([start, *FACE], [end, *FACE])
    assert (len(found.vf), len(found.ee)) == (1, 0)
    np.testing.assert_allclose(found.weights, [weights], atol=1e-15)
    assert found.approach.tolist() == [approach]
    assert np.isnan(found.toc_gradients()).all() == (found.vf_toc[0] == 0 or approach == 0)


def test_grazing_has_no_derivative():
    """The gap is (t - 1/2)**2: the vertex goes down to the face, whose one corner goes down at its side."""
    found = pair([[0.25, 0, 0.25], *FACE], [[0.25, 1, -0.75], *FACE[:2], [0, 1, -1]])
    assert found.vf_toc.tolist() == [0.5] and found.approach.tolist() == [0]
    np.testing.assert_allclose(found.weights, [[1, -0.25, -0.25, -0.5]], atol=1e-15)
    assert np.isnan(found.toc_gradients()).all()


@pytest.mark.parametrize("shift", [0, 0.5, -0.25])
def test_parallel_edges_share_the_middle_of_their_stretch(shift):
    start = [[0, 0, 0], [2, 0, 0], [shift, 1, 0], [shift + 2, 1, 0]]
    end = [[0, 0, 0], [2, 0, 0], [shift, -1, 0], [shift + 2, -1, 0]]
    found = pair(start, end, **EDGES)
    middle = (max(0, shift) + min(2, 2 + shift)) / 2
    s, u = middle / 2, (middle - shift) / 2
    np.testing.assert_allclose(found.weights, [[s - 1, -s, 1 - u, u]], atol=1e-15)
    assert not found.normals.any() and found.approach.tolist() == [0] and np.isnan(found.toc_gradients()).all()
    apart = pair(start, end, minimum_separation=0.5, **EDGES)
    np.testing.assert_allclose(apart.weights, [[s - 1, -s, 1 - u, u]], atol=1e-15)
    assert apart.ee_toc.tolist() == pytest.approx([0.25], abs=1e-12) and apart.approach.tolist() == [-2]
    g0, g1 = apart.toc_gradients()
    np.testing.assert_allclose(g0[0, :, 1], 0.75 / 2 * np.array([s - 1, -s, 1 - u, u]), atol=1e-12)
    np.testing.assert_allclose(g1[0, :, 1], 0.25 / 2 * np.array([s - 1, -s, 1 - u, u]), atol=1e-12)


@pytest.mark.parametrize(
    "face", [[[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 0, 0]] * 3, [[0, 0, 0], [1, 0, 0], [1, 0, 0]]]
)
def test_faces_without_area(face):
    at = np.mean(face, 0)
    found = pair([at + [0, 0, 1], *face], [at - [0, 0, 1], *face])
    assert len(found.vf) == 1 and not found.normals.any() and found.approach.tolist() == [0]
    np.testing.assert_allclose(found.weights[0, 1:] @ np.array(face, float), -at, atol=1e-15)
    assert np.isnan(found.toc_gradients()).all()


@pytest.mark.parametrize("height", 10.0 ** np.arange(-300, 0, 13))
def test_slivers(height):
    """A triangle of any height: the point stays within roundings of its size."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        face = np.array([[0, 0, 0], [1, 0, 0], [rng.uniform(), height, 0]])[rng.permutation(3)]
        at = rng.dirichlet(np.ones(3) * 0.3) @ face
        found = pair([at + [0, 0, 1], *face], [at - [0, 0, 1], *face])
        if len(found.vf):  # rounding may have put it beside the face
            assert_in_range(found, np.array([[1, 2, 3]]))
            assert np.abs(found.weights[0] @ np.array([at, *face])).max() < 1e-14


@pytest.mark.parametrize("short", 10.0 ** np.arange(-17, 0, 2))
def test_triangles_with_one_short_side(short):
    """Within roundings of its size, whichever of its corners are near each other, and wherever it is."""
    rng = np.random.default_rng(0)
    touching, collapsed, detector = 0, short < 1e-15, detector_of_pair()
    for _ in range(4000 if collapsed else 200):  # of 200 that have collapsed rounding leaves none to three in contact
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        face = (np.array([[0, 0, 0], [3, 0, 0], [0, short, 0]]) @ turn + rng.normal(size=3))[rng.permutation(3)]
        at = rng.dirichlet(np.ones(3) * 0.3) @ face
        start, end = np.array([at + turn[2], *face]), np.array([at - turn[2], *face])
        found = detector.detect(start, end)
        touching += len(found.vf)
        gap, size, _ = gaps(found, start, end)
        assert (np.abs(gap).max(1, initial=0) <= size).all()
    assert touching > (0 if collapsed else 10)


@pytest.mark.parametrize("separation", [0.0, 0.25])
def test_what_comes_into_contact_approaches(separation):
    """Features that shrink to a few roundings of themselves, for whose normal rounding decides."""
    rng = np.random.default_rng(1)
    for seed in range(400):
        vertex_face = seed % 2 == 0
        start, end = rng.integers(-6, 7, (2, 4, 3)).astype(float)
        kept, gone = ((1, 2), (0, 1))[rng.integers(2)] if vertex_face else ((0, 1), (2, 3))[rng.integers(2)]
        end[gone] = end[kept]
        if rng.integers(2):
            end[3 - kept] = end[kept]
        end[gone] = np.nextafter(end[gone], rng.choice([-9.0, 9.0], 3))
        found = pair(start, end, minimum_separation=separation, **({} if vertex_face else EDGES))
        assert (found.approach[times(found) > 0] <= 0).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("depth", [0, 1])
def test_of_denormal_motions(depth):
    """The derivative is beyond the largest double."""
    found = pair(np.array([[0.25, 0.5, 1], *FACE]) * 1e-320, np.array([[0.25, 0.5, -depth], *FACE]) * 1e-320)
    assert found.vf_toc[0] > 0 > found.approach[0]
    for gradient, part in zip(found.toc_gradients(), (depth, 1), strict=True):
        assert np.isinf(gradient[0, 0, 2]) == (part > 0) and not gradient[:, :, :2].any()


def test_of_a_step_in_parts():
    """The approach is per step, of which a part is a fraction."""
    scene = hc.Scene()
    scene.add_mesh("pair", [[1, 2, 3]], n_vertices=4)
    detector = hc.Detector(scene, outputs=OUTPUTS, backend="cpu")
    ends = [np.array([[0.25, 0.5, z], *FACE], float) for z in (1.0, 0.25, -0.5)]
    parts = [(detector.detect(ends[k], ends[k + 1]), k, 2) for k in range(2)]
    whole = contacts_of_step(parts)
    straight = detector.detect(ends[0], ends[2])
    assert whole.approach.tolist() == straight.approach.tolist() == [-1.5]
    assert np.array_equal(whole.weights, straight.weights) and np.array_equal(whole.vertices, straight.vertices)


def test_the_same_whatever_threads_and_worlds():
    faces, frames = sheet_faces(24), [sheet_positions(24, k) for k in (0, 9)]
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    for separation in (0.0, 1e-2):
        options = {"outputs": OUTPUTS, "minimum_separation": separation, "backend": "cpu"}
        one = hc.Detector(scene, threads=1, simd="scalar", **options).detect(*frames)
        assert one == hc.Detector(scene, threads=3, **options).detect(*frames)
        many = hc.Detector(scene, worlds=3, threads=2, **options).detect(*(np.stack([x] * 3) for x in frames))
        assert all(many.world(k) == one for k in range(3))
