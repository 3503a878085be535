# SPDX-License-Identifier: Apache-2.0
"""The demo: start the processes, show the progress, verify the recording, draw the frame with the most contacts."""

import contextlib
import os
import shlex
import shutil
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from hpccd_core.whole_file import whole_file
from hpccd_ros import scenes
from hpccd_ros.bag.examine import examine
from hpccd_ros.bag.reader import Recording
from hpccd_ros.bag.writer import free_path
from hpccd_ros.base.errors import UserError
from hpccd_ros.demo.children import Children
from hpccd_ros.replay import recorded_setup
from hpccd_ros.replay.recomputed import Replay
from hpccd_ros.scenes import files

# Results of a run; the next successful run replaces them.
RECORDING, PICTURE, PARAMETERS = RESULTS = ("demo.mcap", "demo.png", "node.yaml")
LOGS = ("node.log", "recorder.log", "publisher.log")
# Kept where the contacts of the recording are not those that it is verified with.
DIVERGED = "demo-diverged.mcap"
# s for the last results to reach the disk; only reached if the recorder has lost some.
WRITTEN = 30.0


def main(args) -> int:
    """Run the demo as the options of `hpccd demo` say."""
    scene = _scene(args)
    folder = Path(args.out)
    if "ROS_DOMAIN_ID" not in os.environ:
        # A domain of its own: neither the nodes that run here already nor a second demo can mix with it.
        os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)
    console = Console(highlight=False, soft_wrap=True)
    try:
        with contextlib.ExitStack() as stack:
            folder.mkdir(parents=True, exist_ok=True)
            drafts = [stack.enter_context(whole_file(folder / name, overwrite=True)) for name in RESULTS]
            for name in LOGS:
                (folder / name).unlink(missing_ok=True)
            worst = _run(args, scene, folder, *drafts, console)
    except OSError as error:
        place = Path(error.filename or os.devnull)
        if folder not in (place, *place.parents) and place not in folder.parents:
            raise  # of another file
        raise UserError(f"--out {place}: {error.strerror}") from error
    _last_words(folder, console, worst)
    return 0


def _run(args, scene, folder, recording, picture, parameters, console):
    """Write the recording, the picture and the node's parameters; returns the step with most contacts."""
    say = console.print
    say(
        f"[bold]scene[/]      {scene.title}\n           "
        + ", ".join(_parts(scene))
        + f"; {scene.n_frames} frames at {args.rate:g} a second"
    )
    files.write_parameters(scene, parameters)
    _stream(args, scene, folder, recording, parameters, console)
    return _verify_and_draw(args, scene, folder, recording, picture, console)


def _scene(args):
    try:
        return scenes.make(args.scene, size=args.size, frames=args.frames, progress=True)
    except ValueError as error:
        raise UserError(str(error)) from error


def _parts(scene):
    for mesh in scene.sent_meshes:
        yield f"{mesh.name} {len(mesh.faces):,} triangles"
    for robot in scene.robots:
        yield f"robot {robot.name} of {len(robot.meshes)} links {sum(len(m.faces) for m in robot.meshes):,} triangles"


def _stream(args, scene, folder, recording, parameters, console):
    # Imported here: ROS reads the domain when it is first used.
    from hpccd_ros.demo.monitor import Monitor

    with Monitor() as monitor, Children(folder) as children:
        monitor.listen(1.0)
        if monitor.nodes_called("/hpccd"):
            raise UserError(
                f"a node /hpccd runs already in DDS domain {os.environ['ROS_DOMAIN_ID']}: end it, or set "
                "another ROS_DOMAIN_ID"
            )
        node = children.start(
            "node",
            "hpccd_ros.node",
            "--ros-args",
            "--params-file",
            str(parameters),
            "-p",
            f"threads:={args.threads}",
            "-p",
            "diagnostics_period:=0.25",
            *(["-p", f"accuracy:={args.accuracy}"] if args.accuracy else []),
            *(["-p", f"features:=[{', '.join(args.features)}]"] if args.features else []),
        )
        recorder = children.start(
            "recorder",
            "hpccd_ros.cli",
            "record",
            "-o",
            str(recording),
            "--compression",
            args.compression,
            # Room for the whole scene: a disk that is still busy with the installation may hold the recorder up.
            "--depth",
            str(scene.n_frames),
            "--wait",
            "180",
        )
        children.wait(lambda: recorder.has_printed("recording "), "the recorder did not hear the node", 180.0)
        children.wait(monitor.receives_contacts, "the node was not heard", 180.0)
        publisher = children.start(
            "publisher", "hpccd_ros.demo.publisher", args.scene, str(args.size), str(scene.n_frames), str(args.rate)
        )
        console.print(
            f"[bold]processes[/]  node {node.process.pid}, recorder {recorder.process.pid}, publisher "
            f"{publisher.process.pid}, over DDS (domain {os.environ['ROS_DOMAIN_ID']})"
        )
        steps = _steps(scene)
        _watch(monitor, children, publisher, steps, console)
        _await_recorded(recording, monitor, children)
        for child in (recorder, node):
            if children.end(child) != 0:
                children.check()
        if monitor.results == 0:
            raise UserError(f"the node sent no results; see the logs in {folder}")
        core = "" if monitor.core_ms is None else f", {monitor.core_ms:.1f} ms a frame in the core (median)"
        console.print(
            f"[bold]results[/]    {monitor.results} of {steps} steps, {monitor.dropped} frames dropped{core}"
            f"{_slower(monitor, scene.n_frames, args.rate)}"
        )


