#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A square cloth falls on a spinning ball, and never touches it or itself.

A simulator with three queries to hpccd: pairs within the separation during a step (constraints of the solver), the
collision-free part of a solved move (one step size, or one for each vertex), and, as a check, intersections. The
physics is in the package cloth_solver beside this file; docs/simulators.md explains it.

  python examples/cloth_on_ball/run.py
                        in this process; a minute or two, with a picture in cloth_on_ball.png
  python examples/cloth_on_ball/run.py --cells 40 --frames 100
                        a coarse mesh, a few seconds
  python examples/cloth_on_ball/run.py --pinched --step vertices
                        a corner of the cloth is pinched below a plate, and the rest falls: with one step for all
                        vertices the cloth would be stuck
  python examples/cloth_on_ball/run.py --mcap cloth.mcap
                        also a recording of the frames, for `hpccd replay` and `hpccd view`
  python examples/cloth_on_ball/run.py --node --mcap cloth.mcap
                        the same queries to an hpccd node over DDS, started by this program. It also receives each
                        frame, and records frames and results: `hpccd replay cloth.mcap` verifies them
  python examples/cloth_on_ball/run.py --params cloth.yaml
  hpccd_node --ros-args --params-file cloth.yaml &
  python examples/cloth_on_ball/run.py --node hpccd
                        a node that is already running

