# SPDX-License-Identifier: Apache-2.0
"""Meshes that keep their shape, at poses: bit-identical to the same queries of the positions."""

import math
import pickle

import numpy as np
import pytest

import hpccd_core as hc
from hpccd_core.options import ALL_OUTPUTS
from hpccd_core.rigid.transform import Rigid

BALL, BALL_FACES = hc.shapes.icosphere(6)
BOX, BOX_FACES = hc.shapes.box()
SHEET, SHEET_FACES = hc.shapes.grid(9, 7)
STRIP = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0.5], [0, 2, 1]]), np.empty((0, 3), np.uint32)


def random_pose(rng, reach):
    turn = rng.normal(size=4)
    return [*(reach * rng.uniform(-1, 1, 3)), *(turn / np.linalg.norm(turn))]


def still_pose(rng, reach):
    return [*(reach * rng.uniform(-1, 1, 3)), 0, 0, 0, 1]


class Shapes:
    """Meshes with a shape: which of them are static, and the scene."""

    def __init__(self, shapes, static=(), **options):
        self.shapes, self.static, self.scene = shapes, static, hc.Scene()
        for number, (vertices, faces) in enumerate(shapes):
            edges = [[i, i + 1] for i in range(len(vertices) - 1)] if len(faces) == 0 else []
            self.scene.add_mesh(f"m{number}", faces, edges=edges, shape=vertices, static=number in static, **options)

    def positions(self, poses):
        """As users compute them."""
        left = iter(poses)
        return np.concatenate(
            [
                np.asarray(v, float)
                if number in self.static
                else Rigid.of((pose := next(left))[:3], pose[3:]).apply(np.asarray(v))
                for number, (v, _) in enumerate(self.shapes)
            ]
        )


def bits(array):
    return np.asarray(array).tobytes()


def gaps_as_bits(gaps):
    return [
        (
            g.mesh_a,
            g.mesh_b,
            g.kind,
            g.features,
            g.inside,
            bits(g.distance),
            bits(g.points),
            bits(g.vertices),
            bits(g.weights),
            bits(g.normal),
        )
        for g in gaps
    ]


def assert_equal(by_poses, by_positions, poses, positions, distance=0.05):
    assert bits(by_poses.positions_at(poses)) == bits(positions)
    assert gaps_as_bits(by_poses.distances(poses=poses)) == gaps_as_bits(by_positions.distances(positions))
    hits, expected = by_poses.intersections(poses=poses), by_positions.intersections(positions)
    assert (
        hits.hash == expected.hash and bits(hits.ef) == bits(expected.ef) and bits(hits.points) == bits(expected.points)
    )
    assert bits(hits.directions) == bits(expected.directions)
    near, expected = by_poses.proximity(distance=distance, poses=poses), by_positions.proximity(positions, distance)
    assert near.hash == expected.hash
    for name in ("vf", "vf_distance", "ee", "ee_distance", "closest", "weights", "normals"):
        assert bits(getattr(near, name)) == bits(getattr(expected, name)), name


def scenes(rng):
    turned = BALL * [1, 0.5, 2] + [0.1, 7, -3]
    yield Shapes([(BALL, BALL_FACES), (BALL.astype(np.float32), BALL_FACES)], self_collision=False), 1.1
    yield Shapes([(BALL, BALL_FACES), (3 * BALL, BALL_FACES)], static={1}, self_collision=False), 1.5
    yield Shapes([(SHEET, SHEET_FACES), (BOX, BOX_FACES), (turned, BALL_FACES)]), 3
    yield Shapes([(SHEET, SHEET_FACES), STRIP, (BOX, BOX_FACES)], thickness=0.05), 1
    yield Shapes([(0.3 * BALL, BALL_FACES) for _ in range(12)], static={3, 4}, self_collision=False), 1
    yield Shapes([(1e-3 * BALL + 5, BALL_FACES), (1e3 * BOX, BOX_FACES)], self_collision=False), 600
    tiny = 1e-7 * BALL
    yield Shapes([(tiny, BALL_FACES), (tiny, BALL_FACES)], self_collision=False), 1  # spread: no shortcut
    cups = np.concatenate([BALL * 0.2 + 0.5 * rng.normal(size=3) for _ in range(20)])
    faces = np.concatenate([BALL_FACES + i * len(BALL) for i in range(20)])
    yield Shapes([(cups, faces), (BALL, BALL_FACES)], self_collision=False), 0.5  # many components


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("number", range(8))
def test_results_are_those_of_the_positions(number, threads):
    rng = np.random.default_rng(number)
    shapes, reach = list(scenes(rng))[number]
    options = {"backend": "cpu", "threads": threads, "outputs": ALL_OUTPUTS}
    by_poses, by_positions = hc.Detector(shapes.scene, **options), hc.Detector(shapes.scene, **options)
    n = len(shapes.shapes) - len(shapes.static)
    for round_ in range(6):
        pose_of = random_pose if round_ % 3 else still_pose
        poses = np.array([pose_of(rng, reach) for _ in range(n)])
        for _ in range(2):  # the second with what the first has left
            assert_equal(by_poses, by_positions, poses, shapes.positions(poses), 0.03 * reach)


