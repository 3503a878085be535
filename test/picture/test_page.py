# SPDX-License-Identifier: Apache-2.0
"""`hpccd view --html`: what the file holds, decoded again, is what was recorded; it runs its own scripts alone."""

import base64
import hashlib
import importlib.resources
import sys
import zipfile

import numpy as np
import pytest
from bag_tools import rewrite
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from page_parts import Page

from hpccd_core.picture.page import packing
from hpccd_core.picture.page.document import document, three
from hpccd_core.picture.page.packing import Grid, MeshPositions, packed
from hpccd_ros.bag.reader import Recording
from hpccd_ros.base.errors import UserError
from hpccd_ros.detect.interpenetration import InterpenetrationDetector
from hpccd_ros.frames.types import Topology
from hpccd_ros.picture import recording_page
from hpccd_ros.picture.recording_page import RecordingPage, drawing_library
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay

NONE = 2**32 - 1
HOSTILE = ("</script><script>alert(1)</script>", "<!--<script>\u2028&lt;'\"\udc80")


def steps_of(path, **options):
    with Recording(path) as recording:
        return list(Replay(recording, recorded_setup.of_recording(recording), outputs=("points",), **options).steps())


def page_of(path, target, *, names=None, shown=lambda number: True, thickness=(), **options):
    """The page of a recording, written here; names, thickness: of its meshes, instead of their own."""
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        replay = Replay(recording, setup, outputs=("points",))
        page = RecordingPage(replay, names or setup.mesh_names, options.pop("title", "a title"), **options)
        for number, step in enumerate(replay.steps()):
            step.thickness = thickness
            page.add(step, shown(number))
        target.write_text(document(*page.described(), three()), encoding="utf-8")
    return Page(target)


def within(found, expected, step):
    """Rounded to multiples of `step`: off by half of it, and by the rounding of float64."""
    return np.abs(found - expected).max(initial=0) <= step * 0.5001 + 1e-15 * np.abs(expected).max(initial=0)


def assert_shows(page, number, step):
    """The page's step `number` holds the frame and the contacts of `step`."""
    said, frame, found = page.said["steps"][number], step.end_frame, step.contacts
    assert (said["step"], said["total"]) == (str(step.step), step.total)
    for mesh, (topology, vertices) in enumerate(zip(frame.topologies, frame.vertices, strict=True)):
        assert np.array_equal(page.faces(mesh, number), topology.faces)
        assert within(page.vertices(mesh, number), vertices, page.said["meshes"][mesh]["step"])
    drawn = page.contacts(number)
    assert (drawn["vf"], len(drawn["toc"])) == (len(found.vf), step.total)
    vertices, faces = step.layout.vertex_offsets, step.layout.face_offsets
    for row in range(step.total):  # mesh after mesh, as the core numbers features
        (a, b), (a0, a1, b0, b1) = drawn["meshes"][row], drawn["features"][row]
        if row < len(found.vf):
            assert (a1, b1) == (NONE, NONE)
            assert [vertices[a] + a0, faces[b] + b0] == found.vf[row].tolist()
        else:
            ends = [vertices[a] + a0, vertices[a] + a1, vertices[b] + b0, vertices[b] + b1]
            assert ends == found.ee[row - len(found.vf)].tolist()
    assert within(drawn["toc"], np.concatenate([found.vf_toc, found.ee_toc]), 1 / 65535)
    assert within(drawn["points"], np.asarray(found.points).reshape(-1, 3), page.said["contacts"]["step"])


def test_what_the_page_holds_is_what_was_recorded(hpccd, small_bag, tmp_path):
    done = hpccd("view", small_bag, "--html", "run.html", "--every", 4)
    assert done.returncode == 0, done.stderr
    assert "run.html: 23 steps" in done.stdout
    page = Page(tmp_path / "run.html")
    steps = steps_of(small_bag)[::4]
    assert len(page.said["steps"]) == len(steps) == 23 and sum(step.total for step in steps) > 1000
    for number, step in enumerate(steps):
        assert_shows(page, number, step)
        assert page.said["steps"][number]["milliseconds"] > 0 and page.said["steps"][number]["notices"] == []
        assert page.said["steps"][number]["time"] == pytest.approx((step.end - steps[0].end) * 1e-9)
    assert [mesh["name"] for mesh in page.said["meshes"]] == ["cloth", "ball"]
    assert page.said["notes"] == ["Each 4th step of the recording is shown (--every 4)."]
    sides = [np.subtract(mesh["high"], mesh["low"]).max() for mesh in page.said["meshes"]]
    assert [mesh["step"] for mesh in page.said["meshes"]] == pytest.approx([side / 65535 for side in sides])


