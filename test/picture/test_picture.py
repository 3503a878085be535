# SPDX-License-Identifier: Apache-2.0
"""The pictures show what is there: the nearest surface in each pixel, contacts where they project to."""

import numpy as np
import pytest

from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.frames.types import NO_EDGES
from hpccd_ros.picture import contacts
from hpccd_ros.picture.camera import Camera
from hpccd_ros.picture.of_recording import separation_fact
from hpccd_ros.picture.raster import rasterize
from hpccd_ros.picture.shading import blur, tubes, vertex_normals


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
    """A picture of a plane with contacts at `places`, none of which tints it."""
    return contacts.Picture([PLANE], np.full(4, np.inf), np.asarray(places, float), np.asarray(toc), "title", ["fact"])


def test_the_surface_is_rendered_within_the_range_of_colours():
    image, _, depth = contacts.render([PLANE], np.full(4, np.inf), (320, 200), -60, 26)
    assert image.shape == (200, 320, 4) and 0 <= image.min() and image.max() <= 1
    seen = image[..., 3] > 0.5
    assert seen.mean() > 0.2 and np.isfinite(depth[::2, ::2][seen]).mean() > 0.98


def test_edges_are_drawn_as_tubes_around_them():
    points = np.random.default_rng(10).normal(size=(20, 3))
    edges = np.array([[0, 1], [2, 2], [3, 4], [5, 3]])
    around, faces, coloured_as = tubes(points, edges, 0.1)
    with_length = edges[[0, 2, 3]]
    assert sorted(set(coloured_as)) == [0, 1, 3, 4, 5] and len(around) == len(coloured_as)
    assert np.allclose(np.linalg.norm(around - points[coloured_as], axis=1), 0.1)
    along = np.repeat(points[with_length[:, 1]] - points[with_length[:, 0]], len(around) // len(with_length), axis=0)
    assert np.allclose(np.einsum("nx,nx->n", around - points[coloured_as], along), 0, atol=1e-12)
    assert faces.min() == 0 and faces.max() == len(around) - 1
    rope = ("rope", np.array([[-1, 0, 0], [0, 0.5, 0], [1, 0, 0.0]]), np.empty((0, 3), int), np.array([[0, 1], [1, 2]]))
    image, *_ = contacts.render([rope], np.full(3, np.inf), (320, 200), -60, 26)
    assert 0.002 < (image[..., 3] > 0.5).mean() < 0.1


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
    assert bool(scene.collections) == (count > 0)
    assert curve.lines[0].get_ydata().tolist() == [0, 7, 14, 21, 28] and curve.lines[1].get_xdata()[0] == 3


def test_a_separation_of_many_pairs_takes_no_more_room():
    pairs = [(f"left_arm_link_{k}", "tool_changer", 0.005) for k in range(1000)]
    assert separation_fact(NONE) is None and separation_fact(Separation(0.25)) == "separation 0.25"
    assert separation_fact(Separation(0.0, tuple(pairs[:1]))) == "separation 0, another for 1 pair"
    assert separation_fact(Separation(0.001, tuple(pairs))) == "separation 0.001, another for 1,000 pairs"
