# SPDX-License-Identifier: Apache-2.0
"""Winding numbers and signed distances against rational arithmetic, and their invariances."""

import itertools
import math
import random
from fractions import Fraction

import numpy as np
import pytest

import hpccd_core as hc

BOX, BOX_FACES = hc.shapes.box((2, 2, 2))
TETRAHEDRON = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)], np.uint32)


def detector(*meshes, **options):
    scene = hc.Scene()
    for k, (vertices, faces) in enumerate(meshes):
        scene.add_mesh(f"mesh{k}", faces, n_vertices=len(vertices))
    return hc.Detector(scene, **{"backend": "cpu", "threads": 1, **options})


def windings(vertices, faces, points, **options):
    return detector((vertices, faces), **options).winding_numbers(vertices, points, 0)


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [np.asarray(f, np.uint32) + np.uint32(start) for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def soup(rng, n, size):
    """Closed meshes on a grid of integers: tetrahedra and boxes, flat, doubled, inverted and degenerate ones too."""
    parts = []
    for _ in range(n):
        if rng.integers(2):
            part = rng.integers(-size, size + 1, (4, 3)).astype(float), TETRAHEDRON
        else:
            low, high = np.sort(rng.integers(-size, size + 1, (2, 3)), axis=0)
            part = np.where(BOX > 0, high, low).astype(float), BOX_FACES
        if rng.integers(3) == 0:
            part = part[0], part[1][:, ::-1]
        parts += [part] * (1 + (rng.integers(4) == 0))
    return joined(*parts)


def integers(*arrays):
    """The same numbers times a power of two, as Python's integers."""
    exact = [[Fraction(float(x)) for x in np.ravel(a)] for a in arrays]
    scale = math.lcm(*(x.denominator for row in exact for x in row))
    return [
        np.array([int(x * scale) for x in row], object).reshape(np.shape(a))
        for row, a in zip(exact, arrays, strict=True)
    ]


def volume(a, b, c):
    x, y, z = (np.moveaxis(v, -1, 0) for v in (a, b, c))
    return x[0] * (y[1] * z[2] - y[2] * z[1]) + x[1] * (y[2] * z[0] - y[0] * z[2]) + x[2] * (y[0] * z[1] - y[1] * z[0])


def sign(x):
    return (x > 0).astype(int) - (x < 0).astype(int)


def expected_windings(vertices, faces, points):
    """By rays in random directions; another one where a ray meets an edge. A point that is on a face lies there for
    some triangle, whose nearest point is at distance 0."""
    v, points_in_integers = integers(vertices, points)
    draw = random.Random(len(points))
    numbers, on_surface = np.zeros(len(points), int), np.zeros(len(points), bool)
    for i, p in enumerate(points_in_integers):
        corners = v[faces] - p
        in_plane = volume(corners[:, 0], corners[:, 1], corners[:, 2]) == 0
        on_surface[i] = any(squared_distance(np.zeros(3, int), t) == 0 for t in corners[in_plane])
        while not on_surface[i]:
            d = np.array([draw.randint(-(10**6), 10**6) for _ in range(3)], object)
            sides = [
                sign(volume(np.broadcast_to(d, corners[:, 0].shape), corners[:, k], corners[:, (k + 1) % 3]))
                for k in range(3)
            ]
            side = np.stack(sides)
            apart = (side > 0).any(axis=0) & (side < 0).any(axis=0)
            if ((side == 0).any(axis=0) & ~apart).any():
                flat = (side == 0).all(axis=0) | in_plane  # a face without area meets no generic ray inside
                if ((side == 0).any(axis=0) & ~apart & ~flat).any():
                    continue
                apart |= flat & (side == 0).any(axis=0)
            ahead = sign(volume(corners[:, 0], corners[:, 1], corners[:, 2]))
            numbers[i] = (side[0] * (side[0] * ahead > 0))[~apart].sum()
            break
    return numbers, on_surface


def squared_distance(p, triangle):
    """Of a point and a triangle, in fractions."""
    a, b, c = (np.array([Fraction(int(x)) if not isinstance(x, Fraction) else x for x in v], object) for v in triangle)
    p = np.array([Fraction(int(x)) if not isinstance(x, Fraction) else x for x in p], object)
    n = np.array([*np.cross(b - a, c - a)], object)
    if nn := n @ n:
        weights = [np.cross(u - p, w - p) @ n for u, w in ((b, c), (c, a), (a, b))]
        if min(weights) >= 0:
            return ((p - a) @ n) ** 2 / nn
    best = None
    for u, w in ((a, b), (b, c), (c, a)):
        e = w - u
        t = min(max((p - u) @ e / (e @ e), 0), 1) if e @ e else 0
        gap = u + e * t - p
        best = gap @ gap if best is None else min(best, gap @ gap)
    return best


def special_points(rng, vertices, faces, n):
    """On vertices, edges and faces, and on lines through them along x."""
    corners = vertices[faces[rng.integers(len(faces), size=n)]]
    weights = rng.multinomial(4, [1 / 3] * 3, n) / 4
    points = (weights[:, :, None] * corners).sum(axis=1)
    points[::2, 0] += rng.integers(-8, 9, len(points[::2])) / 4
    return points


@pytest.mark.parametrize("seed", range(20))
def test_winding_numbers_of_soups_on_a_grid(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, rng.integers(1, 7), 3)
    points = np.concatenate([rng.integers(-8, 9, (60, 3)) / 2, special_points(rng, vertices, faces, 60)])
    numbers, on_surface = windings(vertices, faces, points)
    expected, expected_on_surface = expected_windings(vertices, faces, points)
    assert np.array_equal(on_surface, expected_on_surface)
    assert np.array_equal(numbers, np.where(expected_on_surface, 0, expected))


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("kind", ["float64", "float32", "large", "denormal", "near"])
def test_winding_numbers_of_any_coordinates(seed, kind):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, 4, 3)
    vertices = vertices + rng.uniform(-0.5, 0.5, vertices.shape)
    points = special_points(rng, vertices, faces, 80)
    if kind == "float32":
        vertices, points = vertices.astype(np.float32), points.astype(np.float32)
    elif kind == "large":
        vertices, points = vertices / 8 * 1e300, points / 8 * 1e300
    elif kind == "denormal":
        vertices, points = vertices * 1e-321, points * 1e-321
    elif kind == "near":  # within a few roundings of the surface
        points = points * (1 + rng.integers(-2, 3, points.shape) * 2.0**-52)
    numbers, on_surface = windings(vertices, faces, points)
    expected, expected_on_surface = expected_windings(vertices, faces, points)
    assert np.array_equal(on_surface, expected_on_surface)
    assert np.array_equal(numbers, np.where(expected_on_surface, 0, expected))