@pytest.mark.parametrize("depth", [False, True])
def test_curves_and_depths_of_each_step(hpccd, small_bag, tmp_path, depth, monkeypatch):
    done = hpccd("view", small_bag, "--html", "run.html", "--every", 20, *["--depth"] * depth)
    assert done.returncode == 0, done.stderr
    page, steps = Page(tmp_path / "run.html"), steps_of(small_bag)[::20]
    with Recording(small_bag) as recording:
        detector = InterpenetrationDetector(recorded_setup.of_recording(recording).builder)
    found = 0
    for number, step in enumerate(steps):
        scene = step.end_frame.topologies, step.end_frame.vertices
        hits = detector.intersections(*scene)
        lines, arrows = page.curves(number)
        expected = [np.concatenate([c.points, c.points[: c.closed]]) for c in hits.contours() if len(c) > 1]
        assert [len(line) for line in lines] == [len(line) for line in expected]
        for line, of_detector in zip(lines, expected, strict=True):
            assert within(line, of_detector, page.said["curves"]["step"])
        depths = detector.depths(*scene, hits) if depth else []
        names = [mesh["name"] for mesh in page.said["meshes"]]
        assert [[names[a], names[b], length] for a, b, length in page.said["steps"][number]["depths"]] == [
            [d.mesh_a, d.mesh_b, f"{d.length:.3g}"] for d in depths
        ]
        for arrow, of_detector in zip(arrows, depths, strict=True):
            assert within(arrow, np.stack([of_detector.start, of_detector.end]), page.said["curves"]["step"])
        found += len(lines) + 1000 * len(depths)
    assert found > 10 and (found > 1000) == depth

    monkeypatch.setattr(packing, "MOST_OF_CURVES", 30)
    thinned = packing.Curves()
    count, points = thinned.add(hits.contours(), [])
    assert 0 < count <= points <= 30


def test_links_of_robots_are_shown(hpccd, tmp_path):
    assert hpccd("scene", "arm-and-cloth", "--size", 0.05, "--frames", 5, "--mcap", "arm.mcap").returncode == 0
    assert hpccd("view", "arm.mcap", "--html", "arm.html").returncode == 0
    page, steps = Page(tmp_path / "arm.html"), steps_of(tmp_path / "arm.mcap")
    names = [mesh["name"] for mesh in page.said["meshes"]]
    assert names[:4] == ["table", "cloth", "arm/base", "arm/link_1"]
    assert names[13:] == names[2:13], "behind them the links' visual geometry"
    for number, step in enumerate(steps):
        assert_shows(page, number, step)


def test_meshes_of_several_topologies_and_meshes_at_rest(hpccd, tmp_path):
    assert hpccd("scene", "breaking-like", "--size", 0.015625, "--mcap", "break.mcap").returncode == 0
    page = page_of(tmp_path / "break.mcap", tmp_path / "break.html")
    steps = steps_of(tmp_path / "break.mcap")
    for number, step in enumerate(steps):
        assert_shows(page, number, step)
    statue, _, ground = page.said["meshes"]
    assert len(statue["topologies"]) > 1
    assert [topology["frames"] for topology in ground["topologies"]] == [1], "what rests is stored once"
    assert page.said["notes"][0].startswith("The recording contains no results of a node")
    gaps = [step["gap"] for step in page.said["steps"]]
    numbers = [int(step["step"]) for step in page.said["steps"]]
    assert gaps == [0, *(np.diff(numbers) - 1)] and sum(gaps) > 0
    assert f"{sum(gaps)} steps between the first and the last one: no result" in " ".join(page.said["notes"])


