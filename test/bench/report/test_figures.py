# SPDX-License-Identifier: Apache-2.0
"""Pictures show the numbers of the result that they are drawn from."""

import dataclasses

import pytest
from sources import ROOT

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench.report import drawing, figures, panels_trade
from hpccd_ros.bench.report.results import Kept

RESULTS = ROOT / "hpccd_core" / "bench" / "results"
BY_NAME = {figure.name: figure for figure in figures.FIGURES}


def kept(figure):
    return Kept.read(RESULTS / f"{figure.kept}.json", figure.benchmark)


def lines(axis):
    """{label: [(x, y), ...]} of the lines that a legend names."""
    found = {line.get_label(): list(zip(*line.get_data(), strict=True)) for line in axis.get_lines()}
    return {label: points for label, points in found.items() if not label.startswith("_")}


def widths(axis):
    """Lengths of the bars, by their place."""
    found = {}
    for bar in axis.patches:
        found.setdefault(round(bar.get_y() + bar.get_height() / 2), []).append(bar.get_width())
    return found


@pytest.mark.parametrize("figure", [f for f in figures.FIGURES if f.kept], ids=lambda f: f.name)
def test_committed_pictures_can_be_drawn_again(figure):
    result = kept(figure)
    page = figure.compose(result)
    headings = [figure.heading(rows) for rows in drawing.by(figure.shown(result), *figure.panel)]
    titles = [axis.get_title() for axis in page.axes if axis.axison]
    assert titles[bool(figure.overview) :] == headings and len(headings) > 1
    assert (ROOT / "docs" / "figures" / f"{figure.name}.png").exists()


def test_scaling_has_a_line_for_each_method_and_each_scene():
    result = kept(BY_NAME["scaling"])
    overview, *panels = BY_NAME["scaling"].compose(result).axes
    of = {(r["scene"], r["method"], r["threads"]): r["speedup"] for r in result.rows}
    for axis, scene in zip(panels, ("cloth-ball", "cloth-funnel", "n-body"), strict=True):
        drawn = lines(axis)
        assert set(drawn) == {"default", "published", "naive", "front", "independent detectors", "linear"}
        assert drawn["naive"] == [(n, of[scene, "naive", n]) for n in (1, 2, 4)]
        assert lines(overview)[scene] == [(n, of[scene, "default", n]) for n in (1, 2, 4)]
    naive = [sum(of[scene, "naive", n] for scene in ("cloth-ball", "cloth-funnel", "n-body")) / 3 for n in (1, 2, 4)]
    assert [y for _, y in lines(overview)["naive, average"]] == pytest.approx(naive)


def test_hybrid_has_a_line_for_each_method_and_number_of_gpus():
    rows = [
        {
            "part": "threads and GPUs",
            "scene": "s",
            "accuracy": "balanced",
            "method": method,
            "threads": threads,
            "gpus": gpus,
            "speedup": threads * (1.0 + gpus) * (2 if method == "default" else 1),
        }
        for method in ("published", "default")
        for threads in (4, 1, 2)
        for gpus in (1, 0)
    ]
    result = dataclasses.replace(kept(BY_NAME["hybrid"]), rows=rows)
    (axis,) = BY_NAME["hybrid"].compose(result).axes
    assert lines(axis) == {
        "default, no GPU": [(1, 2), (2, 4), (4, 8)],
        "default, 1 GPU": [(1, 4), (2, 8), (4, 16)],
        "published, no GPU": [(1, 1), (2, 2), (4, 4)],
        "published, 1 GPU": [(1, 2), (2, 4), (4, 8)],
    }


def test_bars_of_stages_add_up_to_the_step():
    result = kept(BY_NAME["cpu"])
    axis = BY_NAME["cpu"].compose(result).axes[0]
    rows = [row for row in result.rows if row["scene"] == "cloth-ball"]
    assert [label.get_text() for label in axis.get_yticklabels()] == [row["variant"] for row in rows]
    for place, row in enumerate(rows):
        assert sum(widths(axis)[place]) == pytest.approx(row["median_ms"], rel=0.02)


