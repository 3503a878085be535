# SPDX-License-Identifier: Apache-2.0
"""The pictures show what is there: the nearest surface in each pixel, contacts where they project to."""

import dataclasses
import resource

import numpy as np
import pytest
from in_process import hpccd as in_process
from matplotlib.image import imread

import hpccd_core as hc
from hpccd_core.picture import contacts, curves, panels, shading, tint
from hpccd_core.picture.camera import Camera
from hpccd_core.picture.lines import Depth
from hpccd_core.picture.raster import rasterize
from hpccd_core.picture.shading import beads, blur, tubes, vertex_normals
from hpccd_ros.base.errors import UserError
from hpccd_ros.detect.plane_patch import FACES, OUTLINE, patch
from hpccd_ros.detect.scene import PlaneSettings, SceneBuilder
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.frames.types import NO_EDGES, MeshSettings, Topology
from hpccd_ros.picture import recording_page, view
from hpccd_ros.picture.intersecting import IntersectingFaces
from hpccd_ros.picture.of_recording import separation_fact


def _nearest_by_hand(corners, x, y):
    """(triangle, depth) seen at a place of the picture, by solving for the barycentric weights of each triangle."""
    best = (-1, np.inf)
    for number, (a, b, c) in enumerate(corners):
        matrix = np.array([b[:2] - a[:2], c[:2] - a[:2]]).T
        if abs(np.linalg.det(matrix)) < 1e-12:
            continue
        u, v = np.linalg.solve(matrix, np.array([x, y]) - a[:2])
        if u >= 0 and v >= 0 and u + v <= 1:
            depth = 1 / ((1 - u - v) / a[2] + u / b[2] + v / c[2])
            if depth < best[1]:
                best = (number, depth)
    return best


def test_rasterizer_finds_the_nearest_triangle():
    generator = np.random.default_rng(7)
    size = (40, 30)
    corners = generator.uniform((-10, -10, 1), (50, 40, 9), size=(60, 3, 3))
    corners[:5, 2] = corners[:5, 1]  # degenerate: seen nowhere
    buffers = rasterize(corners, size)
    for row in range(size[1]):
        for column in range(size[0]):
            triangle, depth = _nearest_by_hand(corners, column + 0.5, row + 0.5)
            assert buffers.triangle[row, column] == triangle
            assert buffers.depth[row, column] == pytest.approx(depth, rel=1e-5)


def test_weights_interpolate_in_space():
    """A textured plane seen at a slant: the interpolated point must project back to its own pixel."""
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    camera = Camera(points, (64, 48), elevation=15)
    buffers = rasterize(camera.project(points)[faces], (64, 48))
    rows, columns = np.nonzero(buffers.triangle >= 0)
    assert len(rows) > 200
    u, v = buffers.weights[rows, columns].T.astype(np.float64)
    corners = points[faces[buffers.triangle[rows, columns]]]
    position = (1 - u - v)[:, None] * corners[:, 0] + u[:, None] * corners[:, 1] + v[:, None] * corners[:, 2]
    seen = camera.project(position)
    assert np.allclose(seen[:, 0], columns + 0.5, atol=0.01) and np.allclose(seen[:, 1], rows + 0.5, atol=0.01)


@pytest.mark.parametrize("elevation", [-80, 0, 26, 89])
def test_camera_has_all_points_in_view(elevation):
    points = np.random.default_rng(8).normal(size=(500, 3)) * (5, 1, 0.2) + (100, -3, 7)
    x, y, depth = Camera(points, (320, 200), elevation=elevation).project(points).T
    assert (depth > 0).all() and (x >= 0).all() and (x <= 320).all() and (y >= 0).all() and (y <= 200).all()
    assert min(x.min(), 320 - x.max(), y.min(), 200 - y.max()) < 20, "and the picture is filled"


