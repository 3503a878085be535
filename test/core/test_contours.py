# SPDX-License-Identifier: Apache-2.0
"""Intersection curves, what they enclose, and how they become shorter."""

import copy
import itertools
import pickle

import numpy as np
import pytest
import random_scenes

import hpccd_core as hc


def hits_of(vertices, *faces, outputs=("points", "directions"), **options):
    scene = hc.Scene()
    for i, mesh in enumerate(faces):
        scene.add_mesh(f"mesh{i}", mesh, n_vertices=len(vertices[i]))
    return hc.Detector(scene, outputs=outputs, **options).intersections(np.concatenate(vertices))


def torus(columns, rows, major=1.0, minor=0.3):
    u, v = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a, b = 2 * np.pi * u / columns, 2 * np.pi * v / rows
    ring = major + minor * np.cos(b)
    vertices = np.stack([ring * np.cos(a), ring * np.sin(a), minor * np.sin(b)], axis=2).reshape(-1, 3)
    number = np.arange(columns * rows).reshape(columns, rows)
    right, up = np.roll(number, -1, axis=0), np.roll(number, -1, axis=1)
    across = np.roll(right, -1, axis=1)
    lower, upper = np.stack([number, right, across], axis=2), np.stack([number, across, up], axis=2)
    return vertices, np.concatenate([lower.reshape(-1, 3), upper.reshape(-1, 3)])


def sheet(n, size=1.0, at=(0, 0, 0.0)):
    """A square around a point, in the plane z = 0."""
    vertices, faces = hc.shapes.grid(n, n)
    vertices = (vertices - vertices.min(axis=0)) / np.ptp(vertices, axis=0).max()
    return size * (vertices - [0.5, 0.5, 0]) + at, faces


def turned(vertices, seed=1):
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return vertices @ turn.T


# An independent computation: both triangles cut the line of their planes in an interval.


def _interval(triangle, n, offset, along):
    """Ends, along a direction, of what a plane cuts from a triangle; None if it does not cross it."""
    heights = triangle @ n - offset
    ends = []
    for i, j in ((0, 1), (1, 2), (2, 0)):
        if (heights[i] > 0) != (heights[j] > 0):
            p = triangle[i] + heights[i] / (heights[i] - heights[j]) * (triangle[j] - triangle[i])
            ends.append(p @ along)
    return sorted(ends) if ends else None


def length_of_triangle_pairs(vertices, faces, faces_b=None):
    """Of the segments in which triangles without a common vertex intersect; of one mesh or of two."""
    total = 0.0
    corners = vertices[faces]
    others = corners if faces_b is None else vertices[faces_b]
    normals = [np.cross(t[..., 1, :] - t[..., 0, :], t[..., 2, :] - t[..., 0, :]) for t in (corners, others)]
    for i, t in enumerate(corners):
        for j, u in enumerate(others):
            if faces_b is None and (j <= i or set(faces[i]) & set(faces[j])):
                continue
            n, m = normals[0][i], normals[1][j]
            along = np.cross(n, m)
            if not along.any():
                continue
            along /= np.linalg.norm(along)
            of_t, of_u = _interval(t, m, u[0] @ m, along), _interval(u, n, t[0] @ n, along)
            if of_t and of_u:
                total += max(0.0, min(of_t[1], of_u[1]) - max(of_t[0], of_u[0]))
    return total


def faces_of_edges(faces):
    found = {}
    for number, face in enumerate(faces):
        for v, w in itertools.combinations(sorted(set(map(int, face))), 2):
            found.setdefault((v, w), []).append(number)
    return found


