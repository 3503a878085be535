# SPDX-License-Identifier: Apache-2.0
"""Parameters of the scene: meshes, what is computed, placement of positions."""

import math
from collections.abc import Iterable
from typing import Any

from hpccd_core.options import FEATURES, OUTPUTS
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.base.quoting import listed, quoted, shortened, suggestion
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import PlaneSettings, SceneBuilder
from hpccd_ros.detect.separation import NONE
from hpccd_ros.frames.follower import Follower
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import POSE, TF, AssemblyRules, MeshFrame, MeshSettings
from hpccd_ros.middleware.topic_names import POINTS, WHOLE, is_whole
from hpccd_ros.params import pair_parameters, robot_parameters
from hpccd_ros.params.robot_parameters import NO_ROBOTS, Robots
from hpccd_ros.params.table import FARTHEST, PLANE, ROBOT
from hpccd_ros.params.values import ParameterError

MeshValues = dict[str, dict[str, Any]]


def scene_builder(settings: dict[str, Any], meshes: MeshValues, robots: Robots = NO_ROBOTS) -> SceneBuilder:
    """The scene without its topologies. Raises ParameterError: an unknown mesh, tier or kind in a pair."""
    links = robot_parameters.links(robots)
    by_default = [pair for name in settings[ROBOT] if name in robots for pair in robots[name].ignored_pairs]
    return SceneBuilder(
        mesh_settings(settings, meshes) + robot_parameters.mesh_settings(settings, robots),
        pair_parameters.ignored_pairs(settings, links, by_default),
        pair_parameters.pair_accuracies(settings, links),
        pair_parameters.pair_features(settings, links),
        planes(settings),
    )


def planes(settings: dict[str, Any]) -> tuple[PlaneSettings, ...]:
    """In the order of parameter ``planes``. Raises ParameterError."""
    for name, of in settings[PLANE].items():
        normal = of["normal"]
        if len(normal) != 3 or not all(map(math.isfinite, normal)) or not any(normal):
            raise ParameterError(
                f"{PLANE}.{name}.normal: {shortened(normal)} must be three finite numbers x y z that are not all 0"
            )
        if (largest := max(map(abs, normal))) > FARTHEST:
            raise ParameterError(f"{PLANE}.{name}.normal: {largest:g} is beyond {FARTHEST:g}; scale it down")
    return tuple(PlaneSettings(name, tuple(of["normal"]), of["offset"]) for name, of in settings[PLANE].items())


def mesh_settings(settings: dict[str, Any], meshes: MeshValues) -> tuple[MeshSettings, ...]:
    """In the order of parameter ``meshes``."""
    return tuple(
        MeshSettings(
            name,
            of["static"],
            of["self_collision"] and of["input"] not in (POSE, TF),
            of["transform"],
            of["frame"],
            tuple(of["pose"]),
            of["input"],
            whole=is_whole(of["input"], name in settings["points"]),
            ignored_rings=of["ignored_rings"],
            ignored_at_rest=of["ignored_at_rest"] if of["ignored_at_rest"] >= 0 else None,
            points=name in settings["points"],
        )
        for name, of in meshes.items()
    )


def frame_pipeline(
    settings: dict[str, Any],
    meshes: MeshValues,
    max_pending: int,
    robots: Robots = NO_ROBOTS,
    followers: Iterable[Follower] = (),
) -> FramePipeline:
    """The pipeline from messages of the meshes to frames of the scene, with the topologies of robots. followers: of
    robots that joint states move. Raises ValueError if nothing in the scene moves."""
    nearest = settings["stamp_match"] == "nearest"
    rules = AssemblyRules(
        max_pending=max_pending,
        restart_after=settings["restart_after"],
        tolerance=round(settings["stamp_tolerance"] * 1e9) if nearest else None,
        frame_id=settings["frame_id"],
    )
    of_robots = robot_parameters.mesh_settings(settings, robots)
    pipeline = FramePipeline(mesh_settings(settings, meshes) + of_robots, rules, tuple(followers))
    for robot in robots.values():
        for mesh in robot.meshes:
            pipeline.load(mesh.name, mesh.topology, MeshFrame(0, mesh.vertices, version=mesh.topology.version))
    return pipeline


def detector_options(settings: dict[str, Any], robots: Robots = NO_ROBOTS) -> Options:
    """Options of the node's detector."""
    outputs = set(settings["outputs"])
    wanted = pair_parameters.separation(settings, robot_parameters.links(robots))
    if settings["markers"]:
        outputs |= {"points", "normals"}
        if wanted != NONE or settings["thickness"]:
            outputs.add("closest")
    return Options(
        settings["accuracy"],
        settings["backend"],
        settings["threads"],
        settings["report"],
        tuple(name for name in OUTPUTS if name in outputs),
        wanted,
        settings["distances"],
        features(settings),
        rigid(settings),
        thickness=pair_parameters.thickness(settings, robot_parameters.links(robots)),
    )


def rigid(settings: dict[str, Any]) -> RigidOptions:
    """How steps with meshes that move by poses are cut."""
    return RigidOptions(settings["rigid_tolerance"], settings["rigid_parts"])


