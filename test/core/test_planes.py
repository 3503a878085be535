# SPDX-License-Identifier: Apache-2.0
"""Planes against rational arithmetic, and in every query."""

import copy
import math
import pickle
from fractions import Fraction

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.parts import contacts_of_step, hash_of

TRIANGLE = np.array([[0.0, 0, 1], [1, 0, 3], [0, 1, 3]])
DOWN = np.array([0.0, 0, 2])


def above_floor(n_planes=1, **options):
    scene = hc.Scene()
    scene.add_mesh("falling", [[0, 1, 2]])
    for k in range(n_planes):
        scene.add_plane(f"floor {k}", offset=-float(k))
    return hc.Detector(scene, **options)


def exact_value(normal, offset, x):
    return sum(Fraction(n) * Fraction(float(c)) for n, c in zip(normal, x, strict=True)) - Fraction(offset)


def is_within(value, square):
    """Whether value <= sqrt(square)."""
    return value <= 0 or value * value <= square


def root(square, bits=400):
    """Within 2^-300 of the square root, relative to it."""
    shift = bits + max(0, square.denominator.bit_length() - square.numerator.bit_length())
    shift += shift % 2
    return Fraction(math.isqrt((square.numerator << shift) // square.denominator), 1 << (shift // 2))


def exact_time(normal, offset, separation, x0, x1):
    """The time of impact, or None."""
    square = Fraction(separation) ** 2 * sum(Fraction(n) ** 2 for n in normal)
    f0, f1 = exact_value(normal, offset, x0), exact_value(normal, offset, x1)
    if is_within(f0, square):
        return Fraction(0)
    if not is_within(f1, square):
        return None
    return (f0 - root(square)) / (f0 - f1)


def numbers(rng, n, kind):
    """(n, 3) coordinates of one kind."""
    x = rng.normal(size=(n, 3))
    if kind == "integers":
        return rng.integers(-9, 10, (n, 3)) / 8.0
    if kind == "denormal":
        return rng.integers(-5, 6, (n, 3)) * 5e-324
    if kind == "mixed":
        return x * 10.0 ** rng.integers(-320, 140, (n, 3))
    scale = {"tiny": 1e-290, "huge": 1e140, "far": 1.0, "usual": 1.0}[kind]
    return x * scale + (1e9 if kind == "far" else 0)


NORMALS = {
    "axis": [(0, 0, 1), (0, -1, 0), (0.25, 0, 0)],
    "rational": [(3, 4, 0), (-1, 2, 2), (0, 0, 3)],
    "others": [(1, 1, 1), (0.3, -0.2, 0.7), (1e-3, 5, 1e7)],
    "extreme": [(1e-310, 0, 2e-310), (1e300, 1e-300, 1), (5e-324, 0, 0)],
}


def random_plane(rng, x, kind):
    """Normal, offset and separation: often such that vertices lie exactly on the plane, or at the separation."""
    normals = NORMALS[rng.choice(list(NORMALS))]
    normal = tuple(float(c) for c in normals[rng.integers(len(normals))])
    on_plane = exact_value(normal, 0.0, x[rng.integers(len(x))])
    try:
        offset = float(on_plane) if rng.random() < 0.7 else float(rng.normal())
    except OverflowError:
        offset = 0.0
    if rng.random() < 0.4 or not math.isfinite(offset):
        return normal, offset if math.isfinite(offset) else 0.0, 0.0
    if rng.random() < 0.5 and kind in ("integers", "usual"):
        return normal, offset, float(rng.integers(1, 9)) / 8
    return normal, offset, float(abs(x[rng.integers(len(x)), rng.integers(3)]))


def check_queries(seed, n, n_batches):
    rng = np.random.default_rng(seed)
    n_hits = 0
    for batch in range(n_batches):
        kind = ("usual", "integers", "tiny", "huge", "denormal", "far", "mixed")[batch % 7]
        start, end = numbers(rng, n, kind), numbers(rng, n, kind)
        if batch % 3 == 0:
            end = start + (end - start) * 1e-9  # little motion
        if kind in ("usual", "integers") and batch % 2:
            start, end = start.astype(np.float32), end.astype(np.float32)
        normal, offset, separation = random_plane(rng, start, kind)
        scene = hc.Scene()
        scene.add_mesh("points", n_vertices=n, self_collision=False)
        scene.add_plane("plane", normal, offset)
        scene.set_separation("points", "plane", separation)
        detector = hc.Detector(scene, threads=1)
        found = detector.detect(start, end)
        times = [exact_time(normal, offset, separation, a, b) for a, b in zip(start, end, strict=True)]
        expected = [v for v, time in enumerate(times) if time is not None]
        assert found.vp.tolist() == [[v, 0] for v in expected], (batch, kind, normal, offset, separation)
        for v, toc in zip(expected, found.vp_toc, strict=True):
            assert 0 <= toc <= 1
            assert abs(Fraction(float(toc)) - times[v]) <= Fraction(1, 10**12)
            assert toc == 0 or times[v] > 0
        earliest = min((time for time in times if time is not None), default=None)
        step = detector.collision_free_step(start, end)
        if earliest is None:
            assert step == 1
        else:
            assert Fraction(step) <= earliest <= Fraction(step) + Fraction(1, 10**9)
        n_hits += len(expected)
    assert n_hits > n * n_batches / 10
    return n_hits


@pytest.mark.parametrize("seed", range(3))
def test_contacts_are_those_of_rational_arithmetic(seed):
    check_queries(seed, 40, 70)


@pytest.mark.parametrize("kind", ["usual", "integers", "tiny", "huge", "denormal", "far", "mixed"])
def test_proximity_is_that_of_rational_arithmetic(kind):
    rng = np.random.default_rng(7)
    for _ in range(20):
        x = numbers(rng, 50, kind)
        normal, offset, distance = random_plane(rng, x, kind)
        scene = hc.Scene()
        scene.add_mesh("points", n_vertices=len(x), self_collision=False)
        scene.add_plane("plane", normal, offset)
        detector = hc.Detector(scene)
        near = detector.proximity(x, distance)
        of_normal = sum(Fraction(n) ** 2 for n in normal)
        values = [exact_value(normal, offset, v) for v in x]
        expected = [v for v, f in enumerate(values) if is_within(f, Fraction(distance) ** 2 * of_normal)]
        assert near.vp.tolist() == [[v, 0] for v in expected]
        distances = [f / root(of_normal, 2400) for f in values]
        if max(map(abs, distances)) > Fraction(1e300):  # beyond the range of doubles
            continue
        for v, value in zip(expected, near.vp_distance, strict=True):
            assert abs(Fraction(float(value)) - distances[v]) <= abs(distances[v]) * Fraction(1, 10**14) + Fraction(
                5e-324
            )
        (gap,) = detector.distances(x)
        assert gap.kind == "vertex-plane"
        least = min(distances)
        assert abs(Fraction(gap.distance) - least) <= abs(least) * Fraction(1, 10**14) + Fraction(5e-324)


def test_outputs_of_contacts():
    detector = above_floor(outputs=("points", "normals", "closest", "weights"), minimum_separation=0.5)
    contacts = detector.detect(TRIANGLE, TRIANGLE - DOWN)
    assert contacts.vp.tolist() == [[0, 0]]
    assert contacts.vp_toc.tolist() == [0.25]
    assert contacts.first_toc == 0.25
    assert contacts.points.tolist() == [[0, 0, 0.25]]
    assert contacts.normals.tolist() == [[0, 0, 1]]
    assert contacts.closest.tolist() == [[[0, 0, 0.5], [0, 0, 0]]]
    assert contacts.vertices.tolist() == [[0, 0, 0, 0]]
    assert contacts.weights.tolist() == [[1, 0, 0, 0]]
    assert contacts.approach.tolist() == [-2]
    g0, g1 = contacts.toc_gradients()
    assert g0[0, 0].tolist() == [0, 0, 0.375]
    assert g1[0, 0].tolist() == [0, 0, 0.125]
    sides = contacts.mesh_a, contacts.mesh_b, contacts.local_a, contacts.local_b
    assert [side.tolist() for side in sides] == [[0], [1], [[0, 2**32 - 1]], [[2**32 - 1, 2**32 - 1]]]
    assert hash_of(contacts) == contacts.hash
    assert repr(contacts) == "Contacts(0 vertex-face, 0 edge-edge, 1 vertex-plane, first at 0.25)"
    assert len(contacts) == 1


def test_outputs_of_snapshots():
    detector = above_floor(outputs=("normals", "closest", "weights"))
    near = detector.proximity(TRIANGLE - DOWN, 0.0)
    assert near.vp_distance.tolist() == [-1]
    assert near.closest.tolist() == [[[0, 0, -1], [0, 0, 0]]]
    assert near.normals.tolist() == [[0, 0, 1]]
    assert near.weights.tolist() == [[1, 0, 0, 0]]
    within, gap = detector.distances(TRIANGLE - DOWN)
    assert within.mesh_a == within.mesh_b == "falling"
    assert (gap.mesh_a, gap.mesh_b, gap.kind, gap.features) == ("falling", "floor 0", "vertex-plane", (0, 0))
    assert gap.distance == -1
    assert gap.points.tolist() == [[0, 0, -1], [0, 0, 0]]
    assert gap.normal.tolist() == [0, 0, 1]
    assert gap.weights.tolist() == [1, 0, 0, 0]


def test_several_planes_are_sorted_by_vertex():
    contacts = above_floor(3).detect(TRIANGLE, TRIANGLE - 2 * DOWN)
    assert contacts.vp.tolist() == [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [2, 0], [2, 1]]
    assert contacts.vp_toc.tolist() == [0.25, 0.5, 0.75, 0.75, 1, 0.75, 1]


def grids(rng, n=12, way=0.08):
    """Two small cloths above a floor and beside a wall."""
    vertices, faces = hc.shapes.grid(n, n)
    scene = hc.Scene()
    scene.add_mesh("low", faces)
    scene.add_plane("floor", (0, 0.1, 1), -0.15)
    scene.add_mesh("high", faces)
    scene.add_plane("wall", (1, 0, 0), -1.05)
    start = np.concatenate([vertices, vertices + [0, 0, 0.05]])
    return scene, start, start + rng.normal(scale=way, size=start.shape)


@pytest.mark.parametrize("report", ["first", "any"])
def test_reports_agree_with_all(report):
    rng = np.random.default_rng(1)
    seen = set()
    for _ in range(40):
        scene, start, end = grids(rng, 3)
        every = hc.Detector(scene).detect(start, end)
        contacts = hc.Detector(scene, report=report, outputs=("points",)).detect(start, end)
        if report == "any":
            assert len(contacts) == min(1, len(every))
            continue
        assert contacts.first_toc == every.first_toc
        for kind in ("vf", "ee", "vp"):
            earliest = getattr(every, f"{kind}_toc") == every.first_toc
            assert getattr(contacts, kind).tolist() == getattr(every, kind)[earliest].tolist()
            seen |= {kind} if earliest.any() else set()
        assert len(contacts.points) == len(contacts)
        assert hash_of(contacts) == contacts.hash
    assert report == "any" or seen == {"vf", "ee", "vp"}


@pytest.mark.parametrize("backend", hc.backends())
@pytest.mark.parametrize("report", ["all", "first", "any"])
def test_worlds_are_those_of_each_alone(backend, report):
    rng = np.random.default_rng(2)
    worlds = [grids(rng, 4)[1:] for _ in range(9)]
    worlds[4] = (worlds[4][0], worlds[4][0])  # nothing moves
    scene = grids(rng, 4)[0]
    options = {"report": report, "outputs": ("points", "normals", "closest", "weights")}
    if report == "any":
        options["threads"] = 1
    together = hc.Detector(scene, worlds=9, backend=backend, **options)
    alone = hc.Detector(scene, backend=backend, **options)
    start, end = (np.stack(ends) for ends in zip(*worlds, strict=True))
    contacts, near = together.detect(start, end), together.proximity(end, 0.01)
    steps, motion = together.collision_free_step(start, end), together.collision_free_motion(start, end)
    gaps = together.distances(end)
    assert len(contacts) > 0
    for k in range(9):
        own = alone.detect(start[k], end[k])
        if report != "any" or backend == "cpu":
            assert contacts.world(k) == own
        assert near.world(k) == alone.proximity(end[k], 0.01)
        assert steps[k] == alone.collision_free_step(start[k], end[k])
        assert np.array_equal(motion.factors[k], alone.collision_free_motion(start[k], end[k]).factors)
        assert gaps[k] == alone.distances(end[k])
    assert contacts.vp_offsets[-1] == len(contacts.vp)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_results_do_not_depend_on_threads_or_backends(dtype):
    rng = np.random.default_rng(3)
    scene, start, end = grids(rng, 60, 0.03)
    end[:, 2] -= 0.1
    start, end = start.astype(dtype), end.astype(dtype)
    found = [
        hc.Detector(scene, threads=threads, backend=backend, outputs=("points", "weights")).detect(start, end)
        for backend in hc.backends()
        for threads in (1, 2, 5)
    ]
    assert len(found[0].vp) > 500
    assert all(contacts == found[0] for contacts in found)


def test_separations_and_ignored_pairs():
    scene = hc.Scene()
    scene.add_mesh("a", [[0, 1, 2]])
    scene.add_mesh("b", [[0, 1, 2]])
    scene.add_plane("floor")
    scene.set_separation("b", "floor", 1.5)
    both = np.concatenate([TRIANGLE, TRIANGLE])
    detector = hc.Detector(scene, features="edge_edge", minimum_separation=0.25)
    assert detector.detect(both, both).vp.tolist() == [[3, 0]]
    detector.set_separation("a", "floor", 1.0)  # exactly met
    assert detector.detect(both, both).vp.tolist() == [[0, 0], [3, 0]]
    detector.set_separation("a", "floor", np.nextafter(1.0, 0))
    assert detector.detect(both, both).vp.tolist() == [[3, 0]]
    scene.ignore_pair("b", "floor")
    detector = hc.Detector(scene)
    assert detector.detect(both, both - np.tile(DOWN, (6, 1))).vp.tolist() == [[0, 0]]
    assert [(gap.mesh_a, gap.mesh_b) for gap in detector.distances(both)] == [
        ("a", "a"),
        ("a", "b"),
        ("a", "floor"),
        ("b", "b"),
    ]


def test_thickness_counts():
    """Of each vertex the greatest of its faces, in the separation and in distances."""
    scene = hc.Scene()
    scene.add_mesh("cloth", [[0, 1, 2], [2, 1, 3]], thickness=[0.5, 0.125])
    scene.add_mesh("rope", edges=[[0, 1]], thickness=1.0)
    scene.add_plane("floor")
    scene.set_separation("cloth", "floor", 0.25)
    detector = hc.Detector(scene, outputs=("closest",))
    heights = np.array([0.75, 0.75, 0.875, 0.375, 1.0, 1.125])
    x = np.pad(heights[:, None], ((0, 0), (2, 0)))
    assert detector.detect(x, x).vp.tolist() == [[0, 0], [1, 0], [3, 0], [4, 0]]
    x[3, 2] = 0.4
    assert detector.detect(x, x).vp.tolist() == [[0, 0], [1, 0], [4, 0]]
    near = detector.proximity(x, 0.25)
    assert near.vp.tolist() == [[0, 0], [1, 0], [4, 0], [5, 0]]
    assert near.vp_distance.tolist() == [0.25, 0.25, 0, 0.125]
    assert near.closest[-4].tolist() == [[0, 0, 0.75], [0, 0, 0]]
    by_pair = {(gap.mesh_a, gap.mesh_b): gap for gap in detector.distances(x)}
    assert (by_pair["cloth", "floor"].distance, by_pair["cloth", "floor"].features) == (0.25, (0, 0))
    assert (by_pair["rope", "floor"].distance, by_pair["rope", "floor"].features) == (0, (4, 0))
    detector.set_thickness("cloth", 0.0)
    assert detector.detect(x, x - [0, 0, 0.25]).vp.tolist() == [[3, 0], [4, 0], [5, 0]]


@pytest.mark.parametrize("static_plane", [True, False])
def test_static_meshes_and_planes(static_plane):
    scene = hc.Scene()
    scene.add_mesh("rock", [[0, 1, 2]], static=True)
    scene.add_plane("floor", offset=2.0, static=static_plane)
    scene.add_plane("ceiling", (0, 0, -1), -9.0)
    detector = hc.Detector(scene)
    assert len(detector.detect(TRIANGLE, TRIANGLE).vp) == (0 if static_plane else 1)
    assert len(detector.distances(TRIANGLE)) == detector._n_mesh_pairs == (0 if static_plane else 1)


def test_set_plane():
    detector = above_floor(2)
    assert detector.detect(TRIANGLE, TRIANGLE).vp.tolist() == []
    detector.set_plane("floor 1", (0, 0, 2), 3.0)
    assert detector.detect(TRIANGLE, TRIANGLE).vp.tolist() == [[0, 1]]
    for arguments in ((0, (0, 0, 1)), (1, (0, 0, 0)), (1, (0, math.nan, 1)), (1, (0, 0, 1), math.inf)):
        with pytest.raises(ValueError, match="plane|normal|offset"):
            detector.set_plane(*arguments)


def test_motions_stay_above_planes():
    rng = np.random.default_rng(4)
    for dtype in ("float64", "float32"):
        for _ in range(10):
            scene, start, end = grids(rng, 8)
            start, end = start.astype(dtype), end.astype(dtype)
            detector = hc.Detector(scene)
            motion = detector.collision_free_motion(start, end)
            assert motion.vertices.dtype == dtype
            contacts = detector.detect(start, motion.vertices)
            assert set(contacts.vp[:, 0].tolist()) | set(contacts.vf.ravel().tolist()) <= set(motion.stuck.tolist())
            assert len(motion.stuck) == 0
            step = detector.collision_free_step(start, end)
            assert motion.factors.min() >= 0.9 * step
            free = np.ones(len(start), bool)
            free[detector.detect(start, end).vp[:, 0]] = False
            assert len(detector.detect(start, end).vp) > 0
            assert (motion.factors[~free] < 1).all()


def test_vertices_on_the_wrong_side_are_stuck():
    detector = above_floor()
    start = TRIANGLE - DOWN
    motion = detector.collision_free_motion(start, start + DOWN)
    assert motion.stuck.tolist() == [0]
    assert motion.factors.tolist() == [0, 1, 1]
    assert detector.collision_free_step(start, start + DOWN) == 0


def test_parts_of_a_step():
    detector = above_floor(2, outputs=("points", "weights"))
    middle = TRIANGLE - DOWN / 2
    parts = [(detector.detect(TRIANGLE, middle), 0, 2), (detector.detect(middle, TRIANGLE - DOWN), 1, 2)]
    assert contacts_of_step(parts) == detector.detect(TRIANGLE, TRIANGLE - DOWN)


def test_scenes_with_planes_can_be_copied():
    scene = hc.Scene()
    scene.add_mesh("falling", [[0, 1, 2]])
    scene.add_plane("floor", (0, 0, 2), 1.0, static=False)
    scene.set_separation("falling", "floor", 0.5)
    contacts = hc.Detector(scene).detect(TRIANGLE, TRIANGLE)
    for other in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert hc.Detector(other).detect({"falling": TRIANGLE}, {"falling": TRIANGLE}) == contacts
    assert len(contacts.vp) == 1
    assert scene.locate(2) == ("falling", 2)


def test_arguments_of_planes():
    scene = hc.Scene()
    scene.add_plane("floor")
    for arguments in (("floor",), ("a", (0, 0, 0)), ("a", (0, 0, math.inf)), ("a", (0, 0, 1), math.nan), ("a", (0, 1))):
        with pytest.raises(ValueError, match="name|normal|offset"):
            scene.add_plane(*arguments)
    assert scene.mesh_names == ["floor"]
    scene.add_mesh("cloth", [], n_vertices=0)
    with pytest.raises(ValueError, match="plane: 'cloth' is a mesh, not a plane; the scene's planes are floor"):
        hc.Detector(scene).set_plane("cloth", (0, 0, 1))
    assert hc.Detector(scene).detect(np.empty((0, 3)), np.empty((0, 3))).vp.shape == (0, 2)


def test_stats_and_profile():
    detector = above_floor()
    detector.detect(TRIANGLE, TRIANGLE - DOWN)
    assert detector.stats["vp_contacts"] == 1
    assert detector.profile["planes"] >= 0
    detector.proximity(TRIANGLE, 2.0)
    assert detector.stats["vp_near"] == 1
    assert "vp_contacts" not in hc.Detector(hc.Scene()).stats


def test_conservative_times_are_not_late():
    """Starts and ends on integer heights: most times are no doubles, and are rounded up as often as down."""
    heights = [(a, -b) for a in range(1, 30) for b in range(1, 30)]
    scene = hc.Scene()
    scene.add_points("points", len(heights))
    scene.add_plane("floor")
    start, end = (np.array([[0.0, 0.0, h[k]] for h in heights]) for k in (0, 1))
    found = hc.Detector(scene, accuracy="conservative", backend="cpu").detect(start, end)
    true = [Fraction(a, a - b) for a, b in heights]
    for (vertex, _), toc in zip(found.vp.tolist(), found.vp_toc.tolist(), strict=True):
        assert true[vertex] - Fraction(3, 10**12) < Fraction(toc) <= true[vertex]
    assert len(found.vp) == len(heights)