Exit status: 0 if nothing intersected and momentum and energy are accounted for, 1 if not or if the cloth is stuck, 2
for wrong arguments.
"""

import argparse
import contextlib
import sys
import time
from pathlib import Path

import numpy as np
from account import Account
from cloth_solver.motion import Simulation, Stuck
from cloth_solver.queries import InProcess
from cloth_solver.setup import Setup

from hpccd_core.progress import track
from hpccd_ros.base.errors import UserError
from hpccd_ros.scenes.scene import Frame, Scene


def main(argv=None) -> int:
    """Run the command line `argv`; the exit status."""
    try:
        return run(_arguments(argv))
    except UserError as error:
        print(f"cloth_on_ball: {error}", file=sys.stderr)
        return 2
    except Stuck as error:
        print(f"cloth_on_ball: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("cloth_on_ball: interrupted", file=sys.stderr)
        return 130


def _arguments(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--frames",
        type=int,
        default=240,
        metavar="N",
        help="the start and N - 1 moves of at most 10 ms each (default: %(default)s)",
    )
    parser.add_argument(
        "--cells",
        type=int,
        default=100,
        metavar="N",
        help="cells along a side of the cloth, 2 N^2 triangles (default: %(default)s)",
    )
    parser.add_argument(
        "--spin",
        type=float,
        default=Setup.spin,
        metavar="RAD/S",
        help="spin of the ball (default: %(default)s); at 12 some moves are solved repeatedly",
    )
    parser.add_argument(
        "--pinched", action="store_true", help="a corner of the cloth lies between the ball and a plate, the rest falls"
    )
    parser.add_argument(
        "--step",
        choices=("global", "vertices"),
        default="global",
        help="shorten a blocked move by one factor for all vertices (default), or by one for each",
    )
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the cloth's unevenness (default: 0)")
    parser.add_argument(
        "--threads", type=int, default=0, metavar="N", help="threads of the detector; 0: all cores (default)"
    )
    parser.add_argument(
        "--node",
        nargs="?",
        const="",
        metavar="NAME",
        help="use a node over DDS: the one with this name or, without a name, a new one",
    )
    parser.add_argument(
        "--picture",
        type=Path,
        default=Path("cloth_on_ball.png"),
        metavar="FILE",
        help="picture of six frames (default: %(default)s); an empty name for none",
    )
    parser.add_argument("--mcap", type=Path, metavar="FILE", help="recording; must not exist yet")
    parser.add_argument("--npz", type=Path, metavar="FILE", help="all frames as numpy arrays; must not exist yet")
    parser.add_argument("--params", type=Path, metavar="FILE", help="write parameters for a node, and end")
    args = parser.parse_args(argv)
    for name, least, most in (
        ("frames", 2, 100_000),
        ("cells", 4, 1000),
        ("spin", 0, 30),
        ("seed", 0, 2**32 - 1),
        ("threads", 0, 1024),
    ):
        if not least <= getattr(args, name) <= most:
            parser.error(f"--{name} {getattr(args, name)}: from {least} to {most}")
    for path, suffix in ((args.mcap, ".mcap"), (args.npz, ".npz"), (args.params, ".yaml")):
        if path and (path.suffix != suffix or path.exists()):
            parser.error(f"{path}: name a file that ends in {suffix} and does not exist yet")
    if args.picture.name and args.picture.suffix not in (".png", ".pdf", ".svg"):
        parser.error(f"--picture {args.picture}: name a file that ends in .png, .pdf or .svg")
    for path in (args.mcap, args.npz, args.params, args.picture):  # not found out after the simulation
        if path and not path.parent.is_dir():
            parser.error(f"{path}: there is no folder {path.parent}")
    if args.node is not None and args.step == "vertices":
        parser.error("--step vertices: a node returns one factor for a step; leave out --node or take --step global")
    return args


def run(args) -> int:
    """Simulate, write what was asked for, and tell how it went."""
    setup = (Setup.pinched if args.pinched else Setup)(cells=args.cells, spin=args.spin)
    positions: list[np.ndarray] = []
    times: list[float] = []
    scene = _scene(setup, positions, times, args.frames)
    if args.params:
        from over_dds import write_parameters

        write_parameters(scene, args.params)
        return 0
    with contextlib.ExitStack() as stack:
        queries = _queries(args, setup, scene, stack)
        simulation = Simulation(setup, queries, args.seed, args.step)
        account = Account(simulation, queries)
        print(
            f"cloth {len(scene.meshes[0].faces):,} triangles, ball {len(scene.meshes[1].faces):,}; "
            f"{setup.substeps} small steps a move",
            flush=True,
        )
        for index in track(range(args.frames), "simulating", True):
            begin = time.perf_counter()
            move = simulation.move() if index else None
            account.enter(move, time.perf_counter() - begin)
            positions.append(simulation.positions)
            times.append(simulation.time)
            queries.made(simulation.positions)
        for line in account.lines():
            print(line)
    _write(args, scene)
    return 0 if account.plausible else 1


def _scene(setup, positions, times, frames) -> Scene:
    meshes = setup.meshes()
    ends = np.cumsum([mesh.n_vertices for mesh in meshes])[:-1]

    def frame(index):
        return Frame(np.split(positions[index], ends), index, times[index])

    title = "a cloth on a spinning ball"
    return Scene("cloth-on-ball", title, meshes, frames, setup.period, frame, ignored_pairs=setup.ignored_pairs)


def _queries(args, setup, scene, stack):
    if args.node is None:
        return InProcess(setup, args.threads)
    from over_dds import OverDds, started_node

    name = args.node or stack.enter_context(started_node(scene, args.threads, args.mcap))
    return stack.enter_context(OverDds(setup, scene.meshes, name))


def _write(args, scene):
    from hpccd_ros.picture import of_scene
    from hpccd_ros.scenes import files

    if args.mcap and not args.mcap.exists():  # a node that was started for this has written its own
        files.write_mcap(scene, args.mcap, 1 / scene.frame_period, progress=True)
    if args.npz:
        files.write_npz(scene, args.npz)
    if args.picture.name:
        shown = sorted({round((scene.n_frames - 1) * part) for part in (0.15, 0.25, 0.35, 0.5, 0.75, 1.0)})
        of_scene.save(scene, shown, args.picture)
    for path in (args.mcap, args.npz, args.picture):
        if path and path.name:
            print(f"wrote {path}")


if __name__ == "__main__":
    sys.exit(main())
