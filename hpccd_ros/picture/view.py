# SPDX-License-Identifier: Apache-2.0
"""`hpccd view`: which steps of a recording to draw, and where to put the pictures."""

import contextlib
import os
import sys
from pathlib import Path

from hpccd_core.whole_file import whole_file
from hpccd_ros.bag.reader import Recording
from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted
from hpccd_ros.picture.intersecting import IntersectingFaces
from hpccd_ros.picture.of_recording import History, draw_step
from hpccd_ros.picture.recording_page import write_page
from hpccd_ros.picture.rerun_recording import RerunWriter, need_rerun
from hpccd_ros.picture.visual_geometry import VisualGeometry
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay


def main(args) -> int:
    """Draw as the options of `hpccd view` say."""
    source = Path(args.file)
    title = args.title or source.stem
    view = {"azimuth": args.azimuth, "elevation": args.elevation}
    in_rerun = args.rerun or str(args.output).endswith(".rrd")
    if in_rerun:
        need_rerun()  # before anything is computed
    page = args.html or (args.output if str(args.output).endswith(".html") else None)
    if page is not None:
        return write_page(args, source, Path(page), title, view)
    outputs = ("points", "normals") if in_rerun else ("points",)
    with Recording(source) as recording:
        setup = recorded_setup.of_recording(recording, args.params)
        replay = Replay(recording, setup, outputs=outputs, distances=False)
        steps = (s for s in replay.steps() if s.contacts is not None)
        view["visual"] = VisualGeometry(setup.visual())
        if not in_rerun:
            view["intersecting"] = IntersectingFaces(setup.builder, depth=args.depth)
        if in_rerun:
            _show_in_rerun(args, steps, source, title, view)
        elif args.every is None:
            target = Path(args.output or source.with_suffix(".png").name)
            _draw_one(args, steps, target, title, view)
        else:
            target = Path(args.output or f"{source.stem}-frames")
            try:
                target.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise UserError(f"--output {target}: {error.strerror}") from error
            _draw_many(args, steps, target, title, view)
    return 0


def _show_in_rerun(args, steps, source, title, view):
    # Without a screen, or where a file is named: written.
    target = args.output or (None if _has_screen() else f"{source.stem}.rrd")
    count = 0
    try:
        with contextlib.ExitStack() as stack:
            draft = None if target is None else stack.enter_context(whole_file(target, overwrite=True))
            writer = stack.enter_context(contextlib.closing(RerunWriter(title, draft, **view)))
            for number, step in enumerate(steps):
                if step.step == args.step if args.step is not None else number % (args.every or 1) == 0:
                    writer.add(step)
                    count += 1
                    print(f"\r{count} steps", end="", flush=True)
            print()
            if not count:
                which = "" if args.step is None else f" {args.step}"
                raise UserError(f"{args.file}: no step{which} that can be shown{HINT}")
    except OSError as error:
        raise UserError(f"--output {target}: {error.strerror}") from error
    if target is not None:
        size = f"{Path(target).stat().st_size / 1e6:.1f} MB"
        print(f"{target}: {counted(count, 'step')}, {size}; open it with: rerun {target}")


HINT = "; `hpccd replay` says why"


def _has_screen() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def _what_is_there(history, args) -> str:
    if not history.steps:
        return f"it has none of all meshes{HINT}"
    first, last = min(history.steps), max(history.steps)
    if args.step is None or not first < args.step < last:
        return f"it has {first} to {last}"
    nearest = min(history.steps, key=lambda step: abs(step - args.step))
    return f"dropped when it was recorded; the nearest is --step {nearest}"


def _draw_one(args, steps, target, title, view):
    history, chosen = History(), None
    for step in steps:
        history.add(step)
        if args.step is None:
            chosen = step if chosen is None or step.total > chosen.total else chosen
        elif step.step == args.step:
            chosen = step
    if chosen is None:
        there = _what_is_there(history, args)
        raise UserError(f"{args.file}: no step {'to show' if args.step is None else args.step}: {there}")
    _draw(chosen, target, history, title=title, **view)
    print(f"{target}: step {chosen.step}, {counted(chosen.total, 'contact')}")


def _draw(step, target, *history, **options):
    try:
        draw_step(step, target, *history, **options)
    except OSError as error:
        raise UserError(f"--output {target}: {error.strerror or error}") from error
    except ValueError as error:  # a suffix that matplotlib cannot write
        raise UserError(f"--output {target}: {error}") from error


def _draw_many(args, steps, folder, title, view):
    count = 0
    for number, step in enumerate(steps):
        if number % args.every == 0:
            _draw(step, folder / f"{step.step:06}.png", title=title, **view)
            count += 1
            if sys.stderr.isatty():
                print(f"\r{count} drawn ", end="", file=sys.stderr, flush=True)
    print(f"{folder}: {counted(count, 'picture')}")
