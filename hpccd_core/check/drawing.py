# SPDX-License-Identifier: Apache-2.0
"""The page and the picture of a checked sequence."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..contacts import Contacts
from ..contours import Contour
from ..mesh_files.errors import shortened
from ..picture import contacts as picture
from ..picture.intersecting_faces import marked
from ..picture.page.description import described
from ..picture.page.document import Library, document
from ..picture.page.packing import ContactColumns, Curves, FaceLists, MeshPositions, sampled
from ..proximity import Intersections
from ..sequences import FrameSequence
from .analysis import Checker, Options, State
from .frame_scene import FrameScene
from .report import FrameResult, Report

# Bytes of positions in a page, before compression; more frames than this allows are left out.
MOST_POSITIONS = 1 << 26
# Frames of a page: each is computed again, and a slider has about as many pixels.
MOST_FRAMES = 1_000

# Rows map (x, y, z) to what is drawn, whose third axis points up.
UPRIGHT = {
    "x": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], np.float64),
    "y": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], np.float64),
    "z": np.eye(3),
}

ORIGIN = "Contacts and intersections were computed again when this page was written."


LABEL = "faces that intersect"
NO_EDGES = np.empty((0, 2), np.uint32)


@dataclasses.dataclass(frozen=True, eq=False)
class Topology:
    """As `packing` needs it of a mesh."""

    version: int
    n_vertices: int
    faces: NDArray[np.uint32]
    edges: NDArray[np.uint32] = dataclasses.field(default_factory=lambda: NO_EDGES)


@dataclasses.dataclass(frozen=True)
class Drawn:
    """A frame, its intersections, and the contacts of the step that ends with it; None where there are none."""

    state: State
    before: State | None
    contacts: Contacts | None
    hits: Intersections | None

    def marked(self) -> list[NDArray[np.bool_]]:
        """The faces of each mesh that intersect."""
        faces = self.state.motion.faces
        found = np.zeros(len(faces), bool)
        if self.hits is not None:
            found = marked(self.hits, faces, len(self.state.x), within=True)
        return np.split(found, np.cumsum([len(of_mesh) for of_mesh in self.state.scene.faces])[:-1])

    def contours(self, turn: NDArray[np.float64]) -> list[Contour]:
        """The intersection curves."""
        found = [] if self.hits is None else self.hits.contours()
        return [dataclasses.replace(contour, points=contour.points @ turn.T) for contour in found]


def worst(report: Report) -> int:
    """The frame with the most contacts in the step before it; of several the one with the most intersections."""

    def badness(frame: FrameResult) -> tuple[float, ...]:
        contacts = report.steps[frame.index - 1].contacts if frame.index else 0
        distance = np.inf if frame.distance is None else frame.distance
        return contacts or 0, frame.intersections, len(frame.inside), -distance, -frame.index

    return max(report.frames, key=badness).index


def write_picture(sequence: FrameSequence, options: Options, report: Report, path: str | Path, up: str) -> None:
    """Draw the `worst` frame, with the surfaces in the middle of the step before it if that has contacts."""
    drawn, turn = _drawn(Checker(sequence, options), worst(report), report), UPRIGHT[up]
    state, contacts = drawn.state, drawn.contacts
    x = state.x if drawn.before is None else 0.5 * drawn.before.x + 0.5 * state.x
    parts = zip(state.frame.meshes, _of_meshes(state, x @ turn.T), state.scene.faces, strict=True)
    no_points = np.empty((0, 3))
    step = picture.Picture(
        [(mesh.name, positions, faces, NO_EDGES) for mesh, positions, faces in parts],
        no_points if contacts is None else np.asarray(contacts.points).reshape(-1, 3) @ turn.T,
        np.empty(0) if contacts is None else _times(contacts),
        _title(state.frame.index, report),
        [*_facts(state.frame.index, report), *_inside(state.frame.index, report)],
        Path(report.source).name,
        intersecting=np.concatenate(drawn.marked()),
        contours=drawn.contours(turn),
        intersecting_are=LABEL,
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # of names in other scripts
        picture.draw(step, path, _history(report, state.frame.index))


class SequencePage:
    """Collects frames, each with the step that ends with it."""

    def __init__(self, report: Report, up: str) -> None:
        self._report, self._turn = report, UPRIGHT[up]
        self._meshes: dict[str, MeshPositions] = {}
        self._topologies: dict[FrameScene, list[Topology]] = {}
        self._contacts, self._marked, self._curves = ContactColumns(), FaceLists(), Curves()
        self._steps: list[dict[str, Any]] = []

    def add(self, drawn: Drawn) -> None:
        """The next frame."""
        state, index = drawn.state, drawn.state.frame.index
        names = [mesh.name for mesh in state.frame.meshes]
        for name in names:
            if name not in self._meshes:
                self._meshes[name] = MeshPositions(name)
                for _ in self._steps:
                    self._meshes[name].add_nothing()
        of_meshes = zip(self._topologies_of(state), _of_meshes(state, state.x @ self._turn.T), strict=True)
        shown = dict(zip(names, of_meshes, strict=True))
        for name, mesh in self._meshes.items():
            if name in shown:
                mesh.add(*shown[name])
            else:
                mesh.add_nothing()
        marks = dict(zip(names, drawn.marked(), strict=True))
        no_marks = np.empty(0, bool)
        step = self._report.steps[index - 1] if index else None
        n_contacts = 0 if step is None else step.contacts
        drawn_contacts = self._add_contacts(drawn, names)
        self._steps.append(
            {
                "step": str(index),
                "where": f"the step to frame {index}" if index else "frame 0",
                "time": None,
                "total": n_contacts,
                "drawn": drawn_contacts,
                "intersecting": self._marked.add([marks.get(name, no_marks) for name in self._meshes]),
                "curves": self._curves.add(drawn.contours(self._turn), []),
                "depths": [],
                "milliseconds": None,
                "facts": _facts(index, self._report),
                "notices": self._notices(index, sum(drawn_contacts)),
                "gap": 0,
            }
        )

    def described(self, left_out: int) -> tuple[dict[str, Any], dict[str, bytes]]:
        """As `document` needs it. left_out: how many frames are not shown."""
        names = list(self._meshes)
        looks = [
            {"colour": colour, "group": group, "hidden": False, "plane": False, "thickness": 0.0}
            for colour, group in zip(picture.mesh_colours(names), picture.mesh_groups(names), strict=True)
        ]
        notes = [f"{self._report.sentence()}.", *(f"{note}." for note in self._report.notes)]
        if left_out:
            notes.append(f"{left_out:,} of {len(self._report.frames):,} frames are left out to keep the page small.")
        return described(
            Path(self._report.source).name,
            {"azimuth": -60.0, "elevation": 26.0},
            list(zip(self._meshes.values(), looks, strict=True)),
            self._contacts,
            self._marked,
            self._curves,
            self._steps,
            notes,
            ORIGIN,
            LABEL,
        )

    def _topologies_of(self, state: State) -> list[Topology]:
        if state.scene not in self._topologies:
            of_meshes = zip(state.scene.faces, state.scene.counts, strict=True)
            version = len(self._topologies)
            self._topologies[state.scene] = [Topology(version, count, faces) for faces, count in of_meshes]
        return self._topologies[state.scene]

    def _add_contacts(self, drawn: Drawn, names: list[str]) -> tuple[int, int]:
        """How many vertex-face and edge-edge contacts of a step are drawn."""
        contacts = drawn.contacts
        if contacts is None:
            return 0, 0
        toc = _times(contacts)
        kept = sampled(toc)
        numbers = np.array([list(self._meshes).index(name) for name in names], np.uint32)
        meshes = numbers[np.stack([contacts.mesh_a, contacts.mesh_b], axis=1)[kept]]
        features = np.concatenate([contacts.local_a, contacts.local_b], axis=1)[kept]
        self._contacts.add(meshes, features, toc[kept], np.asarray(contacts.points).reshape(-1, 3)[kept] @ self._turn.T)
        vertex_face = int((kept < len(contacts.vf)).sum())
        return vertex_face, len(kept) - vertex_face

    def _notices(self, index: int, drawn: int) -> list[str]:
        step = self._report.steps[index - 1] if index else None
        notices = [f"{sentence}." for sentence in _inside(index, self._report)]
        if step is not None and step.contacts is None:
            notices.append("The step to this frame was not checked, because meshes changed.")
        if step is not None and step.contacts and step.contacts > drawn:
            notices.append(f"{drawn:,} of {step.contacts:,} contacts are drawn, sampled evenly in order of TOI.")
        return [shortened(notice, 400) for notice in notices]


def write_page(
    sequence: FrameSequence,
    options: Options,
    report: Report,
    path: Path,
    up: str,
    library: Library,
    progress: Callable[[list[int]], Iterable[int]] = iter,
) -> None:
    """Write the frames with defects, and others between them as far as a page can hold them.

    path: overwritten. progress: yields the frames that it is given.
    """
    checker, page = Checker(sequence, options), SequencePage(report, up)
    indices = _shown(len(checker.state(0).x), report)
    for index in progress(indices):
        page.add(_drawn(checker, index, report))
    path.write_text(
        document(*page.described(len(report.frames) - len(indices)), library), encoding="utf-8", newline="\n"
    )


def _shown(n_vertices: int, report: Report) -> list[int]:
    """Numbers of the frames of a page: the first and the last, those with defects, then others at even distances."""
    count = len(report.frames)
    most = max(2, min(count, MOST_FRAMES, MOST_POSITIONS // (6 * max(n_vertices, 1))))
    defects = {frame.index for frame in report.frames if frame.has_defect}
    bad = sorted(defects | {step.end for step in report.steps if step.contacts != 0})
    chosen = dict.fromkeys([worst(report), 0, count - 1])
    for indices in (bad, range(count)):
        chosen |= dict.fromkeys(_evenly([index for index in indices if index not in chosen], most - len(chosen)))
    return sorted(chosen)


def _evenly(indices: Sequence[int], most: int) -> list[int]:
    if len(indices) <= most:
        return list(indices)
    return [indices[k * len(indices) // most] for k in range(most)] if most > 0 else []


def _drawn(checker: Checker, index: int, report: Report) -> Drawn:
    """Computes only what the report says is there."""
    step = report.steps[index - 1] if index else None
    before = checker.state(index - 1) if step is not None and step.contacts else None
    state = checker.state(index)
    contacts = None if before is None else checker.step(before, state)[1]
    hits = state.motion.intersections(state.x) if report.frames[index].intersections else None
    return Drawn(state, before, contacts, hits)


def _of_meshes(state: State, x: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return np.split(x, np.cumsum(state.scene.counts)[:-1])


def _times(contacts: Contacts) -> NDArray[np.float64]:
    return np.concatenate([contacts.vf_toc, contacts.ee_toc])


def _title(index: int, report: Report) -> str:
    contacts = report.steps[index - 1].contacts if index else 0
    frame = f"frame {index}"
    return f"{contacts:,} contact{'' if contacts == 1 else 's'} in the step to {frame}" if contacts else frame


def _facts(index: int, report: Report) -> list[str]:
    frame, step = report.frames[index], report.steps[index - 1] if index else None
    facts = [
        shortened(frame.file, 60),
        f"{frame.intersections:,} intersection{'' if frame.intersections == 1 else 's'}",
        f"smallest distance {frame.distance:.4g}" if frame.distance is not None else "",
        f"first at t = {step.first_toc:.4f}" if step is not None and step.first_toc is not None else "",
        f"separation {report.separation:g}" if report.separation else "",
    ]
    return [fact for fact in facts if fact]


def _inside(index: int, report: Report) -> list[str]:
    """Sentences about meshes inside another one, at most four."""
    found = report.frames[index].inside
    more = [f"{len(found) - 3} more meshes are inside another"] if len(found) > 3 else []
    return [*(f"{shortened(inner, 60)} is inside {shortened(outer, 60)}" for inner, outer in found[:3]), *more]


def _history(report: Report, index: int) -> picture.History | None:
    if len(report.frames) < 2:
        return None
    counts = np.array([0, *(step.contacts or 0 for step in report.steps)])
    return picture.History(np.arange(len(report.frames)), counts, None, index)
