# SPDX-License-Identifier: Apache-2.0
"""What the parameters say of the scene: meshes, pairs, where positions are placed."""

from typing import Any

from hpccd_core.options import ACCURACIES, FEATURES, OUTPUTS
from hpccd_ros.base.quoting import listed, quoted, shortened
from hpccd_ros.detect.core import Options
from hpccd_ros.detect.rigid_step import RigidOptions
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.detect.separation import NONE, Separation
from hpccd_ros.frames.pipeline import FramePipeline
from hpccd_ros.frames.types import POSE, TF, AssemblyRules, MeshSettings
from hpccd_ros.params.table import FARTHEST
from hpccd_ros.params.values import ParameterError
from hpccd_ros.rigid.transform import Rigid

MeshValues = dict[str, dict[str, Any]]


def scene_builder(settings: dict[str, Any], meshes: MeshValues) -> SceneBuilder:
    """The scene without its topologies. Raises ParameterError: an unknown mesh, tier or kind in a pair."""
    return SceneBuilder(
        mesh_settings(meshes), ignored_pairs(settings), pair_accuracies(settings), pair_features(settings)
    )


def mesh_settings(meshes: MeshValues) -> tuple[MeshSettings, ...]:
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
        )
        for name, of in meshes.items()
    )


def frame_pipeline(settings: dict[str, Any], meshes: MeshValues, max_pending: int) -> FramePipeline:
    """The way from messages of the meshes to frames of the scene. Raises ValueError: nothing in the scene moves."""
    nearest = settings["stamp_match"] == "nearest"
    rules = AssemblyRules(
        max_pending=max_pending,
        restart_after=settings["restart_after"],
        tolerance=round(settings["stamp_tolerance"] * 1e9) if nearest else None,
        frame_id=settings["frame_id"],
    )
    return FramePipeline(mesh_settings(meshes), rules)


def detector_options(settings: dict[str, Any]) -> Options:
    """What the node's detector computes, and how."""
    outputs, wanted = set(settings["outputs"]), separation(settings)
    if settings["markers"]:
        outputs |= {"points", "normals"}
        if wanted != NONE:
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
        RigidOptions(settings["rigid_tolerance"], settings["rigid_parts"]),
    )


def features(settings: dict[str, Any]) -> tuple[str, ...]:
    """Parameter ``features``, in the order of FEATURES. Raises ParameterError."""
    if not settings["features"]:
        raise ParameterError(
            f"features: empty, so nothing would be tested; name {' or '.join(FEATURES)}, or both; meshes that shall "
            "not be tested against each other are named by ignored_pairs"
        )
    return tuple(name for name in FEATURES if name in settings["features"])


def separation(settings: dict[str, Any]) -> Separation:
    """Parameters ``minimum_separation`` and ``pair_separation``. Raises ParameterError."""
    found: dict[frozenset[str], tuple[str, str, float]] = {}
    for text in settings["pair_separation"]:
        *names, number = text.split(":")
        distance = _distance(number)
        if len(names) != 2 or not set(names) <= set(settings["meshes"]) or distance is None:
            raise ParameterError(
                f"pair_separation: {quoted(text)} must be NAME:NAME:DISTANCE with meshes out of {_names(settings)} "
                f"and a distance from 0 to {FARTHEST:g}"
            )
        entry = (*names, distance)
        pair = frozenset(names)
        if found.setdefault(pair, entry)[2] != distance:
            other = ":".join(map(str, found[pair]))
            raise ParameterError(f"pair_separation: {text!r} contradicts {other!r}; leave one out")
    return Separation(settings["minimum_separation"], tuple(found.values()))


