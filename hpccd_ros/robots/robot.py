# SPDX-License-Identifier: Apache-2.0
"""A robot: meshes of its links, pairs that are not tested, kinematics."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np

from hpccd_core.joint_chains import placed
from hpccd_core.rigid.body import Body
from hpccd_core.rigid.joints import LinkMotion
from hpccd_ros.base.quoting import listed, quoted
from hpccd_ros.frames.coordinates import LARGEST_OF_POSES, unusable_coordinates
from hpccd_ros.frames.types import JOINTS, TF, MeshSettings, Topology
from hpccd_ros.robots import srdf, urdf
from hpccd_ros.robots.errors import RobotError
from hpccd_ros.robots.geometry import LinkMeshes, Resolver, no_files
from hpccd_ros.robots.kinematics import Kinematics, RobotState
from hpccd_ros.robots.placement import LinkPlacement


class LinkVertices:
    """bodies: for each mesh the number of its link, and its geometry in the frame of the link."""

    def __init__(self, bodies: Sequence[tuple[int, Body]]) -> None:
        ends = np.cumsum([len(body.vertices) for _, body in bodies]).tolist()
        self._vertices = np.concatenate([body.vertices for _, body in bodies])
        self._meshes = [(link, end) for (link, _), end in zip(bodies, ends, strict=True)]
        self._rows = [slice(begin, end) for begin, end in zip([0, *ends], ends, strict=False)]

    def placed(self, poses: np.ndarray) -> np.ndarray:
        """(V,3) float64, as Rigid.apply returns them. poses (links,7): quaternion and translation."""
        return placed(poses, self._meshes, self._vertices)

    def of_meshes(self, vertices: np.ndarray) -> list[np.ndarray]:
        """A view for each mesh. vertices: (V,3) of all."""
        return [vertices[rows] for rows in self._rows]


#: How far meshes of round shapes may stand out of them, in metres.
TOLERANCE = 1e-3

_SEPARATORS = str.maketrans("/:", "__")


@dataclass(frozen=True, eq=False)
class RobotMesh:
    """Of the link ``link``: ``name`` is ROBOT/LINK. ``body``: its vertices in the link's frame, with their bounds."""

    name: str
    link: str
    topology: Topology
    body: Body

    @property
    def vertices(self) -> np.ndarray:
        """(n,3) float64. Read-only."""
        return self.body.vertices


