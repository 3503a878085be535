# SPDX-License-Identifier: Apache-2.0
"""The data of a page about a replayed recording, and its texts."""

import itertools
from collections import Counter
from pathlib import Path

import numpy as np
from hpccd.msg import ContactArray

from hpccd_core.picture.contacts import mesh_colours, mesh_groups
from hpccd_core.picture.page.description import described
from hpccd_core.picture.page.document import Library, LibraryError, document, three
from hpccd_core.picture.page.packing import MOST, ContactColumns, Curves, FaceLists, MeshPositions, sampled
from hpccd_core.progress import track
from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.reader import Recording
from hpccd_ros.base import extras
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import shortened
from hpccd_ros.detect.plane_patch import FACES as PATCH_FACES
from hpccd_ros.detect.plane_patch import OUTLINE, patch
from hpccd_ros.frames.types import Topology
from hpccd_ros.middleware.contact_messages import FeaturePairs, fill_pairs, times_of
from hpccd_ros.picture.intersecting import IntersectingFaces
from hpccd_ros.picture.of_recording import facts
from hpccd_ros.picture.visual_geometry import NO_VISUAL, VisualGeometry
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay, ReplayedStep

# Bytes of positions that a browser is asked to hold.
MOST_POSITIONS = 1 << 29
# Why there may be nothing of a step.
GAP = "(dropped, not recorded, or started with another topology)"

ORIGIN = (
    "Contacts were computed again from the recorded frames when this page was written; milliseconds are those of that "
    "computation. A step whose recorded result differs has a notice."
)

_PATCH = Topology(0, 4, PATCH_FACES, OUTLINE)