def test_normals_and_blur():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5.0]])
    normals = vertex_normals(vertices, np.array([[0, 1, 2]]))
    assert np.allclose(normals, [[0, 0, 1]] * 3 + [[0, 0, 0]])
    image = np.zeros((40, 50), np.float32)
    image[20, 25] = 1
    spread = blur(image, 3)
    assert spread.sum() == pytest.approx(1, rel=1e-5) and spread.argmax() == image.argmax() and spread.max() < 0.1


CORNERS = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]])
PLANE = ("plane", CORNERS, np.array([[0, 1, 2], [0, 2, 3]]), NO_EDGES)


def picture_of(places, toc):
    """A picture of a plane with contacts at `places`."""
    return contacts.Picture([PLANE], np.asarray(places, float), np.asarray(toc), "title", ["fact"])


def test_the_surface_is_rendered_within_the_range_of_colours():
    image, _, depth = contacts.render([PLANE], (320, 200), -60, 26)
    assert image.shape == (200, 320, 4) and 0 <= image.min() and image.max() <= 1
    seen = image[..., 3] > 0.5
    assert seen.mean() > 0.2 and np.isfinite(depth[::2, ::2][seen]).mean() > 0.98


def test_a_plane_is_drawn_from_within_its_half_space_only():
    sphere, faces = hc.shapes.icosphere(3)
    ball = ("ball", 0.5 * sphere + [0, 0, 0.5], faces, NO_EDGES)
    shown = []
    for offset in (-0.7, 0.7):  # behind the ball, and between it and the camera at azimuth 0
        wall = PlaneSettings("wall", (-np.sign(offset), 0.0, 0.0), -0.7)
        corners = patch(wall, [ball[1]])
        assert np.allclose(corners[:, 0], offset)
        assert (corners[:, 1:].min(axis=0) < ball[1][:, 1:].min(axis=0)).all()
        assert (corners[:, 1:].max(axis=0) > ball[1][:, 1:].max(axis=0)).all()
        meshes = [ball, ("wall", corners, FACES, OUTLINE)]
        image, camera, depth = contacts.render(meshes, (320, 200), 0, 0, planes=1)
        column, row, distance = camera.project(np.array([[0.5, 0.0, 0.5]]))[0]
        assert depth[int(row), int(column)] == pytest.approx(distance, rel=1e-2), "the ball is seen"
        shown.append((image[..., 3] > 0.5).mean())
    assert shown[0] > 1.5 * shown[1]
    lit, *_ = contacts.render([ball, ("wall", corners, FACES, NO_EDGES)], (320, 200), 0, 0, planes=1)
    alone, *_ = contacts.render([ball], (320, 200), 0, 0, framed=np.concatenate([ball[1], corners]))
    assert np.abs(lit - alone).max() < 0.02, "it casts no shadow"


