# SPDX-License-Identifier: Apache-2.0
"""The page in a real browser: it draws, plays and reacts to the pointer, complains of nothing and asks for nothing."""

import itertools

import chromium
import numpy as np
import pytest
from bag_tools import rewrite
from page_parts import Page
from test_page import HOSTILE, page_of

from hpccd_core.picture.contacts import BACKGROUND, TOC_COLOURS

pytestmark = pytest.mark.skipif(
    chromium.program() is None,
    reason="no Chromium here to open the page in: apt install chromium, or HPCCD_CHROMIUM=PATH",
)

READY = "document.body?.dataset.ready === 'yes'"
STEP = "document.body.dataset.step"
TITLE = "document.getElementById('title').textContent"
TIP = "document.getElementById('tip').hidden ? '' : document.getElementById('tip').textContent"


@pytest.fixture
def browser(tmp_path):
    with chromium.Chromium(tmp_path / "profile") as opened:
        yield opened


def opened(browser, page):
    browser.open(page)
    browser.wait(READY)
    return Scene(browser)


class Scene:
    """The part of the tab in which the step is drawn."""

    def __init__(self, browser):
        self.browser = browser
        rectangle = "(({x, y, width, height}) => [x, y, width, height])"
        self.x, self.y, self.width, self.height = browser.evaluate(
            f"{rectangle}(document.getElementById('scene').getBoundingClientRect())"
        )
        self.part = [
            round(self.x + 0.25 * self.width),
            round(self.y + 2),
            round(0.7 * self.width),
            round(0.9 * self.height),
        ]

    def pixels(self):
        """Those of `part`, where no text stands."""
        x, y, w, h = self.part
        return self.browser.picture()[y : y + h, x : x + w]

    def drawn(self):
        """Which of the pixels show something."""
        return self.shows(self.pixels())

    @staticmethod
    def shows(pixels):
        """Which are not of the background."""
        return np.abs(pixels - [int(BACKGROUND[k : k + 2], 16) for k in (1, 3, 5)]).max(axis=-1) > 12

    def contacts_under_the_pointer(self, most):
        """(what is told, colour there) of some places at which contacts are drawn; all meshes must be hidden."""
        picture, drawn = self.pixels(), self.drawn()
        rows, columns = np.nonzero(drawn)
        chosen = []
        for row, column in np.random.default_rng(4).permutation(np.stack([rows, columns], axis=1)):
            whole = drawn[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2].all()  # not the soft border
            if whole and all(np.hypot(row - r, column - c) > 12 for r, c in chosen) and len(chosen) < most:
                chosen.append((row, column))
        for row, column in chosen:
            self.browser.move(self.part[0] + column + 0.5, self.part[1] + row + 0.5)
            yield self.browser.wait(TIP, 10), picture[row, column]

    def show(self, mesh, on):
        """Toggle a mesh in the legend."""
        box = f"document.querySelectorAll('#meshes input')[{mesh}]"
        assert self.browser.evaluate(f"{box}.checked") is not on
        self.browser.evaluate(f"{box}.click()")


def test_it_draws_and_steps_and_plays(browser, hpccd, small_bag, tmp_path):
    assert hpccd("view", small_bag, "--html", "run.html").returncode == 0
    scene = opened(browser, tmp_path / "run.html")
    steps = Page(tmp_path / "run.html").said["steps"]
    most = max(steps, key=lambda step: step["total"])
    assert browser.evaluate(STEP) == most["step"], "it opens with the step of most contacts"
    assert browser.evaluate(TITLE) == f"{most['total']} contacts in step {most['step']} of 89"
    assert 0.1 < scene.drawn().mean() < 0.9
    browser.press("ArrowLeft", 37)  # the view widens where a step needs that
    browser.press("ArrowRight", 39)
    first = scene.pixels()
    browser.press("ArrowLeft", 37)
    assert browser.evaluate(STEP) == str(int(most["step"]) - 1)
    assert (np.abs(scene.pixels() - first).max(axis=2) > 30).mean() > 0.01, "another step looks different"
    browser.press("ArrowRight", 39)
    assert browser.evaluate(STEP) == most["step"] and np.array_equal(scene.pixels(), first), "and the same one the same"

    browser.press("Home", 36)
    assert browser.evaluate(STEP) == "1" and browser.evaluate("document.getElementById('back').disabled")
    assert "No contacts in this step." in browser.evaluate("document.getElementById('notices').textContent")
    browser.press(" ", 32)
    browser.wait(f"Number({STEP}) > 5")
    browser.press(" ", 32)
    stopped = browser.evaluate(STEP)
    scene.pixels()
    assert browser.evaluate(STEP) == stopped, "space stops it again"
    browser.press("End", 35)
    assert browser.evaluate(STEP) == "89"
    assert browser.said == [] and browser.asked == [(tmp_path / "run.html").as_uri()]


