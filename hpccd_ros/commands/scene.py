# SPDX-License-Identifier: Apache-2.0
"""Generate a deforming scene and publish it over DDS, write it to a file, or draw it.

  hpccd scene --list
  hpccd scene cloth-drop --publish --rate 30 --loop
                        publish meshes/cloth/... and meshes/ball/... like a simulation
  hpccd scene arm-and-cloth --publish --rate 60
                        a robot beside a cloth: also joint_states and robot_description
  hpccd scene cloth-drop --params drop.yaml
                        parameters for hpccd_node --ros-args --params-file drop.yaml
  hpccd scene n-body-like-lr --mcap bodies.mcap
                        a recording, in rosbag2's MCAP layout
  hpccd scene cloth-ball-like --size 0.25 --npz cloth.npz
  hpccd scene breaking-like --png break.png --at 0,12,20,40

The same name, size, frames and seed give the same scene, bit for bit. A simulated motion takes seconds the first time
and is then stored in the cache folder ($XDG_CACHE_HOME or ~/.cache, hpccd/scenes).
"""

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import counted


def configure(parser):
    parser.add_argument("name", nargs="?", metavar="NAME", help="name of the scene, see --list")
    parser.add_argument("--list", action="store_true", help="names and titles of all scenes")
    parser.add_argument(
        "--size",
        type=float,
        default=1.0,
        metavar="X",
        help="factor on the number of triangles, same motion (default: %(default)s)",
    )
    parser.add_argument("--frames", type=int, metavar="N", help="number of frames (default: the scene's own)")
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="seed of random numbers (default: %(default)s)"
    )
    parser.add_argument(
        "--rate",
        type=float,
        default=30.0,
        metavar="HZ",
        help="frames per second, for --publish and --mcap (default: %(default)s)",
    )
    play = parser.add_argument_group("play over DDS")
    play.add_argument("--publish", action="store_true", help="publish meshes, and the joint states of a robot")
    play.add_argument("--loop", action="store_true", help="repeat until Ctrl-C")
    play.add_argument(
        "--wait",
        type=float,
        default=10.0,
        metavar="S",
        help="seconds to wait for subscribers before the first frame (default: %(default)s)",
    )
    play.add_argument(
        "--subscribers",
        type=int,
        default=1,
        metavar="N",
        help="number to wait for; 2 for a node and a recorder (default: %(default)s)",
    )
    play.add_argument("--ros-args", nargs="...", default=[], help="ROS arguments, such as remappings")
    files = parser.add_argument_group(
        "write a file, into an existing folder (existing files are not overwritten, but for pictures)"
    )
    files.add_argument("--mcap", metavar="FILE", help="recording of all frames")
    files.add_argument(
        "--compression",
        choices=("none", "lz4", "zstd"),
        default="none",
        help="compression of --mcap (default: %(default)s)",
    )
    files.add_argument("--npz", metavar="FILE", help="all frames as numpy arrays")
    files.add_argument(
        "--step",
        type=int,
        metavar="K",
        help="with --npz: only the step from frame K-1 to K (vertices_t0, vertices_t1, faces)",
    )
    files.add_argument("--params", metavar="FILE", help="parameters for a node that receives this scene")
    files.add_argument("--png", metavar="FILE", help="picture of some frames")
    files.add_argument("--at", metavar="K,K,...", help="frames of --png (default: six over the whole scene)")


def run(args) -> int:
    from hpccd_ros import scenes

    if args.list:
        width = max(map(len, scenes.names()))
        for name, title, frames in scenes.describe():
            print(f"{name:{width}}  {frames:3} frames  {title}")
        return 0
    if args.name is None:
        raise UserError("which scene? `hpccd scene --list` names them")
    _check(args)
    try:
        scene = scenes.make(args.name, args.size, args.frames, args.seed, progress=True)
    except ValueError as error:
        raise UserError(str(error)) from error
    print(
        f"{scene.name}: {scene.title}; {counted(scene.n_triangles, 'triangle')}, "
        f"{counted(scene.n_vertices, 'vertex', 'vertices')}, {counted(scene.n_frames, 'frame')}",
        flush=True,
    )
    asked = [args.publish, args.mcap, args.npz, args.params, args.png]
    if not any(asked):
        for mesh in scene.meshes:
            static = ", static" if mesh.static else ""
            self_collision = "" if mesh.self_collision else ", no self-collision"
            print(f"  {mesh.name}: {counted(len(mesh.faces), 'triangle')}{static}{self_collision}")
        print("add --publish, --mcap FILE, --npz FILE, --params FILE or --png FILE to use it")
    frames = _frames(scene, args.at) if args.png else []
    if args.step is not None and not 1 <= args.step < scene.n_frames:
        raise UserError(f"--step {args.step}: the scene has steps 1 to {scene.n_frames - 1}")
    try:
        _write(scene, args, frames)
    except FileExistsError as error:
        exists = f"{error.filename} exists and is not overwritten; remove it or name another"
        raise UserError(exists if error.filename else str(error)) from error
    except (OSError, LookupError) as error:
        named = isinstance(error, OSError) and error.filename and error.strerror
        raise UserError(f"{error.filename}: {error.strerror}" if named else str(error)) from error
    if args.publish:
        from hpccd_ros.scenes.publish import publish

        count = publish(
            scene, args.rate, args.loop, args.wait, args.ros_args, progress=True, subscribers=args.subscribers
        )
        print(f"published {counted(count, 'frame')}", flush=True)
    return 0


def _check(args):
    if not 0 < args.rate <= 10_000:
        raise UserError(f"--rate {args.rate}: must be above 0, at most 10000 Hz")
    if not 0 <= args.wait < float("inf"):
        raise UserError(f"--wait {args.wait}: must be a number of seconds, not negative")
    if args.loop and not args.publish:
        raise UserError("--loop belongs to --publish")
    if args.step is not None and not args.npz:
        raise UserError("--step belongs to --npz")
    if args.at and not args.png:
        raise UserError("--at belongs to --png")
    if args.mcap and not args.mcap.endswith(".mcap"):
        raise UserError(f"--mcap {args.mcap}: name a file that ends in .mcap")


def _write(scene, args, frames):
    if args.mcap:
        from hpccd_ros.scenes import files

        files.write_mcap(scene, args.mcap, args.rate, args.compression, progress=True)
        print(f"wrote {args.mcap}")
    if args.npz:
        from hpccd_ros.scenes import files

        if args.step is None:
            files.write_npz(scene, args.npz, progress=True)
        else:
            files.write_step(scene, args.step, args.npz)
        print(f"wrote {args.npz}")
    if args.params:
        from hpccd_ros.scenes import files

        files.write_parameters(scene, args.params)
        print(f"wrote {args.params}")
    if args.png:
        from hpccd_ros.picture import of_scene

        try:
            of_scene.save(scene, frames, args.png)
        except ValueError as error:  # a suffix that matplotlib cannot write
            raise UserError(f"--png {args.png}: {error}") from error
        print(f"wrote {args.png}")


def _frames(scene, text):
    if not text:
        last = scene.n_frames - 1
        return sorted({round(last * k / 5) for k in range(6)})
    try:
        chosen = [int(word) for word in text.split(",")]
    except ValueError as error:
        raise UserError(f"--at {text}: frame numbers with commas between, for example 0,20,40") from error
    for index in chosen:
        if not 0 <= index < scene.n_frames:
            raise UserError(f"--at {index}: the scene has frames 0 to {scene.n_frames - 1}")
    return chosen
