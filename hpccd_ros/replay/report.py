# SPDX-License-Identifier: Apache-2.0
"""`hpccd replay`: progress while it runs, then what was verified, and the exit status."""

import contextlib
import csv
import json
import os
import sys
import time

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hpccd_core.options import FEATURES
from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.reader import Recording
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted
from hpccd_ros.frames.drops import Reason
from hpccd_ros.params import unknown
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.pacing import Pace, next_wanted
from hpccd_ros.replay.recomputed import Replay, ReplayedStep

# Behind a reason for which messages were not used.
_HINTS = {
    Reason.NO_SHAPE: "; the recording has no shape of it on meshes/{mesh}/vertices: begin it before the shape is sent, "
    "or give the node mesh.{mesh}.file"
}
COLUMNS = (
    "number",
    "step",
    "start_ns",
    "end_ns",
    "contacts",
    "vertex_face",
    "edge_edge",
    "vertex_plane",
    "of_points",
    "first_toc",
    "separation",
    "features",
    "ms",
    "hash",
    "recorded_contacts",
    "recorded_hash",
    "result",
)


@contextlib.contextmanager
def new_file(option: str, path):
    """`whole_file`, or None where no file is asked for. Raises UserError naming the option, before anything is computed
    where the file exists or its folder does not."""
    if not path:
        yield None
        return
    try:
        with whole_file(path) as draft:
            yield draft
    except OSError as error:
        if error.filename != str(path):
            raise  # of another file
        remedy = "; existing files are not overwritten" if isinstance(error, FileExistsError) else ""
        raise UserError(f"{option} {path}: {error.strerror or error}{remedy}") from error


