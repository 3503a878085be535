# SPDX-License-Identifier: Apache-2.0
"""Check a sequence of frames. In each frame: which surfaces intersect, which mesh is inside another, and the smallest
distance. In each step to the next frame: what touches or passes through. All decisions are exact.

  COMMAND frames/                      a folder of OBJ, PLY, STL, DAE, VTK or VTU files, one for each frame
  COMMAND 'out/cloth_*.obj'            a pattern; body_0001.obj beside cloth_0001.obj is a second mesh
  COMMAND cache.npz run.usd run.glb    arrays, USD, glTF: each file is a sequence
  COMMAND sim.pc2 --faces rest.obj     point caches (PC2, MDD) and .npy, with their faces
  COMMAND run.mcap --json out.json     a recording of meshes
  COMMAND frames/ --html page.html     an interactive page with contacts and intersection curves
  COMMAND frames/ --separation 0.002   report meshes closer than 0.002, too
  COMMAND frames/ --cluster --jobs 4   in four processes, with Dask

Contacts assume that each vertex moves in a straight line from frame to frame.

exit status: 0 clean; 1 surfaces touch, intersect, pass through or contain each other; 2 no verdict; 130 interrupted
"""

from __future__ import annotations

import argparse
import contextlib
import difflib
import glob
import importlib
import io
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn, TextIO

from .._core import __version__
from ..mesh_files.errors import MeshFileError, printable, shortened
from ..progress import counting, track
from ..sequences import FrameSequence, open_sequence
from ..sequences.mesh_folder import SUFFIXES
from ..sequences.opening import WHOLE
from ..whole_file import whole_file
from . import workers
from .analysis import Options
from .report import COLUMNS, Report, cells, write_csv, write_json

# Rows of the printed table; --csv has all.
MOST_ROWS = 40
# Columns of a terminal in which that table does not fit.
NARROW = 60