def test_a_click_in_the_chart_shows_that_step(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html")
    opened(browser, tmp_path / "run.html")
    box = "(({x, y, width, height}) => [x, y, width, height])(document.getElementById('chart').getBoundingClientRect())"
    x, y, width, height = browser.evaluate(box)
    left, right = browser.evaluate("[Chart.LEFT, Chart.RIGHT]")
    for step in (1, 20, 57, 89):
        place = (x + left + (width - left - right) * (step - 0.5) / 89, y + height / 2)
        browser.drag(place, place)
        assert browser.evaluate(STEP) == str(step)
        assert browser.evaluate("document.getElementById('slider').value") == str(step - 1)
    assert browser.said == []


def test_the_pointer_on_a_contact_tells_its_pair(browser, small_bag, tmp_path):
    page = page_of(small_bag, tmp_path / "run.html", shown=lambda number: number == 79)
    scene = opened(browser, tmp_path / "run.html")
    contacts = page.contacts(0)
    said = {}
    for row, ((a, b), (a0, a1, b0, b1)) in enumerate(zip(contacts["meshes"], contacts["features"], strict=True)):
        a, b = ("cloth", "ball")[a], ("cloth", "ball")[b]
        vertex_face, edges = f"vertex {a}:{a0} – face {b}:{b0}", f"edge {a}:{a0}-{a1} – edge {b}:{b0}-{b1}"
        said[vertex_face if row < contacts["vf"] else edges] = (contacts["toc"][row], contacts["points"][row])
    for mesh in (0, 1):
        scene.show(mesh, False)
    told = set()
    for text, _ in scene.contacts_under_the_pointer(30):
        pair, time, where = text.split("\n")
        toc, point = said[pair]
        assert time == f"t = {toc:.4f} of the step"
        shown = [float(value) for value in where.removeprefix("at ").split(",")]
        assert np.abs(shown - point).max() < 2 * page.said["contacts"]["step"]
        told.add(pair)
    assert len(told) > 15 and {pair.split(" ")[0] for pair in told} == {"vertex", "edge"}
    assert browser.said == []


def test_contacts_are_drawn_in_the_colour_of_their_time(browser, small_bag, tmp_path):
    page = page_of(small_bag, tmp_path / "run.html", shown=lambda number: number == 29)
    scene = opened(browser, tmp_path / "run.html")
    assert 3 <= page.said["steps"][0]["total"] <= 40, "few, so that one does not hide the other"
    for mesh in (0, 1):
        scene.show(mesh, False)
    away = []
    for text, colour in scene.contacts_under_the_pointer(10):
        toc = float(text.split("\n")[1].split()[2])
        away.append(np.abs(colour - 255 * np.array(TOC_COLOURS(toc)[:3])).max())
    assert len(away) >= 3 and max(away) < 25, away


def test_meshes_are_hidden_and_the_view_is_turned(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html", shown=lambda number: number == 0)
    scene = opened(browser, tmp_path / "run.html")
    both = scene.drawn()
    scene.show(0, False)
    ball = scene.drawn()
    assert 0.01 < ball.mean() < 0.8 * both.mean()
    scene.show(1, False)
    assert scene.drawn().mean() == 0
    scene.show(0, True)
    before = scene.pixels()
    middle = (scene.x + scene.width / 2, scene.y + scene.height / 2)
    browser.drag(middle, (middle[0] + 150, middle[1] + 40))
    assert (np.abs(scene.pixels() - before).max(axis=2) > 20).mean() > 0.02
    assert browser.said == []


def test_planes_are_drawn_from_within_only_and_do_not_widen_the_view(browser, hpccd, small_bag, tmp_path):
    (tmp_path / "planes.yaml").write_text(
        "/**: {ros__parameters: {meshes: [cloth, ball], mesh: {ball: {self_collision: false}}, "
        "planes: [floor, wall], plane: {floor: {offset: -0.3}, wall: {normal: [-1.0, 0.0, 0.0], offset: -0.6}}}}"
    )
    ball, wall = [], []
    for given in ([], ["--params", "planes.yaml"], ["--params", "planes.yaml", "--azimuth", "120"]):
        assert hpccd("view", small_bag, "--html", "run.html", "--step", 60, *given).returncode == 0
        scene = opened(browser, tmp_path / "run.html")
        legend = browser.evaluate("document.getElementById('meshes').textContent")
        for box in ("contacts", "intersecting", "curves"):
            browser.evaluate(f"document.getElementById('show-{box}').click()")
        scene.show(0, False)
        if given:
            assert legend.count("plane") == 2
            scene.show(2, False)
            scene.show(3, False)
        ball.append(scene.drawn()[100:].mean())  # below the notice
        if given:
            scene.show(1, False)
            scene.show(3, True)
            wall.append(scene.drawn()[100:].mean())  # below the notice
    assert ball[1] == pytest.approx(ball[0], rel=0.05)
    assert 0 < wall[0] < 0.02 and wall[1] > 0.2
    assert browser.said == []


def test_names_are_shown_and_never_run(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "wild.html", shown=lambda number: number > 60, names=HOSTILE, title=HOSTILE[0])
    opened(browser, tmp_path / "wild.html")
    shown = browser.evaluate("[...document.querySelectorAll('#meshes .of')].map((name) => name.textContent)")
    assert shown == list(HOSTILE)
    assert browser.evaluate("document.getElementById('name').textContent") == HOSTILE[0]
    assert browser.evaluate("document.title") == f"{HOSTILE[0]} · hpccd"
    browser.evaluate("document.body.append(Object.assign(document.createElement('script'), {textContent: 'ran = 1'}))")
    assert browser.evaluate("typeof ran") == "undefined", "its policy lets no other script run"
    assert all("Content Security Policy" in line for line in browser.said) and browser.said


def test_what_moves_between_topologies_is_drawn(browser, hpccd, tmp_path):
    assert hpccd("scene", "breaking-like", "--size", 0.015625, "--mcap", "break.mcap").returncode == 0
    page_of(tmp_path / "break.mcap", tmp_path / "break.html")
    scene = opened(browser, tmp_path / "break.html")
    seen = []
    for key in (("Home", 36), ("End", 35)):
        browser.press(*key)
        seen.append(scene.drawn())
        assert seen[-1].mean() > 0.05
    assert (seen[0] != seen[1]).mean() > 0.02
    assert browser.said == []


def test_edges_are_drawn_as_lines(browser, small_bag, tmp_path):
    seen = []
    for name, edges in (("points", ()), ("rope", [k + end for k in range(91) for end in (0, 1)])):

        def change(_, message, decoded, edges=edges):
            if message.topic == "/meshes/ball/topology":
                decoded.faces, decoded.edges = np.zeros(0, np.uint32), np.array(edges, np.uint32)
            return decoded

        rewrite(small_bag, tmp_path / f"{name}.mcap", change)
        page_of(tmp_path / f"{name}.mcap", tmp_path / f"{name}.html")
        scene = opened(browser, tmp_path / f"{name}.html")
        browser.press("Home", 36)
        scene.show(0, False)
        seen.append(scene.drawn().sum())
    assert seen[1] > 1.5 * seen[0]
    assert "91 edges" in browser.evaluate("document.getElementById('meshes').textContent")


@pytest.mark.parametrize("edges", [[], [k + end for k in range(91) for end in (0, 1)]])
def test_points_and_ropes_with_a_thickness_are_drawn_as_spheres_and_capsules(browser, small_bag, tmp_path, edges):
    def change(_, message, decoded):
        if message.topic == "/meshes/ball/topology":
            decoded.faces, decoded.edges = np.zeros(0, np.uint32), np.array(edges, np.uint32)
        return decoded

    rewrite(small_bag, tmp_path / "points.mcap", change)
    seen, rows = [], []
    for radius in (0.0, 0.04, 0.08):
        page_of(tmp_path / "points.mcap", tmp_path / "run.html", thickness=(("ball", radius),))
        scene = opened(browser, tmp_path / "run.html")
        browser.evaluate("document.getElementById('show-contacts').click()")
        scene.show(0, False)
        browser.press("Home", 36)
        at_first = scene.drawn()[100:]
        browser.press("End", 35)
        seen.append(scene.drawn()[100:].mean())
        rows.append((at_first != scene.drawn()[100:]).mean())
    assert 0 < (2 if edges else 5) * seen[0] < seen[1] < seen[2]
    assert rows[1] > 0, "they move"
    browser.evaluate("document.getElementById('facts').textContent = 'long words '.repeat(40)")
    lines = "(name => (name.selectNodeContents(document.getElementById('name')), name.getClientRects().length))"
    assert browser.evaluate(f"{lines}(document.createRange())") == 1, "the name stays on its line"
    assert browser.said == []


def test_meshes_without_faces_are_drawn_as_points_and_missing_frames_not_at_all(browser, small_bag, tmp_path):
    def change(index, message, decoded):
        if message.topic == "/meshes/ball/topology":
            decoded.faces = np.zeros(0, np.uint32)
        return None if message.topic == "/meshes/ball/vertices" and index == 31 else decoded

    rewrite(small_bag, tmp_path / "points.mcap", change)
    page_of(tmp_path / "points.mcap", tmp_path / "points.html")
    scene = opened(browser, tmp_path / "points.html")
    assert "92 points, no faces" in browser.evaluate("document.getElementById('meshes').textContent")
    browser.press("Home", 36)
    scene.show(0, False)
    points = scene.drawn()
    assert 92 < points.sum() < 92 * 25
    scene.show(0, True)
    slider = "document.getElementById('slider')"
    browser.evaluate(f"{slider}.value = 30; {slider}.dispatchEvent(new Event('input'))")
    assert browser.evaluate(TITLE) == "No contacts known in step 31 of 89"
    assert "Nothing is drawn" in browser.evaluate("document.getElementById('notices').textContent")
    assert not scene.drawn()[100:].any(), "below the notices"
    browser.press("ArrowLeft", 37)
    assert scene.drawn().any()
    assert browser.said == []


def test_the_view_holds_each_step_until_it_is_moved_by_hand(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html")
    scene = opened(browser, tmp_path / "run.html")
    for key in (("Home", 36), ("End", 35)):
        browser.press(*key)
        assert scene.drawn().mean() > 0.1
        left, right = (browser.picture()[scene.part[1] :, round(x)] for x in (scene.x + 3, scene.x + scene.width - 3))
        height = round(0.85 * scene.height)
        assert not scene.shows(left[100:height]).any() and not scene.shows(right[:height]).any()
    middle = (scene.x + scene.width / 2, scene.y + scene.height / 2)
    browser.drag(middle, (middle[0] + 3000, middle[1]))
    before = scene.pixels()
    browser.press("ArrowLeft", 37)
    browser.press("ArrowRight", 39)
    assert np.array_equal(scene.pixels(), before)
    browser.press("f", 70)
    assert not np.array_equal(scene.pixels(), before)


def test_without_webgl_the_rest_of_it_works(small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html")
    with chromium.Chromium(tmp_path / "profile", options=["--disable-3d-apis"]) as browser:
        opened(browser, tmp_path / "run.html")
        assert "not available in this browser" in browser.evaluate("document.getElementById('halt').textContent")
        browser.press("End", 35)
        assert browser.evaluate(STEP) == "89" and "contacts in step 89 of 89" in browser.evaluate(TITLE)
        assert browser.said == ["THREE.WebGLRenderer: Error creating WebGL context."]


def test_a_narrow_screen_shows_all_of_it(small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html", title="a recording with a long name, " * 3)
    with chromium.Chromium(tmp_path / "profile", (480, 900)) as browser:
        opened(browser, tmp_path / "run.html")
        boxes = browser.evaluate(
            "Object.fromEntries(['view', 'help', 'controls', 'slider', 'chart', 'times', 'meshes', 'name'].map((id) => "
            "[id, (({left, right, top, bottom}) => ({left, right, top, bottom}))"
            "(document.getElementById(id).getBoundingClientRect())]))"
        )
        assert all(0 <= box["left"] and box["right"] <= 480 for box in boxes.values()), boxes
        assert browser.evaluate("document.documentElement.scrollWidth") <= 480
        assert boxes["view"]["bottom"] - boxes["view"]["top"] > 350
        # One below the other: nothing lies over the meshes, and nothing scrolls but the page.
        order = [boxes[name] for name in ("name", "view", "help", "controls", "chart", "times", "meshes")]
        assert all(a["bottom"] <= b["top"] for a, b in itertools.pairwise(order)), boxes
        scrolled = "[...document.querySelectorAll('body *')].filter((e) => e.scrollHeight > e.clientHeight + 1 && "
        assert browser.evaluate(scrolled + "['auto', 'scroll'].includes(getComputedStyle(e).overflowY)).length") == 0
        heights = browser.evaluate("[...document.querySelectorAll('#controls button')].map((b) => b.offsetHeight)")
        assert max(heights) < 1.5 * min(heights), "no label breaks into lines"
        assert browser.said == []


def test_the_tint_surrounds_contacts_and_can_be_switched_off(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html", shown=lambda number: number == 79)
    scene = opened(browser, tmp_path / "run.html")
    browser.evaluate("document.getElementById('show-contacts').click()")
    tinted = scene.pixels()
    browser.evaluate("document.getElementById('show-tint').click()")
    changed = np.abs(scene.pixels() - tinted).max(axis=2) > 12
    drawn = scene.drawn().sum()
    assert 0.002 * drawn < changed.sum() < 0.3 * drawn
    assert browser.said == []


def test_one_spike_does_not_rule_the_chart(browser, small_bag, tmp_path):
    page_of(small_bag, tmp_path / "run.html")
    opened(browser, tmp_path / "run.html")
    usual = "usual([...new Array(88).fill(4), 400])"
    assert 4 < browser.evaluate(usual) < 8
    assert browser.evaluate("usual([1, 2])") == 2 and browser.evaluate("usual([0])") == 0


def test_faces_that_intersect_another_mesh_have_a_colour_of_their_own(browser, hpccd, small_bag, tmp_path):
    assert hpccd("view", small_bag, "--step", "80", "--html", "run.html").returncode == 0
    page = Page(tmp_path / "run.html")
    counts = page.said["steps"][0]["intersecting"]
    faces = page.integers("intersecting-faces", 4, (1, sum(counts), 1))[0, :, 0]
    assert counts[0] > 0 and counts[1] > 0
    assert faces[: counts[0]].max() < len(page.faces(0, 0)) and faces[counts[0] :].max() < len(page.faces(1, 0))
    scene = opened(browser, tmp_path / "run.html")
    assert not browser.evaluate("document.getElementById('intersecting').hidden")
    marked = scene.pixels()
    browser.evaluate("document.getElementById('show-intersecting').click()")
    changed = np.abs(scene.pixels() - marked).max(axis=2) > 25
    assert changed.any()
    red, green, _ = marked[changed].mean(axis=0)
    assert green > 2 * red, "as dark as in the legend"


def test_curves_and_depths_are_drawn_and_can_be_switched_off(browser, hpccd, small_bag, tmp_path):
    assert hpccd("view", small_bag, "--step", "45", "--depth", "--html", "run.html").returncode == 0
    page = Page(tmp_path / "run.html")
    (depth,) = page.said["steps"][0]["depths"]
    scene = opened(browser, tmp_path / "run.html")
    for name in ("show-contacts", "show-tint", "show-intersecting"):
        browser.evaluate(f"document.getElementById('{name}').click()")
    for mesh in (0, 1):
        scene.show(mesh, False)
    both = scene.pixels()
    seen = []
    for name in ("curves", "depth"):
        assert not browser.evaluate(f"document.getElementById('{name}').hidden")
        browser.evaluate(f"document.getElementById('show-{name}').click()")
        pixels = scene.pixels()
        changed = np.abs(pixels - both).max(axis=2) > 60
        seen.append((changed.sum(), np.median(both[changed], axis=0)))
        both = pixels
    assert not scene.drawn().any(), "nothing else was drawn"
    (curves, colour), (arrow, white) = seen
    assert curves > 500 and colour[0] > 1.5 * colour[2], "red"
    assert 40 < arrow < curves and white.min() > 200
    assert browser.evaluate("document.getElementById('depths').textContent") == f"cloth out of ball: {depth[2]}"
    # The tip of the arrow is where the depth ends: three.js projects it with the camera of the page.
    browser.evaluate("draw = Stage.prototype.draw; Stage.prototype.draw = function () { draw.call(stage = this); }")
    browser.evaluate("document.getElementById('show-depth').click()")
    _, ((_, end),) = page.curves(0)
    rows, columns = np.nonzero((scene.pixels() > 200).all(axis=2))
    x, y = browser.evaluate(
        f"(({{recording: r, camera, canvas}}) => {{ const p = new THREE.Vector3(...{end.tolist()}.map((v, k) => "
        "(v - r.centre[k]) / r.scale)).project(camera.three); "
        "return [(0.5 + 0.5 * p.x) * canvas.clientWidth, (0.5 - 0.5 * p.y) * canvas.clientHeight]; })(stage)"
    )
    away = np.hypot(columns + scene.part[0] - scene.x - x, rows + scene.part[1] - scene.y - y)
    assert away.min() < 4
    assert browser.said == []


def test_steps_without_curves_say_nothing_of_them(browser, hpccd, small_bag, tmp_path):
    assert hpccd("view", small_bag, "--step", "1", "--depth", "--html", "run.html").returncode == 0
    scene = opened(browser, tmp_path / "run.html")
    assert browser.evaluate("['curves', 'depth'].every((id) => document.getElementById(id).hidden)")
    assert browser.evaluate("document.getElementById('depths').textContent") == ""
    assert scene.drawn().any() and browser.said == []


def test_the_panel_of_a_scene_with_a_robot_fits_without_scrolling(browser, hpccd, tmp_path):
    options = ("--size", "0.1", "--frames", "5", "--mcap", "arm.mcap")
    assert hpccd("scene", "arm-and-cloth", *options).returncode == 0
    assert hpccd("view", "arm.mcap", "--html", "arm.html").returncode == 0
    opened(browser, tmp_path / "arm.html")
    browser.evaluate("document.querySelector('aside > details').open = false")  # opened by the note on the recording
    browser.evaluate("document.getElementById('intersecting').hidden = false")
    assert browser.evaluate("document.querySelectorAll('#meshes li').length") == 4
    assert (
        browser.evaluate(
            "(({scrollHeight, clientHeight}) => scrollHeight - clientHeight)(document.querySelector('aside'))"
        )
        == 0
    )
