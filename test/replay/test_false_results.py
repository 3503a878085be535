# SPDX-License-Identifier: Apache-2.0
"""Results that are not what the node would have sent diverge, however they are disguised."""

import functools
import json
import math

import numpy as np
import pytest
from bag_tools import typestore
from hostile_kinds import decoded
from in_process import hpccd
from mcap_model import Bag

import hpccd_core as hc
from hpccd_core.options import REPORTS
from hpccd_core.results import OUTPUT_ARRAYS
from hpccd_ros.picture import view

RESULT = 3


@pytest.fixture
def with_change(sound_bags, tmp_path):
    """Replays a copy with one result changed by `change(put, result)`, put(field, value); options for the node."""

    def replay(change, source="streams.mcap", **parameters):
        bag = Bag.read(sound_bags / source)
        info = json.loads(bag.metadata[0].metadata["json"])
        info["parameters"] |= parameters
        bag.metadata[0].metadata["json"] = json.dumps(info)
        if "report" in parameters:
            number = 1 + REPORTS.index(parameters["report"])
            decoded(bag, "/contacts", _First(), lambda put, result: put("report", number), all_of_them=True)
        target = bag.of_topic("/contacts")[RESULT]
        others, bag.messages = bag.messages, [target]
        decoded(bag, "/contacts", _First(), change)
        bag.messages = others
        done = hpccd("replay", bag.write(tmp_path / "x.mcap"))
        assert not done.traceback, done.traceback
        return done

    return replay


class _First:
    @staticmethod
    def choice(things):
        return things[0]


def _diverges(done, says):
    assert done.status == 1 and "DIVERGED: 1 of 7 results differ" in done.out and says in done.out, done.out


def _vertices(sound_bags):
    bag, name = Bag.read(sound_bags / "streams.mcap"), "hpccd/msg/MeshTopology"
    data = bag.of_topic("/meshes/cloth/topology")[0].data
    return typestore().deserialize_cdr(data, name).n_vertices


def test_the_same_number_in_the_scene_under_another_mesh(with_change, sound_bags):
    shift = _vertices(sound_bags)

    def change(put, result):
        mesh, features = result.mesh_a.copy(), result.features_a.copy()
        sign = 1 if mesh[0] == 1 else -1
        mesh[0] = 1 - mesh[0]
        features[0] = np.uint32((int(features[0]) + sign * shift) % 2**32)
        put("mesh_a", mesh)
        put("features_a", features)

    _diverges(with_change(change), "malformed: features_a of contact 0 are ")


def test_an_entry_that_is_not_used(with_change):
    def change(put, result):
        features = result.features_b.copy()
        features[1] = 5
        put("features_b", features)

    _diverges(with_change(change), "malformed: features_b of contact 0 are ")


@pytest.mark.parametrize("name", OUTPUT_ARRAYS)
def test_outputs_of_another_number(with_change, name):
    def change(put, result):
        put(name, np.zeros(5, getattr(result, name).dtype))

    _diverges(with_change(change), f"malformed: {name} has 5 entries for")


@pytest.mark.parametrize("name", OUTPUT_ARRAYS)
def test_an_output_that_the_core_does_not_compute(with_change, name):
    """A replay computes the outputs that a result has; everything.mcap has all."""
    done = with_change(lambda put, result: None, "everything.mcap")
    assert done.status == 0 and "VERIFIED" in done.out, done.out

    def change(put, result):
        values = getattr(result, name).copy()
        values[-1] = values[-1] + 1 if values.dtype.kind == "u" else np.nextafter(values[-1], np.inf)
        put(name, values)

    done = with_change(change, "everything.mcap")
    assert done.status == 1 and f"{name} of contact " in done.out and "] was recorded, now it is [" in done.out


def test_a_zero_of_another_sign(with_change):
    def change(put, result):
        assert (result.weights == 0).any()
        put("weights", np.where(result.weights == 0, -result.weights, result.weights))

    done = with_change(change, "everything.mcap")
    assert done.status == 1 and "weights of contact " in done.out, done.out


def test_marked_as_cut_off_though_it_is_whole(with_change):
    _diverges(with_change(lambda put, result: put("truncated", True)), "contacts are marked as truncated")


def test_a_time_that_is_no_number(with_change):
    def change(put, result):
        put("toc", np.where(np.arange(len(result.toc)) == 0, math.nan, result.toc))

    _diverges(with_change(change), "recorded at t = nan")


