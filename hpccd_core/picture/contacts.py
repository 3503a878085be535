# SPDX-License-Identifier: Apache-2.0
"""The picture of one step: shaded meshes, contacts as points coloured by their time, and the step in its context."""

import dataclasses
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

import hpccd_core as hc
from hpccd_core.mesh_files.errors import printable, shortened
from hpccd_core.picture import curves
from hpccd_core.picture.camera import Camera
from hpccd_core.picture.lines import Depth
from hpccd_core.picture.raster import rasterize
from hpccd_core.picture.shading import RADIUS, beads, shade, tubes
from hpccd_core.picture.tint import Tint
from hpccd_core.whole_file import whole_file

BACKGROUND = "#10141c"
INK = "#e8ecf4"
FAINT = "#8a93a6"
# Calm colours that leave yellow, red and violet to the contacts.
MESH_COLOURS = ("#56759f", "#c3c9d4", "#5f8f83", "#7f8aa8", "#8fa3b8", "#a0937d")
# From the start of the step to its end; light enough at both ends to be seen on any of the above.
TOC_COLOURS = LinearSegmentedColormap.from_list("toc", ["#fff38a", "#ffb52e", "#ff5f45", "#f03fa0", "#b46bff"])
# Colour of faces that intersect another mesh.
INTERSECTING = "#2fd3ab"
SUPERSAMPLING = 2
MOST_NAMES = 8  # in the legend
LIGHT = np.array([0.35, -0.55, 1.25])


@dataclasses.dataclass
class Picture:
    """The drawn parts of a step: name of each mesh, its vertices in the middle of the step, its faces, and its edges
    beside theirs; contacts at their points (N,3), and their times of impact.

    intersecting: (F,) which faces of all meshes, one after the other, intersect another mesh; None: not known.
    """

    meshes: list[tuple[str, np.ndarray, np.ndarray, np.ndarray]]
    points: np.ndarray
    toc: np.ndarray
    title: str
    facts: list[str]
    scene: str = ""  # name, at the right of the title
    intersecting: np.ndarray | None = None
    contours: Sequence[hc.Contour] = ()  # along which meshes intersect
    depths: Sequence[Depth] = ()
    unit: float = 1.0  # the length of the unit of the positions
    planes: int = 0  # how many of the meshes, the last ones, are patches of planes
    thickness: Mapping[str, float] = dataclasses.field(
        default_factory=dict
    )  # of meshes: radius of spheres and capsules
    intersecting_are: str = "faces that intersect another mesh"


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
        draft.write_bytes(as_bytes(compose(picture, history, **view), draft.suffix, facecolor=BACKGROUND))


def as_bytes(figure: Figure, suffix: str, **options) -> bytes:
    """A file of the figure, PNG without a suffix. Not written by matplotlib: its writers of PDF hide the error of a
    full disk behind one of their own, and add a suffix to a name that has none."""
    rendered = io.BytesIO()
    figure.savefig(rendered, format=suffix.removeprefix(".") or "png", **options)
    return rendered.getvalue()


def compose(picture: Picture, history: History | None = None, *, azimuth=-60.0, elevation=26.0, size=(1280, 860)):
    """The picture as a matplotlib figure; size: of its scene, pixels."""
    picture = _of_drawable_size(picture)
    contacts = (picture.points, picture.toc)
    of_scene = {"planes": picture.planes, "thickness": picture.thickness}
    image, camera, depth = render(picture.meshes, size, azimuth, elevation, contacts, picture.intersecting, **of_scene)
    figure = Figure(figsize=(16, 9), dpi=120, facecolor=BACKGROUND)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.13, 0.80, 0.735))
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
    meshes: list[Any] = [(name, np.ldexp(np.asarray(v, np.float64), exponent), *of) for name, v, *of in picture.meshes]
    contours = [dataclasses.replace(c, points=np.ldexp(c.points, exponent)) for c in picture.contours]
    depths = [
        dataclasses.replace(d, start=np.ldexp(d.start, exponent), translation=np.ldexp(d.translation, exponent))
        for d in picture.depths
    ]
    points = np.ldexp(picture.points, exponent)
    thickness = {name: float(np.ldexp(value, exponent)) for name, value in picture.thickness.items()}
    unit = float(np.ldexp(1.0, -exponent))
    return dataclasses.replace(
        picture, meshes=meshes, points=points, contours=contours, depths=depths, unit=unit, thickness=thickness
    )