def test_edges_are_drawn_as_tubes_around_them():
    points = np.random.default_rng(10).normal(size=(20, 3))
    edges = np.array([[0, 1], [2, 2], [3, 4], [5, 3]])
    radii = np.array([0.1, 0.2, 0.3, 0.4])
    around, faces, coloured_as = tubes(points, edges, radii)
    with_length = edges[[0, 2, 3]]
    assert sorted(set(coloured_as)) == [0, 1, 3, 4, 5] and len(around) == len(coloured_as)
    of_each = np.repeat(radii[[0, 2, 3]], len(around) // 3)
    assert np.allclose(np.linalg.norm(around - points[coloured_as], axis=1), of_each)
    along = np.repeat(points[with_length[:, 1]] - points[with_length[:, 0]], len(around) // len(with_length), axis=0)
    assert np.allclose(np.einsum("nx,nx->n", around - points[coloured_as], along), 0, atol=1e-12)
    assert faces.min() == 0 and faces.max() == len(around) - 1
    rope = ("rope", np.array([[-1, 0, 0], [0, 0.5, 0], [1, 0, 0.0]]), np.empty((0, 3), int), np.array([[0, 1], [1, 2]]))
    image, *_ = contacts.render([rope], (320, 200), -60, 26)
    assert 0.002 < (image[..., 3] > 0.5).mean() < 0.1


@pytest.mark.parametrize("round_, corners, triangles", [(2, 42, 80), (1, 6, 8)])
def test_points_are_drawn_as_beads_around_them(monkeypatch, round_, corners, triangles):
    monkeypatch.setattr(shading, "MOST_ROUND", round_)
    points = np.random.default_rng(11).normal(size=(9, 3))
    around, faces, coloured_as = beads(points, np.array([2, 5]), np.array([0.1, 0.2]))
    assert coloured_as.tolist() == [2] * corners + [5] * corners
    radii = np.linalg.norm(around - points[coloured_as], axis=1)
    assert np.allclose(radii, np.repeat([0.1, 0.2], corners))
    a, b, c = (around[faces[:, i]] for i in range(3))
    outside = np.einsum("nx,nx->n", np.cross(b - a, c - a), a - points[coloured_as[faces[:, 0]]])
    assert len(faces) == 2 * triangles and (outside > 0).all()
    # A point beside a rope; vertices that a mesh with triangles does not use are not drawn.
    grains = ("grains", np.array([[-1, 0, 0], [0, 0.5, 0], [1, 0, 0.0]]), np.empty((0, 3), int), np.array([[0, 1]]))
    mesh = ("mesh", np.array([[-1, 0, 0], [0, 0.5, 0], [1, 0, 0], [3, 0, 0]]), np.array([[0, 1, 2]]), NO_EDGES)
    assert contacts.alone([grains, mesh], [3, 4]).tolist() == [2]


def test_spheres_and_capsules_have_their_thickness():
    one = ("one", np.array([[0, 0, 0.0]]), np.empty((0, 3), int), NO_EDGES)
    rod = ("rod", np.array([[0, 0, 1.0], [0, 0, 2.0]]), np.empty((0, 3), int), np.array([[0, 1]]))
    framed = np.array([[-1, -1, -1], [1, 1, 3.0]])
    *_, camera, depth = contacts.render([one, rod], (320, 200), 0, 0, framed=framed, thickness={"one": 0.4, "rod": 0.2})
    for place, seen in (
        ([0, 0.38, 0], True),
        ([0, 0.43, 0], False),
        ([0, 0.13, 1.5], True),  # of a tube with five sides
        ([0, 0.22, 1.5], False),
        ([0, 0, 2.18], True),
        ([0, 0, 2.23], False),
    ):
        column, row, _ = camera.project(np.array([place], float))[0].astype(int)
        assert np.isfinite(depth[row, column]) == seen, place


def test_contacts_are_drawn_where_they_project_to_in_the_colour_of_their_time():
    generator = np.random.default_rng(9)
    places, toc = generator.uniform(-0.8, 0.8, size=(300, 3)) * (1, 1, 0), generator.uniform(size=300)
    scene, *_ = contacts.compose(picture_of(places, toc), size=(320, 200)).axes
    camera = Camera(PLANE[1], (640, 400), -60.0, 26.0)
    expected = camera.project(places)[:, :2] / 2
    drawn = [(dots.get_offsets(), dots.get_facecolor()[:, :3]) for dots in scene.collections if len(dots.get_offsets())]
    for offsets, colours in drawn:
        nearest = np.linalg.norm(offsets[:, None] - expected, axis=2).argmin(axis=1)
        np.testing.assert_allclose(offsets, expected[nearest], atol=1e-9)
        np.testing.assert_allclose(colours, contacts.TOC_COLOURS(toc[nearest])[:, :3])
    assert {tuple(o) for offsets, _ in drawn for o in np.round(offsets, 6)} == set(map(tuple, np.round(expected, 6)))


def test_contacts_behind_the_surface_are_faint():
    scene, *_ = contacts.compose(picture_of([[0, 0, 0.1], [0, 0, -0.4]], [0.5, 0.5]), size=(320, 200)).axes
    faint, _, whole = (dots.get_alpha() for dots in scene.collections)
    assert faint < 0.5 and whole == 1.0
    (in_front,) = scene.collections[2].get_offsets()
    (behind,) = scene.collections[0].get_offsets()
    assert in_front[1] < behind[1], "pixels go down"


@pytest.mark.parametrize("count", [0, 1, 300])
def test_times_of_contact_are_counted_beside_the_scene(count):
    toc = np.linspace(0, 1, count)
    history = contacts.History(np.arange(5), np.arange(5) * 7, None, 3)
    figure = contacts.compose(picture_of(np.zeros((count, 3)), toc), history, size=(320, 200))
    scene, times, curve = figure.axes
    assert sum(bar.get_width() for bar in times.patches) == count
    assert [text.get_text() for text in times.texts if not count] == ["No contacts\nin this step."] * (not count)
    assert times.axison == (count > 0)
    assert bool(scene.collections) == (count > 0)
    assert curve.lines[0].get_ydata().tolist() == [0, 7, 14, 21, 28] and curve.lines[1].get_xdata()[0] == 3


def test_a_separation_of_many_pairs_takes_no_more_room():
    pairs = [(f"left_arm_link_{k}", "tool_changer", 0.005) for k in range(1000)]
    assert separation_fact(NONE) is None and separation_fact(Separation(0.25)) == "separation 0.25"
    assert separation_fact(Separation(0.0, tuple(pairs[:1]))) == "separation 0, another for 1 pair"
    assert separation_fact(Separation(0.001, tuple(pairs))) == "separation 0.001, another for 1,000 pairs"


def grid(cells):
    """A square of side 2 in the plane z = 0, with about 2 * cells^2 triangles."""
    x, y = np.meshgrid(np.linspace(-1, 1, cells + 1), np.linspace(-1, 1, cells + 1))
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    a, b, c, d = first, first + 1, first + cells + 2, first + cells + 1
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return ("plane", vertices, faces, NO_EDGES)


def test_the_tint_reaches_as_far_whatever_the_size_of_faces():
    found = []
    contact = (np.array([[0.3, -0.2, 0.0]]), np.array([0.5]))
    for cells in (1, 7, 60):
        plain, camera, _ = contacts.render([grid(cells)], (640, 480), -60, 60)
        tinted, *_ = contacts.render([grid(cells)], (640, 480), -60, 60, contact)
        changed = np.abs(tinted - plain).max(axis=2) > 0.02
        rows, columns = np.nonzero(changed)
        x, y, _ = camera.project(contact[0])[0]
        away = np.hypot(columns + 0.5 - x / 2, rows + 0.5 - y / 2)
        found.append((changed.sum(), away.max()))
        # Pixels to a unit of length, where the view foreshortens least.
        scale = np.ptp(camera.project(np.array([[0.3, -0.2, 0], [0.3, -0.2, 0] + camera.right]))[:, 0]) / 2
        assert 0.4 < away.max() / scale / (2 * tint.RADIUS) < 1.05
    (most, _), (least, _) = max(found), min(found)
    assert most - least < 0.05 * most, found


def test_only_surfaces_near_a_contact_are_tinted():
    own = np.full((3, 3), 0.25)
    places = np.array([[0, 0, 0], [0, 0, 0.9 * 2 * tint.RADIUS], [0, 0, 1.5 * 2 * tint.RADIUS]])
    painted = tint.Tint(np.zeros((1, 3)), np.array([[1.0, 0, 0]]), CORNERS).applied(places, own)
    assert painted[0, 0] > painted[1, 0] >= 0.25 and np.array_equal(painted[2], own[2])
    assert tint.Tint(np.empty((0, 3)), np.empty((0, 3)), CORNERS).applied(places, own) is own
    # The step is much longer than the scene.
    far = tint.Tint(np.array([[1e9, 0, 0], [0, 0, 0.0]]), np.ones((2, 3)), CORNERS)
    assert far.applied(places, own)[0, 0] > 0.25


def test_links_of_a_robot_have_one_colour():
    names = ["table", "arm/base", "arm/hand", "cloth", "other/base", "other/hand"]
    table, base, hand, cloth, other, _ = contacts.mesh_colours(names)
    assert base == hand and len({table, base, cloth, other}) == 4
    assert contacts.mesh_groups(names) == ["table", "arm", "arm", "cloth", "other", "other"]


def test_one_warm_up_does_not_rule_the_axis():
    usual = np.full(90, 4.0)
    usual[0] = 400.0
    assert 4.0 < contacts.usual_ceiling(usual) < 10.0
    assert contacts.usual_ceiling(np.array([1.0, 2.0])) >= 2.0
    assert contacts.usual_ceiling(np.array([np.nan, 3.0])) >= 3.0
    ramp = np.linspace(1, 9, 50)
    assert 9.0 < contacts.usual_ceiling(ramp) < 12.0, "an even rise is shown whole"


def test_a_spike_beyond_the_axis_is_named():
    milliseconds = np.full(60, 4.0)
    for spike, names in ((400.0, ["\u2191 400 ms"]), (5.0, [])):
        milliseconds[7] = spike
        history = contacts.History(np.arange(60), np.arange(60), milliseconds.copy(), 3)
        *_, times = contacts.compose(picture_of(np.zeros((1, 3)), [0.5]), history, size=(320, 200)).axes
        assert [text.get_text() for text in times.texts] == names
        assert times.get_ylim()[1] < 10.0


def test_a_recording_without_contacts_says_so():
    history = contacts.History(np.arange(5), np.zeros(5, int), np.ones(5), 3)
    *_, curve = contacts.compose(picture_of(np.zeros((0, 3)), []), history, size=(320, 200)).axes
    assert [text.get_text() for text in curve.texts] == ["No contacts in any step."]


TETRAHEDRON = np.array([[0, 0, -0.2], [0.3, 0, -1], [-0.2, 0.3, -1], [-0.2, -0.3, -1.0]])
SIDES = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]], np.uint32)