@pytest.mark.parametrize("backend", [name for name in ("cpu", "gpu") if name in hc.backends()])
@pytest.mark.parametrize("ignored", ["faces", "pairs"])
@pytest.mark.parametrize("position", [[0.7, 0.6, 0.5], [0.5, 0, 0], [0, 0, 0.25]])
def test_which_lies_inside_where_contacts_are_ignored(position, ignored, backend):
    """Boxes may intersect unnoticed: whether the box of one is within that of the other must not matter."""
    shapes = Shapes([(BOX, BOX_FACES), (0.5 * BOX, BOX_FACES)], self_collision=False)
    poses = [[0, 0, 0, 0, 0, 0, 1], [*position, 0, 0, 0, 1]]
    positions = shapes.positions(poses)
    found = hc.Detector(shapes.scene, backend="cpu").intersections(positions)
    if ignored == "faces":
        shapes.scene.ignore_faces("m0", np.arange(len(BOX_FACES)), "m1")
    else:
        shapes.scene.ignore_features(ef=found.ef)
    (gap,) = hc.Detector(shapes.scene, backend=backend).distances(positions)
    assert gaps_as_bits([gap]) == gaps_as_bits(hc.Detector(shapes.scene, backend="cpu").distances(poses=poses))
    assert gap.inside is None and (gap.distance > 0 or ignored == "pairs")


def test_slow_motions_and_contact_that_begins_and_ends():
    shapes = Shapes([(BALL, BALL_FACES), (BALL, BALL_FACES)], static={0}, self_collision=False)
    options = {"backend": "cpu", "threads": 2, "outputs": ALL_OUTPUTS}
    by_poses, by_positions = hc.Detector(shapes.scene, **options), hc.Detector(shapes.scene, **options)
    for x in [*np.linspace(2.2, 1.9, 16), 1.9, *np.linspace(1.9, 2.2, 16), 0.0, 0.01]:
        turn = Rigid.of([0, 0, 0], [0, 0, 0, 1]).between(Rigid.of([0, 0, 0], [0, 0.6, 0, 0.8]), x / 3)
        poses = np.array([[x, 0.1 * x, 0, *turn.quaternion]])
        assert_equal(by_poses, by_positions, poses, shapes.positions(poses))


@pytest.mark.parametrize("far", [1e5, 1e9, 1e15])
def test_far_from_the_origin(far):
    rng = np.random.default_rng(7)
    shapes = Shapes([(BALL + far, BALL_FACES), (BALL - far, BALL_FACES)], self_collision=False)
    by_poses, by_positions = (hc.Detector(shapes.scene, backend="cpu", outputs=ALL_OUTPUTS) for _ in "ab")
    for _ in range(4):
        shift = np.array([far, 2 * far, -far]) + rng.uniform(-1, 1, 3)
        poses = np.array([[*(shift - far), 0, 0, 0, 1], [*(shift + far), 0, 0, 0, 1]])
        assert_equal(by_poses, by_positions, poses, shapes.positions(poses), 0.1)
        poses[:, 3:] = [0.6, 0, 0, 0.8]
        assert_equal(by_poses, by_positions, poses, shapes.positions(poses), 0.1)


def test_shapes_of_huge_coordinates():
    shapes = Shapes([(1e200 * BALL, BALL_FACES), (1e200 * BOX, BOX_FACES)], self_collision=False)
    poses = np.array([[3e200, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 1, 0, 0]])
    by_poses, by_positions = hc.Detector(shapes.scene), hc.Detector(shapes.scene)
    positions = shapes.positions(poses)
    assert gaps_as_bits(by_poses.distances(poses=poses)) == gaps_as_bits(by_positions.distances(positions))
    with pytest.raises(ValueError, match=r"vertices\["):
        by_poses.distances(poses=[[1e301, 0, 0, 0, 0, 0, 1], poses[1]])
    with pytest.raises(ValueError, match=r"^vertices\[0, 0\] is .*, beyond 1e\+300"):
        by_poses.positions_at([[1e301, 0, 0, 0, 0, 0, 1], poses[1]])
    with pytest.raises(ValueError, match=r"^vertices\[1, 0, 0\] is "):
        hc.Detector(shapes.scene, worlds=2).positions_at([poses, [[1e301, 0, 0, 0, 0, 0, 1], poses[1]]])
    assert by_poses.distances(poses=poses)[0].distance > 0