def test_it_asks_for_nothing_and_runs_only_its_own_scripts(small_bag, tmp_path):
    page = page_of(small_bag, tmp_path / "run.html", shown=lambda number: number == 60)
    policy = next(a["content"] for tag, a in page.tags if tag == "meta" and "http-equiv" in a)
    assert len(page.scripts) == 2
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'" for script in page.scripts
    )
    assert policy == f"default-src 'none'; style-src 'unsafe-inline'; script-src {hashes}"
    assert not [tag for tag, attributes in page.tags if {"src", "href", "onclick", "onload"} & set(attributes)]
    assert "\r" not in page.text, "a parser would change it, and the hashes with it"
    assert "Permission is hereby granted, free of charge" in page.text and "three.js authors" in page.text
    assert page.said["library"]["source"].startswith("trimesh ") and page.said["library"]["revision"].isdecimal()


def test_nothing_of_a_recording_becomes_markup(small_bag, tmp_path):
    one = {"shown": lambda number: number == 60}
    tame = page_of(small_bag, tmp_path / "tame.html", **one)
    page = page_of(small_bag, tmp_path / "wild.html", names=HOSTILE, title=HOSTILE[0], **one)
    assert [mesh["name"] for mesh in page.said["meshes"]] == list(HOSTILE) and page.said["title"] == HOSTILE[0]
    assert page.tags == tame.tags and page.scripts == tame.scripts


def notices(page):
    return {step["step"]: step["notices"] for step in page.said["steps"]}


def test_what_is_missing_truncated_or_different_is_said(hpccd, small_bag, tmp_path):
    def change(index, message, decoded):
        if message.topic == "/meshes/ball/vertices" and index == 31:  # ends step 31, begins step 32
            return None
        if message.topic == "/contacts":
            if decoded.step in (40, 41):
                return None
            if decoded.step == 20:  # before the lost message, which could explain it
                decoded.total += 1
            if decoded.step == 60:
                kept = np.sort(np.argsort(decoded.toc, kind="stable")[:5])
                for name in ("kind", "mesh_a", "mesh_b", "toc"):
                    setattr(decoded, name, np.asarray(getattr(decoded, name))[kept])
                for name, width in (("features_a", 2), ("features_b", 2), ("points", 3), ("normals", 3)):
                    values = np.asarray(getattr(decoded, name)).reshape(-1, width)
                    setattr(decoded, name, values[kept].ravel() if len(values) else values.ravel())
                decoded.truncated = True
            decoded.dropped_frames = 3
        return decoded

    rewrite(small_bag, tmp_path / "torn.mcap", change)
    done = hpccd("view", "torn.mcap", "-o", "torn.html")
    assert done.returncode == 0, done.stderr
    page = Page(tmp_path / "torn.html")
    told = {number: said for number, said in notices(page).items() if said}
    assert set(told) == {"20", "31", "32", "42", "60"}
    assert told["31"][0].startswith(
        "No contacts are shown for this step: it lists a message of meshes/ball/vertices sent at"
    )
    assert told["31"][1].startswith("Nothing is drawn")
    (said,) = told["32"]
    assert "the inputs taken make no frame at its start" in said
    assert told["42"] == [f"2 steps right before this one: no result {recording_page.GAP}."]
    assert "contacts were recorded, now there are" in told["20"][0]
    total = next(step["total"] for step in page.said["steps"] if step["step"] == "60")
    assert told["60"] == [f"The recorded result holds only the 5 earliest of {total} contacts (max_contacts)."]
    numbers = [step["step"] for step in page.said["steps"]]
    assert page.said["meshes"][0]["shown"][numbers.index("31")] is None
    assert page.said["meshes"][0]["shown"][numbers.index("32")] is not None, "its end is drawn"
    assert [step["total"] for step in page.said["steps"] if step["step"] in ("31", "32")] == [None, None]
    notes = "\n".join(page.said["notes"])
    for part in (
        "2 of 87 steps: not computed",
        "1 of 87 steps: recorded result differs",
        "1 of 87 steps: recorded result truncated",
        "The node had dropped 3 frames",
    ):
        assert part in notes


def test_of_many_contacts_some_are_drawn_over_the_whole_step(small_bag, tmp_path, monkeypatch):
    monkeypatch.setattr(packing, "MOST", 50)
    page = page_of(small_bag, tmp_path / "few.html", shown=lambda number: number in (3, 79))
    few, many = page.said["steps"]
    assert few["notices"] == [] and sum(few["drawn"]) == few["total"]
    assert many["total"] > 300 and sum(many["drawn"]) == 50
    assert many["notices"] == [f"50 of {many['total']} contacts are drawn, sampled evenly in order of TOI."]
    step = steps_of(small_bag)[79]
    toc = np.sort(page.contacts(1)["toc"])
    assert toc[0] == pytest.approx(step.contacts.first_toc, abs=1e-5) and toc[-1] > 0.9