@dataclass(frozen=True, eq=False)
class Robot:
    """``meshes``: of the links that have geometry, in the order of the description. ``ignored_pairs``: names of meshes,
    sorted. ``warnings``: sentences about parts of the descriptions that were ignored or renamed."""

    name: str
    description: urdf.Description
    kinematics: Kinematics
    meshes: tuple[RobotMesh, ...]
    ignored_pairs: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        urdf_text: str,
        srdf_text: str | None = None,
        geometry: str = "collision",
        resolver: Resolver = no_files,
        *,
        name: str | None = None,
        tolerance: float = TOLERANCE,
    ) -> "Robot":
        """geometry: "collision" or "visual". resolver: see geometry.py. name: before the links' in names of meshes;
        None: as the description calls it. tolerance: how far meshes of round shapes may stand out.

        Raises RobotError naming the element and the remedy.
        """
        description = urdf.parse(urdf_text, geometry)
        called = description.name if name is None else name
        if not called:
            raise RobotError("name: the description has none; give one")
        made = LinkMeshes(resolver, tolerance)
        names = _mesh_names(called, (link.name for link in description.links if link.geometry))
        meshes = []
        for link in description.links:
            if (shape := made.of(link)) is not None:
                vertices, faces = shape
                topology = Topology(0, len(vertices), faces)
                meshes.append(RobotMesh(names[link.name], link.name, topology, Body.of(vertices)))
        if not meshes:
            other = next(kind for kind in urdf.GEOMETRIES if kind != geometry)
            raise RobotError(f"geometry: no link has <{geometry}>, so the robot has no meshes; try {other}")
        _check_reach(description, meshes)
        semantics = None if srdf_text is None else srdf.parse(srdf_text, (link.name for link in description.links))
        ignored = srdf.ignored(description, semantics)
        warnings = (_renamed(called, names), semantics.ignored if semantics is not None else "")
        return cls(
            called,
            description,
            Kinematics(description, names),
            tuple(meshes),
            _sorted((names[a], names[b]) for a, b in ignored if a in names and b in names),
            tuple(warning for warning in warnings if warning),
        )

    @cached_property
    def _vertices(self) -> LinkVertices:
        return LinkVertices([(self.kinematics.number(mesh.link), mesh.body) for mesh in self.meshes])

    def settings(self, frame_prefix: str = "", by_joints: bool = False) -> tuple[MeshSettings, ...]:
        """Settings of each mesh, moved by joint states, or by transforms from the frame ``frame_prefix`` + link."""
        moved = JOINTS if by_joints else TF
        return tuple(
            MeshSettings(mesh.name, self_collision=False, input=moved, frame=frame_prefix + mesh.link)
            for mesh in self.meshes
        )

    def placements(self, state: RobotState) -> tuple[LinkPlacement, ...]:
        """Placement of each mesh, for frames of the scene: steps between them follow the joints. Raises RobotError if
        the core cannot use the position of one."""
        together = self._vertices.placed(state.pose_rows)
        vertices = self._vertices.of_meshes(together)
        if unusable_coordinates(together, by_poses=True):
            for mesh, of_mesh in zip(self.meshes, vertices, strict=True):
                if problem := unusable_coordinates(of_mesh, by_poses=True):
                    raise RobotError(f"positions: in mesh {quoted(mesh.name)} {problem[1]}")
        return tuple(
            LinkPlacement.of(mesh.body, mesh.link, state, of_mesh)
            for mesh, of_mesh in zip(self.meshes, vertices, strict=True)
        )

    def motions(self, start: RobotState, end: RobotState) -> tuple[LinkMotion, ...]:
        """Motion of each mesh between two states of this robot (kinematics.py defines it)."""
        step = self.kinematics.step(start, end)
        return tuple(step.motion(mesh.link, mesh.body) for mesh in self.meshes)


def _mesh_names(robot: str, links: Iterable[str]) -> dict[str, str]:
    """Link -> name of its mesh. / and : in names of links become _, because they separate names of meshes."""
    names = {link: f"{robot.translate(_SEPARATORS)}/{link.translate(_SEPARATORS)}" for link in links}
    link_of: dict[str, str] = {}
    for link, name in names.items():
        if (other := link_of.setdefault(name, link)) != link:
            raise RobotError(
                f"{urdf.DOCUMENT}: links {quoted(other)} and {quoted(link)} would both be the mesh {quoted(name)}: / "
                "and : become _ there; rename one of them"
            )
    return names


def _renamed(robot: str, names: Mapping[str, str]) -> str:
    renamed = [f"{quoted(link)} is {name}" for link, name in names.items() if name != f"{robot}/{link}"]
    return f"{urdf.DOCUMENT}: in names of meshes / and : become _: link {listed(renamed)}" if renamed else ""


def _sorted(of_names: Iterable[tuple[str, str]]) -> tuple[tuple[str, str], ...]:
    """Pairs and the names in each, sorted, by numbers: a thousand links fixed together have half a million pairs."""
    given = list(of_names)
    names = sorted(set(chain.from_iterable(given)))
    number = {name: k for k, name in enumerate(names)}
    count = len(names)
    keys = [min(a, b) * count + max(a, b) for a, b in ((number[a], number[b]) for a, b in given)]
    return tuple((names[key // count], names[key % count]) for key in sorted(keys))


def _check_reach(description: urdf.Description, meshes: list[RobotMesh]) -> None:
    """Between two states that the core can use, a link may be as far away as the sum of all offsets."""
    offsets = sum(math.hypot(*joint.origin.shift.tolist()) for joint in description.joints)
    reach = offsets + max(mesh.body.radius for mesh in meshes)
    if not reach <= LARGEST_OF_POSES:
        raise RobotError(
            f"{urdf.DOCUMENT}: fully stretched, the robot would reach {reach:g}, beyond the limit of "
            f"{LARGEST_OF_POSES:g}; fix the origins of joints or the sizes of links"
        )