def test_a_search_reaches_few_leaves():
    ball, faces = hc.shapes.icosphere(60)
    shapes = Shapes([(ball, faces), (ball, faces)], static={0}, self_collision=False)
    detector = hc.Detector(shapes.scene, backend="cpu", threads=1)
    detector.distances(poses=[[2.5, 0.1, 0.2, 0, 0, 0, 1]])
    detector.distances(poses=[[2.5, 0.1, 0.2, 0, 0, 0, 1]])
    assert detector.stats["leaf_pairs"] < 500 and "refit" not in detector.profile


def test_meshes_beside_others():
    scene = hc.Scene()
    scene.add_mesh("cloth", SHEET_FACES)
    scene.add_mesh("ball", BALL_FACES, shape=BALL)
    scene.add_mesh("box", BOX_FACES, shape=BOX, static=True)
    scene.add_plane("floor", offset=-2)
    detector, pose = hc.Detector(scene, backend="cpu"), [0.1, 0.2, 0.3, 0, 0.6, 0, 0.8]
    positions = np.concatenate([SHEET, Rigid.of(pose[:3], pose[3:]).apply(BALL), BOX])
    assert bits(detector.positions_at([pose], vertices=SHEET)) == bits(positions)
    assert gaps_as_bits(detector.distances(SHEET, poses=[pose])) == gaps_as_bits(detector.distances(positions))
    assert detector.intersections(SHEET, poses=[pose]).hash == detector.intersections(positions).hash
    single = SHEET.astype(np.float32)
    positions[: len(single)] = single
    assert detector.proximity(single, 0.1, poses=[pose]).hash == detector.proximity(positions, 0.1).hash


def test_worlds():
    shapes = Shapes([(BALL, BALL_FACES), (BOX, BOX_FACES)], self_collision=False)
    detector, rng = hc.Detector(shapes.scene, backend="cpu", worlds=3), np.random.default_rng(3)
    poses = np.array([[random_pose(rng, 1) for _ in range(2)] for _ in range(3)])
    positions = np.array([shapes.positions(of_world) for of_world in poses])
    assert bits(detector.positions_at(poses)) == bits(positions)
    for got, expected in zip(detector.distances(poses=poses), detector.distances(positions), strict=True):
        assert gaps_as_bits(got) == gaps_as_bits(expected)
    assert detector.intersections(poses=poses).hash == detector.intersections(positions).hash


def test_no_pose_is_the_identity():
    shapes = Shapes([(BALL, BALL_FACES), (BALL + [2.5, 0, 0], BALL_FACES)], self_collision=False)
    detector = hc.Detector(shapes.scene, backend="cpu")
    assert gaps_as_bits(detector.distances()) == gaps_as_bits(
        detector.distances(np.concatenate([BALL, BALL + [2.5, 0, 0]]))
    )
    assert bits(detector.positions_at()) == bits(np.concatenate([BALL, BALL + [2.5, 0, 0]]))


def test_a_mesh_without_vertices_takes_its_row():
    empty = np.empty((0, 3)), np.empty((0, 3), np.uint32)
    shapes = Shapes([(BALL, BALL_FACES), empty, (BOX, BOX_FACES)], self_collision=False)
    poses = np.array([still_pose(np.random.default_rng(0), 2) for _ in range(3)])
    by_poses, by_positions = (hc.Detector(shapes.scene, backend="cpu", outputs=ALL_OUTPUTS) for _ in "ab")
    assert_equal(by_poses, by_positions, poses, shapes.positions(poses))
    assert hc.Detector(Shapes([empty], static={0}).scene).distances() == []


def test_the_sign_of_a_zero_in_a_pose_counts():
    triangle = np.array([[0, -0.0, -0.0], [1, -0.0, -0.0], [0, 1, -0.0]]), [[0, 1, 2]]
    shapes = Shapes([triangle, (BALL + [0, 0, 3], BALL_FACES)], static={1}, self_collision=False)
    by_poses, by_positions = (hc.Detector(shapes.scene, backend="cpu", outputs=ALL_OUTPUTS) for _ in "ab")
    for zero in (0.0, -0.0):
        poses = np.array([[0.5, zero, zero, 0, 0, 0, 1]])
        assert_equal(by_poses, by_positions, poses, shapes.positions(poses))


def test_changed_thickness_filters_and_pickled_scenes_count():
    shapes = Shapes([(BALL, BALL_FACES), (BOX, BOX_FACES)], self_collision=False)
    shapes.scene.ignore_faces("m0", range(40), "m1")
    scene, pose = pickle.loads(pickle.dumps(shapes.scene)), np.array([[0, 0, 0, 0, 0, 0, 1.0], [1.6, 0, 0, 0, 0, 0, 1]])
    detector, positions = hc.Detector(scene, backend="cpu"), shapes.positions(pose)
    assert gaps_as_bits(detector.distances(poses=pose)) == gaps_as_bits(detector.distances(positions))
    detector.set_thickness("m0", np.linspace(0, 0.1, len(BALL_FACES)))
    assert gaps_as_bits(detector.distances(poses=pose)) == gaps_as_bits(detector.distances(positions))
    assert detector.proximity(distance=0.2, poses=pose).hash == detector.proximity(positions, 0.2).hash