def test_numbers_do_not_depend_on_the_numbering_and_add_up():
    rng = np.random.default_rng(5)
    first, second = soup(rng, 3, 4), soup(rng, 3, 4)
    points = rng.uniform(-5, 5, (500, 3))
    separate = windings(*first, points)[0] + windings(*second, points)[0]
    vertices, faces = joined(first, second)
    assert np.array_equal(windings(vertices, faces, points)[0], separate)
    new = rng.permutation(len(vertices)).astype(np.uint32)
    shuffled = rng.permutation(
        [np.roll(f, k) for f, k in zip(new[faces], rng.integers(3, size=len(faces)), strict=True)]
    )
    moved = np.empty_like(vertices)
    moved[new] = vertices
    assert np.array_equal(windings(moved, shuffled, points)[0], separate)
    assert np.array_equal(windings(vertices, faces[:, ::-1], points)[0], -separate)


def test_numbers_do_not_change_when_faces_are_divided():
    rng = np.random.default_rng(6)
    vertices, faces = soup(rng, 4, 4)
    middles, divided = {}, []
    for f in faces.tolist():
        m = [middles.setdefault(frozenset(e), len(vertices) + len(middles)) for e in itertools.combinations(f, 2)]
        ab, ac, bc = m
        divided += [(f[0], ab, ac), (ab, f[1], bc), (ac, bc, f[2]), (ab, bc, ac)]
    finer = np.concatenate([vertices, [vertices[list(e)].sum(axis=0) / len(e) for e in middles]])
    points = np.concatenate([rng.uniform(-5, 5, (200, 3)), special_points(rng, vertices, faces, 200)])
    for coarse, fine in zip(windings(vertices, faces, points), windings(finer, np.array(divided), points), strict=True):
        assert np.array_equal(coarse, fine)