def assert_contours(hits):
    """What must hold of every result."""
    contours = hits.contours()
    rows = np.concatenate([c.rows for c in contours]) if contours else np.empty(0, int)
    assert sorted(rows.tolist()) == list(range(len(hits))), "each row once"
    of_edge = faces_of_edges(hits.faces)
    pairs = [{tuple(sorted((t, int(f)))) for t in of_edge.get((int(a), int(b)), [])} for a, b, f in hits.ef]
    names = hits.layout.mesh_names
    size = 1e-12 * (1 + np.abs(hits.points).max(initial=0))
    for contour in contours:
        assert contour.points.tolist() == hits.points[contour.rows].tolist()
        nodes = []  # rows of one point
        for row in contour.rows.tolist():
            if nodes and np.abs(hits.points[row] - hits.points[nodes[-1][-1]]).max() < size:
                nodes[-1].append(row)
            else:
                nodes.append([row])
        neighbours = list(itertools.pairwise(nodes))
        if contour.closed:
            assert len(nodes) >= 3 and contour.rows[0] == contour.rows.min()
            neighbours.append((nodes[-1], nodes[0]))
        for one, other in neighbours:
            common = set().union(*(pairs[i] for i in one)) & set().union(*(pairs[i] for i in other))
            assert common, "neighbours share a pair of triangles, or a point"
        for mesh in (*hits.mesh_a[contour.rows], *hits.mesh_b[contour.rows]):
            assert names[mesh] in (contour.mesh_a, contour.mesh_b)
    assert [c.rows.min() for c in contours] == sorted(c.rows.min() for c in contours)
    return contours


def test_two_spheres_have_one_closed_contour():
    vertices, faces = hc.shapes.icosphere(4)
    hits = hits_of([turned(vertices), turned(vertices, 2) + [1.0, 0, 0]], faces, faces)
    (contour,) = assert_contours(hits)
    assert contour.closed and (contour.mesh_a, contour.mesh_b) == ("mesh0", "mesh1")
    assert contour.length == pytest.approx(2 * np.pi * np.sqrt(0.75), rel=0.02)
    (region,) = hits.regions()
    inside_a = np.linalg.norm(turned(vertices) - [1.0, 0, 0], axis=1) < 0.96
    assert set(np.flatnonzero(inside_a)) <= set(region.vertices_a.tolist())
    assert len(region.vertices_a) < len(vertices) / 3
    assert region.vertices_b.min() >= len(vertices)


def test_a_plane_cuts_a_torus_in_two_loops():
    vertices, faces = torus(48, 24)
    plane, plane_faces = sheet(6, 4.0)
    for axis, radii, inside in ((0, (0.3, 0.3), False), (2, (0.7, 1.3), False)):
        flat = np.roll(plane, axis + 1, axis=1) + np.array([0.01, 0.02, 0.03])
        hits = hits_of([vertices, flat], faces, plane_faces)
        contours = assert_contours(hits)
        assert [c.closed for c in contours] == [True, True]
        assert sorted(c.length for c in contours) == pytest.approx([2 * np.pi * r for r in radii], rel=0.03)
        # A ring around the torus does not divide it.
        assert all(len(r.vertices_a) == 0 for r in hits.regions()) == (not inside)


def test_a_torus_pushed_into_a_sheet():
    """A dent: the contour divides both."""
    vertices, faces = torus(48, 24)
    plane, plane_faces = sheet(60, 6.0, (0.03, 0.01, 0))
    standing = vertices[:, [0, 2, 1]] + [0, 0, 1.15]
    hits = hits_of([standing, plane], faces, plane_faces)
    (contour,), (region,) = assert_contours(hits), hits.regions()
    assert contour.closed
    assert region.vertices_a.tolist() == np.flatnonzero(standing[:, 2] < 0).tolist()
    x, y = plane[region.vertices_b - len(vertices)][:, :2].T
    assert len(x) and (np.hypot(np.hypot(x, 1.15) - 1, y) < 0.3).all()


def test_curves_of_open_sheets_end_at_borders():
    vertices, faces = sheet(7)
    across = vertices[:, [0, 2, 1]] + [0.3, 0.11, -0.4]
    hits = hits_of([vertices, across], faces, faces)
    (contour,) = assert_contours(hits)
    assert not contour.closed and contour.length == pytest.approx(0.7, rel=1e-9)
    ends = np.sort(contour.points[[0, -1], 0])
    assert ends == pytest.approx([-0.2, 0.5])
    assert [len(r.vertices_a) + len(r.vertices_b) for r in hits.regions()] == [0]


def test_a_cloth_that_intersects_itself():
    """The curve begins and ends where the cloth begins to intersect itself, at vertices of both sides: on the cloth it
    is one loop. (u, v) and (u, -v) meet where u^2 + v^2 = 1."""
    flat, faces = sheet(30, 3.0, (0.013, 0.007, 0))
    u, v = flat[:, 0], flat[:, 1]
    hits = hits_of([np.stack([u, v**2, v**3 + (u**2 - 1) * v], axis=1)], faces)
    (contour,), (region,) = assert_contours(hits), hits.regions()
    assert not contour.closed and (contour.mesh_a, contour.mesh_b) == ("mesh0", "mesh0")
    radius = np.hypot(u, v)
    assert set(np.flatnonzero(radius < 0.9)) <= set(region.vertices_a.tolist()) <= set(np.flatnonzero(radius < 1.1))
    assert region.vertices_b.tolist() == region.vertices_a.tolist()