class RecordingPage:
    """Collects steps, computed with outputs=("points",). every: each N-th step is shown."""

    def __init__(
        self,
        replay: Replay,
        mesh_names,
        title: str,
        *,
        every=1,
        azimuth=-60.0,
        elevation=26.0,
        visual: VisualGeometry = NO_VISUAL,
        intersecting: IntersectingFaces | None = None,
    ):
        self._replay = replay
        self._names, self._visual = list(mesh_names), visual
        self._meshes = [MeshPositions(name) for name in self._names]
        # Drawn in place of links; behind the meshes of the scene, whose numbers contacts have.
        self._seen = {name: MeshPositions(name) for name in visual.topologies}
        self._intersecting, self._marked = intersecting, FaceLists()
        self._contacts, self._curves = ContactColumns(), Curves()
        self._title, self._every = title, every
        self._view = {"azimuth": azimuth, "elevation": elevation}
        self._steps: list[dict] = []
        self._patches: dict = {}
        self._planes: set[int] = set()  # numbers of meshes that are planes
        self._thickness: dict[str, float] = {}  # of meshes, the last one that they had
        self._first_end: int | None = None
        self._numbers: list[int] = []  # of all steps of the recording
        self._missing = self._differ = self._truncated = self._cut = 0
        self._dropped = 0

    @property
    def steps(self) -> int:
        return len(self._steps)

    def add(self, step: ReplayedStep, shown: bool = True) -> None:
        """The next step of the recording. shown: false for one that is only looked at for what is missing around it.

        Raises UserError where the page would ask more of a browser than it can hold.
        """
        self._numbers.append(step.step)
        if step.recorded is not None:
            self._dropped = step.recorded.dropped_frames
        if not shown:
            return
        self._add_positions(step)
        self._thickness |= dict(step.thickness)
        marked, contours, depths = [np.empty(0, bool)] * len(self._meshes), [], []
        if self._intersecting is not None and step.end_frame is not None:
            marked = self._intersecting.of(step.end_frame.topologies, step.end_frame.vertices, step.rest)
            contours, depths = self._drawn(self._intersecting.contours), self._drawn(self._intersecting.depths)
        drawn = (0, 0) if step.contacts is None else self._add_contacts(step.contacts, step.layout)
        self._steps.append(
            {
                "step": str(step.step),  # a publisher may count to 2**64, more than a number of the page holds
                "time": self._time(step),
                "total": None if step.contacts is None else step.total,
                "drawn": drawn,
                "intersecting": self._marked.add(marked),
                "curves": self._curves.add(contours, depths),
                "depths": [
                    [self._names.index(d.mesh_a), self._names.index(d.mesh_b), f"{d.length:.3g}"] for d in depths
                ],
                "milliseconds": None if step.contacts is None else step.milliseconds,
                "facts": [] if step.contacts is None else [shortened(fact, 100) for fact in facts(step)],
                "notices": [shortened(notice, 400) for notice in self._notices(step, sum(drawn))],
                "place": len(self._numbers) - 1,
            }
        )

    def _add_contacts(self, contacts, layout) -> tuple[int, int]:
        """How many vertex-face and other contacts are drawn. Their features have the numbers of ContactArray."""
        toc = times_of(contacts)
        kept = sampled(toc)
        pairs = FeaturePairs.of_result(contacts).keep(kept)
        message = ContactArray()
        fill_pairs(message, pairs, layout)
        sides = [np.asarray(side, np.uint32).reshape(-1, 2) for side in (message.features_a, message.features_b)]
        meshes = np.stack([message.mesh_a, message.mesh_b], axis=1)
        points = np.asarray(contacts.points).reshape(-1, 3)[kept]
        self._contacts.add(meshes, np.concatenate(sides, axis=1), toc[kept], points)
        return len(pairs.vf), len(pairs) - len(pairs.vf)

    def _drawn(self, found):
        """Those between meshes that are drawn as they are tested, not by visual geometry."""
        return [between for between in found if not {between.mesh_a, between.mesh_b} & self._visual.topologies.keys()]

    def _add_positions(self, step):
        frame = step.end_frame
        for number, mesh in enumerate(self._meshes):
            if frame is None:
                mesh.add_nothing()
            elif number < len(frame.topologies):
                mesh.add(frame.topologies[number], frame.vertices[number])
            else:
                self._planes.add(number)
                self._add_plane(mesh, step.planes[number - len(frame.topologies)], frame)
        found = {} if frame is None else self._visual.vertices(self._names, frame)
        for name, mesh in self._seen.items():
            if name in found:
                mesh.add(self._visual.topologies[name], found[name])
            else:
                mesh.add_nothing()
        if sum(mesh.bytes for mesh in (*self._meshes, *self._seen.values())) > MOST_POSITIONS:
            raise UserError(
                f"the positions of {self.steps} steps fill the {MOST_POSITIONS >> 20} MB that a page may hold; "
                f"show fewer of them: --every {2 * self._every}"
            )

    def _add_plane(self, mesh, plane, frame):
        """Where it was first drawn: a patch that follows the meshes would seem to move."""
        if plane not in self._patches:
            self._patches[plane] = patch(plane, frame.vertices)
        corners = self._patches[plane]
        if corners is None:
            mesh.add_nothing()
        else:
            mesh.add(_PATCH, corners)

    def _time(self, step):
        if step.end_frame is None:
            return None
        if self._first_end is None:
            self._first_end = step.end
        return (step.end - self._first_end) * 1e-9

    def _notices(self, step, drawn):
        if step.missing:
            self._missing += 1
            yield f"No contacts are shown for this step: {step.missing}."
        if step.end_frame is None:
            yield "Nothing is drawn: positions of some meshes at the end of this step are not in the recording."
        if step.difference:
            self._differ += 1
            yield f"The recorded result differs: {step.difference}."
        recorded = step.recorded
        if recorded is not None and recorded.truncated:
            self._truncated += 1
            yield (
                f"The recorded result holds only the {len(recorded.kind):,} earliest of {recorded.total:,} contacts "
                "(max_contacts)."
            )
        if step.total > drawn:
            self._cut += 1
            yield f"{drawn:,} of {step.total:,} contacts are drawn, sampled evenly in order of TOI."

    def described(self) -> tuple[dict, dict[str, bytes]]:
        """(what the page says, as JSON can hold it, {name: bytes} of what it draws)."""
        drawn = [*self._meshes, *self._seen.values()]
        names = [mesh.name for mesh in drawn]
        colours, groups = mesh_colours(names), mesh_groups(names)
        meshes = []
        for number, mesh in enumerate(drawn):
            group = groups[number]
            collision = number < len(self._meshes)
            if mesh.name in self._seen:
                group += ": collision geometry" if collision else ""
            looks = {"colour": colours[number], "group": group, "hidden": collision and mesh.name in self._seen}
            looks |= {"plane": number in self._planes, "thickness": self._thickness.get(mesh.name, 0.0)}
            meshes.append((mesh, looks))
        gaps = _gaps(self._numbers)
        steps = [self._with_gap(step, gaps) for step in self._steps]
        drawn_of_steps = (self._contacts, self._marked, self._curves)
        return described(self._title, self._view, meshes, *drawn_of_steps, steps, self._notes(sum(gaps)), ORIGIN)

    def _with_gap(self, step, gaps):
        missing = gaps[step["place"]]
        notices = [f"{_count(missing, 'step')} right before this one: no result {GAP}."] if missing else []
        return {**step, "gap": missing, "notices": step["notices"] + notices}

    def _notes(self, left_out):
        replay = self._replay
        notes = []
        if not replay.recorded_results:
            notes.append("The recording contains no results of a node: contacts were computed from its frames.")
        if self._every > 1:
            notes.append(f"Each {_ordinal(self._every)} step of the recording is shown (--every {self._every}).")
        for count, what in (
            (self._missing, "not computed; their contacts are not shown"),
            (self._differ, "recorded result differs; the contacts computed again are shown"),
            (self._truncated, "recorded result truncated (max_contacts); all contacts were computed again"),
            (self._cut, f"more than {MOST:,} contacts; only {MOST:,} are drawn"),
        ):
            if count:
                notes.append(f"{count:,} of {_count(len(self._steps), 'step')}: {what}.")
        if left_out:
            notes.append(f"{_count(left_out, 'step')} between the first and the last one: no result {GAP}.")
        if self._dropped:
            notes.append(f"The node had dropped {_count(self._dropped, 'frame')} by the last result.")
        return notes


