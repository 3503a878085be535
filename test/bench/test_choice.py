# SPDX-License-Identifier: Apache-2.0
"""`hpccd bench accuracy --choose`: the cheapest setting that keeps bounds."""

import sys
from types import SimpleNamespace

import numpy as np
import pytest
from sources import ROOT

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import accuracy, choice
from hpccd_ros.bench.choice import ASKED, Asked, Outcome, Setting

STRIP = ("folding-strip", "--size", "0.1", "--steps", "2", "--repeat", "1")


def outcome(accuracy, ms, asked="all", **values):
    return Outcome(Setting(accuracy, "cpu", asked), ms, dict.fromkeys(choice.QUANTITIES, 0.0) | values)


def test_bounds_are_read():
    bounds = choice.parse(" misses<1e-4,late <= 0 ,")
    assert [str(bound) for bound in bounds] == ["misses<0.0001", "late<=0"]
    assert not bounds[0].keeps(1e-4) and bounds[0].keeps(0.99e-4)
    assert bounds[1].keeps(0.0) and not bounds[1].keeps(1e-300)


NO_BOUNDS = {
    "": "name at least one bound",
    "misses": "write QUANTITY<NUMBER",
    "misses>1e-4": "write QUANTITY<NUMBER",
    "misses=0": "QUANTITY<=NUMBER",
    "misses<1e-4; late<1": "with commas between",
    "mises<1e-4": "choose from misses, spurious, late, early, error",
    "misses<few": "few is not a number",
    "late<nan": "bounds nothing",
    "late<-1": "bounds nothing",
    "late<0": "write late<=0",
    "late<1, late<2": "bounded twice",
}


@pytest.mark.parametrize("text", NO_BOUNDS)
def test_what_is_no_bound_is_explained(text):
    with pytest.raises(UserError, match="--choose") as raised:
        choice.parse(text)
    assert NO_BOUNDS[text] in str(raised.value)


def test_the_cheapest_that_keeps_all_bounds_is_taken():
    fast, balanced, exact = outcome("fast", 1, misses=1e-3), outcome("balanced", 2, late=1e-14), outcome("exact", 3)
    for bounds, taken in {"misses<1e-2": fast, "misses<1e-3": balanced, "misses<1e-3, late<=0": exact}.items():
        assert choice.cheapest([exact, fast, balanced], choice.parse(bounds)) is taken
    # Among equally fast ones the more accurate one.
    alike = [outcome("balanced", 2.0, error=1e-14), outcome("exact", 2.09), outcome("exact", 2.2)]
    assert choice.cheapest(alike, choice.parse("misses<1e-3")) is alike[1]


def test_the_nearest_goes_beyond_its_worst_bound_the_least():
    bounds = choice.parse("misses<1e-4, error<=0")
    near, far = outcome("balanced", 9, misses=2e-4), outcome("fast", 1, misses=9e-5, error=1e-9)
    assert choice.cheapest([near, far], bounds) is None
    assert choice.nearest([near, far], bounds) is near


def test_the_front_holds_whom_none_beats_that_asks_for_the_same():
    fast, slow = outcome("fast", 1, misses=1e-3), outcome("exact", 2)
    beaten, other = outcome("balanced", 3, error=1e-14), outcome("exact", 0.1, asked="any")
    assert choice.front([fast, slow, beaten, other]) == [fast, slow, other]
    coarse = Outcome(Setting("exact", "cpu", "all", 0.1), 0.5, dict.fromkeys(choice.QUANTITIES, 0.0) | {"deviation": 1})
    assert choice.front([fast, slow, coarse]) == [fast, slow, coarse]


def test_outcomes_are_of_the_worst_scene_and_of_settings_that_all_were_tested_with():
    row = {"accuracy": "fast", "backend": "cpu", "asked": "all", "true": 10, "reported": 8, "missed": 2, "invented": 0}
    row |= {"latest": 0.1, "earliest": 0.2, "toc_worst": 0.2, "step_ms": 3.0, "scene": "a"}
    other = row | {"scene": "b", "missed": 0, "invented": 2, "step_ms": 1.0}
    (found,) = choice.outcomes([row, row | {"step_ms": 99.0}, other, row | {"accuracy": "exact"}])
    assert found.setting == Setting("fast", "cpu") and found.ms == 2.0
    assert found.values == {"misses": 0.2, "spurious": 0.25, "late": 0.1, "early": 0.2, "error": 0.2, "deviation": 0.0}