def test_wrong_contacts_stand_in_the_picture():
    methods = BY_NAME["methods"]
    rows = [
        {
            "scene": "s",
            "variant": "default",
            "threads": 4,
            "accuracy": "exact",
            "sequence_ms": 8.0,
            "steps": 2,
            "same_contacts": same,
        }
        for same in (True, False)
    ]
    (axis,) = methods.compose(dataclasses.replace(kept(BY_NAME["cpu"]), rows=rows)).axes
    assert widths(axis) == {0: [4.0], 1: [4.0]}
    assert [text.get_text().strip() for text in axis.texts] == ["4", "4  OTHER CONTACTS"]


def test_the_trade_has_a_point_for_each_setting_and_one_for_each_scene():
    def row(scene, accuracy, asked, ms, missed, error):
        return {
            "part": "scene",
            "scene": scene,
            "accuracy": accuracy,
            "backend": "cpu",
            "simd": "auto",
            "asked": asked,
            "step_ms": ms,
            "contacts": 100,
            "true": 100,
            "reported": 100 - missed,
            "missed": missed,
            "invented": 0,
            "toc_worst": error,
        }

    rows = [
        row("a", "exact", "all", 10.0, 0, 0.0),
        row("b", "exact", "all", 1.0, 0, 1e-15),
        row("a", "fast", "all", 5.0, 1, 1e-5),
        row("b", "fast", "all", 0.5, 2, 1e-4),
        row("a", "exact", "any", 1.0, 0, 0.0),
        row("b", "exact", "any", 0.1, 0, 0.0),
        row("c", "fast", "all", 1.0, 0, 0.0),  # nothing to compare with
    ]
    trade = BY_NAME["trade"]
    result = dataclasses.replace(kept(trade), rows=[*rows, rows[0] | {"simd": "scalar", "step_ms": 99.0}])
    whole = {
        (p["quantity"], p["accuracy"], p["asked"]): (p["x"], p["y"]) for p in trade.shown(result) if p["scene"] is None
    }
    assert whole == {
        ("wrong", "exact", "all"): (1, 0),
        ("wrong", "fast", "all"): (0.5, 0.02),
        ("wrong", "exact", "any"): (0.1, 0),
        ("error", "exact", "all"): (1, 1e-15),
        ("error", "fast", "all"): (0.5, 1e-4),
        ("error", "exact", "any"): (pytest.approx(0.1), 0),
    } | {("wrong", "exact", "any"): (pytest.approx(0.1), 0)}
    wrong, error, *less = trade.compose(result).axes
    assert [axis.get_title() for axis in less] == ["less: any one contact"] * 2
    for axis, heights in ((wrong, [0.02, panels_trade.QUANTITIES["wrong"][1]]), (error, [1e-4, 1e-15])):
        (front,) = (line for line in axis.get_lines() if line.get_gid() == "front")
        corners = list(zip(*front.get_data(), strict=True))[1:-1]
        assert [x for x, _ in corners] == pytest.approx([0.5, 1.0])
        assert corners[0][1] == heights[0] and corners[1][1] <= heights[1]
        assert {text.get_text() for text in axis.texts} == {"fast, cpu", "exact, cpu"}
        assert axis.get_xlim() == less[0].get_xlim()


def test_sweeps_show_errors_of_zero_at_the_lower_end():
    result = kept(BY_NAME["accuracy-sweeps"])
    ordinary, *_, degenerate = BY_NAME["accuracy-sweeps"].compose(result).axes
    assert {y for _, y in lines(ordinary)["exact"]} == {figures.SHARE_FLOOR}
    assert max(y for _, y in lines(degenerate)["balanced"]) > 0.01


def test_a_result_without_such_rows_has_no_picture(tmp_path):
    result = dataclasses.replace(kept(BY_NAME["hybrid"]), rows=[{"part": "frame"}])
    assert figures.draw(result, tmp_path) == []
    with pytest.raises(UserError, match=r"hybrid\.png: this result has no rows for it"):
        BY_NAME["hybrid"].save(result, tmp_path)