def _gaps(numbers: list[int]) -> list[int]:
    """For each step how many are missing right before it. A publisher may give every tenth step only: what is between
    most of them is not missing."""
    forward = [max(b - a, 0) for a, b in itertools.pairwise(numbers)]
    usual = Counter(filter(None, forward)).most_common(1)
    return [0] + [max(difference // usual[0][0] - 1, 0) if usual else 0 for difference in forward] if numbers else []


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"


def drawing_library() -> Library:
    """three.js. Raises UserError where trimesh, which carries it, is missing or has none."""
    extras.require("trimesh", "page", "an HTML page")
    try:
        return three()
    except LibraryError as error:
        raise UserError(str(error)) from error


# Bytes of a file that a browser takes long to open.
LARGE = 50_000_000


def write_page(args, source: Path, target: Path, title: str, view: dict) -> int:
    """As the options of `hpccd view` say. view: azimuth, elevation."""
    library = drawing_library()  # before anything is computed
    every = args.every or 1
    try:
        with whole_file(target, overwrite=True) as draft:
            page = _page_of(args, source, title, view, every)
            draft.write_text(document(*page.described(), library), encoding="utf-8", newline="\n")
    except OSError as error:
        if error.filename != str(target):
            raise  # of the recording
        raise UserError(f"--html {target}: {error.strerror}") from error
    size = target.stat().st_size
    advice = f"; --every {2 * every} makes it smaller" if size > LARGE and args.step is None else ""
    print(f"{target}: {page.steps} step{'' if page.steps == 1 else 's'}, {size / 1e6:.1f} MB{advice}")
    return 0


def _page_of(args, source, title, view, every) -> RecordingPage:
    with Recording(source) as recording:
        setup = recorded_setup.of_recording(recording, args.params)
        replay = Replay(recording, setup, outputs=("points",), distances=False)
        visual = VisualGeometry(setup.visual())
        view |= {"visual": visual, "intersecting": IntersectingFaces(setup.builder, depth=args.depth)}
        page = RecordingPage(replay, setup.mesh_names, title, every=every, **view)
        for number, step in enumerate(track(replay.steps(), "steps", True, replay.recorded_results or None)):
            page.add(step, step.step == args.step if args.step is not None else number % every == 0)
        if not page.steps:
            raise UserError(f"{source}: no step{'' if args.step is None else f' {args.step}'} that can be shown")
    return page