class Found:
    """Contacts as a detector would report them."""

    def __init__(self, vf, toc):
        self.vf, self.vf_toc = np.array(vf, np.uint32).reshape(-1, 2), np.array(toc)
        self.ee, self.ee_toc = np.empty((0, 4), np.uint32), np.empty(0)
        self.first_toc = min(toc, default=np.inf)

    def __len__(self):
        return len(self.vf)


def test_wrong_results_count_against_what_is_asked():
    every, first, any_, faces, edges, *_ = ASKED
    true = vars(Found([[0, 1], [2, 3]], [0.25, 0.5]))
    true = {key: true[key] for key in ("vf", "vf_toc", "ee", "ee_toc")}
    late, none = Found([[2, 3]], [0.625]), Found([], [])
    for asked, found, expected in (
        (every, late, (2, 1, 0, 0.125)),
        (first, late, (1, 0, 0, 0.375)),
        (any_, late, (1, 0, 0, 0.125)),
        (first, none, (1, 1, 0, 0.0)),
        (any_, none, (1, 1, 0, 0.0)),
        (edges, none, (0, 0, 0, 0.0)),
        (faces, late, (2, 1, 0, 0.125)),
    ):
        errors = asked.errors(found, true)
        assert (errors.true, errors.missed, errors.invented, errors.latest) == expected


class Step:
    """Three meshes of a triangle each."""

    meshes = [SimpleNamespace(n_vertices=3)] * 3

    def faces(self):
        return np.arange(9).reshape(3, 3)


def test_errors_of_meshes_are_those_of_the_first_contact_of_each_pair():
    of_meshes, any_ = ASKED[-2:]
    true = vars(Found([[0, 1], [4, 0], [0, 2]], [0.5, 0.25, 0.75]))  # 0 and 1 from 0.25, 0 and 2 from 0.75
    true = {key: true[key] for key in ("vf", "vf_toc", "ee", "ee_toc")}
    exact, none, within = Found([[1, 1], [1, 2]], [0.25, 0.75]), Found([], []), Found([[0, 0]], [0.1])
    early = Found([[1, 0], [3, 1]], [0.125, 0.5])  # of coarse faces in another order: 0 and 1, 1 and 2
    for found, faces, expected in (
        (exact, None, (2, 0, 0, 0.0)),
        (none, None, (2, 2, 0, 0.0)),
        (within, None, (2, 2, 0, 0.0)),
        (early, np.array([[3, 4, 5], [6, 7, 8]]), (2, 1, 1, 0.125)),
    ):
        errors = of_meshes.errors(found, true, Step(), faces)
        assert (errors.true, errors.missed, errors.invented, errors.toc_worst) == expected and errors.latest == 0
        errors = any_.errors(found, true, Step(), faces)
        assert (errors.true, errors.missed, errors.invented) == (1, int(expected[1] == 2), 0)
    intersecting = Found([], [])
    intersecting.ef = np.array([[0, 1, 1]])
    assert of_meshes.errors(intersecting, true, Step()).toc_worst == 0.25  # at the start


def test_a_setting_is_written_for_python_and_for_the_node(monkeypatch):
    python, node = Setting("balanced", "cpu", "first").as_written().split("; ")
    asked = eval(python, {"hc": SimpleNamespace(Detector=lambda scene, **options: options), "scene": None})
    assert asked == {"accuracy": "balanced", "backend": "cpu", "report": "first"}
    assert node == "hpccd_node --ros-args -p accuracy:=balanced -p backend:=cpu -p report:=first"
    assert "detail" not in python and Setting("exact", "cpu", "meshes", 0.1).as_written() == (
        'hc.Detector(scene, accuracy="exact", backend="cpu", detail=0.1); '
        "hpccd_node --ros-args -p accuracy:=exact -p backend:=cpu "
        '-p stop_detail:="[NAME:0.1]" for each mesh NAME; all meshes with self_collision false'
    )
    # An option of several words is a list.
    monkeypatch.setattr(choice, "ASKED", (*ASKED, Asked("some", {"outputs": ("points", "normals")})))
    python, node = Setting("exact", "cpu", "some").as_written().split("; ")
    assert python.endswith("backend=\"cpu\", outputs=('points', 'normals'))")
    assert node.endswith(' -p outputs:="[points, normals]"')