def render(meshes, size, azimuth, elevation, contacts=None, intersecting=None, framed=None, planes=0, thickness=None):
    """(image (h,w,4) sRGB with alpha, camera, depth (h,w)) of meshes [(name, vertices, faces, edges)].

    contacts: (points (N,3), times of impact (N,)), around which surfaces are tinted. intersecting: as of `Picture`.
    framed: (N,3) points that are in view; None: all. planes: as of `Picture`: only their edges are drawn where the view
    is from outside the half-space, which would hide the meshes; they cast no shadow. thickness: as of `Picture`.
    """
    vertices = np.concatenate([np.asarray(v, dtype=np.float64) for _, v, *_ in meshes])
    sizes = [len(v) for _, v, *_ in meshes]
    faces, edges = (scene_indices([mesh[i] for mesh in meshes], sizes) for i in (2, 3))
    colours = np.repeat(
        [linear(to_rgb(colour)) for colour in mesh_colours([name for name, *_ in meshes])], sizes, axis=0
    )
    paint = _paint(vertices, faces, contacts, intersecting)
    extent = float(np.ptp(vertices, axis=0).max())
    first, last = (sum(len(mesh[2]) for mesh in meshes[:count]) for count in (len(meshes) - planes, len(meshes)))
    thick = np.repeat([(thickness or {}).get(name, 0.0) for name, *_ in meshes], sizes)
    radii, single = np.maximum(thick, RADIUS * extent), alone(meshes, sizes)
    radii[single] = np.maximum(thick[single], 2 * RADIUS * extent)
    ends = np.unique(edges[thick[edges[:, 0]] >= RADIUS * extent])  # of capsules
    round_ = np.concatenate([single, ends])
    for around, sides, coloured_as in (
        tubes(vertices, edges, radii[edges[:, 0]]),
        beads(vertices, round_, radii[round_]),
    ):
        faces = np.concatenate([faces, sides + len(vertices)])
        vertices, colours = np.concatenate([vertices, around]), np.concatenate([colours, colours[coloured_as]])
    large = (size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING)
    camera = Camera(vertices if framed is None else framed, large, azimuth, elevation)
    casting = np.delete(faces, slice(first, last), axis=0)
    corners = vertices[faces[first:last]]
    outwards = np.cross(corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 0])
    outside = np.einsum("fx,fx->f", outwards, camera.eye - corners[:, 0]) >= 0
    faces[first:last][outside] = 0  # without area: not drawn
    buffers = rasterize(camera.project(vertices)[faces], large)
    light = LIGHT @ np.array(
        [
            [np.cos(np.radians(azimuth + 60)), np.sin(np.radians(azimuth + 60)), 0],
            [-np.sin(np.radians(azimuth + 60)), np.cos(np.radians(azimuth + 60)), 0],
            [0, 0, 1],
        ]
    )
    shaded = shade(buffers, camera, vertices, faces, casting, colours, light, paint)
    alpha = (buffers.triangle >= 0).astype(np.float64)[..., None]
    shaded = np.concatenate([shaded, alpha], axis=2)
    h, w = size[1], size[0]
    shaded = shaded.reshape(h, SUPERSAMPLING, w, SUPERSAMPLING, 4).mean(axis=(1, 3))
    alpha = shaded[..., 3:]
    rgb = srgb(np.clip(shaded[..., :3] / np.maximum(alpha, 1e-9), 0, 1))
    return np.concatenate([rgb, alpha], axis=2), camera, buffers.depth


def alone(meshes, sizes):
    """Vertices in no edge, of meshes without faces."""
    alone = [np.setdiff1d(np.arange(0 if len(faces) else len(v)), edges) for _, v, faces, edges in meshes]
    return scene_indices(alone, sizes)


def scene_indices(indices, sizes):
    """Indices of each mesh's own vertices -> (N,k) of the scene's. sizes: vertices of each mesh."""
    offsets = np.cumsum([0, *sizes])
    return np.concatenate([np.asarray(i, np.int64) + offset for i, offset in zip(indices, offsets, strict=False)])


def mesh_groups(names) -> list[str]:
    """Group of each mesh: links ROBOT/LINK belong to their robot, other meshes to themselves."""
    robots = [name.partition("/")[0] for name in names]
    links = Counter(robots)
    return [robot if links[robot] > 1 else name for robot, name in zip(robots, names, strict=True)]


def mesh_colours(names) -> list[str]:
    """Colour of each mesh; the links of a robot have one."""
    groups = mesh_groups(names)
    number = {group: k for k, group in enumerate(dict.fromkeys(groups))}
    return [MESH_COLOURS[number[group] % len(MESH_COLOURS)] for group in groups]


def toc_colours(toc) -> np.ndarray:
    """(N,3) linear RGB."""
    return linear(TOC_COLOURS(np.asarray(toc))[:, :3])


def _paint(vertices, faces, contacts, intersecting):
    """The argument `paint` of `shade`."""
    points, toc = contacts or (np.empty((0, 3)), np.empty(0))
    tint = Tint(np.asarray(points, np.float64).reshape(-1, 3), toc_colours(toc), vertices)
    # The last one is that of all further triangles: tubes around edges, and beads.
    marked = np.append(np.zeros(len(faces), bool) if intersecting is None else intersecting, False)

    def paint(position, triangle, own):
        painted = tint.applied(position, own)
        if marked.any():
            of_marked = marked[np.minimum(triangle, len(marked) - 1)]
            painted[of_marked] = 0.3 * painted[of_marked] + 0.7 * linear(to_rgb(INTERSECTING))
        return painted

    return paint