def test_a_cloth_pushed_through_itself():
    """Two layers, one dented through the other: a closed contour, whose two sides are different loops."""
    flat, faces = sheet(40)
    x, y = flat[:, 0] + 0.0013, flat[:, 1] + 0.0007
    folded = np.where(x > 0, 0.0, np.pi)
    dent = 0.2 * np.exp(-((x - 0.25) ** 2 + y**2) / 0.01)
    vertices = np.stack([np.abs(x), y, 0.1 * np.sin(folded / 2) * np.tanh(20 * np.abs(x)) + (x > 0) * dent], axis=1)
    hits = hits_of([vertices], faces)
    (contour,), (region,) = assert_contours(hits), hits.regions()
    assert contour.closed
    dented = set(np.flatnonzero((x > 0) & (vertices[:, 2] > 0.1)).tolist())
    sides = [set(region.vertices_a.tolist()), set(region.vertices_b.tolist())]
    assert dented in sides and dented
    other = np.array(sorted(sides[1 - sides.index(dented)]))
    assert len(other) and (x[other] < 0).all()


@pytest.mark.parametrize("seed", range(6))
def test_lengths_of_tangled_cloth(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(9)
    vertices = turned(vertices + rng.normal(0, 0.12, vertices.shape))
    hits = hits_of([vertices], faces)
    contours = assert_contours(hits)
    assert sum(c.length for c in contours) == pytest.approx(length_of_triangle_pairs(vertices, faces), rel=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_lengths_of_two_tangled_meshes(seed):
    rng = np.random.default_rng(seed)
    (flat, faces), (ball, ball_faces) = sheet(8), hc.shapes.icosphere(3)
    flat, ball = (mesh + rng.normal(0, 0.05, mesh.shape) for mesh in (flat, ball))
    flat, ball = turned(flat, seed), 0.4 * turned(ball)
    scene = hc.Scene()
    scene.add_mesh("flat", faces, self_collision=False)
    scene.add_mesh("ball", ball_faces, self_collision=False)
    both = np.concatenate([flat, ball])
    hits = hc.Detector(scene, outputs=("points",)).intersections(both)
    length = length_of_triangle_pairs(both, faces, ball_faces + len(flat))
    assert sum(c.length for c in assert_contours(hits)) == pytest.approx(length, rel=1e-9)


@pytest.mark.parametrize("generate", random_scenes.ALL)
def test_every_row_is_in_one_contour(generate):
    """Degenerate scenes too: coplanar, through vertices and edges, repeated vertices, edges of many faces."""
    for seed in range(4):
        meshes = generate(np.random.default_rng(seed))
        hits = hc.Detector(meshes.scene(), outputs=("points",)).intersections(meshes.vertices_t1)
        contours = hits.contours()
        rows = np.concatenate([c.rows for c in contours]) if contours else np.empty(0, int)
        assert sorted(rows.tolist()) == list(range(len(hits)))
        regions = hits.regions()
        assert len(regions) == len(contours)
        for contour, region in zip(contours, regions, strict=True):
            for name, vertices in ((contour.mesh_a, region.vertices_a), (contour.mesh_b, region.vertices_b)):
                first, last = hits.layout.vertex_offsets[hits.layout.mesh_names.index(name) :][:2]
                assert ((first <= vertices) & (vertices < last)).all()
                assert (np.diff(vertices.astype(int)) > 0).all()


def test_a_box_that_stands_on_a_table():
    """Coplanar faces: the outline of the overlap is a closed contour; points inside it are contours of one point."""
    box, box_faces = hc.shapes.box()
    table, table_faces = sheet(3, 4.0)
    box = box - [0, 0, box[:, 2].min()] + [0.2, 0.1, 0]
    hits = hits_of([box, table], box_faces, table_faces)
    contours = assert_contours(hits)
    closed = [c for c in contours if c.closed]
    assert len(closed) == 1 and closed[0].length == pytest.approx(4)
    assert all(c.length == 0 for c in contours if not c.closed)


@pytest.mark.parametrize("at", [(0.5, 0.5), (1 / 3, 0.5), (0.0, 0.0)])
def test_through_vertices_and_edges(at):
    """A ring whose edges pass through vertices and edges of a lattice: one closed contour."""
    table, table_faces = sheet(12, 4.0)
    vertices, faces = hc.shapes.box()
    box = vertices - vertices.mean(axis=0) + [*at, 0.1]
    hits = hits_of([box, table], faces, table_faces)
    (contour,) = assert_contours(hits)
    assert contour.closed and contour.length == pytest.approx(4)
    (region,) = hits.regions()
    below = np.flatnonzero(box[:, 2] < 0).tolist()
    assert region.vertices_a.tolist() in (below, np.flatnonzero(box[:, 2] > 0).tolist())
    inside = (np.abs(table[:, :2] - at) < 0.5 - 1e-9).all(axis=1)
    assert region.vertices_b.tolist() == (len(box) + np.flatnonzero(inside)).tolist()


def test_the_order_does_not_depend_on_threads():
    rng = np.random.default_rng(2)
    vertices, faces = sheet(12)
    vertices = vertices + rng.normal(0, 0.1, vertices.shape)
    results = [hits_of([vertices], faces, threads=n) for n in (1, 3)]
    assert results[0].contours() == results[1].contours() and results[0].regions() == results[1].regions()


def test_copies_keep_their_contours():
    vertices, faces = hc.shapes.icosphere(2)
    hits = hits_of([turned(vertices), turned(vertices, 2) + [1.0, 0, 0]], faces, faces)
    for other in (pickle.loads(pickle.dumps(hits)), copy.deepcopy(hits), hits.world(0)):
        assert other == hits and other.contours() == hits.contours()
    assert repr(hits.contours()[0]).startswith("Contour(mesh0 and mesh1, ")


# Directions.


def length_of(hits):
    return sum(contour.length for contour in hits.contours())


def displacements(hits, vertices, faces):
    """Of all vertices, by half the direction at each point: of the edge along it, of the face against it."""
    moved, g = np.zeros_like(vertices), hits.directions / 2
    s = hits.edge_parameters[:, None]
    np.add.at(moved, hits.ef[:, 0], (1 - s) * g)
    np.add.at(moved, hits.ef[:, 1], s * g)
    for k in range(3):
        np.add.at(moved, faces[hits.ef[:, 2], k], -hits.weights[:, k, None] * g)
    return moved


@pytest.mark.parametrize("seed", range(4))
def test_directions_are_the_derivative_of_the_length(seed):
    """By finite differences, with random displacements of the vertices of one edge and of the face that it crosses. The
    other points of the curve move too: the sum over all of them is the derivative."""
    rng = np.random.default_rng(seed)
    (flat, faces), (ball, ball_faces) = sheet(8), hc.shapes.icosphere(3)
    vertices = np.concatenate([flat + rng.normal(0, 0.02, flat.shape), 0.3 * turned(ball) + [0, 0, 0.1]])
    scene = hc.Scene()
    scene.add_mesh("flat", faces), scene.add_mesh("ball", ball_faces)
    detector = hc.Detector(scene, outputs=("points", "directions"))
    hits = detector.intersections(vertices)
    length, h = length_of(hits), 1e-7
    # A relative translation of both meshes: each point's edge moves by +-D/2, its face by -+D/2.
    d = rng.normal(size=3)
    sign = np.where(hits.mesh_a == 1, 1.0, -1.0)
    moved = vertices + h * np.where(np.arange(len(vertices)) < len(flat), -0.5, 0.5)[:, None] * d
    slope = (length_of(detector.intersections(moved)) - length) / h
    assert slope == pytest.approx(-0.5 * float(sign @ (hits.directions @ d)), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_moving_along_directions_shortens_the_curve(seed):
    rng = np.random.default_rng(seed)
    vertices, faces = sheet(9)
    vertices = turned(vertices + rng.normal(0, 0.1, vertices.shape), seed)
    scene = hc.Scene()
    scene.add_mesh("cloth", faces)
    detector = hc.Detector(scene, outputs=("points", "directions"))
    hits = detector.intersections(vertices)
    moved = displacements(hits, vertices, hits.faces)
    step = 1e-7 / np.abs(moved).max()
    assert length_of(detector.intersections(vertices + step * moved)) < length_of(hits)
