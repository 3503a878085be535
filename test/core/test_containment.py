# SPDX-License-Identifier: Apache-2.0
"""Which meshes lie inside others: special cases, and decisions that are kept from frame to frame."""

import numpy as np
import pytest
from fuzz.containment import CONTAINMENT_KINDS, CONTAINMENT_POINTS, CUP, scene_of

import hpccd_core as hc

BOX, BOX_FACES = hc.shapes.box((2.0, 2.0, 2.0))
BALL, BALL_FACES = hc.shapes.icosphere(3)


def inside(*meshes, **options):
    """Of the first two of meshes, each a list of parts (vertices, faces): the gap of (0, 1)."""
    scene, vertices = hc.Scene(), {}
    for number, parts in enumerate(meshes):
        starts = np.cumsum([0, *(len(v) for v, _ in parts)])
        faces = np.concatenate([np.asarray(f) + start for (_, f), start in zip(parts, starts, strict=False)])
        vertices[f"mesh{number}"] = np.concatenate([v for v, _ in parts])
        scene.add_mesh(f"mesh{number}", faces, n_vertices=int(starts[-1]))
    gaps = hc.Detector(scene, backend="cpu", threads=1, **options).distances(vertices)
    assert all(gap.inside is None for gap in gaps if gap.mesh_a == gap.mesh_b)
    return next(gap for gap in gaps if (gap.mesh_a, gap.mesh_b) == ("mesh0", "mesh1"))


def box(size=1.0, at=(0.0, 0.0, 0.0), turned=False):
    return BOX * size + at, BOX_FACES[:, ::-1] if turned else BOX_FACES


def point(*at):
    return np.array([at], float), np.empty((0, 3), np.uint32)


def test_a_distance_remains_that_of_the_surfaces():
    gap = inside([box(1)], [box(4)])
    assert (gap.inside, gap.distance) == ("a", 3.0)
    gap = inside([box(4)], [box(1)])
    assert (gap.inside, gap.distance) == ("b", 3.0)
    assert inside([box(1, (9, 0, 0))], [box(4)]).inside is None


def test_components_count_by_themselves():
    beside = box(1, (20, 0, 0))
    assert inside([beside, box(1)], [box(4)]).inside == "a"
    assert inside([box(1), box(4, (50, 0, 0))], [box(4), box(1, (50, 0, 0))]).inside == "both"
    assert inside([point(0, 0, 0)], [box(4)]).inside == "a"
    assert inside([beside, point(0, 0, 0)], [box(4)]).inside == "a"
    assert inside([beside, point(5, 0, 0)], [box(4)]).inside is None


def test_what_faces_wind_around_is_inside_whichever_way():
    assert inside([box(1)], [box(4, turned=True)]).inside == "a"
    assert inside([box(1, turned=True)], [box(4)]).inside == "a"
    assert inside([box(1)], [box(4), box(3)]).inside == "a"  # winding number 2
    assert inside([box(1)], [box(4), box(3, turned=True)]).inside is None, "in the cavity"
    assert inside([box(3)], [box(4), box(2, turned=True)]).inside == "both", "between the shells, around the cavity"
    assert inside([box(1)], [box(4), box(3), box(2, turned=True)]).inside == "a"


def test_only_closed_meshes_contain_anything():
    vertices, faces = box(4)
    assert inside([box(1)], [(vertices, faces[1:])]).inside is None
    assert inside([box(1)], [(vertices, faces), (vertices + 30, faces[1:])]).inside is None
    flipped = faces.copy()
    flipped[3] = flipped[3, ::-1]
    assert inside([box(1)], [(vertices, flipped)]).inside is None
    collapsed = np.vstack([faces, [[0, 0, 1], [2, 2, 2]]])  # edges and points, which are not faces
    assert inside([box(1)], [(vertices, collapsed)]).inside == "a"


@pytest.mark.parametrize("at", [(3, 0, 0), (5, 0, 0), (3, 3, 3), (4, 4, 4)])
def test_nothing_is_inside_what_it_touches(at):
    gap = inside([box(1, at)], [box(4)])
    assert (gap.distance, gap.inside) == (0.0, None)
    assert inside([box(1, at), box(0.25)], [box(4)]).inside is None, "not decided where another component touches"


