# SPDX-License-Identifier: Apache-2.0
"""The picture of one step: shaded meshes, contacts as points coloured by their time, and the step in its context."""

import dataclasses

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure

from hpccd_ros.base.whole_file import whole_file
from hpccd_ros.picture.camera import Camera
from hpccd_ros.picture.raster import rasterize
from hpccd_ros.picture.shading import RADIUS, shade, tubes

BACKGROUND = "#10141c"
INK = "#e8ecf4"
FAINT = "#8a93a6"
# Calm colours that leave yellow, red and violet to the contacts.
MESH_COLOURS = ("#56759f", "#c3c9d4", "#5f8f83", "#7f8aa8", "#8fa3b8", "#a0937d")
# From the start of the step to its end; light enough at both ends to be seen on any of the above.
TOC_COLOURS = LinearSegmentedColormap.from_list("toc", ["#fff38a", "#ffb52e", "#ff5f45", "#f03fa0", "#b46bff"])
SUPERSAMPLING = 2
TINT = 0.62
LIGHT = np.array([0.35, -0.55, 1.25])


@dataclasses.dataclass
class Picture:
    """What is drawn of a step: name of each mesh, its vertices in the middle of the step, its faces, and its edges
    beside theirs; contacts at their points (N,3).

    touched: (V,) earliest time of contact of each vertex, all meshes one after the other; inf where it has none.
    """

    meshes: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]
    touched: np.ndarray
    points: np.ndarray
    toc: np.ndarray
    title: str
    facts: list[str]
    scene: str = ""  # name, at the right of the title


@dataclasses.dataclass
class History:
    """Contacts and milliseconds of every frame of a recording, and which one is drawn."""

    frames: np.ndarray
    contacts: np.ndarray
    milliseconds: np.ndarray | None
    marked: int


def draw(picture: Picture, path, history: History | None = None, **view) -> None:
    """Write the picture to `path` (PNG, or what else matplotlib writes, by its suffix); view: as compose() takes it."""
    with whole_file(path, overwrite=True) as draft:
        compose(picture, history, **view).savefig(draft, facecolor=BACKGROUND)


def compose(picture: Picture, history: History | None = None, *, azimuth=-60.0, elevation=26.0, size=(1280, 860)):
    """The picture as a matplotlib figure; size: of its scene, pixels."""
    picture = _of_drawable_size(picture)
    image, camera, depth = render(picture.meshes, picture.touched, size, azimuth, elevation)
    figure = Figure(figsize=(16, 9), dpi=120, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.13, 0.80, 0.77))
    _draw_scene(axes, image, camera, depth, picture)
    _write_title(figure, picture)
    _draw_times(figure.add_axes((0.845, 0.30, 0.10, 0.52)), picture)
    if history is not None:
        _draw_history(figure.add_axes((0.045, 0.055, 0.90, 0.085)), history)
    return figure


def _of_drawable_size(picture: Picture) -> Picture:
    """The same in another unit of length where single precision, in which the light is computed, would not hold it."""
    largest = max(float(np.abs(vertices).max(initial=0.0)) for _, vertices, *_ in picture.meshes)
    if largest == 0.0 or 1e-6 < largest < 1e6:
        return picture
    exponent = -int(np.frexp(largest)[1])  # of two: no digit changes
    meshes = [(name, np.ldexp(np.asarray(v, np.float64), exponent), *of) for name, v, *of in picture.meshes]
    return dataclasses.replace(picture, meshes=meshes, points=np.ldexp(picture.points, exponent))


def render(meshes, touched, size, azimuth, elevation):
    """(image (h,w,4) sRGB with alpha, camera, depth (h,w)) of meshes [(name, vertices, faces, edges)]."""
    vertices = np.concatenate([np.asarray(v, dtype=np.float64) for _, v, *_ in meshes])
    sizes = [len(v) for _, v, *_ in meshes]
    faces, edges = (scene_indices([mesh[i] for mesh in meshes], sizes) for i in (2, 3))
    colours = vertex_colours(sizes, faces, edges, touched)
    extent = float(np.ptp(vertices, axis=0).max())
    around, sides, coloured_as = tubes(vertices, edges, RADIUS * extent)
    faces = np.concatenate([faces, sides + len(vertices)])
    vertices, colours = np.concatenate([vertices, around]), np.concatenate([colours, colours[coloured_as]])
    large = (size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING)
    camera = Camera(vertices, large, azimuth, elevation)
    buffers = rasterize(camera.project(vertices)[faces], large)
    light = LIGHT @ np.array(
        [
            [np.cos(np.radians(azimuth + 60)), np.sin(np.radians(azimuth + 60)), 0],
            [-np.sin(np.radians(azimuth + 60)), np.cos(np.radians(azimuth + 60)), 0],
            [0, 0, 1],
        ]
    )
    shaded = shade(buffers, camera, vertices, faces, colours, light)
    alpha = (buffers.triangle >= 0).astype(np.float64)[..., None]
    shaded = np.concatenate([shaded, alpha], axis=2)
    h, w = size[1], size[0]
    shaded = shaded.reshape(h, SUPERSAMPLING, w, SUPERSAMPLING, 4).mean(axis=(1, 3))
    alpha = shaded[..., 3:]
    rgb = srgb(np.clip(shaded[..., :3] / np.maximum(alpha, 1e-9), 0, 1))
    return np.concatenate([rgb, alpha], axis=2), camera, buffers.depth