class Table:
    """One row of text for each step, into a CSV file."""

    def __init__(self, path):
        self._file = open(path, "w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._writer.writerow(COLUMNS)

    def add(self, step: ReplayedStep) -> None:
        found, recorded = step.contacts, step.recorded
        self._writer.writerow(
            [
                step.number,
                step.step,
                step.start,
                step.end,
                *(
                    [
                        step.total,
                        len(found.vf),
                        len(found.ee),
                        len(found.vp),
                        len(found.vv) + len(found.ve),
                        repr(float(found.first_toc)),
                        step.separation.text,
                        " ".join(step.features),
                        f"{step.milliseconds:.3f}",
                        f"{found.hash:#018x}",
                    ]
                    if found is not None
                    else [""] * 10
                ),
                *([recorded.total, f"{recorded.hash:#018x}"] if recorded is not None else [""] * 2),
                step.missing or step.difference or ("equal" if recorded is not None else ""),
            ]
        )

    def close(self):
        self._file.close()


def write_json(path, rows) -> None:
    """Write the rows of a report."""
    with open(path, "w", encoding="utf-8") as stream:
        json.dump(rows, stream, indent=1)


def main(args) -> int:
    """Verify as the options of `hpccd replay` say. 0: all equal, 1: not."""
    with contextlib.ExitStack() as stack:
        recording = stack.enter_context(Recording(args.file))
        setup = recorded_setup.of_recording(recording, args.params)
        csv_file, json_file = (
            stack.enter_context(new_file(*named)) for named in (("--csv", args.csv), ("--json", args.json))
        )
        table = stack.enter_context(contextlib.closing(Table(csv_file))) if csv_file else None
        progress = stack.enter_context(_progress_bar())
        replay = Replay(
            recording,
            setup,
            backend=args.backend,
            threads=args.threads,
            accuracy=args.accuracy,
            features=args.features,
            begin=args.begin,
            end=args.end,
        )
        bar = progress.add_task("replay", total=replay.message_count, line="")
        summary = Summary()
        pace = Pace(args.rate or 0.0)
        for step in replay.steps():
            pace.wait(step.at)
            summary.add(step)
            if table:
                table.add(step)
            progress.update(bar, completed=replay.messages_read)
            if step.contacts is not None:
                progress.update(
                    bar, line=f"step {step.step}: {counted(step.total, 'contact')}, {step.milliseconds:.1f} ms"
                )
            if step.difference and args.keep_going:
                progress.console.print(
                    f"step {step.step} (ends at {step.end} ns): {step.difference}", markup=False, highlight=False
                )
            if args.step:
                progress.stop()
                print(line(step))
                if not next_wanted(f"{step.at:.3f} s"):
                    break
        progress.update(bar, line="")
        if json_file:
            write_json(json_file, [summary.row(args.file, replay)])
    for note in recording.notes:
        print(note, file=sys.stderr)
    for name in setup.unknown:
        print(unknown.warning(name), file=sys.stderr)
    summary.print(args, recording, replay)
    failed = any(part.diverged or part.unverified for part in (replay, replay.distances))
    return 1 if failed or not summary.computed else 0


def line(step: ReplayedStep) -> str:
    """One step in words."""
    if step.missing:
        return f"step {step.step}: not computed: {step.missing}"
    result = step.difference or ("equal" if step.recorded is not None else "nothing recorded to compare with")
    return f"step {step.step}: {counted(step.total, 'contact')}, hash {step.contacts.hash:#018x}, {result}"


class Summary:
    """Adds up the steps of a replay, and says what came of them."""

    def __init__(self):
        self.began = time.perf_counter()
        self.computed = self.contacts = 0
        self.milliseconds = 0.0
        self.seconds_recorded = 0.0
        self.accuracies = set()
        self.separations = set()
        self.features = set()
        self.missing: ReplayedStep | None = None
        self.before = 0

    def add(self, step: ReplayedStep) -> None:
        if step.missing:
            self.before += step.before_recording
            if not step.before_recording:
                self.missing = self.missing or step
            return
        self.computed += 1
        self.contacts += step.total
        self.milliseconds += step.milliseconds
        self.seconds_recorded += (step.end - step.start) * 1e-9
        self.separations |= {step.separation.text} - {""}
        self.features.add(" ".join(step.features))
        if step.recorded is not None:
            self.accuracies.add(step.recorded.accuracy)

    def row(self, path, replay) -> dict:
        """The outcome, JSON-able."""
        distances = replay.distances
        if replay.diverged:
            result, first = "DIVERGED", replay.first_divergence
            why = f"step {first.step}: {first.difference}"
        elif distances.diverged:
            result, why = "DIVERGED", distances.first
        elif replay.unverified:
            result, why = "NOT VERIFIED", f"step {self.missing.step}: {self.missing.missing}"
        elif distances.unverified:
            result, why = "NOT VERIFIED", distances.first
        elif replay.verified:
            result, why = "VERIFIED", ""
        else:
            result = "COMPUTED" if self.computed else "NOTHING"
            why = "no recorded contacts" if self.computed else "no step of all meshes"
        return {
            "file": str(path),
            "result": result,
            "verified": replay.verified,
            "diverged": replay.diverged,
            "unverified": replay.unverified,
            "frames": replay.frames,
            "steps": self.computed,
            "contacts": self.contacts,
            "core_ms": round(self.milliseconds, 3),
            "seconds": round(time.perf_counter() - self.began, 3),
            "accuracy": sorted(self.accuracies),
            "separation": sorted(self.separations),
            "features": sorted(self.features),
            "distances_verified": distances.verified,
            "why": why,
        }

    def print(self, args, recording, replay) -> None:
        wall = time.perf_counter() - self.began
        print(
            f"{recording.path}: {counted(replay.frames, 'frame')}, {counted(self.computed, 'step')} computed, "
            f"{counted(self.contacts, 'contact')}"
        )
        if self.computed:
            print(
                f"  {wall:.2f} s ({self.milliseconds / self.computed:.2f} ms a step in the core) for "
                f"{self.seconds_recorded:.2f} s of motion; {counted(args.threads or os.cpu_count(), 'thread')}"
            )
        _print_losses(replay)
        if self.before:
            print(
                f"  {counted(self.before, 'result')} not verified: the step began before the recording, or depends on "
                "earlier messages"
            )
        if self.missing:
            print(
                f"  {counted(replay.unverified, 'result')} NOT VERIFIED, first step {self.missing.step} "
                f"(ends at {self.missing.end} ns): {self.missing.missing}"
            )
        _print_distances(replay.distances)
        if replay.diverged:
            first = replay.first_divergence
            print(
                f"DIVERGED: {replay.diverged} of {replay.diverged + replay.verified} results differ, first in step "
                f"{first.step}, result {first.number} of the recording (ends at {first.end} ns):\n"
                f"  {first.difference}"
            )
        elif replay.verified:
            hold, are = ("holds", "is") if replay.verified == 1 else ("hold", "are")
            what = (
                f"{hold} a contact where there is one, and one that there is"
                if replay.any_one
                else f"{are} equal in every contact, time and hash"
            )
            # The word stands for all of the recording.
            verdict = " " if replay.distances.diverged else "VERIFIED:"
            print(f"{verdict} {counted(replay.verified, 'result')} {what} ({self._tiers()})")
        elif replay.recorded_results and not replay.unverified and (args.begin > 0 or args.end < float("inf")):
            print("NOTHING VERIFIED: no step of the recording ends between --from and --to (seconds of it)")
        elif replay.recorded_results:
            print("NOTHING VERIFIED: the recording has results, but not the frames that they belong to")
        elif self.computed:
            print("computed only: the recording has no contacts to compare with")
        else:
            print("NOTHING COMPUTED: no two frames of all meshes follow each other in the recording")
        sys.stdout.flush()

    def _tiers(self) -> str:
        separated = [f"separation {text}" for text in sorted(self.separations)]
        tested = [f"only {text}" for text in sorted(self.features) if text in FEATURES]
        return "; ".join([f"accuracy {', '.join(sorted(self.accuracies))}", *separated, *tested])


def _print_distances(distances) -> None:
    if distances.diverged:
        print(
            f"DIVERGED: {distances.diverged} of {distances.diverged + distances.verified} results about distances "
            f"differ, the first:\n  {distances.first}"
        )
    elif distances.unverified:
        print(f"  {counted(distances.unverified, 'result')} about distances NOT VERIFIED, the first: {distances.first}")
    elif distances.verified:
        are = "is" if distances.verified == 1 else "are"
        print(f"  {counted(distances.verified, 'result')} about distances {are} equal, points included")


def _print_losses(replay) -> None:
    for what, counter in replay.source.rejected.items():
        for (mesh, reason), count in sorted(counter.by_mesh_and_reason().items()):
            print(f"  {count} {what} of {mesh} not used: {reason}{_HINTS.get(reason, '').format(mesh=mesh)}")
    for topic, count in sorted(replay.not_taken.items()):
        if count:
            print(f"  {counted(count, 'message')} of {topic} not taken by the node: lost on the way to it, or rejected")


def _progress_bar() -> Progress:
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("messages"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[line]}"),
        console=Console(stderr=True),
        transient=True,
        disable=not sys.stderr.isatty(),
    )