@pytest.mark.parametrize(
    ("size", "dtype"), [*((s, np.float64) for s in (1e300, 2.0**400, 1e-300, 1e-320, 3.0)), (3.0, np.float32)]
)
def test_any_magnitude(size, dtype):
    outer, inner = (BOX * 0.5 * size).astype(dtype), (BALL * size / 64 + size / 8).astype(dtype)
    gap = inside([(inner, BALL_FACES)], [(outer, BOX_FACES)])
    assert gap.distance > 0 and gap.inside == "a"
    assert inside([(inner + dtype(size / 2), BALL_FACES)], [(outer, BOX_FACES)]).inside is None


def test_small_bodies_far_apart():
    """Where boxes are of double precision only: bodies of size 1e-5 in pairs, and pairs 1e6 apart."""
    at = np.array([(0, 0, 0), (1e6, 0, 0), (-3e5, 7e5, 1e6)])
    parts = [(BALL * 1e-5 + x, BALL_FACES) for x in at]
    around = [(BALL * 3e-5 + x, BALL_FACES) for x in at[1:]]
    assert inside(parts, around).inside == "a"
    assert inside(parts[:1], around).inside is None


def test_ignored_pairs_are_left_out():
    scene = hc.Scene()
    for name in ("inner", "outer", "third"):
        scene.add_mesh(name, BOX_FACES, self_collision=False)
    scene.ignore_pair("inner", "outer")
    gaps = hc.Detector(scene).distances({"inner": BOX, "outer": 4 * BOX, "third": 9 * BOX})
    assert [(gap.mesh_a, gap.mesh_b, gap.inside) for gap in gaps] == [
        ("inner", "third", "a"),
        ("outer", "third", "a"),
    ]


@pytest.mark.parametrize("name", CONTAINMENT_KINDS)
@pytest.mark.parametrize("threads", [1, 3])
def test_results_do_not_depend_on_earlier_frames(name, threads):
    scene = scene_of(CONTAINMENT_KINDS[name])
    kept = hc.Detector(scene, backend="cpu", threads=threads)
    rng = np.random.default_rng(2026)
    seen = set()
    for generate in CONTAINMENT_POINTS[name].values():
        for vertices in generate(rng, 60):
            gaps = kept.distances(vertices)
            assert gaps == hc.Detector(scene, backend="cpu", threads=1).distances(vertices)
            seen |= {gap.inside for gap in gaps}
    assert len(seen) > 1


def test_worlds_have_their_own_history():
    kind = CONTAINMENT_KINDS["grains"]
    scene = scene_of(kind)
    worlds = hc.Detector(scene, backend="cpu", worlds=5, threads=2)
    for frame in zip(
        *(CONTAINMENT_POINTS["grains"]["moving"](np.random.default_rng(k), 30) for k in range(5)), strict=True
    ):
        for vertices, gaps in zip(frame, worlds.distances(np.array(frame)), strict=True):
            assert gaps == hc.Detector(scene, backend="cpu", threads=1).distances(vertices)


def cup_of_grains(n, rng):
    """A cup, and grains outside it in its pit."""
    scene = hc.Scene()
    scene.add_mesh("cup", CUP.faces, self_collision=False)
    scene.add_mesh("grains", np.empty((0, 3), int), n_vertices=n, self_collision=False)
    grains = rng.uniform((-0.45, -0.45, 0.05), (0.45, 0.45, 0.95), (n, 3))
    return scene, CUP.vertices, grains


def test_grains_that_enter_the_wall_between_small_steps_are_seen():
    """Many components stay outside: their decisions are kept, except of those that may have crossed the surface."""
    rng = np.random.default_rng(7)
    scene, cup, grains = cup_of_grains(200, rng)
    detector = hc.Detector(scene, backend="cpu", threads=1)
    velocity = np.zeros(grains.shape)
    velocity[17, 0] = 0.004
    found = []
    for frame in range(300):
        jolt = rng.normal(0, 1e-4, 3)
        grains, cup = grains + velocity + jolt, cup + jolt
        gap = detector.distances({"cup": cup, "grains": grains})[-1]
        found.append(gap.inside)
        place = grains[17] - (cup[0] + 1)
        assert gap.distance > 0
        assert gap.inside == ("b" if 0.5 < place[0] < 1 else None), (frame, place)
    assert found[0] is None and "b" in found and found[-1] is None