@pytest.mark.parametrize("cells", [1, 8], ids=["inside-a-face", "across-faces"])
@pytest.mark.parametrize("ignored", [(), (("plane", "body"),)])
def test_faces_that_intersect_another_mesh(ignored, cells):
    _, vertices, faces, _ = grid(cells)
    topologies = (Topology(0, len(vertices), faces.astype(np.uint32)), Topology(0, 4, SIDES))
    builder = SceneBuilder((MeshSettings("plane"), MeshSettings("body")), ignored)
    intersecting = IntersectingFaces(builder)
    for height in (0.0, 0.5):  # below the plane, and with its tip through it
        plane, body = intersecting.of(topologies, [vertices, TETRAHEDRON + [0.5, -0.3, height]])
        through = height > 0 and not ignored
        assert plane.any() == through and not plane.all()
        assert body.tolist() == [through, through, through, False]


def test_they_are_drawn_in_a_colour_of_their_own():
    body = ("body", TETRAHEDRON + [0.05, 0.02, 0.5], SIDES, NO_EDGES)
    meshes = [grid(8), body]
    marked = np.zeros(len(meshes[0][2]) + 4, bool)
    marked[-4:-1] = True
    plain, *_ = contacts.render(meshes, (320, 200), -60, 26)
    image, *_ = contacts.render(meshes, (320, 200), -60, 26, intersecting=marked)
    changed = np.abs(image - plain).max(axis=2) > 0.05
    assert 20 < changed.sum() < 0.1 * changed.size
    red, green, blue = image[changed][:, :3].mean(axis=0)
    assert green > blue > red
    picture = contacts.Picture(meshes, np.empty((0, 3)), np.empty(0), "title", [], intersecting=marked)
    names = ["plane", "body"]
    for flags, expected in ((marked, [*names, "faces that intersect another mesh"]), (None, names)):
        (legend,) = contacts.compose(dataclasses.replace(picture, intersecting=flags), size=(320, 200)).legends
        assert [text.get_text() for text in legend.texts] == expected