def _draw_scene(axes, image, camera, depth, picture):
    axes.imshow(image, extent=(0, image.shape[1], image.shape[0], 0), interpolation="lanczos")
    axes.set_axis_off()
    curves.draw(axes, picture.contours, camera, depth, SUPERSAMPLING)
    curves.draw_depths(axes, picture.depths, camera, SUPERSAMPLING, picture.unit)
    if not len(picture.points):
        return
    seen = camera.project(picture.points)
    hidden = curves.behind(seen, depth)
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
    scene, words = printable(picture.scene), printable("   ·   ".join(picture.facts))
    figure.text(0.97, 0.945, scene, color=INK, fontsize=14, va="center", ha="right", parse_math=False)
    facts = figure.text(0.03, 0.905, words, color=FAINT, fontsize=11.5, va="center", parse_math=False)
    while facts.get_window_extent().x1 > 0.97 * figure.bbox.width and facts.get_fontsize() > 4:
        facts.set_fontsize(facts.get_fontsize() - 0.5)  # widths of letters are rounded: no proportion
    names = [name for name, *_ in picture.meshes]
    colours = dict(zip(mesh_groups(names), mesh_colours(names), strict=True))
    if picture.intersecting is not None and picture.intersecting.any():
        colours[picture.intersecting_are] = INTERSECTING
    if any(len(contour) > 1 for contour in picture.contours):
        colours["intersection curves"] = curves.COLOUR
    if picture.depths:
        colours["penetration depth"] = curves.DEPTH
    if len(colours) <= MOST_NAMES:
        legend = figure.legend(
            handles=[Patch(color=colour) for colour in colours.values()],
            labels=[printable(shortened(name, 40)) for name in colours],
            loc="upper left",
            bbox_to_anchor=(0.022, 0.892),
            ncols=len(colours),
            frameon=False,
            labelcolor=FAINT,
            fontsize=11,
            handlelength=0.9,
            handleheight=0.9,
            columnspacing=1.6,
        )
        for text in legend.get_texts():
            text.set_parse_math(False)  # a $ in a name is a $


def _draw_times(axes, picture):
    if not len(picture.toc):
        _say(axes, "No contacts\nin this step.")
        return
    edges = np.linspace(0, 1, 41)
    counts = np.histogram(picture.toc, edges)[0]
    middle = (edges[1:] + edges[:-1]) / 2
    axes.barh(middle, counts, height=0.9 / 40, color=TOC_COLOURS(middle))
    axes.set_ylim(0, 1)
    axes.set_facecolor(BACKGROUND)
    axes.set_title("time of impact", color=INK, fontsize=12, pad=12)
    axes.yaxis.tick_right()
    axes.set_yticks([0, 0.25, 0.5, 0.75, 1], ["0  start", "¼", "½", "¾", "1  end"])
    axes.set_xlabel("contacts", color=FAINT, fontsize=9)
    note = "surfaces in the middle of the step,\nfaint points lie behind them"
    axes.text(0.5, -0.19, note, transform=axes.transAxes, ha="center", va="top", color=FAINT, fontsize=8.5)
    _style(axes)


def _say(axes, sentence):
    """A sentence in place of a chart that would be empty."""
    axes.set_axis_off()
    axes.text(0.5, 0.5, sentence, transform=axes.transAxes, ha="center", va="center", color=FAINT, fontsize=12)


def _draw_history(axes, history):
    axes.set_facecolor(BACKGROUND)
    if not history.contacts.any():
        _say(axes, "No contacts in any step.")
        return
    axes.fill_between(history.frames, history.contacts, step="mid", color="#e0668c", alpha=0.35, linewidth=0)
    axes.step(history.frames, history.contacts, where="mid", color="#e0668c", linewidth=1.2)
    axes.axvline(history.marked, color=INK, linewidth=1, alpha=0.8)
    axes.set_xlim(history.frames[0], history.frames[-1])
    axes.set_ylim(0, max(1, history.contacts.max() * 1.1))
    axes.set_ylabel("contacts", color="#e0668c", fontsize=9)
    axes.set_xlabel("step", color=FAINT, fontsize=9, labelpad=1)
    axes.locator_params(axis="x", integer=True)
    _style(axes)
    if history.milliseconds is not None:
        times = axes.twinx()
        times.plot(history.frames, history.milliseconds, color="#7fd1e0", linewidth=1.2)
        top = usual_ceiling(history.milliseconds)
        times.set_ylim(0, top)
        most = int(np.nanargmax(history.milliseconds))
        if history.milliseconds[most] > top:
            at, text = (history.frames[most], 1.0), f"\u2191 {history.milliseconds[most]:.3g} ms"
            times.annotate(
                text,
                at,
                (3, 1),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                color="#7fd1e0",
                fontsize=8,
            )
        times.set_ylabel("ms a frame", color="#7fd1e0", fontsize=9)
        _style(times)


def usual_ceiling(values) -> float:
    """Upper end of an axis that the largest 5 % of the values, such as those of a warm-up, do not rule."""
    values = np.sort(np.asarray(values, float)[np.isfinite(values)])
    usual = values[: max(1, len(values) - max(1, len(values) // 20))][-1]
    return 1.15 * values[-1] if values[-1] < 2.5 * usual else 1.5 * usual


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