class CheckError(Exception):
    """A problem and its remedy, for the user of the command."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "paths",
        metavar="PATH",
        nargs="+",
        help="a folder, a pattern or files of one sequence; or several sequences, each a folder or a file with all its "
        "frames",
    )
    parser.add_argument("--faces", metavar="FILE", help="faces of PC2, MDD and .npy: a mesh file, .npy or .npz")
    parser.add_argument(
        "--separation",
        type=float,
        default=0.0,
        metavar="D",
        help="report different meshes within this distance, in the unit of the positions (default: %(default)s)",
    )
    parser.add_argument("--split", action="store_true", help="connected components of a mesh are meshes of their own")
    parser.add_argument(
        "--weld",
        action="store_true",
        help="join vertices of a mesh that have one position in the first frame, as at seams of exported meshes",
    )
    parser.add_argument(
        "--changes",
        action="store_true",
        help="accept meshes that change from frame to frame; the step of a change is not checked",
    )
    results = parser.add_argument_group("results")
    results.add_argument("--json", metavar="FILE", help="write verdict, frames and steps")
    results.add_argument("--csv", metavar="FILE", help="write a table with one row for each frame")
    results.add_argument("--html", metavar="FILE", help="write an interactive page that needs no network")
    results.add_argument("--png", metavar="FILE", help="draw the worst frame")
    results.add_argument(
        "--up",
        choices=("x", "y", "z"),
        help="axis that points up in page and picture (default: as USD and glTF files say, otherwise z)",
    )
    speed = parser.add_argument_group("speed")
    speed.add_argument(
        "--jobs", type=int, default=0, metavar="N", help="processes; 0: one for each core (default), 1: this one"
    )
    speed.add_argument("--cluster", action="store_true", help="check with Dask: its own processes on this machine")
    speed.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask cluster whose workers see the files under the same names"
    )


def description(command: str) -> str:
    """The help text."""
    return (__doc__ or "").replace("COMMAND", command)


def run(args: argparse.Namespace) -> int:
    """Check as the options say, write files and print the result.

    Returns
    -------
    int
        0: clean, 1: defects.

    Raises
    ------
    CheckError
        Wrong use, unusable input, or an error of the system or the program: whatever is no verdict.
    """
    try:
        reports = _checked(args)
        try:
            for report in reports:
                _print(report, len(reports) > 1)
        except OSError as error:
            _discard(sys.stdout)
            if not isinstance(error, BrokenPipeError):  # where the reader has gone, the verdict remains
                raise CheckError(f"the result cannot be printed: {error.strerror}; give --json FILE") from error
    except CheckError:
        raise
    except OSError as error:
        where = f"{shortened(error.filename)}: " if error.filename else ""
        raise CheckError(f"{where}{error.strerror or error}; no result is written") from error
    except Exception as error:
        if _interrupts:  # libraries turn it into errors of their own while they are imported
            raise KeyboardInterrupt from error
        traceback.print_exc()
        raise CheckError("this is an error in the program and no verdict; report it with the lines above") from error
    return 0 if all(report.clean for report in reports) else 1


def _checked(args: argparse.Namespace) -> list[Report]:
    """The reports of all sequences; files are written."""
    for name in (*FILES, "faces", "scheduler"):
        if getattr(args, name) == "":
            raise CheckError(f"--{name}: is empty; give a name or leave it out")
    if "" in args.paths:
        raise CheckError("PATH: is empty; give a folder, a pattern or files")
    if not 0.0 <= args.separation < float("inf"):
        raise CheckError(f"--separation {args.separation}: must be a finite number, 0 or more")
    if args.jobs < 0:
        raise CheckError(f"--jobs {args.jobs}: must be 0 or more")
    options = Options(args.separation, args.weld, args.changes)
    try:
        if options.weld and options.changes:
            raise CheckError("--weld: joins vertices as in the first frame; leave out --changes")
        groups = _sequences(args.paths)
        if len(groups) > 1 and (args.html or args.png):
            option = "--html" if args.html else "--png"
            raise CheckError(f"{option}: shows one sequence, {len(groups)} are given; run one command for each")
        _reject_one_file_for_two(args)
        library = _library(args)
        with contextlib.ExitStack() as files:
            drafts = {name: files.enter_context(_new_file(name, getattr(args, name))) for name in FILES}
            sequences = [open_sequence(paths, faces=args.faces, split=args.split) for paths in groups]
            reports = _reports(sequences, options, args)
            _write(drafts, sequences, options, reports, library, args)
    except (MeshFileError, workers.ClusterError) as error:
        raise CheckError(str(error)) from error
    return reports


FILES = ("json", "csv", "html", "png")
# Results never replace files that a sequence may consist of, such as the frames in a folder.
INPUTS = (*SUFFIXES, *WHOLE, ".bin")
PICTURES = ("", ".png", ".pdf", ".svg", ".jpg", ".jpeg")


def _sequences(given: list[str]) -> list[list[str]]:
    """The paths of each sequence: mesh files and patterns belong to one, a folder or a whole file is one of its own."""
    paths = [path for word in given for path in _whole_files(word) or [word]]
    whole = [path for path in paths if os.path.isdir(path) or Path(path).suffix.lower() in WHOLE]
    rest = [path for path in paths if path not in whole]
    return [[path] for path in dict.fromkeys(whole)] + ([rest] if rest else [])


def _whole_files(pattern: str) -> list[str]:
    """The files of a pattern, as a shell would list them, if each has all frames of a sequence."""
    if os.path.exists(pattern) or not glob.has_magic(pattern):
        return []
    found = sorted(glob.glob(os.path.expanduser(pattern)))
    return found if all(Path(path).suffix.lower() in WHOLE for path in found) else []


def _reject_one_file_for_two(args: argparse.Namespace) -> None:
    """Raises CheckError if a result would replace another one, or the input."""
    used = {os.path.realpath(path): "an input" for path in [*args.paths, *([args.faces] if args.faces else [])]}
    for name in FILES:
        if path := getattr(args, name):
            if what := used.get(os.path.realpath(path)):
                raise CheckError(f"--{name} {shortened(path)}: is {what}, too; give another name")
            suffix = Path(os.path.realpath(path)).suffix.lower()
            if suffix in INPUTS:
                raise CheckError(f"--{name} {shortened(path)}: is a name of an input ({suffix}); give another name")
            if name == "png" and suffix not in PICTURES:
                raise CheckError(
                    f"--png {shortened(path)}: is no name of a picture; use one of {', '.join(PICTURES[1:])}"
                )
            used[os.path.realpath(path)] = f"the file of --{name}"


def _library(args: argparse.Namespace) -> Any:
    """three.js for --html. Raises CheckError before anything is computed where a package is missing."""
    _need("rich", "the table of results")
    if args.cluster or args.scheduler:
        _need("distributed", "--scheduler" if args.scheduler else "--cluster", "cluster")
    if args.png or args.html:
        _need("matplotlib", "--png" if args.png else "--html")
    if not args.html:
        return None
    from ..picture.page.document import LibraryError, three

    try:
        return three()
    except LibraryError as error:
        raise CheckError(f"--html: {error}") from error


def _need(module: str, what: str, extra: str = "check") -> Any:
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise CheckError(f"{what}: needs the Python package {module}; pip install 'hpccd-core[{extra}]'") from error


@contextlib.contextmanager
def _new_file(option: str, path: str | None) -> Iterator[Path | None]:
    """A place to write to, which becomes the file at the end; an existing file is replaced."""
    if not path:
        yield None
        return
    try:
        with whole_file(path, overwrite=True) as draft:
            yield draft
    except OSError as error:
        if error.filename != str(path):
            raise
        raise CheckError(f"--{option} {shortened(path)}: {error.strerror or error}") from error


def _reports(sequences: list[FrameSequence], options: Options, args: argparse.Namespace) -> list[Report]:
    with counting("frames", sum(map(len, sequences))) as progress:
        if not (args.cluster or args.scheduler):
            return [
                workers.report_of(sequence, options, workers.in_processes(sequence, options, args.jobs, progress))
                for sequence in sequences
            ]
        most = sum(workers.n_parts(sequence) for sequence in sequences)
        distributed = importlib.import_module("distributed")
        with workers.cluster(distributed, args.scheduler, args.jobs, most) as (client, threads):
            return [
                workers.report_of(sequence, options, workers.on_cluster(client, sequence, options, threads, progress))
                for sequence in sequences
            ]


def _write(
    drafts: dict[str, Path | None],
    sequences: list[FrameSequence],
    options: Options,
    reports: list[Report],
    library: Any,
    args: argparse.Namespace,
) -> None:
    """Write the files that are asked for."""
    for name, write in (("json", write_json), ("csv", write_csv)):
        if draft := drafts[name]:
            with draft.open("w", encoding="utf-8", newline="") as stream:
                write(stream, reports)
    if not (drafts["png"] or drafts["html"]):
        return
    from . import drawing

    drawn = (sequences[0], options, reports[0])
    up = args.up or sequences[0].up or "z"
    if draft := drafts["png"]:
        drawing.write_picture(*drawn, draft, up)
    if draft := drafts["html"]:
        drawing.write_page(*drawn, draft, up, library, lambda frames: track(frames, "page", True))


def _print(report: Report, several: bool) -> None:
    """The table of what is wrong, notes, and the verdict."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    rows = report.bad_rows()
    console = Console(highlight=False)
    if rows and console.is_terminal and console.width >= NARROW:
        table = Table("frame", "file", "intersections", "distance", "inside", "contacts to next", "first at")
        for row in rows[:MOST_ROWS]:
            table.add_row(*map(Text, _short(cells(*row, unknown="not checked"))))
        console.print(table)
    elif rows:
        print("\t".join(COLUMNS))
        for row in rows[:MOST_ROWS]:
            print("\t".join(map(printable, cells(*row, unknown="not checked"))))
    if len(rows) > MOST_ROWS:
        print(f"... {len(rows) - MOST_ROWS:,} more rows; --csv writes all")
    for note in report.notes:
        print(f"note: {printable(note)}")
    print(f"{printable(report.source)}: " * several + printable(report.sentence()), flush=True)