def test_intersection_curves_in_a_picture(tmp_path):
    """In front of surfaces bright, behind them faint; a closed one is closed; none of single points."""
    vertices, faces = hc.shapes.icosphere(3)
    scene = hc.Scene()
    scene.add_mesh("left", faces), scene.add_mesh("right", faces)
    both = np.concatenate([vertices, vertices + [1.0, 0.1, 0.2]])
    (contour,) = hc.Detector(scene, outputs=("points",)).intersections(both).contours()
    point = hc.Contour(contour.rows[:1], contour.points[:1], False, "left", "right")
    meshes = [("left", both[: len(vertices)], faces, NO_EDGES), ("right", both[len(vertices) :], faces, NO_EDGES)]

    def red(name, contours):
        panels.save([panels.Panel("spheres", meshes, contours=contours)], tmp_path / name, width=480)
        r, g, b, *_ = imread(tmp_path / name).transpose(2, 0, 1)
        return int(((r > 0.8) & (g < 0.6) & (b < 0.5)).sum())

    assert red("none.png", ()) == red("point.png", [point]) == 0
    assert red("curve.png", [contour]) > 100
    picture = contacts.Picture(meshes, np.empty((0, 3)), np.empty(0), "title", [], contours=[contour, point])
    figure = contacts.compose(picture, size=(320, 200))
    assert figure.legends[0].texts[-1].get_text() == "intersection curves"
    tiny = dataclasses.replace(
        picture,
        meshes=[(name, 1e-30 * v, *of) for name, v, *of in meshes],
        contours=[dataclasses.replace(contour, points=1e-30 * contour.points)],
    )
    lines, others = (list(f.axes[0].collections) for f in (figure, contacts.compose(tiny, size=(320, 200))))
    assert len(lines) == len(others) == 2
    assert [len(c.get_segments()) for c in lines] == [len(c.get_segments()) for c in others]
    assert sum(len(c.get_segments()) for c in lines) == len(contour)