def test_a_page_that_no_browser_would_hold(small_bag, tmp_path, monkeypatch):
    monkeypatch.setattr(recording_page, "MOST_POSITIONS", 20_000)
    with pytest.raises(UserError, match="positions of 6 steps fill the 0 MB that a page may hold; .*--every 2"):
        page_of(small_bag, tmp_path / "large.html")


def test_steps_and_places_that_are_not_there(hpccd, small_bag, tmp_path):
    for options, says in (
        (("--html", "x.html", "--step", 900), "no step 900"),
        (("--html", "no/folder/x.html"), "--html no/folder/x.html: there is no folder no/folder; create it\n"),
        (("--html", "x.html", "-o", "y.png"), "--html x.html: takes neither --rerun nor --output"),
        (("--html", "."), "Is a directory"),
    ):
        done = hpccd("view", small_bag, *options)
        assert done.returncode == 2 and says in done.stderr, done.stderr
    done = hpccd("view", small_bag, "--html", "one.html", "--step", 30, "--title", "mine")
    assert done.returncode == 0 and "one.html: 1 step," in done.stdout
    page = Page(tmp_path / "one.html")
    assert [step["step"] for step in page.said["steps"]] == ["30"] and page.said["title"] == "mine"


def test_missing_trimesh_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)  # as if it were not installed
    with pytest.raises(UserError, match=r"needs the Python package trimesh .* extra 'page'"):
        drawing_library()


def test_a_trimesh_without_the_library_is_named(monkeypatch, tmp_path):
    monkeypatch.setattr(importlib.resources, "files", lambda package: tmp_path)
    with pytest.raises(UserError, match=r"three\.js that trimesh carries: trimesh [\d.]+: .*No such file"):
        drawing_library()
    folder = tmp_path / "resources" / "templates"
    folder.mkdir(parents=True)
    with zipfile.ZipFile(folder / "viewer.zip", "w") as archive:
        archive.writestr("viewer.html.template", "<script>another viewer</script>")
    with pytest.raises(UserError, match=r"trimesh [\d.]+ has none"):
        drawing_library()


@given(
    st.sampled_from([np.uint16, np.uint32]).flatmap(
        lambda kind: arrays(kind, st.tuples(st.integers(1, 3), st.integers(0, 5), st.integers(1, 4)))
    )
)
def test_packed_integers_come_back(values):
    page = Page.__new__(Page)
    page.texts = {"some": base64.b64encode(packed(values)).decode()}
    assert np.array_equal(page.integers("some", values.itemsize, values.shape), values)


EXTENTS = [(0, 1), (1e6, 1e-3), (-3e8, 7.0), (0, 1e300), (1e308, 7e307), (5, 0), (0, 5e-324)]


@pytest.mark.parametrize("middle, size", EXTENTS)
def test_places_are_rounded_by_half_a_step_at_most(middle, size):
    places = middle + size * np.random.default_rng(3).uniform(-1, 1, size=(200, 3)) * (1, 0.3, 0)
    low, high = places.min(axis=0), places.max(axis=0)
    grid = Grid(low, high)
    rounded = grid.rounded(places)
    assert np.isfinite(grid.step) and grid.step > 0 and (size < 1e-300 or rounded.max() in (0, 65535))
    assert within(low + grid.step * rounded.astype(float), places, grid.step)


def test_a_mesh_without_faces_keeps_its_points_and_edges():
    rope = MeshPositions("rope")
    topology = Topology(1, 4, np.empty((0, 3), np.uint32), np.array([[0, 1], [1, 2]], np.uint32))
    for height in (0.0, 1.0, 1.0):
        rope.add(topology, np.full((4, 3), height, np.float32))
    rope.add_nothing()
    said, blobs = rope.described()
    assert said["shown"] == [(0, 0), (0, 1), (0, 1), None]
    assert said["topologies"] == [{"version": 1, "vertices": 4, "faces": 0, "edges": 2, "frames": 2}]
    assert set(blobs) == {"faces-0", "edges-0", "positions-0"}