@pytest.mark.parametrize("accuracy", ["", "exakt", "a" * 100_000])
def test_found_with_an_accuracy_that_there_is_not(with_change, accuracy):
    _diverges(with_change(lambda put, result: put("accuracy", accuracy)), "malformed: its accuracy is ")


def _only(rows):
    """A change that keeps these contacts of the result."""

    def change(put, result):
        for name, size in {"kind": 1, "mesh_a": 1, "mesh_b": 1, "features_a": 2, "features_b": 2, "toc": 1}.items():
            put(name, getattr(result, name).reshape(-1, size)[rows].reshape(-1))
        for name in OUTPUT_ARRAYS:
            put(name, getattr(result, name)[:0])
        put("total", len(result.kind))
        put("first_toc", float(min(result.toc, default=math.inf)))

    return change


def test_any_contact_is_verified_where_any_was_asked_for(with_change):
    done = with_change(_only([5]), report="any")
    assert done.status == 0, done
    assert "VERIFIED: 7 results hold a contact where there is one, and one that there is" in done.out


def test_the_core_finds_the_same_time_of_any_contact():
    """Or the comparison above would call the node's own results wrong."""
    generator = np.random.default_rng(5)
    faces = np.arange(120).reshape(-1, 3)
    scene = hc.Scene()
    scene.add_mesh("soup", faces)
    for _ in range(20):
        t0, t1 = generator.normal(size=(2, 120, 3))
        every = hc.Detector(scene, backend="cpu").detect(t0, t1)
        any_one = hc.Detector(scene, backend="cpu", report="any").detect(t0, t1)
        rows = {
            (*map(int, row), toc)
            for name in ("vf", "ee")
            for row, toc in zip(getattr(every, name), getattr(every, name + "_toc"), strict=True)
        }
        found = [
            (*map(int, row), toc)
            for name in ("vf", "ee")
            for row, toc in zip(getattr(any_one, name), getattr(any_one, name + "_toc"), strict=True)
        ]
        assert found and set(found) <= rows and any_one.first_toc == min(row[-1] for row in found)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda put, result: put("toc", result.toc[::-1].copy()), "now at t = "),
        (
            lambda put, result: put(
                "features_b", np.where(np.arange(len(result.features_b)) == 0, 0, result.features_b)
            ),
            "now not found",
        ),
        (lambda put, result: put("total", 1), "1 contacts in total"),
        (lambda put, result: put("first_toc", 0.5), "first time of contact"),
        (_only([]), "0 contacts were recorded"),
        (lambda put, result: put("kind", result.kind[:-1]), "malformed"),
    ],
)
def test_any_contact_must_be_one_that_there_is(with_change, change, says):
    _diverges(with_change(change, report="any"), says)


def test_coordinates_that_the_core_rejects(sound_bags, tmp_path):
    bag = Bag.read(sound_bags / "everything.mcap")

    def change(put, message):
        put("vertices_f64", np.full_like(message.vertices_f64, 1e300))

    decoded(bag, "/meshes/cloth/vertices", _First(), change, all_of_them=True)
    path = bag.write(tmp_path / "x.mcap")
    done = hpccd("replay", path)
    # Rejected as the node rejects them, before the core sees them.
    assert done.status == 1 and "NOTHING VERIFIED" in done.out and "out_of_range" in done.out, done
    assert hpccd("view", path, "-o", tmp_path / "x.png").status == 2


@pytest.mark.parametrize("factor", [1e30, 1e-35])
def test_pictures_of_scenes_beyond_single_precision(sound_bags, tmp_path, factor, monkeypatch):
    monkeypatch.setattr(view, "draw_step", functools.partial(view.draw_step, size=(160, 120)))  # sooner
    bag = Bag.read(sound_bags / "everything.mcap")

    def change(put, message):
        put("vertices_f64", message.vertices_f64 * factor)

    decoded(bag, "/meshes/cloth/vertices", _First(), change, all_of_them=True)
    done = hpccd("view", bag.write(tmp_path / "x.mcap"), "-o", tmp_path / "x.png")
    assert done.status == 0 and not done.err, done


@pytest.mark.parametrize("name", ["vertices", "weights", "approach"])
def test_one_array_of_an_output_left_out(with_change, name):
    """The node sends all arrays of an output or none."""

    def change(put, result):
        put(name, getattr(result, name)[:0])

    done = with_change(change, "everything.mcap")
    assert done.status == 1 and f"malformed: {name} is empty" in done.out, done.out
