# SPDX-License-Identifier: Apache-2.0
"""The oracles of inside, separation and depth against closed forms and invariances."""

from fractions import Fraction

import numpy as np
import oracle
import pytest
from fuzz.solid_scenes import TRANSLATION_SCENES, lattice, shaped

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4)]
CUBE = np.array([*CUBE, (1, 5, 7), (1, 7, 3)])
TETRAHEDRON = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def box(low, high):
    return np.asarray(low) + CORNERS * (np.asarray(high, float) - low), CUBE


def joined(*meshes):
    starts = np.cumsum([0, *(len(v) for v, _ in meshes)])
    faces = [f + start for (_, f), start in zip(meshes, starts, strict=False)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def grid(n, step=1.0):
    return step * np.stack(np.meshgrid(*[np.arange(n)] * 3), axis=-1).reshape(-1, 3) - step


def test_closed():
    assert oracle.closed(CUBE) and oracle.closed(TETRAHEDRON) and oracle.closed(CUBE[:, ::-1])
    assert not oracle.closed(CUBE[1:])
    assert not oracle.closed(np.vstack([CUBE[:1, ::-1], CUBE[1:]]))
    assert not oracle.closed(np.vstack([CUBE, CUBE])) and not oracle.closed([(0, 1, 2), (0, 1, 2)])


def test_boxes_in_boxes_on_a_grid():
    """Each box adds one inside of it, an inverted one takes one away; points on vertices, edges and faces."""
    outer, inner, hole = box((0, 0, 0), (6, 6, 6)), box((2, 1, 1), (5, 5, 5)), box((3, 2, 2), (4, 4, 4))
    mesh = joined(outer, inner, (hole[0], CUBE[:, ::-1]), (hole[0], CUBE[:, ::-1]))
    points = grid(17, 0.5)
    expected, on = np.zeros(len(points), int), np.zeros(len(points), bool)
    for (vertices, _), sign in ((outer, 1), (inner, 1), (hole, -2)):
        low, high = vertices[0], vertices[7]
        expected += sign * ((points > low) & (points < high)).all(axis=1)
        on |= ((points >= low) & (points <= high)).all(axis=1) & ((points == low) | (points == high)).any(axis=1)
    numbers, on_surface = oracle.winding_numbers(mesh, points)
    assert np.array_equal(on_surface, on)
    assert np.array_equal(numbers, np.where(on, 0, expected))
    assert set(numbers) == {0, 1, 2}


@pytest.mark.parametrize("scale", [1.0, 2.0**-1060, 2.0**1000])
def test_winding_numbers_agree_with_solid_angles(scale):
    """Of closed meshes that intersect themselves: the sum of the solid angles (van Oosterom, Strackee 1983)."""
    rng = np.random.default_rng(7)
    for _ in range(20):
        mesh = joined(*((rng.normal(size=(4, 3)), TETRAHEDRON[:, :: rng.choice([1, -1])]) for _ in range(4)))
        points = rng.normal(size=(50, 3))
        a, b, c = (mesh[0][mesh[1][:, i]] - points[:, None] for i in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
        ab, bc, ca = ((x * y).sum(-1) for x, y in ((a, b), (b, c), (c, a)))
        triple = (a * np.cross(b, c)).sum(-1)
        angle = 2 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb)
        numbers, on_surface = oracle.winding_numbers((scale * mesh[0], mesh[1]), scale * points)
        # Scaled down, the coordinates keep about ten bits: some points are on the other side then.
        if scale > 1e-300:
            assert np.array_equal(numbers, np.rint(angle.sum(axis=1) / (4 * np.pi))) and not on_surface.any()
            assert len(set(numbers)) > 1


def test_contained_by_components_and_only_in_closed_meshes():
    shell, far = box((0, 0, 0), (9, 9, 9)), box((20, 0, 0), (21, 1, 1))
    two, lid = joined(box((1, 1, 1), (2, 2, 2)), far), (shell[0] + 0.5, CUBE[1:])
    inside = oracle.contained([shell, two, lid, (np.full((1, 3), 4.5), np.empty((0, 3), int))])
    assert np.argwhere(inside).tolist() == [[1, 0], [2, 0], [3, 0]]


def test_translations_of_boxes():
    """Boxes with integer corners: separation along axes and diagonals is the least over the axes, zero where apart."""
    rng = np.random.default_rng(3)
    pairs, directions, expected = [], [], []
    for _ in range(300):
        (a0, b0), (a, b) = rng.integers(0, 5, (2, 3)), rng.integers(1, 6, (2, 3))
        d = rng.integers(-2, 3, 3)
        if not d.any():
            continue
        leave = [(b0 + b - a0)[i] / d[i] if d[i] > 0 else (b0 - a0 - a)[i] / d[i] for i in range(3) if d[i]]
        enter = [(b0 - a0 - a)[i] / d[i] if d[i] > 0 else (b0 + b - a0)[i] / d[i] for i in range(3) if d[i]]
        meet = ((a0 <= b0 + b) & (b0 <= a0 + a))[d == 0].all() and max(enter) <= 0 <= min(leave)
        pairs.append((box(a0, a0 + a), box(b0, b0 + b)))
        directions.append(d)
        expected.append(min(leave) * np.linalg.norm(d) if meet else 0.0)
    found = oracle.separating_translations(pairs, directions)
    assert found == pytest.approx(expected, rel=1e-15)
    assert 0 < (found == 0).sum() < len(found)
    doubled = oracle.separating_translations(pairs, np.array(directions) * 2.0**-1070)
    assert np.array_equal(found, doubled)


def test_translation_out_of_a_shell_and_through_a_hole():
    small = box((1, 1, 1), (2, 2, 2))
    shell, (corners, faces) = box((0, 0, 0), (10, 10, 10)), box((0, 0, 0), (10, 10, 10))
    open_shell = corners, np.array([f for f in faces if not (corners[f][:, 2] == 10).all()])
    ends = [(small, shell), (small, open_shell), (shell, small), (open_shell, small)]
    up, down = (0, 0, 3), (0, 0, -1)
    assert oracle.separating_translations(ends, [up] * 4).tolist() == [9, 0, 2, 0]
    across = box((1, 1, -1), (2, 2, 1))  # in the bottom of the open shell, at s = 1 above it, and out at the top
    assert oracle.separating_translations([(across, open_shell), (across, shell)], [up, up]).tolist() == [1, 11]
    assert oracle.separating_translations([(across, open_shell)], [down]).tolist() == [1]


def test_depths_of_boxes_and_their_images():
    rng = np.random.default_rng(5)
    a, b = box((0, 0, 0), (4, 4, 4)), box((3, 2, -9), (9, 9, 9))
    assert oracle.convex_depths([(a, b), (b, a)]).tolist() == [1, 1]
    assert oracle.convex_depths([(a, box((4, 0, 0), (5, 1, 1))), (a, box((5, 0, 0), (6, 1, 1)))]).tolist() == [0, 0]
    diamond = CORNERS @ np.array([[1, 1, 0], [-1, 1, 0], [0, 0, 1]]) - (0.5, 0, 0)  # its lower right side: x - y = -0.5
    assert oracle.convex_depths([(box((0, 0, 0), (1, 1, 1)), (diamond, CUBE))])[0] == pytest.approx(0.5 / np.sqrt(2))
    for _ in range(50):  # two tetrahedra far from the grid: integers of any size
        v, w = rng.normal(size=(2, 4, 3))
        pair = (v, TETRAHEDRON), (w, TETRAHEDRON)
        depth = oracle.convex_depths([pair])[0]
        directions = rng.normal(size=(2000, 3))
        overlap = (directions @ w.T).max(axis=1) - (directions @ v.T).min(axis=1)
        shortest = (overlap / np.linalg.norm(directions, axis=1)).min()
        assert depth == 0 or depth <= shortest <= depth + 0.2
        assert (depth == 0) >= (shortest < 0)
        short = [(np.round(x * 256) / 256, TETRAHEDRON) for x in (v, w)]
        assert oracle.convex_depths([short])[0] == pytest.approx(
            oracle.convex_depths([[(x * 3 * 2.0**40 + 2.0**45, f) for x, f in short]])[0] / (3 * 2.0**40), rel=1e-12
        )


def test_depth_is_the_least_separating_translation():
    rng = np.random.default_rng(9)
    pairs = [tuple((rng.integers(-8, 9, (4, 3)).astype(float), TETRAHEDRON) for _ in range(2)) for _ in range(60)]
    depths = oracle.convex_depths(pairs)
    touching = [i for i, pair in enumerate(pairs) if depths[i] > 0]
    assert 6 < len(touching) < 57
    for i in touching:
        (v, f), (w, g) = pairs[i]
        sides = [np.cross(x[h[:, 1]] - x[h[:, 0]], x[h[:, 2]] - x[h[:, 0]]) for x, h in ((v, f), (w, g))]
        along = [np.array([x[i] - x[j] for i in range(4) for j in range(i)]) for x in (v, w)]
        normals = np.vstack([*sides, np.cross(along[0][:, None], along[1][None]).reshape(-1, 3)])
        normals = normals[normals.any(axis=1)]
        normals = np.vstack([normals, -normals])
        least = oracle.separating_translations([pairs[i]] * len(normals), normals).min()
        if all(np.linalg.det(x[1:] - x[0]) != 0 for x in (v, w)):
            assert least == pytest.approx(depths[i], rel=1e-14)


def test_points_of_edges_and_faces():
    """Against the equations of edge and face, and against whether they share a point at all."""
    rng = np.random.default_rng(11)
    points = rng.integers(-3, 4, (20000, 5, 3)).astype(float)
    points[:2000, :, 2] = 0
    t, weights, place = oracle.edge_face_points(points)
    hit = oracle.edge_face_intersect(points)
    assert np.array_equal(np.isfinite(t), hit) and 1000 < hit.sum() < 19000
    p, q, *corners = (points[hit, i] for i in range(5))
    t, weights, place = t[hit], weights[hit], place[hit]
    assert ((t >= 0) & (t <= 1)).all()
    assert np.abs(p + t[:, None] * (q - p) - place).max() < 1e-14
    flat = np.isnan(weights).any(axis=1)
    assert 0 < flat.sum() < len(flat)
    assert (weights[~flat] >= 0).all()
    assert np.abs(sum(weights[:, i, None] * corners[i] for i in range(3)) - place)[~flat].max() < 1e-14
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    coplanar = ((normal * (p - corners[0])).sum(1) == 0) & ((normal * (q - p)).sum(1) == 0) & ~flat & (p != q).any(1)
    assert coplanar.sum() > 100
    just_before = t[coplanar] > 0  # nothing of the face is on the edge before
    short = points[hit][coplanar][just_before]
    short[:, 1] = short[:, 0] + (t[coplanar][just_before] * (1 - 1e-9))[:, None] * (short[:, 1] - short[:, 0])
    assert not oracle.edge_face_intersect(short).any()


def test_point_of_an_edge_and_a_face_rounds_once():
    points = [[(0, 0, -1), (1, 0, 2), (-1, -1, 0), (2, 0, 0), (0, 3, 0)]]
    t, weights, place = oracle.edge_face_points(points)
    third = float(Fraction(1, 3))
    assert t[0] == third and place[0].tolist() == [third, 0, 0]
    # x = third = -w0 + 2 w1, 0 = -w0 + 3 w2, w0 + w1 + w2 = 1
    w0 = Fraction(5, 11)
    assert weights[0].tolist() == [float(w0), float((w0 + Fraction(1, 3)) / 2), float(w0 / 3)]


def is_free(a, b):
    faces = [a[1], b[1]]
    hits = oracle.intersections(np.concatenate([a[0], b[0]]), faces, n_vertices=[len(a[0]), len(b[0])],
                                no_self_collision=[0, 1], threads=1)  # fmt: skip
    return not len(hits) and not oracle.contained([a, b], threads=1).any()


@pytest.mark.parametrize("kind", TRANSLATION_SCENES)
def test_translations_are_the_least_free_ones(kind):
    """No multiple of 1/8 below is free, and the next number above is, where no interval begins at once."""
    rng = np.random.default_rng(13)
    faces, rest = TRANSLATION_SCENES[kind]
    free_above, away = [], 0
    for _ in range(12):
        a, b = ((rng.choice([lattice, shaped])(rng, points, 1)[0], f) for points, f in zip(rest, faces, strict=True))
        d = np.roll((1.0, 0, 0), rng.integers(3))
        least = oracle.separating_translations([(a, b)], d)[0]
        assert not any(is_free((a[0] + s * d, a[1]), b) for s in np.arange(0, least, 0.125))
        above = np.ceil(least * 2**12 + 0.5) / 2**12
        free_above.append(is_free((a[0] + above * d, a[1]), b))
        away += least > 0
    assert away >= 2
    assert np.mean(free_above) >= 0.8