def arrows_of(axes):
    """[(start, end)] of the arrows of a picture, in units of its axes."""
    return [patch._posA_posB for patch in axes.patches]


def test_depths_are_arrows_with_their_lengths(tmp_path):
    """Where they project to, whatever the unit, over the surface that they begin behind."""
    depths = [
        Depth("body", "plane", np.array([0.1, 0.2, -0.3]), np.array([0.0, 0.1, 0.6])),
        Depth("other", "plane", np.array([-0.5, 0.2, 0.1]), np.array([0.3, 0.0, 0.0])),
    ]
    picture = dataclasses.replace(picture_of(np.zeros((0, 3)), []), depths=depths)
    camera = Camera(PLANE[1], (640, 400), -60.0, 26.0)
    for unit in (1.0, 2.0**-120, 2.0**200):
        name, vertices, *rest = PLANE
        scaled = dataclasses.replace(
            picture,
            meshes=[(name, unit * vertices, *rest)],
            depths=[dataclasses.replace(d, start=unit * d.start, translation=unit * d.translation) for d in depths],
        )
        figure = contacts.compose(scaled, size=(320, 200))
        scene = figure.axes[0]
        for (start, end), depth in zip(arrows_of(scene), depths, strict=True):
            expected = camera.project(np.stack([depth.start, depth.end]))[:, :2] / 2
            assert np.allclose([start, end], expected, atol=1e-6)
        lengths = [float(text.get_text()) / unit for text in scene.texts]
        assert lengths == pytest.approx([depth.length for depth in depths], rel=5e-3)
        assert figure.legends[0].texts[-1].get_text() == "penetration depth"
    many = dataclasses.replace(picture, depths=depths[:1] * (curves.MOST_LENGTHS + 1))
    scene = contacts.compose(many, size=(320, 200)).axes[0]
    assert len(arrows_of(scene)) == curves.MOST_LENGTHS + 1 and not scene.texts

    def white(name, drawn):
        panels.save([panels.Panel("plane", [PLANE], depths=drawn)], tmp_path / name, width=480)
        return int((imread(tmp_path / name)[60:, :, :3] > 0.95).all(axis=2).sum())

    assert white("none.png", ()) == 0 < 60 < white("arrow.png", depths[:1])