def test_separations_pairs_and_accuracies_hold():
    shapes = Shapes([(BALL, BALL_FACES), (BOX, BOX_FACES), (SHEET, SHEET_FACES)])
    shapes.scene.ignore_pair("m0", "m2")
    shapes.scene.set_features("m0", "m1", "edge_edge")
    rng = np.random.default_rng(1)
    for accuracy in ("fast", "balanced", "conservative"):
        by_poses, by_positions = (
            hc.Detector(shapes.scene, backend="cpu", accuracy=accuracy, outputs=ALL_OUTPUTS) for _ in "ab"
        )
        poses = np.array([random_pose(rng, 0.8) for _ in range(3)])
        assert_equal(by_poses, by_positions, poses, shapes.positions(poses))


@pytest.mark.parametrize(
    ("poses", "error", "message"),
    [
        ([[0, 0, 0, 0, 0, 0, 1]], ValueError, r"poses: expected shape \(2, 7\)"),
        ([0, 0, 0, 0, 0, 0, 1], ValueError, r"poses: expected shape \(2, 7\)"),
        (np.eye(4)[None].repeat(2, 0), ValueError, "from matrices"),
        ([[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 0]], ValueError, r"poses\[1\]: its quaternion has length 0"),
        ([[0, 0, 0, 0, 0, 0, 2], [0, 0, 0, 0, 0, 0, 1]], ValueError, r"poses\[0\]: its quaternion has length 2"),
        ([[0, np.nan, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, 0, 1]], ValueError, r"poses\[0\]: is not finite"),
        ([[0, 0, 0, 0, 0, 0, 1], [0, 0, 0, 0, 0, np.inf, 1]], ValueError, r"poses\[1\]: is not finite"),
        ("poses", TypeError, "poses: expected an array of numbers"),
    ],
)
def test_invalid_poses_are_rejected(poses, error, message):
    detector = hc.Detector(Shapes([(BALL, BALL_FACES), (BOX, BOX_FACES)]).scene)
    with pytest.raises(error, match=message):
        detector.distances(poses=poses)
    assert len(detector.distances(poses=[[0, 0, 0, 0, 0, 0, 1]] * 2)) == 3


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (BALL.T, "transpose it"),
        (BALL[:-1], r"shape: expected \d+ rows"),
        (np.where(np.arange(len(BALL)) == 5, np.nan, 1.0)[:, None] * BALL, r"shape\[5, 0\] is nan"),
        (BALL * 1e301, r"shape\[0, \d\]"),
    ],
)
def test_invalid_shapes_are_rejected(shape, message):
    with pytest.raises(ValueError, match=message):
        hc.Scene().add_mesh("ball", BALL_FACES, shape=shape)


def test_positions_and_poses_are_not_mixed_up():
    scene = hc.Scene()
    scene.add_mesh("cloth", SHEET_FACES)
    scene.add_mesh("ball", BALL_FACES, shape=BALL)
    detector, pose = hc.Detector(scene), [[0, 0, 0, 0, 0, 0, 1]]
    with pytest.raises(ValueError, match="meshes without a shape"):
        detector.distances(np.concatenate([SHEET, BALL]), poses=pose)
    with pytest.raises(TypeError, match="have no shape"):
        detector.distances(poses=pose)
    with pytest.raises(ValueError, match=r"poses: expected shape \(0, 7\)"):
        hc.Detector(Shapes([(BALL, BALL_FACES), (BOX, BOX_FACES)], static={0, 1}).scene).distances(poses=pose)
    plain = hc.Scene()
    plain.add_mesh("cloth", SHEET_FACES)
    with pytest.raises(TypeError, match="got neither"):
        hc.Detector(plain).distances()
    with pytest.raises(TypeError, match="distance is missing"):
        hc.Detector(plain).proximity(SHEET)
    with pytest.raises(ValueError, match="distance: must be finite"):
        hc.Detector(plain).proximity(SHEET, math.nan)
    with pytest.raises(TypeError, match="stream: expected a cudaStream_t"):
        hc.Detector(Shapes([(BALL, BALL_FACES)]).scene).distances(poses=pose, stream="x")
    with pytest.raises(ValueError, match="not offered with detail"):
        hc.Detector(Shapes([(BALL, BALL_FACES)]).scene, detail=0.5).distances(poses=pose)
