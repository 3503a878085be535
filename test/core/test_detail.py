# SPDX-License-Identifier: Apache-2.0
"""Detection on coarse faces: the bound in rationals, and every contact of the full meshes under the promise."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from fuzz import detail as fuzz

import hpccd_core as hc
from hpccd_core import _core

pytest.importorskip("fast_simplification")


def bumpy(rng, n, size, height):
    """A grid with bumps, whose corners are at the origin and at (size, size)."""
    vertices, faces = hc.shapes.grid(n, n)
    vertices = (vertices - vertices.min(axis=0)) / np.ptp(vertices[:, 0]) * size
    vertices[:, 2] = rng.normal(size=len(vertices)) * height
    return vertices, np.array(faces)


def ball(rng, frequency, radius, height):
    vertices, faces = hc.shapes.icosphere(frequency)
    vertices = np.array(vertices, float)
    return vertices * (radius + rng.normal(size=(len(vertices), 1)) * height), np.array(faces)


def turned(rng, vertices):
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return vertices @ matrix.T


def exact(x):
    return [Fraction(float(c)) for c in x]


def test_deviations_are_bounds_in_rational_numbers():
    rng = np.random.default_rng(45)
    threads = _core.DetailThreads(2)
    for scale, dtype in ((1.0, np.float64), (1e-160, np.float64), (1e140, np.float64), (1.0, np.float32)):
        rest, faces = bumpy(rng, 9, 1.0, 0.02)
        faces = faces.astype(np.uint32)
        proposal = hc.detail_levels.propose(faces, rest, 0.15)
        mesh = _core.CoarseMesh(faces, proposal.faces, proposal.survivor, rest, threads)
        moved = (scale * (rest + rng.normal(size=rest.shape) * 0.1)).astype(dtype)
        # Huge coordinates are measured only after a check, which returns the largest one.
        huge = scale > 1e75
        assert not huge or mesh.deviations(moved, 0, None, np.inf, threads) is None
        bounds = mesh.deviations(moved, 0, float(np.abs(moved).max()) if huge else None, np.inf, threads)
        x = [exact(row) for row in moved]
        worst = [Fraction(0)] * len(bounds)
        of_edge = {}
        for c, face in enumerate(mesh.faces.tolist()):
            for edge in edges(face):
                of_edge.setdefault(edge, []).append(c)
        in_faces, on_edges = mesh.mapped

        def square(v, w, s, corners, weights, x=x):
            point, image = blend((v, w), (1 - Fraction(s), Fraction(s)), x), blend(corners, weights, x)
            return sum((a - b) ** 2 for a, b in zip(point, image, strict=True))

        for c, v, w, s, b1, b2 in in_faces.tolist():
            weights = (1 - Fraction(b1) - Fraction(b2), Fraction(b1), Fraction(b2))
            assert min(weights) >= 0
            found = square(int(v), int(w), s, mesh.faces[int(c)].tolist(), weights)
            worst[int(c)] = max(worst[int(c)], found)
        for a, b, v, w, s, r in on_edges.tolist():
            found = square(int(v), int(w), s, (int(a), int(b)), (1 - Fraction(r), Fraction(r)))
            for c in of_edge[int(a), int(b)]:
                worst[c] = max(worst[c], found)
        slack = Fraction(float(np.abs(moved).max())) / 10**14
        for bound, square_of in zip(bounds.tolist(), worst, strict=True):
            assert square_of <= Fraction(bound) ** 2
            assert (
                bound == 0
                or (Fraction(bound) - slack - Fraction(2) ** -530) ** 2 <= square_of * (1 + Fraction(1, 10**9))
                or Fraction(bound) <= 2 * slack + Fraction(2) ** -530
            )


def blend(vertices, weights, x):
    return [sum(w * x[v][k] for v, w in zip(vertices, weights, strict=True)) for k in range(3)]


def test_pieces_cover_each_face():
    """The area of the triangles between listed corners is at least that of the face; each has corners in its patch."""
    rng = np.random.default_rng(1)
    threads = _core.DetailThreads(1)
    for rest, faces in (bumpy(rng, 12, 1.0, 0.05), ball(rng, 6, 1.0, 0.05)):
        faces = faces.astype(np.uint32)
        proposal = hc.detail_levels.propose(faces, rest, 0.1)
        mesh = _core.CoarseMesh(faces, proposal.faces, proposal.survivor, rest, threads)
        assert len(mesh.faces) <= 0.2 * len(faces)
        in_faces, on_edges = mesh.mapped
        points = {c: {(v, v, 0.0) for v in corners} for c, corners in enumerate(mesh.faces.tolist())}
        for c, v, w, s, *_ in in_faces.tolist():
            points[int(c)].add((int(v), int(w), s))
        for a, b, v, w, s, _ in on_edges.tolist():
            for c, corners in enumerate(mesh.faces.tolist()):
                if (int(a), int(b)) in edges(corners):
                    points[c].add((int(v), int(w), s))
        of_face = {}
        for c, f in mesh.held.tolist():
            of_face.setdefault(f, []).append(c)
        for f, corners in enumerate(faces.tolist()):
            area = 0.0
            for c in of_face[f]:
                inside = [barycentric(corners, p) for p in points[c] if {p[0], p[1]} <= set(corners)]
                area += area_of_hull(np.array(inside))
            assert area >= 0.5 - 1e-6  # of the triangle (0, 0), (1, 0), (0, 1)


def barycentric(corners, point):
    v, w, s = point
    x = np.zeros(3)
    x[corners.index(v)] += 1 - s
    x[corners.index(w)] += s
    return x[1:]


def area_of_hull(points):
    """Of points around a convex polygon, by their angle."""
    if len(points) < 3:
        return 0.0
    centre = points.mean(axis=0)
    order = np.argsort(np.arctan2(*(points - centre).T[::-1]))
    x, y = points[order].T
    return abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def covered(scene, detector, full, found, check):
    """The contacts of the full meshes for which no pair of features of the two coarse faces is reported in time."""
    core = detector._core
    coarse = core._last
    held_by = {}
    for mesh, level in zip(core.meshes, coarse.levels, strict=True):
        begin = coarse.face_slices[mesh.number].start
        first = scene.face_offset(mesh.number)
        held = np.arange(len(mesh.faces)).repeat(2).reshape(-1, 2) if level is None else level.held
        for c, f in held.tolist():
            held_by.setdefault(first + f, set()).add(begin + c)
    faces, all_faces = detector.faces.tolist(), scene_faces(scene)
    by_vertex, by_edge = {}, {}
    for f, corners in enumerate(all_faces):
        for k in range(3):
            by_vertex.setdefault(corners[k], []).append(f)
            by_edge.setdefault(tuple(sorted((corners[k], corners[k - 1]))), []).append(f)
    reported = {}

    def note(kind, key, toc):
        reported[kind, key] = min(toc, reported.get((kind, key), 2.0))

    for row, toc in zip(found.vf.tolist(), found.vf_toc, strict=True):
        note("vf", tuple(row), toc)
    for row, toc in zip(found.ee.tolist(), found.ee_toc, strict=True):
        note("ee", tuple(row), toc)
    for row in found.ef.tolist():
        note("ef", tuple(row), 0.0)

    def earliest(p, q):
        """Of the rows with one side in coarse face p and the other in q."""
        best = 2.0
        for a, b in ((p, q), (q, p)):
            for v in faces[a]:
                best = min(best, reported.get(("vf", (v, b)), 2.0))
            for e in edges(faces[a]):
                best = min(best, reported.get(("ef", (*e, b)), 2.0))
                for o in edges(faces[b]):
                    best = min(best, reported.get(("ee", (*min(e, o), *max(e, o))), 2.0))
        return best

    holders = {}  # of each vertex of the full meshes
    for f, corners in enumerate(all_faces):
        for v in corners:
            holders.setdefault(v, set()).update(held_by[f])

    def neighbours(p, q):
        if p == q or set(faces[p]) & set(faces[q]):
            return True
        return any(p in held and q in held for held in holders.values())

    n = 0
    rows = [(by_vertex.get(v, []), [f], t) for (v, f), t in zip(full.vf.tolist(), full.vf_toc, strict=True)]
    rows += [
        (by_edge[tuple(r[:2])], by_edge[tuple(r[2:])], t) for r, t in zip(full.ee.tolist(), full.ee_toc, strict=True)
    ]
    for side_a, side_b, toc in rows:
        for a in side_a:
            for b in side_b:
                pairs = list(itertools.product(held_by[a], held_by[b]))
                if not any(neighbours(p, q) for p, q in pairs):
                    assert min(earliest(p, q) for p, q in pairs) <= toc + 1e-12, (check, pairs, toc)
                    n += 1
    return n


def edges(face):
    return [tuple(sorted((face[k], face[k - 1]))) for k in range(3)]


def scene_faces(scene):
    return hc.Detector(scene, threads=1, backend="cpu").faces.tolist()


@pytest.mark.parametrize("seed", range(12))
def test_every_contact_between_meshes_has_its_pair(seed):
    rng = np.random.default_rng(seed)
    scene = hc.Scene()
    separation = float(rng.choice([0, 0.01, 0.05]))
    thick = seed % 3 == 0
    bodies = []
    for k in range(3):
        make = bumpy(rng, 6, 1.0, 0.05) if k % 2 else ball(rng, 3, 0.5, 0.02)
        vertices, faces = turned(rng, make[0]), make[1]
        thickness = rng.random(len(faces)) * 0.05 if thick else 0.0
        scene.add_mesh(f"body {k}", faces, n_vertices=len(vertices), self_collision=bool(seed % 2), thickness=thickness)
        bodies.append(vertices + rng.normal(size=3) * 0.3)
    options = {"threads": 1 + seed % 2, "backend": "cpu", "minimum_separation": separation}
    detector = hc.Detector(scene, detail={"body 0": 0.15, "body 1": {"error": 0.1}}, **options)
    full = hc.Detector(scene, **options)
    n = 0
    for step in range(4):
        start = np.concatenate(bodies)
        bodies = [b + rng.normal(size=3) * 0.2 + rng.normal(size=b.shape) * 0.01 for b in bodies]
        end = np.concatenate(bodies)
        if seed % 4 == 1:
            start, end = start.astype(np.float32), end.astype(np.float32)
        found = detector.detect(start, end)
        n += covered(scene, detector, full.detect(start, end), found, (seed, step))
        assert len(found.bounds) == len(found) - len(found.ef)
        assert found == detector.detect(start, end)
    assert n > 0


def two_bodies(rng, **options):
    """A bumpy sheet in motion towards a ball: scene, start and end."""
    scene = hc.Scene()
    sheet, faces = bumpy(rng, 12, 2.0, 0.02)
    ball_vertices, ball_faces = ball(rng, 6, 0.5, 0.01)
    scene.add_mesh("sheet", faces, n_vertices=len(sheet), **options)
    scene.add_mesh("ball", ball_faces, n_vertices=len(ball_vertices), **options)
    start = np.concatenate([sheet - [1, 1, 0] + [0, 0, 1.0], ball_vertices])
    end = start + rng.normal(size=start.shape) * 0.01
    end[: len(sheet), 2] -= 0.6
    return scene, start, end


@pytest.mark.parametrize("detail", [0.2, {"sheet": {"error": 0.03}}, {"ball": {"error": 0.0}}])
def test_steps_and_distances_are_conservative(detail):
    for seed in range(6):
        scene, start, end = two_bodies(np.random.default_rng(seed), self_collision=False)
        coarse, full = hc.Detector(scene, detail=detail), hc.Detector(scene)
        for k in range(4):
            to = start + (end - start) * k / 3
            step = coarse.collision_free_step(start, to)
            assert step <= full.collision_free_step(start, to)
            below, true = coarse.distances(to), full.distances(to)
            assert [(g.mesh_a, g.mesh_b) for g in below] == [(g.mesh_a, g.mesh_b) for g in true]
            assert all(a.distance <= b.distance + 1e-12 for a, b in zip(below, true, strict=True))
        assert coarse.collision_free_step(start, start) == 1


def test_a_call_depends_on_its_arguments_only():
    scene, start, end = two_bodies(np.random.default_rng(7), self_collision=False)
    detail = {
        "sheet": {"error": 0.03, "rest_vertices": start[:169]},
        "ball": {"ratio": 0.2, "rest_vertices": start[169:]},
    }
    frames = [start, end, 2 * end - start, start, end]
    stepping = hc.Detector(scene, detail=detail, threads=2)
    for before, after in zip([None, *frames], frames, strict=False):
        stepped = stepping.step(after)
        if before is not None:
            alone = hc.Detector(scene, detail=detail, threads=1).detect(before, after)
            assert stepped == alone
            assert stepped.hash == alone.hash and np.array_equal(stepped.bounds, alone.bounds)


def test_an_error_is_kept_and_the_mesh_itself_is_the_last_resort():
    scene, start, end = two_bodies(np.random.default_rng(3), self_collision=False)
    full = hc.Detector(scene).detect(start, end)
    sizes = []
    for error in (1.0, 0.05, 0.02, 0.0):
        detector = hc.Detector(scene, detail={"sheet": {"error": error}})
        found = detector.detect(start, end)
        assert found.bounds.max(initial=0) <= error * (1 + 1e-15)
        sizes.append(len(detector.faces))
    assert sizes == sorted(sizes) and sizes[0] < sizes[-1] == scene.n_faces
    assert np.array_equal(found.vf, full.vf) and np.array_equal(found.ee_toc, full.ee_toc)


def test_reports_of_the_earliest_and_of_any_contact():
    scene, start, end = two_bodies(np.random.default_rng(5), self_collision=False)
    every = hc.Detector(scene, detail=0.2, outputs=("points", "weights")).detect(start, end)
    assert len(every) > 1 and every.points.shape == (len(every) - len(every.ef), 3)
    first = hc.Detector(scene, detail=0.2, report="first").detect(start, end)
    assert first.first_toc == every.first_toc and np.all(first.vf_toc == first.first_toc) and len(first)
    assert len(hc.Detector(scene, detail=0.2, report="any").detect(start, end)) >= 1
    crossing = start.copy()
    crossing[:169, 2] -= 1
    for report in ("all", "first", "any"):
        found = hc.Detector(scene, detail=0.2, report=report).detect(crossing, crossing)
        assert len(found.ef) and found.first_toc == 0
        assert len(found.mesh_a) == len(found.local_b) == len(found)
    assert hc.Detector(scene, detail=0.2).collision_free_step(crossing, crossing) == 0


def test_faces_within_coarse_meshes_are_refined():
    rng = np.random.default_rng(2)
    scene, start, end = two_bodies(rng)
    start[:13] += [0, 0.5, 0.2]  # the hem is folded over and passes through the sheet
    end[:13] += [0, 0.5, -0.2]
    full = hc.Detector(scene).detect(start, end)
    within = full.mesh_a == full.mesh_b
    assert within.any()
    detector = hc.Detector(scene, detail=0.2, refine="neighbours")
    found = detector.detect(start, end)
    names = {
        (tuple(sorted(detector.faces[f].tolist())), v, t)
        for (v, f), t in zip(found.vf.tolist(), found.vf_toc, strict=True)
    }
    faces = scene_faces(scene)
    n = len(full.vf)
    for (v, f), t, inside in zip(full.vf.tolist(), full.vf_toc, within[:n], strict=True):
        if inside:
            assert (tuple(sorted(faces[f])), v, t) in names
    rows = {tuple(r) for r in found.ee.tolist()}
    assert all(tuple(r) in rows for r, inside in zip(full.ee.tolist(), within[n:], strict=True) if inside)
    assert set(found.mesh_b.tolist()) <= {0, 1}
    assert np.array_equal(np.lexsort(found.vf.T[::-1]), np.arange(len(found.vf)))
    assert detector.collision_free_step(start, end) <= hc.Detector(scene).collision_free_step(start, end)
    assert {(g.mesh_a, g.mesh_b) for g in detector.distances(start)} >= {("sheet", "sheet"), ("ball", "ball")}


def test_components_and_odd_meshes():
    """Tetrahedra, doubled and degenerate faces, edges and points beside faces: all stay covered."""
    rng = np.random.default_rng(9)
    tetrahedron = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * 0.2
    corners = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    vertices = np.concatenate([tetrahedron + rng.normal(size=3) * 0.4 for _ in range(30)])
    faces = np.concatenate([corners + 4 * k for k in range(30)])
    faces = np.concatenate([faces, faces[:3], [[0, 0, 1], [5, 5, 5]]])
    more = np.concatenate([vertices, rng.normal(size=(6, 3)) * 0.4])
    scene = hc.Scene()
    scene.add_mesh("odd", faces, n_vertices=len(more), edges=[[120, 121], [121, 122], [0, 1]], self_collision=False)
    wall, wall_faces = bumpy(rng, 8, 2.0, 0.01)
    scene.add_mesh("wall", wall_faces, n_vertices=len(wall))
    start = np.concatenate([more, wall - [1, 1, 1]])
    end = start.copy()
    end[: len(more), 2] -= 1
    detector, full = hc.Detector(scene, detail={"odd": 0.1, "wall": 0.2}), hc.Detector(scene)
    found, true = detector.detect(start, end), full.detect(start, end)
    assert found.first_toc <= true.first_toc
    assert covered(scene, detector, faces_only(true), found, "odd") > 10
    # Edges and points of no face stay exact.
    beside = {tuple(r) for r in true.vf.tolist() if r[0] in (123, 124, 125)}
    assert {r[0] for r in beside} <= set(found.vf[:, 0].tolist())


def faces_only(contacts):
    """Without rows of edges that are in no face, and of points."""
    lone = np.isin(contacts.ee, [120, 121, 122]).any(axis=1)
    return hc.Contacts(
        contacts.vf[contacts.vf[:, 0] < 120],
        contacts.vf_toc[contacts.vf[:, 0] < 120],
        contacts.ee[~lone],
        contacts.ee_toc[~lone],
        contacts.first_toc,
        0,
    )


def test_what_is_invalid_or_not_offered_is_named():
    scene, start, end = two_bodies(np.random.default_rng(0))
    for detail, message in (
        (0.0, "must be in"),
        (1.5, "must be in"),
        ({"shirt": 0.1}, "no mesh is named 'shirt'"),
        ({"sheet": {"ratio": 0.1, "error": 1.0}}, "either a ratio"),
        ({"sheet": {"rate": 0.1}}, "not known"),
        ({"sheet": {"error": -1.0}}, "not negative"),
        ({"sheet": {"ratio": 0.1, "rest_vertices": [[0, 0, 0]]}}, "expected shape"),
    ):
        with pytest.raises(ValueError, match=message):
            hc.Detector(scene, detail=detail)
    with pytest.raises(ValueError, match="worlds: not offered with detail"):
        hc.Detector(scene, detail=0.1, worlds=2)
    with pytest.raises(ValueError, match="give detail too"):
        hc.Detector(scene, refine="neighbours")
    detector = hc.Detector(scene, detail=0.1)
    assert detector.faces.shape == (0, 3) and detector.stats == {} and detector.threads >= 1
    with pytest.raises(ValueError, match="proximity is not offered on coarse meshes"):
        detector.proximity(start, 0.1)
    with pytest.raises(ValueError, match="refine='neighbours'"):
        detector.collision_free_step(start, end)
    with pytest.raises(TypeError, match="detail: expected a number, got str"):
        hc.Detector(scene, detail="0.1")
    bad = end.copy()
    bad[40, 1] = np.nan
    with pytest.raises(ValueError, match=r"vertices_t1\[40, 1\] is NaN"):
        detector.detect(start, bad)
    detector.detect(start, end)
    detector.cancel()
    with pytest.raises(hc.Cancelled):
        detector.detect(start, end)


def test_separations_and_thickness_of_a_detector_change():
    scene, start, _ = two_bodies(np.random.default_rng(4), self_collision=False)
    detector = hc.Detector(scene, detail={"sheet": 0.2})
    gap = next(g.distance for g in detector.distances(start) if g.mesh_a != g.mesh_b)
    assert gap > 0 and not len(detector.detect(start, start))
    detector.set_separation("sheet", "ball", gap + 0.01)
    assert len(detector.detect(start, start))
    detector.set_separation("sheet", "ball", 0)
    detector.set_thickness("sheet", gap + 0.01)
    assert len(detector.detect(start, start))
    detector.set_thickness("sheet", np.zeros(288))
    detector.set_thickness("ball", gap + 0.01)
    assert len(detector.detect(start, start))


def test_ignored_faces_are_ignored_where_the_whole_patch_is():
    scene, start, end = two_bodies(np.random.default_rng(6), self_collision=False)
    assert len(hc.Detector(scene, detail=0.2).detect(start, end))
    scene.ignore_faces("sheet", np.arange(288), "ball")
    assert not len(hc.Detector(scene, detail=0.2).detect(start, end))


def test_small_scenes_side_by_side():
    """A short run of python -m fuzz.detail."""
    tally = dict.fromkeys(("contacts", "rows", "crossing", "coarse", "faces"), 0)
    for number in range(12):
        assert fuzz.batch(np.random.default_rng([45, number]), 50, tally) == []
    assert tally["contacts"] > 1000 and tally["crossing"] > 0 and tally["coarse"] < 0.8 * tally["faces"]


def test_components_keep_to_themselves():
    """Faces whose component collapsed stay as they are, and no coarse face joins two components."""
    vertices, faces = hc.shapes.box((1.0, 1.0, 1.0))
    n = len(vertices)
    rest = np.concatenate([vertices + [8 * k, 0, 0] for k in range(200)])
    each = np.concatenate([faces + n * k for k in range(200)]).astype(np.uint32)
    proposal = hc.detail_levels.propose(each, rest, 0.05)
    mesh = _core.CoarseMesh(each, proposal.faces, proposal.survivor, rest, _core.DetailThreads(2))
    assert np.array_equal(mesh.faces.min(axis=1) // n, mesh.faces.max(axis=1) // n)
    assert set(mesh.held[:, 1].tolist()) == set(range(len(each)))


def with_a_floor(rng, **thickness):
    """Two bodies, a floor that is added between them, and grains: scene, start and end."""
    scene = hc.Scene()
    sheet, faces = bumpy(rng, 12, 2.0, 0.02)
    ball_vertices, ball_faces = ball(rng, 6, 0.5, 0.01)
    scene.add_mesh("sheet", faces, n_vertices=len(sheet), self_collision=False, **thickness)
    scene.add_plane("floor", (0, 0.1, 1), -0.55)
    scene.add_mesh("ball", ball_faces, n_vertices=len(ball_vertices), self_collision=False)
    scene.add_points("grains", 30, thickness=0.03)
    grains = rng.random((30, 3)) * [2, 2, 0.3] + [-1, -1, 0.8]
    start = np.concatenate([sheet - [1, 1, 0] + [0, 0, 1.0], ball_vertices, grains])
    end = start + rng.normal(size=start.shape) * 0.01
    end[: len(sheet), 2] -= 1.7
    end[len(sheet) :, 2] -= 0.2
    return scene, start, end


@pytest.mark.parametrize("refine", ["none", "neighbours"])
@pytest.mark.parametrize("thickness", [{}, {"thickness": 0.02}, {"thickness": np.linspace(0, 0.1, 288)}])
def test_planes_and_points_are_tested_on_all_vertices(thickness, refine):
    scene, start, end = with_a_floor(np.random.default_rng(8), **thickness)
    options = {"outputs": ("points", "normals"), "threads": 1, "backend": "cpu"}
    detector = hc.Detector(scene, detail={"sheet": 0.2, "ball": 0.2}, refine=refine, **options)
    full = hc.Detector(scene, **options)
    found, true = detector.detect(start, end), full.detect(start, end)
    for kind in ("vp", "vp_toc", "vv", "vv_toc"):
        assert len(getattr(true, kind)) and np.array_equal(getattr(found, kind), getattr(true, kind))
    of_planes = slice(len(found.vf) + len(found.ee), len(found.vf) + len(found.ee) + len(found.vp))
    of_true = slice(len(true.vf) + len(true.ee), len(true.vf) + len(true.ee) + len(true.vp))
    assert np.array_equal(found.points[of_planes], true.points[of_true])
    assert not found.bounds[of_planes].any()
    assert covered(scene, detector, true, found, thickness) > 0
    assert found.first_toc <= true.first_toc
    assert [(g.mesh_a, g.mesh_b) for g in detector.distances(start)] == [
        (g.mesh_a, g.mesh_b) for g in full.distances(start)
    ]
    assert all(
        a.distance <= b.distance + 1e-12 for a, b in zip(detector.distances(end), full.distances(end), strict=True)
    )
    for k in range(1, 5):
        to = start + (end - start) * k / 4
        assert detector.collision_free_step(start, to) <= full.collision_free_step(start, to)


def test_a_plane_of_a_detector_with_detail_changes():
    scene, start, end = with_a_floor(np.random.default_rng(9))
    detector, full = hc.Detector(scene, detail={"sheet": 0.2}), hc.Detector(scene)
    for change in (
        lambda d: d.set_plane("floor", (0, 0, 1), 0.3),
        lambda d: d.set_thickness("sheet", np.linspace(0.05, 0, 288)),
        lambda d: d.set_separation("ball", "floor", 0.2),
        lambda d: d.set_plane("floor", (0, 0, 1), -3),
    ):
        change(detector), change(full)
        found, true = detector.detect(start, end), full.detect(start, end)
        assert np.array_equal(found.vp, true.vp) and np.array_equal(found.vp_toc, true.vp_toc)
    with pytest.raises(ValueError, match="is a mesh, not a plane"):
        detector.set_plane("ball", (0, 0, 1), 0)
    without, *_ = two_bodies(np.random.default_rng(9))
    with pytest.raises(ValueError, match="is a mesh, not a plane"):
        hc.Detector(without, detail=0.2).set_plane("sheet", (0, 0, 1), 0)


def test_faces_ignored_against_a_plane_leave_the_vertices_of_others():
    scene, start, end = with_a_floor(np.random.default_rng(10))
    scene.ignore_faces("sheet", np.arange(100), "floor")
    found, true = (hc.Detector(scene, **o).detect(start, end) for o in ({"detail": 0.2}, {}))
    sheet = true.vp[true.vp[:, 0] < 169]
    assert 0 < len(sheet) < 169 and np.array_equal(found.vp, true.vp)


def test_a_rejected_call_does_not_decide_how_coarse_a_mesh_is():
    scene, start, end = two_bodies(np.random.default_rng(11), self_collision=False)
    detector, fresh = (hc.Detector(scene, detail=0.2) for _ in range(2))
    bad = start.copy()
    bad[::3] = np.nan
    for query in (detector.detect, detector.collision_free_step):
        with pytest.raises(ValueError, match="NaN"):
            query(bad, end)
    with pytest.raises(ValueError, match="NaN"):
        detector.distances(bad)
    assert detector.detect(start, end) == fresh.detect(start, end)
    assert np.array_equal(detector.faces, fresh.faces)


def test_coarse_borders_lie_on_those_of_the_mesh():
    vertices, faces = hc.shapes.grid(40, 40)
    scene = hc.Scene()
    scene.add_mesh("sheet", faces, self_collision=False)
    scene.add_mesh("probe", [[0, 1, 2]])
    probe = np.array([[0.0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]])
    detector = hc.Detector(scene, detail={"sheet": 0.1}, minimum_separation=0.2)
    found = detector.detect(flat := np.concatenate([vertices, probe]), flat)
    assert len(found.bounds) and found.bounds.max() < 1e-3 / 20  # of an edge
    assert len(detector.faces) < 0.4 * len(faces)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e160])
def test_each_vertex_of_a_static_mesh_is_checked_at_both_ends(bad):
    vertices, faces = hc.shapes.grid(4, 5)
    scene = hc.Scene()
    scene.add_mesh("still", faces, static=True, self_collision=False)
    scene.add_mesh("moving", faces, self_collision=False)
    start = np.concatenate([vertices, vertices + 3])
    detector = hc.Detector(scene, detail={"still": 0.3})
    detector.detect(start, start)
    for vertex in range(len(vertices)):
        end = start.copy()
        end[vertex, 1] = bad
        for query in (detector.detect, detector.collision_free_step):
            with pytest.raises(ValueError, match="vertices_t1|static"):
                query(start, end)
    assert detector.detect(start, start) == hc.Detector(scene, detail={"still": 0.3}).detect(start, start)
