# SPDX-License-Identifier: Apache-2.0
"""Steps of a replayed recording as a Rerun recording: meshes, contacts by their time, normals, curves, timelines."""

import numpy as np
from matplotlib.colors import to_rgb

from hpccd_core.picture.contacts import TOC_COLOURS, linear, mesh_colours, srgb, toc_colours
from hpccd_core.picture.shading import RADIUS, vertex_normals
from hpccd_core.picture.tint import Tint
from hpccd_ros.base import extras
from hpccd_ros.middleware.contact_messages import times_of
from hpccd_ros.picture.of_recording import meshes_in_the_middle
from hpccd_ros.picture.visual_geometry import NO_VISUAL, VisualGeometry
from hpccd_ros.replay.recomputed import ReplayedStep

# Parts of the largest extent of the first step's scene.
POINT_RADIUS, NORMAL_LENGTH, EYE_DISTANCE = 0.003, 0.03, 1.0


def need_rerun():
    """The module rerun, or UserError."""
    return extras.require("rerun", "rerun", "a Rerun recording")


class RerunWriter:
    """Writes steps, computed with outputs=("points", "normals"), to `path` (.rrd), or to a viewer it opens (None).

    Entities: meshes/NAME in the middle of the step, tinted around contacts; contacts/vertex_face, contacts/edge_edge,
    and those of planes and points, coloured by toc; contacts/normals; curves of contacts, first_toc and milliseconds of
    the core. Timelines: step (the number that the publisher gave), stamp (its end).
    azimuth, elevation: degrees, from where the viewer looks first.
    Raises UserError where rerun-sdk is not installed, OSError where `path` cannot be written.
    """

    def __init__(self, title: str, path=None, *, azimuth=-60.0, elevation=26.0, visual: VisualGeometry = NO_VISUAL):
        self._rr = rr = need_rerun()
        self._stream = rr.RecordingStream("hpccd")
        if path is None:
            self._stream.spawn()
        else:
            with open(path, "wb"):  # rerun reports a path that cannot be written only in a log
                pass
            self._stream.save(path)
        self._stream.send_recording_name(title)
        self._faces: dict[str, np.ndarray] = {}  # logged last
        self._extent = 0.0
        self._visual = visual
        self._direction = np.radians([azimuth, elevation])

    def close(self) -> None:
        """Hand all to the file or the viewer."""
        self._stream.flush()
        self._stream.disconnect()

    def add(self, step: ReplayedStep) -> None:
        rr, stream = self._rr, self._stream
        meshes = meshes_in_the_middle(step, self._visual)
        vertices = np.concatenate([vertices for _, vertices, *_ in meshes])
        if not self._extent:
            self._look_at(vertices)
        stream.set_time("step", sequence=min(step.step, np.iinfo(np.int64).max))  # a publisher may count to 2**64
        stream.set_time("stamp", timestamp=np.datetime64(step.end, "ns"))
        toc = times_of(step.contacts)
        tint = Tint(np.asarray(step.contacts.points).reshape(-1, 3), toc_colours(toc), vertices)
        for colour, (name, own_vertices, faces, edges) in zip(
            mesh_colours([name for name, *_ in meshes]), meshes, strict=True
        ):
            own = np.broadcast_to(linear(to_rgb(colour)), own_vertices.shape)
            colours = (255 * srgb(tint.applied(own_vertices, own))).astype(np.uint8)
            if len(faces):
                self._add_mesh(name, own_vertices, faces, colours)
            if len(edges):
                self._add_edges(name, own_vertices, edges, colours)
        self._add_contacts(step)
        for name, value in (
            ("contacts", step.total),
            ("milliseconds", step.milliseconds),
            ("first_toc", float(step.contacts.first_toc) if step.total else np.nan),
        ):
            stream.log(f"curves/{name}", rr.Scalars(value))

    def _look_at(self, vertices):
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        self._extent = float((high - low).max()) or 1.0
        azimuth, elevation = self._direction
        towards = [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        middle = 0.5 * (low + high)
        self._stream.send_blueprint(_blueprint(middle + EYE_DISTANCE * self._extent * np.array(towards), middle))

    def _add_mesh(self, name, vertices, faces, colours):
        changed = self._faces.get(name) is not faces  # triangles once, and after each change of topology
        self._faces[name] = faces
        # One row a time: which of two holds, readers that do not look at the order of rows could not tell.
        fields = self._rr.Mesh3D.from_fields(
            clear_unset=changed,
            vertex_positions=vertices,
            vertex_normals=vertex_normals(vertices, faces),
            vertex_colors=colours,
            **({"triangle_indices": faces} if changed else {}),
        )
        self._stream.log(f"meshes/{name}", fields)

    def _add_edges(self, name, vertices, edges, colours):
        radius = RADIUS * self._extent
        self._stream.log(
            f"edges/{name}", self._rr.LineStrips3D(vertices[edges], colors=colours[edges[:, 0]], radii=radius)
        )

    def _add_contacts(self, step):
        rr, found = self._rr, step.contacts
        points, normals = np.asarray(found.points), np.asarray(found.normals)
        n_vf, n_ee = len(found.vf), len(found.ee)
        toc = times_of(found)
        colours = (255 * TOC_COLOURS(toc)[:, :3]).astype(np.uint8)
        radius = POINT_RADIUS * self._extent
        kinds = [("vertex_face", slice(0, n_vf)), ("edge_edge", slice(n_vf, n_vf + n_ee))]
        if step.planes or len(toc) > n_vf + n_ee:
            kinds.append(("planes_and_points", slice(n_vf + n_ee, None)))
        for name, part in kinds:
            self._stream.log(f"contacts/{name}", rr.Points3D(points[part], colors=colours[part], radii=radius))
        self._stream.log(
            "contacts/normals",
            rr.Arrows3D(
                origins=points, vectors=NORMAL_LENGTH * self._extent * normals, colors=colours, radii=0.2 * radius
            ),
        )


def _blueprint(eye, target):
    import rerun.blueprint as rrb

    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Spatial3DView(
                name="meshes and contacts",
                origin="/",
                contents=["/meshes/**", "/edges/**", "/contacts/**"],
                eye_controls=rrb.EyeControls3D(
                    kind=rrb.Eye3DKind.Orbital, position=eye, look_target=target, eye_up=[0, 0, 1]
                ),
            ),
            rrb.Horizontal(
                *(
                    rrb.TimeSeriesView(name=name, origin=f"/curves/{name}")
                    for name in ("contacts", "first_toc", "milliseconds")
                )
            ),
            row_shares=[4, 1],
        ),
        rrb.TimePanel(state="collapsed", timeline="step"),
        collapse_panels=True,
    )