def features(settings: dict[str, Any]) -> tuple[str, ...]:
    """Parameter ``features``, in the order of FEATURES. Raises ParameterError."""
    if not settings["features"]:
        raise ParameterError(
            f"features: empty, so nothing would be tested; name {' or '.join(FEATURES)}, or both; to leave out "
            "pairs of meshes use ignored_pairs"
        )
    return tuple(name for name in FEATURES if name in settings["features"])


def poses(meshes: MeshValues) -> dict[str, Rigid]:
    """``mesh.NAME.pose`` of each mesh. Raises ParameterError."""
    found = {}
    for name, values in meshes.items():
        try:
            found[name] = Rigid.of(values["pose"][:3], values["pose"][3:])
        except ValueError as error:
            raise ParameterError(f"mesh.{name}.pose: {shortened(values['pose'])} {error}") from error
    return found


def check(settings: dict[str, Any], meshes: MeshValues, robots: Robots = NO_ROBOTS) -> None:
    """Check values that depend on each other. robots: known robots. Raises ParameterError."""
    pair_parameters.check(settings, robot_parameters.links(robots))
    robot_parameters.check(settings)
    features(settings)
    planes(settings)
    _check_points(settings, meshes)
    poses(meshes)
    # The links of an unknown robot are unknown.
    if set(settings["robots"]) <= set(robots):
        check_stop(settings, scene_builder(settings, meshes, robots))
    for name, values in meshes.items():
        _check_filters(name, values)
        if values["file"] and is_whole(values["input"], name in settings["points"]):
            what = "is the whole mesh" if values["input"] == POINTS else "carries the triangles"
            raise ParameterError(
                f"mesh.{name}.file: with mesh.{name}.input {values['input']} each message {what}; leave one of them out"
            )
        if values["input"] in (POSE, TF):
            _check_rigid(name, values, settings)
        if values["transform"] == "tf" and not settings["frame_id"]:
            raise ParameterError(f"mesh.{name}.transform: tf needs a frame to transform to; set parameter frame_id")
        if values["transform"] == "tf" and values["static"] and values["file"]:
            raise ParameterError(
                f"mesh.{name}.transform: the positions of a static mesh from a file have no stamp to look a transform "
                f"up for; give mesh.{name}.pose"
            )
        moved = values["transform"] != "none" or values["input"] == TF
        if not moved and values["frame"] not in ("", settings["frame_id"]):
            raise ParameterError(
                f"mesh.{name}.frame: {quoted(values['frame'])} is not the scene's frame "
                f"{quoted(settings['frame_id'])}; set "
                f"mesh.{name}.transform to pose or tf, or the parameter frame_id"
            )


def check_stop(settings: dict[str, Any], builder: SceneBuilder) -> None:
    """Raises ParameterError."""
    if settings["approach_time"] > 0 and settings["stop_distance"] < 0:
        raise ParameterError(
            f"approach_time: {settings['approach_time']:g} s slows down before stop, and stop_distance "
            f"{settings['stop_distance']:g} switches stop off; set stop_distance to 0 or more, or approach_time to 0"
        )
    if settings["stop_distance"] >= 0 and not builder.pairs:
        raise ParameterError(
            "stop_distance: no two different meshes are tested against each other, so nothing could ever be near; name "
            "two in meshes of which one moves and that ignored_pairs does not name, or leave stop_distance negative"
        )


def _check_points(settings: dict[str, Any], meshes: MeshValues) -> None:
    for name in settings["points"]:
        if name not in meshes:
            raise ParameterError(
                f"points: {quoted(name)} must be a mesh out of {listed(meshes) or '(none)'}{suggestion(name, meshes)}"
            )
        if meshes[name]["input"] in WHOLE:
            raise ParameterError(
                f"points: {name} has no triangles, and with mesh.{name}.input {meshes[name]['input']} each message "
                f"carries them; set mesh.{name}.input to vertices or points, or leave {name} out"
            )


def _check_filters(name: str, values: dict[str, Any]) -> None:
    within = values["self_collision"] and not values["static"] and values["input"] not in (POSE, TF)
    for key, off in (("ignored_rings", 0), ("ignored_at_rest", -1.0)):
        if values[key] != off and not within:
            raise ParameterError(
                f"mesh.{name}.{key}: {values[key]} leaves out pairs within the mesh, which is not tested against "
                "itself (static, self_collision: false, or moved by poses); leave it out"
            )


def _check_rigid(name: str, values: dict[str, Any], settings: dict[str, Any]) -> None:
    moved = f"mesh.{name}.input: {values['input']}"
    if values["static"]:
        raise ParameterError(f"{moved} moves the mesh, and mesh.{name}.static: true fixes it; leave one out")
    if values["transform"] == "pose":
        raise ParameterError(
            f"mesh.{name}.transform: pose is for vertices that are sent in each frame; of a mesh that moves by poses "
            f"mesh.{name}.pose places its shape in the body's own frame, without a transform"
        )
    if values["input"] == TF and not settings["frame_id"]:
        raise ParameterError(f"{moved} needs a frame to transform to; set parameter frame_id")
    if values["input"] == TF and not values["frame"]:
        raise ParameterError(f"{moved} needs the body's own frame to transform from; set mesh.{name}.frame")