def _short(row: list[str]) -> list[str]:
    """Numbers with few digits."""
    numbers = ("distance", "first_toc")
    return [
        f"{float(text):.4g}" if name in numbers and text else printable(text)
        for name, text in zip(COLUMNS, row, strict=True)
    ]


_interrupts: list[int] = []


def _interrupt(number: int, _: object) -> NoReturn:
    _interrupts.append(number)
    raise KeyboardInterrupt


def _complain(text: str) -> None:
    try:
        print(f"hpccd-check: {text}", file=sys.stderr, flush=True)
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Data left in a stream that cannot be written to would change the exit status when the process ends."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _nearest(word: str, options: list[str]) -> str:
    """The option that a word begins, or is spelled like; empty if there is none."""
    begun = [option for option in options if len(word) > 3 and option.startswith(word.lower())]
    return (begun or difflib.get_close_matches(word, options, n=1, cutoff=0.7) or [""])[0]


class _Parser(argparse.ArgumentParser):
    """Names the option that a misspelt one is nearest to."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        self._given = sys.argv[1:] if args is None else list(args)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        options = [option for option in self._option_string_actions if option.startswith("--")]
        words = [word.partition("=")[0] for word in self._given if word.startswith("--")]
        near = [_nearest(word, options) for word in words if word not in options]
        meant = "; did you mean " + ", ".join(name for name in near if name) + "?" if any(near) else ""
        super().error(message + meant)


def main(argv: Sequence[str] | None = None) -> int:
    """The command `hpccd-check`.

    Parameters
    ----------
    argv : sequence of str, optional
        Its arguments; by default those of the process.

    Returns
    -------
    int
        The exit status.
    """
    parser = _Parser(
        prog="hpccd-check",
        description=description("hpccd-check"),
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("-V", "--version", action="version", version=f"hpccd-check {__version__}")
    configure(parser)
    sys.stdout, sys.stderr = (stream or open(os.devnull, "w") for stream in (sys.stdout, sys.stderr))
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # file names need not be text of the terminal
    args = parser.parse_args(argv)
    _interrupts.clear()
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):  # so that incomplete files are removed
            if (handler := signal.getsignal(number)) in (signal.SIG_DFL, signal.default_int_handler):
                signal.signal(number, _interrupt)
                before[number] = handler
    try:
        return run(args)
    except CheckError as error:
        _complain(printable(str(error)))
        return 2
    except KeyboardInterrupt:
        _complain("interrupted")
        return 130
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