def _steps(scene) -> int:
    """Number of steps with a result: the first frame, and the first with another topology, only begins one."""
    if scene.make_faces is None:
        return scene.n_frames - 1
    return sum(1 for frame in scene.frames() if frame.index and not frame.topologies)


def _slower(monitor, frames, rate) -> str:
    """A note if the scene was played slower than at `rate`."""
    took = monitor.last_received - monitor.first_received
    planned = (frames - 2) / rate  # from the first result to the last
    if took < 1.25 * planned + 1.0:
        return ""
    return f"; it took {took:.0f} instead of {planned:.0f} s: each frame waits for the result of the one before"


def _await_recorded(path, monitor, children):
    """Wait until all results are on the disk: a recorder that is told to end takes only what has reached it."""
    deadline = time.monotonic() + WRITTEN
    while _recorded_results(path) < monitor.results and time.monotonic() < deadline:
        children.check()
        monitor.listen(0.25)


def _recorded_results(path) -> int:
    return sum(count for topic, count in examine(path).counts.items() if topic.endswith("/contacts"))


def _watch(monitor, children, publisher, steps, console):
    """Show the results as they arrive, until the publisher has ended and the last result has arrived."""
    progress = Progress(
        TextColumn("          "),
        BarColumn(bar_width=28),
        MofNCompleteColumn(),
        TextColumn("steps"),
        TextColumn("{task.fields[status]}"),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    shown = -1
    with progress:
        bar = progress.add_task("steps", total=steps, status="")
        while publisher.running or (monitor.results < steps and not _silent(monitor)):
            monitor.listen(0.1)
            children.check()
            status = _state(monitor)
            progress.update(bar, completed=monitor.results, status=status)
            if not console.is_terminal and monitor.results // 10 > shown:
                shown = monitor.results // 10
                console.print(f"           frame {monitor.step:4}: {status}")
    children.check()


def _silent(monitor) -> bool:
    """Whether no more results are to be expected; on a busy machine the first may be late."""
    return time.monotonic() - monitor.last_received >= (3.0 if monitor.results else 60.0)


def _state(monitor) -> str:
    first = f"first at t = {monitor.first_toc:.3f}" if monitor.contacts else "nothing touches"
    core = "" if monitor.core_ms is None else f", {monitor.core_ms:.1f} ms a frame"
    return f"{monitor.contacts:,} contacts, {first}{core}, {monitor.dropped} dropped"


def _verify_and_draw(args, scene, folder, path, picture, console):
    from hpccd_ros.picture.intersecting import IntersectingFaces
    from hpccd_ros.picture.of_recording import History, draw_step
    from hpccd_ros.picture.visual_geometry import VisualGeometry

    history, worst = History(), None
    with Recording(path) as recording:
        setup = recorded_setup.of_recording(recording)
        drawn = {"visual": VisualGeometry(setup.visual()), "intersecting": IntersectingFaces(setup.builder)}
        replay = Replay(recording, setup, threads=args.threads, outputs=("points",))
        for step in replay.steps():
            if step.contacts is None:
                continue
            history.add(step)
            if worst is None or step.total > worst.total:
                worst = step
    if replay.diverged:
        kept = free_path(folder / DIVERGED)
        os.replace(path, kept)
        raise UserError(
            "computed again from the recording, the contacts differ from those that the node sent: "
            f"{replay.first_divergence.difference}; please report it with {kept}"
        )
    console.print(f"[bold]verified[/]   {replay.verified} recorded results, computed again from the file: all equal")
    console.print("[bold]picture[/]    rendering the frame with most contacts ...")
    draw_step(worst, picture, history, title=scene.title, **drawn)
    return worst


def _last_words(folder, console, worst):
    command = hpccd_from_here()
    recording, picture = folder / RECORDING, folder / PICTURE
    replayed = shlex.quote(str(recording))
    console.print(
        f"""
[bold green]done[/]       worst frame: step {worst.step}, {worst.total:,} contacts
           recording  {recording}  ({recording.stat().st_size / 1e6:.1f} MB, in rosbag2's MCAP layout)
           picture    {picture}

try next
  {command} replay {replayed}            recompute it, compare every contact
  {command} view {replayed} --step {worst.step}    draw a frame of your choice
  {command} scene --list                          other scenes: {command} demo --scene n-body-like-lr
  {command} --help                                all commands""",
        markup=True,
        soft_wrap=True,
    )


def hpccd_from_here() -> str:
    """The command that runs this hpccd from the user's shell and folder."""
    beside = Path(sys.executable).parent
    search = os.environ.get("PATH", "").split(os.pathsep)
    if "MAKELEVEL" in os.environ and search[:1] == [str(beside)]:
        search = search[1:]  # which make has put there for its recipes
    found, program = shutil.which("hpccd", path=os.pathsep.join(search)), beside / "hpccd"
    if found and (_is_running(found) or (program.is_file() and os.path.samefile(found, program))):
        return "hpccd"
    if program.is_file():
        return shlex.quote(min(os.path.relpath(program), str(program), key=len))
    return f"{shlex.quote(sys.executable)} -m hpccd_ros.cli"


def _is_running(program: str) -> bool:
    return os.path.exists(sys.argv[0]) and os.path.samefile(program, sys.argv[0])
