# SPDX-License-Identifier: Apache-2.0
"""`hpccd view --html`: replay a recording, write its page."""

from pathlib import Path

from hpccd_ros.bag.reader import Recording
from hpccd_ros.base.errors import UserError
from hpccd_ros.picture.page.document import document
from hpccd_ros.picture.page.library import three
from hpccd_ros.picture.page.recording_page import RecordingPage
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay
from hpccd_ros.scenes.progress import track

# Bytes of a file that a browser takes long to open.
LARGE = 50_000_000


def write_page(args, source: Path, target: Path, title: str, view: dict) -> int:
    """As the options of `hpccd view` say. view: azimuth, elevation."""
    library = three()  # before anything is computed, as the folder
    if not target.parent.is_dir():
        raise UserError(f"--html {target}: there is no folder {target.parent}")
    every = args.every or 1
    with Recording(source) as recording:
        setup = recorded_setup.of_recording(recording, args.params)
        replay = Replay(recording, setup, outputs=("points",), distances=False)
        page = RecordingPage(replay, setup.mesh_names, title, every=every, **view)
        for number, step in enumerate(track(replay.steps(), "steps", True, replay.recorded_answers or None)):
            page.add(step, step.step == args.step if args.step is not None else number % every == 0)
        if not page.steps:
            raise UserError(f"{source}: no step{'' if args.step is None else f' {args.step}'} that can be shown")
        text = document(*page.described(), library)
    try:
        target.write_text(text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise UserError(f"--html {target}: {error.strerror}") from error
    size = target.stat().st_size
    advice = f"; --every {2 * every} makes it smaller" if size > LARGE and args.step is None else ""
    print(f"{target}: {page.steps} step{'' if page.steps == 1 else 's'}, {size / 1e6:.1f} MB{advice}")
    return 0