def scene_indices(indices, sizes):
    """Indices of each mesh's own vertices -> (N,k) of the scene's. sizes: vertices of each mesh."""
    offsets = np.cumsum([0, *sizes])
    return np.concatenate([np.asarray(i, np.int64) + offset for i, offset in zip(indices, offsets, strict=False)])


def vertex_colours(sizes, faces, edges, touched):
    """(V,3) linear RGB: the meshes' own colours, tinted around the contacts. sizes: vertices of each mesh; faces (F,3),
    edges (E,2) beside theirs and touched (V,) of all meshes together."""
    owner = np.repeat(np.arange(len(sizes)), sizes)
    own = np.array([linear(to_rgb(MESH_COLOURS[i % len(MESH_COLOURS)])) for i in range(len(sizes))])[owner]
    glow, weight = _glow(touched, faces, edges)
    return (1 - TINT * weight[:, None]) * own + TINT * glow


def _glow(touched, faces, edges):
    """(V,3) colour times weight, and (V,) weight 0..1 of a tint around the contacts, so that contacts between layers
    show on the outside of the layers. Spread twice over the edges, or single vertices would make stars."""
    contact = np.isfinite(touched)
    values = np.zeros((len(touched), 4))
    values[contact, :3] = linear(TOC_COLOURS(touched[contact])[:, :3])
    values[contact, 3] = 1.0
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]], edges])
    a, b = np.concatenate([edges, edges[:, ::-1]]).T
    degree = np.maximum(np.bincount(a, minlength=len(touched)), 1)[:, None]
    for _ in range(2):
        around = np.stack([np.bincount(a, values[b, k], minlength=len(touched)) for k in range(4)], axis=1) / degree
        values = 0.5 * (values + around)
    return values[:, :3], values[:, 3]


def _draw_scene(axes, image, camera, depth, picture):
    axes.imshow(image, extent=(0, image.shape[1], image.shape[0], 0), interpolation="lanczos")
    axes.set_axis_off()
    if not len(picture.points):
        return
    seen = camera.project(picture.points)
    column = np.clip(seen[:, 0].astype(int), 0, depth.shape[1] - 1)
    row = np.clip(seen[:, 1].astype(int), 0, depth.shape[0] - 1)
    span = np.ptp(depth[np.isfinite(depth)])
    hidden = seen[:, 2] > depth[row, column] + 0.01 * span
    x, y = seen[:, 0] / SUPERSAMPLING, seen[:, 1] / SUPERSAMPLING
    size = float(np.clip(7000 / len(x), 2.5, 40.0))
    late_first = np.argsort(-picture.toc, kind="stable")
    for index, alpha, scale in (
        (late_first[hidden[late_first]], 0.45, 0.5),
        (late_first[~hidden[late_first]], 1.0, 1.0),
    ):
        colours = TOC_COLOURS(picture.toc[index])
        if scale == 1.0:
            axes.scatter(x[index], y[index], s=size * 6, c=colours, alpha=0.12, linewidths=0)
        axes.scatter(x[index], y[index], s=size * scale, c=colours, alpha=alpha, linewidths=0)


def _write_title(figure, picture):
    figure.text(0.03, 0.945, picture.title, color=INK, fontsize=21, fontweight="bold", va="center")
    figure.text(0.97, 0.945, picture.scene, color=INK, fontsize=14, va="center", ha="right")
    figure.text(0.03, 0.905, "   ·   ".join(picture.facts), color=FAINT, fontsize=11.5, va="center")


def _draw_times(axes, picture):
    edges = np.linspace(0, 1, 41)
    counts = np.histogram(picture.toc, edges)[0]
    middle = (edges[1:] + edges[:-1]) / 2
    axes.barh(middle, counts, height=0.9 / 40, color=TOC_COLOURS(middle))
    axes.set_ylim(0, 1)
    axes.set_facecolor(BACKGROUND)
    axes.set_title("time of contact", color=INK, fontsize=12, pad=12)
    axes.yaxis.tick_right()
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1], ["0  start", "¼", "½", "¾", "1  end"])
    axes.set_xlabel("contacts", color=FAINT, fontsize=9)
    note = "surfaces in the middle of the step,\nfaint points lie behind them"
    axes.text(0.5, -0.19, note, transform=axes.transAxes, ha="center", va="top", color=FAINT, fontsize=8.5)
    _style(axes)


def _draw_history(axes, history):
    axes.set_facecolor(BACKGROUND)
    axes.fill_between(history.frames, history.contacts, step="mid", color="#e0668c", alpha=0.35, linewidth=0)
    axes.step(history.frames, history.contacts, where="mid", color="#e0668c", linewidth=1.2)
    axes.axvline(history.marked, color=INK, linewidth=1, alpha=0.8)
    axes.set_xlim(history.frames[0], history.frames[-1])
    axes.set_ylim(0, max(1, history.contacts.max() * 1.1))
    axes.set_ylabel("contacts", color="#e0668c", fontsize=9)
    axes.set_xlabel("step", color=FAINT, fontsize=9, labelpad=1)
    _style(axes)
    if history.milliseconds is not None:
        times = axes.twinx()
        times.plot(history.frames, history.milliseconds, color="#7fd1e0", linewidth=1.2)
        times.set_ylim(0, np.nanmax(history.milliseconds) * 1.15)
        times.set_ylabel("ms a frame", color="#7fd1e0", fontsize=9)
        _style(times)


def _style(axes):
    axes.tick_params(colors=FAINT, labelsize=9, length=3)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("bottom",))
        spine.set_color(FAINT)


def linear(srgb):
    c = np.asarray(srgb, dtype=np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def srgb(linear):
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055)