def _distance(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if 0 <= number <= FARTHEST else None


def ignored_pairs(settings: dict[str, Any]) -> tuple[tuple[str, str], ...]:
    """Parameter ``ignored_pairs`` as pairs of mesh names. Raises ParameterError."""
    pairs = []
    for text in settings["ignored_pairs"]:
        pair = tuple(text.split(":"))
        if len(pair) != 2 or not set(pair) <= set(settings["meshes"]) or pair[0] == pair[1]:
            raise ParameterError(
                f"ignored_pairs: {quoted(text)} must be NAME:NAME with two different meshes out of "
                f"{_names(settings)}"
            )
        pairs.append(pair)
    return tuple(pairs)


def pair_accuracies(settings: dict[str, Any]) -> tuple[tuple[str, str, str], ...]:
    """Parameter ``pair_accuracy`` as (mesh name, mesh name, tier). Raises ParameterError."""
    found: dict[frozenset[str], tuple[str, str, str]] = {}
    for text in settings["pair_accuracy"]:
        entry = tuple(text.split(":"))
        if len(entry) != 3 or not set(entry[:2]) <= set(settings["meshes"]) or entry[2] not in ACCURACIES:
            raise ParameterError(
                f"pair_accuracy: {quoted(text)} must be NAME:NAME:TIER with meshes out of {_names(settings)} "
                f"and a tier out of {', '.join(ACCURACIES)}"
            )
        pair = frozenset(entry[:2])
        if found.setdefault(pair, entry)[2] != entry[2]:
            raise ParameterError(f"pair_accuracy: {text!r} contradicts {':'.join(found[pair])!r}; leave one out")
    return tuple(found.values())


def pair_features(settings: dict[str, Any]) -> tuple[tuple[str, str, tuple[str, ...]], ...]:
    """Parameter ``pair_features`` as (mesh name, mesh name, features); entries of one pair add up. Raises
    ParameterError."""
    found: dict[frozenset[str], tuple[str, str, set[str]]] = {}
    for text in settings["pair_features"]:
        *names, kind = text.split(":")
        if len(names) != 2 or not set(names) <= set(settings["meshes"]) or kind not in FEATURES:
            raise ParameterError(
                f"pair_features: {quoted(text)} must be NAME:NAME:KIND with meshes out of {_names(settings)} "
                f"and a kind out of {', '.join(FEATURES)}"
            )
        found.setdefault(frozenset(names), (*names, set()))[2].add(kind)
    return tuple((a, b, tuple(name for name in FEATURES if name in kinds)) for a, b, kinds in found.values())


def poses(meshes: MeshValues) -> dict[str, Rigid]:
    """``mesh.NAME.pose`` of each mesh. Raises ParameterError."""
    found = {}
    for name, values in meshes.items():
        try:
            found[name] = Rigid.of(values["pose"][:3], values["pose"][3:])
        except ValueError as error:
            raise ParameterError(f"mesh.{name}.pose: {shortened(values['pose'])} {error}") from error
    return found


def check(settings: dict[str, Any], meshes: MeshValues) -> None:
    """What the values cannot tell one by one. Raises ParameterError."""
    scene_builder(settings, meshes)
    separation(settings)
    features(settings)
    poses(meshes)
    for name, values in meshes.items():
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


def _check_rigid(name: str, values: dict[str, Any], settings: dict[str, Any]) -> None:
    moved = f"mesh.{name}.input: {values['input']}"
    if values["static"]:
        raise ParameterError(f"{moved} moves a mesh, mesh.{name}.static says that it does not move; leave one out")
    if values["transform"] == "pose":
        raise ParameterError(
            f"mesh.{name}.transform: pose is for vertices that are sent in each frame; of a mesh that moves by poses "
            f"mesh.{name}.pose places its shape in the body's own frame, without a transform"
        )
    if values["input"] == TF and not settings["frame_id"]:
        raise ParameterError(f"{moved} needs a frame to transform to; set parameter frame_id")
    if values["input"] == TF and not values["frame"]:
        raise ParameterError(f"{moved} needs the body's own frame to transform from; set mesh.{name}.frame")


def _names(settings: dict[str, Any]) -> str:
    return listed(settings["meshes"]) or "(none)"