def test_a_panel_shows_what_it_is_to_frame(tmp_path):
    seen = []
    for framed in (None, 0.5 * CORNERS):
        panels.save([panels.Panel("plane", [PLANE], framed=framed)], tmp_path / "framed.png", width=320)
        picture = imread(tmp_path / "framed.png")[50:, :, :3]
        seen.append((np.abs(picture - picture[-1, 0]).max(axis=2) > 0.1).mean())
    assert seen[1] > 2.5 * seen[0] > 0, "twice as large"


def test_no_surface_that_is_seen_is_black():
    """Turned away from the sun and the sky: from below, and edge-on."""
    for elevation in (-80, -26, 2):
        image, *_ = contacts.render([grid(8)], (320, 200), -60, elevation)
        seen = image[..., 3] > 0.99
        assert image[seen][:, :3].max(axis=1).min() > 0.15, elevation


@pytest.mark.parametrize("options", [pytest.param((), marks=pytest.mark.long), ("--depth",)])
def test_depths_of_a_recording(hpccd, small_bag, tmp_path, options):
    done = hpccd("view", small_bag, "--step", 80, "-o", "step.png", *options)
    assert done.returncode == 0, done.stderr
    image = imread(tmp_path / "step.png")
    part = image[200:1000, 100 : int(0.8 * image.shape[1]), :3]  # where the meshes are
    assert ((part > 0.97).all(axis=2).sum() > 40) == bool(options)


@pytest.mark.parametrize("count", [1, 3, 14])
def test_the_line_of_facts_fits_the_picture(count):
    picture = dataclasses.replace(picture_of([[0, 0, 0]], [0.5]), facts=["1,234 vertex-face"] * count)
    figure = contacts.compose(picture, size=(320, 200))
    (line,) = (text for text in figure.texts if "vertex-face" in text.get_text())
    assert line.get_window_extent().x1 < 0.98 * figure.bbox.width
    assert (line.get_fontsize() == 11.5) == (count < 14)


@pytest.mark.parametrize("suffix", [".png", ".pdf"])
def test_a_full_disk_leaves_the_earlier_picture(tmp_path, suffix):
    path = tmp_path / f"run{suffix}"
    path.write_bytes(b"from the run before")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    picture = picture_of([[0, 0, 0]], [0.5])
    resource.setrlimit(resource.RLIMIT_FSIZE, (200, before[1]))
    try:
        with pytest.raises(OSError, match="File too large") as raised:
            contacts.draw(picture, path, size=(160, 120))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert raised.value.filename == str(path)
    assert path.read_bytes() == b"from the run before" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("module", "target"), [(view, ("-o", "x.png")), (recording_page, ("--html", "x.html"))])
@pytest.mark.parametrize("options", [(), ("--depth",)])
def test_depths_are_searched_only_where_they_are_asked_for(module, target, options, small_bag, tmp_path, monkeypatch):
    """A search may take a second for each pair of meshes."""
    asked = []

    def made(builder, *, depth=False):
        asked.append(depth)
        raise UserError("enough")

    monkeypatch.setattr(module, "IntersectingFaces", made)
    monkeypatch.chdir(tmp_path)
    done = in_process("view", small_bag, "--step", 80, *target, *options)
    assert asked == [bool(options)], done