def test_threads_and_worlds_change_nothing():
    rng = np.random.default_rng(7)
    vertices, faces = hc.shapes.icosphere(12)
    vertices = np.stack([vertices, 0.5 * vertices, vertices + 0.3])
    points = rng.uniform(-1.2, 1.2, (3, 2000, 3))
    alone = [detector((v, faces)) for v in vertices]
    many = detector((vertices[0], faces), worlds=3, threads=2)
    numbers, on_surface = many.winding_numbers(vertices, points, "mesh0")
    signed = many.signed_distances(vertices, points, "mesh0")
    assert numbers.shape == on_surface.shape == (3, 2000) and signed.closest.shape == (3, 2000, 3)
    for k, of_world in enumerate(alone):
        assert np.array_equal(of_world.winding_numbers(vertices[k], points[k], 0)[0], numbers[k])
        one = of_world.signed_distances(vertices[k], points[k], 0)
        assert all(np.array_equal(getattr(one, x), getattr(signed, x)[k]) for x in ("distance", "faces", "closest"))


def test_results_are_those_of_one_thread():
    rng = np.random.default_rng(13)
    vertices, faces = hc.shapes.icosphere(20)
    points = rng.uniform(-1.2, 1.2, (20000, 3))
    one, several = (detector((vertices, faces), threads=n) for n in (1, 3))
    for query in ("winding_numbers", "signed_distances"):
        a, b = (getattr(d, query)(vertices, points, 0) for d in (one, several))
        rows = (a, b) if query == "winding_numbers" else (vars(a).values(), vars(b).values())
        assert all(np.array_equal(x, y) for x, y in zip(*rows, strict=True))


def test_cancelled_queries_end():
    vertices, faces = hc.shapes.icosphere(8)
    cancelled = detector((vertices, faces))
    cancelled.cancel()
    with pytest.raises(hc.Cancelled):
        cancelled.signed_distances(vertices, vertices, 0)


def check_signed(vertices, faces, points, within=1e-12):
    signed = detector((vertices, faces)).signed_distances(vertices, points, 0)
    assert signed == detector((vertices, faces)).signed_distances(vertices, points, 0)
    numbers, on_surface = expected_windings(vertices, faces, points)
    assert np.array_equal(np.sign(signed.distance), np.where(on_surface, 0, np.where(numbers != 0, -1, 1)))
    for i, p in enumerate(np.asarray(points, float)):
        exact = [
            squared_distance([Fraction(x) for x in p], [[Fraction(float(x)) for x in v] for v in t])
            for t in vertices[faces]
        ]
        size = np.abs(np.asarray(vertices, float) - p).max()
        least = min(exact)
        assert abs(math.sqrt(least) - abs(signed.distance[i])) <= within * size
        assert math.sqrt(exact[signed.faces[i]]) <= math.sqrt(least) + 2 * within * size
        if on_surface[i]:
            assert signed.faces[i] == exact.index(0) and np.array_equal(signed.closest[i], p)
        assert abs(np.linalg.norm(signed.closest[i] - p) - abs(signed.distance[i])) <= 2 * within * size


