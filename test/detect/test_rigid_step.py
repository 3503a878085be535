# SPDX-License-Identifier: Apache-2.0
"""Steps in which meshes move by poses, against motion in pieces so short that straight lines are as good. No ROS."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from waving_sheet import sheet_faces, sheet_positions

import hpccd_core as hc
from hpccd_core.options import OUTPUTS
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.screw import Screw
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import Separation
from hpccd_ros.detect.step_detector import StepDetector
from hpccd_ros.frames.types import MeshSettings, Placement, SceneFrame, Topology

N = 10
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.3, 0.06, 0.02]
BOX = Topology(
    0,
    8,
    np.array(
        [
            [0, 1, 3],
            [0, 3, 2],
            [4, 6, 7],
            [4, 7, 5],
            [0, 4, 5],
            [0, 5, 1],
            [2, 3, 7],
            [2, 7, 6],
            [0, 2, 6],
            [0, 6, 4],
            [1, 5, 7],
            [1, 7, 3],
        ],
        np.uint32,
    ),
)
SHEET = Topology(0, N * N, sheet_faces(N))
BODY = Body.of(CORNERS)
MESHES = tuple(
    MeshSettings(name, self_collision=name == "cloth", input=kind)
    for name, kind in (("blade", "pose"), ("cloth", "vertices"), ("spinner", "tf"))
)
SAMPLES = 400
OPTIONS = Options(backend="cpu", threads=1, rigid=RigidOptions(1e-3, 64))


def frame(stamp, poses, k):
    places = [Placement(BODY, pose) for pose in poses]
    vertices = (places[0].vertices, sheet_positions(N, k), places[1].vertices)
    return SceneFrame(stamp, stamp, "", (BOX, SHEET, BOX), vertices, ("blade",), 0.0, (places[0], None, places[1]))


def random_step(rng):
    """Two blades that turn about the middle of a waving sheet by up to half a turn each."""
    ends = []
    for _ in range(2):
        quaternions = rng.normal(0, 1, (2, 4))
        quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
        ends.append([Rigid.of(rng.normal(0, 0.1, 3) + [0.3, 0.5, 0.1], q) for q in quaternions])
    return frame(1, ends[0], 3), frame(2, ends[1], 4)


def sampled(start, end, rules=()):
    """Earliest times of contact by pieces: {kind: {pair: (toc, part)}}."""
    screws = [Screw.between(a.pose, b.pose) for a, b in zip(start.placements, end.placements, strict=True) if a]
    scene = hc.Scene()
    for mesh, topology in zip(MESHES, (BOX, SHEET, BOX), strict=True):
        scene.add_mesh(mesh.name, topology.faces, n_vertices=topology.n_vertices, self_collision=mesh.self_collision)
    for rule in rules:
        scene.ignore_pair(*rule)
    detector = hc.Detector(scene, backend="cpu", threads=1)
    positions = []
    for k in range(SAMPLES + 1):
        t = k / SAMPLES
        cloth = start.vertices[1] + t * (end.vertices[1].astype(float) - start.vertices[1])
        positions.append(np.concatenate([screws[0].vertices(BODY, t), cloth, screws[1].vertices(BODY, t)]))
    times = {"vf": {}, "ee": {}}
    for k, (a, b) in enumerate(pairwise(positions)):
        found = detector.detect(a, b)
        for kind, of_kind in times.items():
            for pair, toc in zip(map(tuple, getattr(found, kind).tolist()), getattr(found, f"{kind}_toc"), strict=True):
                of_kind.setdefault(pair, (k + toc) / SAMPLES)
    return times


def told(contacts, kind):
    return dict(zip(map(tuple, getattr(contacts, kind).tolist()), getattr(contacts, f"{kind}_toc"), strict=True))


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_missed_and_what_the_cloth_does_by_itself_is_exact(seed):
    start, end = random_step(np.random.default_rng(seed))
    detector = StepDetector(SceneBuilder(MESHES), OPTIONS)
    found = detector.detect(start, end)
    truth = sampled(start, end)
    assert found.bounds.parts > 1 and len(found.bounds.of_meshes) == 3
    assert found.bounds.of_meshes[1] < 1e-14 < max(found.bounds.of_meshes) <= 1.001e-3
    total = 0
    for kind, times in truth.items():
        mine = told(found.contacts, kind)
        total += len(times)
        for pair, toc in times.items():
            assert mine[pair] <= toc + 1e-3
    assert total > 20
    alone = hc.Scene()
    alone.add_mesh("cloth", SHEET.faces)
    own = hc.Detector(alone, backend="cpu").detect(start.vertices[1], end.vertices[1])
    of_cloth = {
        tuple(v - len(CORNERS) for v in pair): toc
        for pair, toc in told(found.contacts, "ee").items()
        if all(len(CORNERS) <= v < len(CORNERS) + N * N for v in pair)
    }
    assert of_cloth == told(own, "ee") and len(own) > 0


def test_finer_cuts_report_less_in_excess():
    start, end = random_step(np.random.default_rng(8))
    counts, bounds = [], []
    for tolerance in (0.1, 1e-2, 1e-3, 1e-4):
        options = replace(OPTIONS, rigid=RigidOptions(tolerance, 1000))
        found = StepDetector(SceneBuilder(MESHES), options).detect(start, end)
        counts.append(len(found.contacts))
        bounds.append(max(found.bounds.of_meshes))
    assert counts == sorted(counts, reverse=True) and counts[0] > counts[-1]
    assert all(bound <= 1.001 * tolerance for bound, tolerance in zip(bounds, (0.1, 1e-2, 1e-3, 1e-4), strict=True))


def test_most_parts_bound_the_work_and_the_bound_tells():
    start, end = random_step(np.random.default_rng(8))
    options = replace(OPTIONS, rigid=RigidOptions(1e-6, 2))
    found = StepDetector(SceneBuilder(MESHES), options).detect(start, end)
    assert found.bounds.parts == 2 and max(found.bounds.of_meshes) > 1e-3
    for kind, times in sampled(start, end).items():
        assert times.keys() <= told(found.contacts, kind).keys()


@pytest.mark.parametrize("report", ["first", "any"])
def test_first_and_any(report):
    for seed in range(4):
        start, end = random_step(np.random.default_rng(seed))
        every = StepDetector(SceneBuilder(MESHES), OPTIONS).detect(start, end).contacts
        found = StepDetector(SceneBuilder(MESHES), replace(OPTIONS, report=report)).detect(start, end).contacts
        assert 0 < len(found) <= len(every)
        for kind in ("vf", "ee"):
            times = told(every, kind)
            assert all(times[pair] == toc for pair, toc in told(found, kind).items()) or report == "any"
            assert told(found, kind).keys() <= times.keys()
        if report == "any":
            assert len(found) == 1
        if report == "first":
            assert found.first_toc == every.first_toc
            at_first = sum((toc == every.first_toc).sum() for toc in (every.vf_toc, every.ee_toc))
            assert len(found) == at_first


def test_separations_change_without_a_new_scene_and_results_do_not_depend_on_what_came_before():
    start, end = random_step(np.random.default_rng(2))
    wide = Separation(0.0, (("blade", "cloth", 0.05), ("cloth", "cloth", 0.002)))
    fresh = {}
    for separation in (Separation(), wide):
        options = replace(OPTIONS, separation=separation)
        fresh[separation] = StepDetector(SceneBuilder(MESHES), options).detect(start, end).contacts
    kept = StepDetector(SceneBuilder(MESHES), OPTIONS)
    for separation in (Separation(), wide, wide, Separation(), wide):
        kept.options = replace(OPTIONS, separation=separation)
        found = kept.detect(start, end)
        assert found.contacts.hash == fresh[separation].hash and len(found.contacts) == len(fresh[separation])
        kept.detect(end, start)
    assert len(fresh[wide]) > len(fresh[Separation()])


def test_outputs_and_distances():
    start, end = random_step(np.random.default_rng(3))
    options = replace(OPTIONS, outputs=OUTPUTS, distances=True)
    found = StepDetector(SceneBuilder(MESHES), options).detect(start, end)
    n = len(found.contacts)
    assert found.contacts.points.shape == found.contacts.normals.shape == (n, 3)
    assert found.contacts.closest.shape == (n, 2, 3)
    assert found.contacts.vertices.shape == found.contacts.weights.shape == (n, 4)
    assert found.bounds.parts > 1 and np.allclose(found.contacts.weights.sum(axis=1), 0)
    assert found.contacts.approach.shape == (n,) and (found.contacts.approach < 0).any()
    assert [(gap.mesh_a, gap.mesh_b) for gap in found.gaps] == [
        ("blade", "cloth"),
        ("blade", "spinner"),
        ("cloth", "cloth"),
        ("cloth", "spinner"),
    ]


def test_no_pair_but_rigid_ones():
    meshes = tuple(replace(mesh, self_collision=False) for mesh in MESHES)
    start, end = random_step(np.random.default_rng(4))
    builder = SceneBuilder(meshes, ignored_pairs=(("blade", "spinner"),))
    assert builder.of_other_pairs() is None
    found = StepDetector(builder, OPTIONS).detect(start, end)
    truth = sampled(start, end, rules=(("cloth", "cloth"), ("blade", "spinner")))
    assert truth["vf"].keys() <= told(found.contacts, "vf").keys() and len(truth["ee"]) > 0
    offset = len(CORNERS) + N * N
    assert not any(v < len(CORNERS) and w >= offset for v, _, w, _ in found.contacts.ee.tolist())


def test_a_body_at_rest_costs_one_part():
    pose = Rigid.of((0.3, 0.5, 0.1), (0, 0, 0, 1))
    found = StepDetector(SceneBuilder(MESHES), OPTIONS).detect(frame(1, [pose] * 2, 3), frame(2, [pose] * 2, 4))
    assert found.bounds.parts == 1 and max(found.bounds.of_meshes) < 1e-12 and len(found.contacts) > 0


def test_a_shape_given_anew_goes_straight():
    start, end = random_step(np.random.default_rng(5))
    other = Body.of(1.5 * CORNERS)
    places = tuple(Placement(other, place.pose) if place else None for place in end.placements)
    vertices = tuple(place.vertices if place else v for place, v in zip(places, end.vertices, strict=True))
    end = replace(end, placements=places, vertices=vertices)
    found = StepDetector(SceneBuilder(MESHES), OPTIONS).detect(start, end)
    assert found.bounds.parts == 1 and found.bounds.of_meshes == (0.0, 0.0, 0.0)
