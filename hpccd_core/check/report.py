# SPDX-License-Identifier: Apache-2.0
"""The result of a check, as a sentence, a table, JSON and CSV."""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Iterable, Sequence
from typing import TextIO


@dataclasses.dataclass(frozen=True)
class FrameResult:
    """One frame.

    Attributes
    ----------
    index : int
        From 0.
    file : str
        The name of the frame.
    intersections : int
        Pairs of an edge and a face that intersect.
    distance : float or None
        The smallest between different meshes, in the unit of the sequence; of a single mesh, between its features that
        share no vertex. 0 if they touch, or if a mesh touches itself and nothing intersects, as where it is folded flat
        along an edge. None if there is no such pair.
    inside : tuple of (str, str)
        Pairs of meshes that do not touch: a connected component of the first lies inside the second, a closed mesh.
    near : bool
        Whether different meshes are within the separation; `distance` is rounded, this is exact.
    """

    index: int
    file: str
    intersections: int
    distance: float | None
    inside: tuple[tuple[str, str], ...]
    near: bool = False

    @property
    def has_defect(self) -> bool:
        """Whether surfaces touch, intersect or contain each other, or different meshes are within the separation."""
        return bool(self.intersections or self.inside or self.near or self.distance == 0)


@dataclasses.dataclass(frozen=True)
class StepResult:
    """The step from one frame to the next.

    Attributes
    ----------
    start, end : int
        Frames.
    contacts : int or None
        Pairs of features that touch, or come within the separation, during the step; None: not checked, because the
        meshes changed.
    first_toc : float or None
        The first time of impact, 0 .. 1; None without contacts.
    """

    start: int
    end: int
    contacts: int | None
    first_toc: float | None


@dataclasses.dataclass(frozen=True)
class Report:
    """The results of all frames and steps of a sequence.

    Attributes
    ----------
    source : str
        The files.
    frames : list of FrameResult
    steps : list of StepResult
    notes : tuple of str
        Sentences about units, transforms, joined vertices and missing frames.
    separation : float
        In the unit of the sequence.
    """

    source: str
    frames: Sequence[FrameResult]
    steps: Sequence[StepResult]
    notes: tuple[str, ...] = ()
    separation: float = 0.0

    @property
    def clean(self) -> bool:
        """Whether no frame has a defect and no step a contact. Steps that were not checked do not count."""
        return not (self._bad_frames() or self._bad_steps())

    @property
    def verdict(self) -> str:
        """``"clean"`` or ``"defects"``."""
        return "clean" if self.clean else "defects"

    def sentence(self) -> str:
        """The verdict in one line."""
        skipped = sum(step.contacts is None for step in self.steps)
        unchecked = f"; {_of(skipped, self.steps, 'step')} not checked, because meshes changed" if skipped else ""
        return (self._clean_sentence(len(self.steps) - skipped) if self.clean else self._defects()) + unchecked

    def _clean_sentence(self, n_steps: int) -> str:
        checked = f"{_count(len(self.frames), 'frame')} and {_count(n_steps, 'step')}"
        within = f" within {self.separation:g}" if self.separation else ""
        known = [(frame.distance, frame.index) for frame in self.frames if frame.distance is not None]
        if not known:
            return f"clean: no contact{within} in {checked}"
        distance, index = min(known)
        return f"clean: no contact{within} in {checked}; smallest distance {distance:.6g} in {self._place(index)}"

    def _defects(self) -> str:
        frames, steps = self._bad_frames(), self._bad_steps()
        counts = {
            "with intersections": sum(frame.intersections > 0 for frame in frames),
            "with a mesh inside another": sum(bool(frame.inside) for frame in frames),
            "where a mesh touches itself": sum(frame.distance == 0 and not frame.intersections for frame in frames),
            f"closer than {self.separation:g}": sum(frame.near and frame.distance != 0 for frame in frames),
        }
        found = [f"{_of(count, self.frames, 'frame')} {what}" for what, count in counts.items() if count]
        if steps:
            found.append(f"{_of(len(steps), self.steps, 'step')} with contacts")
        first = min([frame.index for frame in frames] + [step.end for step in steps])
        return f"defects: {', '.join(found)}; first in {self._place(first)}"

    def _place(self, index: int) -> str:
        return f"frame {index} ({self.frames[index].file})"

    def rows(self) -> Iterable[tuple[FrameResult, StepResult | None]]:
        """Each frame, with the step to the next one."""
        return zip(self.frames, [*self.steps, None], strict=True)

    def bad_rows(self) -> list[tuple[FrameResult, StepResult | None]]:
        """Rows with a defect or a contact, or whose step was not checked."""
        return [
            (frame, step)
            for frame, step in self.rows()
            if frame.has_defect or (step is not None and step.contacts != 0)
        ]

    def to_json(self) -> dict[str, object]:
        """As `hpccd-check --json` writes it: verdict, frames, steps, notes."""
        frames: list[dict[str, object]] = [dataclasses.asdict(frame) for frame in self.frames]
        for frame in frames:
            del frame["near"]
        steps = [dataclasses.asdict(step) for step in self.steps]
        return {"verdict": self.verdict, "frames": frames, "steps": steps, "notes": list(self.notes)}

    def _bad_frames(self) -> list[FrameResult]:
        return [frame for frame in self.frames if frame.has_defect]

    def _bad_steps(self) -> list[StepResult]:
        return [step for step in self.steps if step.contacts]


COLUMNS = ("index", "file", "intersections", "distance", "inside", "contacts_to_next", "first_toc")


def cells(frame: FrameResult, step: StepResult | None, unknown: str = "") -> list[str]:
    """A row of the table, one text for each of COLUMNS. Numbers have all their digits."""
    contacts = "" if step is None else unknown if step.contacts is None else str(step.contacts)
    first = "" if step is None or step.first_toc is None else repr(step.first_toc)
    distance = "" if frame.distance is None else repr(frame.distance)
    inside = "; ".join(f"{inner} in {outer}" for inner, outer in frame.inside)
    return [str(frame.index), frame.file, str(frame.intersections), distance, inside, contacts, first]


def write_csv(stream: TextIO, reports: Sequence[Report]) -> None:
    """One row for each frame; with the sequence in front if there are several."""
    writer = csv.writer(stream)
    several = len(reports) > 1
    writer.writerow([*["sequence"] * several, *COLUMNS])
    for report in reports:
        writer.writerows([*[report.source] * several, *cells(*row, unknown="unknown")] for row in report.rows())


def write_json(stream: TextIO, reports: Sequence[Report]) -> None:
    """One line for each frame and step. Several sequences are a list, with their sources."""
    if len(reports) == 1:
        stream.write(_text(reports[0].to_json(), "") + "\n")
        return
    verdict = "clean" if all(report.clean for report in reports) else "defects"
    texts = [_text({"source": report.source, **report.to_json()}, "  ") for report in reports]
    stream.write(f'{{\n "verdict": "{verdict}",\n "sequences": [\n  ' + ",\n  ".join(texts) + "\n ]\n}\n")


def _text(entries: dict[str, object], indent: str) -> str:
    lines = []
    for name, value in entries.items():
        rows = [json.dumps(row, allow_nan=False) for row in value] if isinstance(value, list) else None
        text = json.dumps(value) if not rows else f"[\n{indent}  " + f",\n{indent}  ".join(rows) + f"\n{indent} ]"
        lines.append(f"{indent} {json.dumps(name)}: {text}")
    return "{\n" + ",\n".join(lines) + f"\n{indent}}}"


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def _of(number: int, all_: Sequence[object], what: str) -> str:
    return f"{number:,} of {_count(len(all_), what)}"