@pytest.mark.parametrize("seed", range(5))
def test_signed_distances(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = soup(rng, 3, 3)
    points = np.concatenate([rng.integers(-8, 9, (12, 3)) / 2, special_points(rng, vertices, faces, 12)])
    check_signed(vertices, faces, points)
    check_signed(vertices + rng.uniform(-0.5, 0.5, vertices.shape), faces, points)


@pytest.mark.parametrize("height", [0.0, 1e-6, 1e-9, 1e-12, 1e-15, 1e-200])
def test_signed_distances_of_needles(height):
    rng = np.random.default_rng(9)
    vertices = np.array([[0, 0, 0], [1, 0.1, 0.3], [0.5, 0.05, 0.15], [0.4, 0.04, 0.12]]) + height * rng.normal(
        size=(4, 3)
    )
    check_signed(vertices, TETRAHEDRON, np.concatenate([rng.uniform(-1, 1, (20, 3)), vertices[:2] + height]))


@pytest.mark.parametrize("away", [20, 1e3, 1e7, 1e12, 1e100])
def test_signed_distances_from_far_away(away):
    rng = np.random.default_rng(14)
    vertices, faces = soup(rng, 3, 3)
    check_signed(vertices + rng.uniform(-0.5, 0.5, vertices.shape), faces, rng.normal(size=(10, 3)) * away)


@pytest.mark.parametrize("scale", [1e-300, 1e-100, 1e290])
def test_signed_distances_at_any_scale(scale):
    rng = np.random.default_rng(10)
    vertices, faces = soup(rng, 2, 3)
    points = rng.integers(-8, 9, (20, 3)) / 2
    expected = detector((vertices, faces)).signed_distances(vertices, points, 0)
    signed = detector((vertices, faces)).signed_distances(vertices * scale, points * scale, 0)
    np.testing.assert_allclose(signed.distance, expected.distance * scale, rtol=1e-10)


def test_the_nearest_face_is_the_lowest_of_equals():
    points = [[0, 0, 0.0], [3, 3, 3], [0, 0, 5]]
    signed = detector((BOX, BOX_FACES)).signed_distances(BOX, points, 0)
    for face, p in zip(signed.faces, points, strict=True):
        squares = [squared_distance([Fraction(x) for x in p], t.astype(int)) for t in BOX[BOX_FACES]]
        assert face == squares.index(min(squares))


def test_the_nearest_face_is_found_among_many():
    vertices, faces = hc.shapes.icosphere(30)
    rng = np.random.default_rng(11)
    vertices *= rng.uniform(0.8, 1.2, (len(vertices), 1))
    points = np.concatenate(
        [rng.uniform(-2, 2, (3000, 3)), rng.uniform(-1, 1, (50, 3)) * 1e6, vertices[:200] * (1 + 1e-9)]
    )
    together = detector((vertices, faces)).signed_distances(vertices, points, 0)
    apart = detector((vertices, faces))
    order = rng.permutation(len(points))[:500]
    for i in order:
        one = apart.signed_distances(vertices, points[i : i + 1], 0)
        assert (one.distance[0], one.faces[0]) == (together.distance[i], together.faces[i])
    number = windings(vertices, faces, points)[0]
    assert np.array_equal(together.distance < 0, number != 0)
    proximity = hc.Scene()
    proximity.add_mesh("sphere", faces)
    proximity.add_mesh("points", n_vertices=len(points))
    for i in order[:20]:
        alone = hc.Scene()
        alone.add_mesh("sphere", faces, self_collision=False)
        alone.add_mesh("point", n_vertices=1)
        gap = hc.Detector(alone, backend="cpu").distances(np.concatenate([vertices, points[i : i + 1]]))[0]
        size = max(1, np.abs(points[i]).max())
        assert abs(gap.distance - abs(together.distance[i])) <= 1e-12 * size


def test_a_small_mesh_in_a_large_scene():
    vertices, faces = hc.shapes.icosphere(8)
    rng = np.random.default_rng(12)
    points = rng.uniform(-1.5, 1.5, (300, 3))
    expected = detector((vertices, faces)).signed_distances(vertices, points, 0)
    far = [[1e9, 0, 0], [1e9, 1, 0], [1e9, 0, 1]]
    both = detector((vertices, faces), (far, [[0, 1, 2]]))
    positions = np.concatenate([vertices, far])
    signed = both.signed_distances(positions, points, "mesh0")
    assert np.array_equal(signed.distance, expected.distance) and np.array_equal(signed.faces, expected.faces)
    assert np.array_equal(both.winding_numbers(positions, points, 0)[0], expected.distance < 0)


def test_faces_are_numbered_in_the_scene():
    pair = detector((BOX, BOX_FACES), (BOX + 5, BOX_FACES))
    signed = pair.signed_distances(np.concatenate([BOX, BOX + 5]), [[0.0, 0, 0], [5, 5, 9]], "mesh1")
    assert (signed.faces >= 12).all() and (signed.distance > 0).all()


def test_closed():
    assert hc.closed(BOX_FACES) and not hc.closed(BOX_FACES[1:]) and not hc.closed([])
    assert not hc.closed([(0, 0, 0)]) and not hc.closed([(0, 0, 1), (2, 2, 2)])
    assert not hc.closed([(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 3, 2)])  # one face turned over
    assert not hc.closed(np.concatenate([BOX_FACES, BOX_FACES]))  # each edge in four faces
    assert hc.closed([*TETRAHEDRON.tolist(), (0, 0, 1)])


@pytest.mark.parametrize("query", ["winding_numbers", "signed_distances"])
def test_errors(query):
    ask = getattr(detector((BOX, BOX_FACES)), query)
    with pytest.raises(ValueError, match=r"mesh: no mesh is named 'mesh1'.*did you mean mesh0\?"):
        ask(BOX, [[0.0, 0, 0]], "mesh1")
    with pytest.raises(ValueError, match=r"points: expected shape \(K, 3\), got \(3,\); for one point"):
        ask(BOX, [0.0, 0, 0], 0)
    with pytest.raises(ValueError, match=r"points\[1, 2\] is NaN"):
        ask(BOX, [[0.0, 0, 0], [0, 0, math.nan]], 0)
    with pytest.raises(ValueError, match=r"points\[0, 0\] is 1e\+301, beyond 1e\+300"):
        ask(BOX, [[1e301, 0, 0]], 0)
    with pytest.raises(ValueError, match="'mesh0' is not closed: the edge between its vertices 0 and 1 is in one face"):
        getattr(detector((BOX[:3], [[0, 1, 2]])), query)(BOX[:3], [[0.0, 0, 0]], 0)
    turned = [*TETRAHEDRON[:3].tolist(), TETRAHEDRON[3][::-1].tolist()]
    with pytest.raises(ValueError, match="in the faces [0-2] and 3, which are oriented differently; reverse one"):
        getattr(detector((BOX[:4], turned)), query)(BOX[:4], [[0.0, 0, 0]], 0)
    with pytest.raises(ValueError, match="between its vertices 0 and 1 is in 3 faces; leave two of them"):
        getattr(detector((BOX[:5], [[0, 1, 2], [1, 0, 3], [0, 1, 4]])), query)(BOX[:5], [[0.0, 0, 0]], 0)
    with pytest.raises(TypeError, match="mesh: expected the name or number of a mesh, got ndarray"):
        ask(BOX, 0, BOX)
    for faces in (np.empty((0, 3), int), [[0, 0, 1]]):
        with pytest.raises(ValueError, match="'mesh0' has no faces"):
            getattr(detector((BOX, faces)), query)(BOX, [[0.0, 0, 0]], 0)
    with pytest.raises(ValueError, match=r"points: expected shape \(2, K, 3\), got \(4, 3\)"):
        worlds = detector((BOX, BOX_FACES), worlds=2)
        getattr(worlds, query)(np.stack([BOX, BOX]), np.zeros((4, 3)), 0)


def test_no_points():
    of_box = detector((BOX, BOX_FACES))
    assert of_box.winding_numbers(BOX, np.empty((0, 3)), 0)[0].shape == (0,)
    assert of_box.signed_distances(BOX, np.empty((0, 3)), 0).closest.shape == (0, 3)