def test_a_recording_is_a_scene_to_choose_for(product, capsys):
    recording = str(ROOT / "bags" / "cloth-drop-small.mcap")
    few = ("--steps", "2", "--repeat", "1", "--ask", "all,first", "--choose", "misses<=0, late<1e-9")
    status, result, _ = product("accuracy", recording, *few)
    assert status == 0 and result["failures"] == [] and "--choose 'misses<=0, late<1e-9'" in result["command"]
    assert {row["part"] for row in result["rows"]} == {"scene"}
    assert {row["asked"] for row in result["rows"]} == {"all", "first"}
    (chosen,) = (row for row in result["rows"] if row["chosen"])
    assert chosen["missed"] == 0 and chosen["latest"] < 1e-9
    assert f'accuracy="{chosen["accuracy"]}"' in capsys.readouterr().out


def test_where_none_keeps_the_bounds_the_nearest_is_named(product, monkeypatch):
    monkeypatch.setattr(Outcome, "broken", lambda self, bounds: list(bounds))
    status, result, _ = product("accuracy", *STRIP, "--choose", "error<1e-20")
    assert status == 1
    (said,) = result["failures"]
    assert "no setting keeps error<1e-20; the nearest is" in said and "-p accuracy:=" in said


def test_where_nothing_touches_nothing_is_chosen(product, tmp_path):
    np.savez(tmp_path / "alone.npz", vertices_t0=np.eye(3), vertices_t1=np.eye(3) + 1, faces=np.array([[0, 1, 2]]))
    for steps in ("1", "0"):
        words = (str(tmp_path / "alone.npz"), "--steps", steps, "--repeat", "1", "--choose", "misses<1e-4")
        status, result, _ = product("accuracy", *words)
        assert status == 1 and not any(row.get("chosen") for row in result["rows"])
        (said,) = result["failures"]
        assert "no contact in the steps measured" in said and ("--steps 0" in said) == (steps == "1")


def test_what_too_few_contacts_cannot_show_is_said_and_the_trade_is_drawn(product, tmp_path):
    words = ("--tiers", "fast,exact", "--choose", "misses<1e-9, late<1e-3", "--picture", str(tmp_path / "trade.png"))
    status, result, _ = product("accuracy", *STRIP, *words)
    assert status == 0 and (tmp_path / "trade.png").read_bytes().startswith(b"\x89PNG")
    (said,) = (note for note in result["notes"] if "true contacts" in note)
    assert "misses<1e-09" in said and "late" not in said


def test_coarse_meshes_are_tried_where_a_deviation_is_tolerated(product, tmp_path):
    pytest.importorskip("fast_simplification")
    scene = ("cloth-drop", "--size", "0.3", "--steps", "1", "--repeat", "1", "--tiers", "exact")
    words = ("--ask", "any_meshes", "--choose", "misses<=0, deviation<1", "--picture", str(tmp_path / "trade.png"))
    status, result, _ = product("accuracy", *scene, *words)
    assert status == 0 and result["failures"] == []
    rows = {row["detail"]: row for row in result["rows"]}
    assert set(rows) == {1.0, 0.3, 0.1, 0.03} and {row["asked"] for row in result["rows"]} == {"any_meshes"}
    assert rows[1.0]["deviation"] == 0 < rows[0.3]["deviation"] and all(row["missed"] == 0 for row in rows.values())
    status, result, _ = product("accuracy", *scene, "--detail", "0.1", "--ask", "all")
    assert status == 0 and {(row["asked"], row["detail"]) for row in result["rows"]} == {
        ("all", 1.0),
        ("meshes", 1.0),
        ("meshes", 0.1),
    }


def test_one_mesh_is_not_asked_which_meshes_touch(product, capsys):
    status, result, _ = product("accuracy", *STRIP, "--tiers", "exact", "--ask", "all,meshes")
    assert status == 0 and [row["asked"] for row in result["rows"]] == ["all"]
    assert product("accuracy", *STRIP, "--ask", "meshes")[0] != 0 and "no scene has two" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["2", "0", "few", "0.1,1"])
def test_a_detail_is_a_part(text):
    with pytest.raises(UserError, match="must be a number above 0 and below 1"):
        accuracy.details(text)


def test_without_the_simplifier_no_detail_is_tried(monkeypatch):
    monkeypatch.setitem(sys.modules, "fast_simplification", None)
    with pytest.raises(UserError, match="pip install"):
        accuracy.details("0.1")
    assert accuracy.details("") == []
