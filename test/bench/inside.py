# SPDX-License-Identifier: Apache-2.0
"""Winding numbers, signed distances and intersection curves, compared with peers; containment; penetration.

  python -m bench inside --threads 1 --peers trueform,open3d,libigl     pip install trueform open3d libigl
  python -m bench inside --parts curves --peers trueform
  python -m bench inside --parts containment
  python -m bench inside --parts penetration
  python -m bench inside --parts poses --peers trueform

points: near the surface (1e-6 to 1e-2 of the size), in the box of the mesh, far (2 to 10 sizes), or hard: copies of
single coordinates of vertices, and points that are a few roundings of single precision away from vertices, edges and
faces. still: the mesh of the call before, so a peer keeps its tree. deforming: other positions in each call, for which
a tree is refitted or made. With one thread times are those of the process. wrong: signs that differ from the exact
winding number; points on the surface do not count. off: the largest error of an absolute distance, divided by the size
of the mesh.

penetration: one mesh beside itself. first: without a start. warm: a moved by a thousandth of its size each time, with
the translation before as the start. A translation is free if intersections and distances of the moved meshes say so.

poses: two spheres that keep their shape, of a million triangles each. still: the poses of the call before. moving: one
sphere turns and moves by a hundredth of its size in each call. positions: of both, computed before the call. trueform:
neighbor_search, and intersection_curves; its tree is made before, and a pose is the transformation of its mesh.
"""

from __future__ import annotations

import dataclasses
import importlib
import itertools
import os
import time

import numpy as np

import hpccd_core as hc
from bench import lab, shapes
from hpccd_core.rigid.transform import Rigid
from hpccd_ros.bench.sources import of_scene
from hpccd_ros.scenes.shapes import torus

PARTS = ("points", "curves", "containment", "penetration", "poses")
PEERS = ("trueform", "open3d", "libigl")
KINDS = ("near", "box", "far", "hard")
FRAMES = 4  # of a deforming mesh
STREAMS = ("cloth-ball-like", "armadillo-like")
COLUMNS = {
    "points": {
        "mesh": "mesh",
        "query": "query",
        "points": "points",
        "state": "state",
        "way": "way",
        "ms": "median_ms",
        "/ hpccd": "over_hpccd",
        "wrong": "wrong",
        "off": "off",
    },
    "curves": {
        "mesh": "mesh",
        "state": "state",
        "way": "way",
        "points": "points",
        "curves": "curves",
        "length": "length",
        "ms": "median_ms",
        "/ hpccd": "over_hpccd",
    },
    "containment": {
        "mesh": "mesh",
        "triangles": "triangles",
        "distances, ms": "median_ms",
        "same without closed meshes": "open_ms",
        "ratio": "over_open",
    },
    "penetration": {
        "mesh": "mesh",
        "triangles": "triangles",
        "depth": "depth",
        "lower bound": "lower_bound",
        "upper / lower": "upper_over_lower",
        "first, ms": "first_ms",
        "warm, ms": "warm_ms",
    },
    "poses": {
        "spheres": "place",
        "query": "query",
        "state": "state",
        "way": "way",
        "distance or pairs": "found",
        "ms": "median_ms",
        "/ hpccd": "over_hpccd",
    },
}


def configure(parser):
    lab.configure(parser, leave_out=("sources", "data"))
    add = parser.add_argument
    add("--parts", default=",".join(PARTS), metavar="NAME,...", help="default: %(default)s")
    add("--kinds", default=",".join(KINDS), metavar="NAME,...", help="kinds of points (default: %(default)s)")
    add("--points", type=int, default=100_000, metavar="N", help="of each kind (default: %(default)s)")
    add("--peers", default="", metavar="NAME,...", help=f"ask the same of {', '.join(PEERS)}, in turn")
    parser.set_defaults(sources=[])


def run(args) -> lab.Report:
    parts = lab.listed("--parts", args.parts, PARTS)
    kinds = lab.listed("--kinds", args.kinds, KINDS)
    names = lab.listed("--peers", args.peers, PEERS) if args.peers else []
    result, _ = lab.begin(args)
    cores = os.sched_getaffinity(0)
    threads = args.threads or len(cores)
    # Peers take as many threads as there are cores, and have no other option in common.
    os.sched_setaffinity(0, sorted(cores)[:threads])
    try:
        peers = [PEER[name](threads, dtype) for name in names for dtype in PEER[name].dtypes]
        for peer in peers:
            result.note(peer.note)
        ask = {
            "points": lambda: of_points(result, args, threads, peers, kinds),
            "curves": lambda: of_curves(result, args, threads, [peer for peer in peers if hasattr(peer, "curves")]),
            "containment": lambda: of_containment(result, args, threads),
            "penetration": lambda: of_penetration(result, args, threads),
            "poses": lambda: of_poses(
                result, args, threads, [p for p in peers if hasattr(p, "nearest") and p.dtype == np.float64]
            ),
        }
        for part in parts:
            ask[part]()
            rows = [row for row in result.rows if row["part"] == part]
            lab.show(f"{part}, {threads} {'thread' if threads == 1 else 'threads'}", COLUMNS[part], rows)
    finally:
        os.sched_setaffinity(0, cores)
    return result


class TrueForm:
    note = "trueform: a mesh in double precision; new positions are assigned to its mesh"
    dtypes = (np.float64, np.float32)

    def __init__(self, threads: int, dtype):
        self._kit, self.dtype = imported("trueform"), dtype
        self.name = "trueform" if dtype == np.float64 else "trueform, float32"

    def mesh(self, vertices, faces):
        return self._kit.Mesh(faces.astype(np.int32), vertices)

    def moved(self, mesh, vertices):
        mesh.points = vertices
        return mesh

    def signed_distances(self, mesh, points):
        return self._kit.signed_distance(mesh, points)

    def winding_numbers(self, mesh, points):
        return self._kit.winding_number(mesh, points)

    def posed(self, mesh, pose):
        matrix = np.eye(4, dtype=self.dtype)
        matrix[:3, :3], matrix[:3, 3] = Rigid.of(pose[:3], pose[3:]).rotation(), pose[:3]
        mesh.transformation = matrix
        return mesh

    def nearest(self, meshes):
        found = self._kit.neighbor_search(*meshes)
        return None if found is None else float(found[1][0]) ** 0.5

    def curves(self, meshes):
        kit = self._kit
        paths, points = kit.intersection_curves(*meshes) if len(meshes) > 1 else kit.self_intersection_curves(*meshes)
        return [points[np.asarray(path)] for path in paths]


class Open3D:
    note = "Open3D: RaycastingScene, in single precision; made again for new positions; 0 or 1 as winding number"
    name, dtypes = "open3d", (np.float32,)

    def __init__(self, threads: int, dtype):
        self._kit, self._threads, self.dtype = imported("open3d"), threads, dtype

    def mesh(self, vertices, faces):
        self._faces = self._kit.core.Tensor(faces.astype(np.uint32))
        return self.moved(None, vertices)

    def moved(self, mesh, vertices):
        scene = self._kit.t.geometry.RaycastingScene(nthreads=self._threads)
        scene.add_triangles(self._kit.core.Tensor(vertices), self._faces)
        return scene

    def signed_distances(self, scene, points):
        return scene.compute_signed_distance(self._kit.core.Tensor(points), nthreads=self._threads).numpy()

    def winding_numbers(self, scene, points):
        return scene.compute_occupancy(self._kit.core.Tensor(points), nthreads=self._threads).numpy()


class LibIGL:
    note = (
        "libigl: its Python bindings keep no tree, so each call makes one; signed_distance with "
        "SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER multiplies distances by 1 - 2 |w|, and w is not quite 0 or 1"
    )
    name, dtypes = "libigl", (np.float64,)

    def __init__(self, threads: int, dtype):
        self._kit, self.dtype = imported("igl"), dtype
        self._kind = self._kit.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER

    def mesh(self, vertices, faces):
        self._faces = faces.astype(np.int64)
        return vertices

    def moved(self, mesh, vertices):
        return vertices

    def signed_distances(self, vertices, points):
        return self._kit.signed_distance(points, vertices, self._faces, self._kind)[0]

    def winding_numbers(self, vertices, points):
        return self._kit.fast_winding_number(vertices, self._faces, points)


PEER = {"trueform": TrueForm, "open3d": Open3D, "libigl": LibIGL}


def clock_of(threads: int):
    """One thread takes as much time of a processor beside other programs as alone."""
    return time.process_time if threads == 1 else time.perf_counter


def imported(module: str):
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise lab.UserError(f"{module}: cannot be imported ({error}); pip install trueform open3d libigl") from error


# Points


def of_points(result, args, threads, peers, kinds):
    # One mesh for times. The other has other winding numbers than 0 and 1: hard points suffice to see who knows them.
    meshes = {"bumpy sphere": bumpy_sphere(args.size), "overlapping spheres": overlapping_spheres(args.size)}
    for mesh, (vertices, faces) in meshes.items():
        frames = deformed(vertices)
        for kind in kinds if mesh == "bumpy sphere" else set(kinds) & {"hard"}:
            points = points_of(kind, vertices, faces, args.points)
            for state, positions in (("still", frames[:1]), ("deforming", frames)):
                for query in ("winding numbers", "signed distances"):
                    title = f"{mesh}, {query}, {kind}, {state}"
                    rows = of_query(query, positions, faces, points, threads, peers, args.repeat, title)
                    for row in rows:
                        of = {"mesh": mesh, "triangles": len(faces), "query": query, "points": kind, "state": state}
                        result.add(part="points", **of, n=len(points), threads=threads, **row)


def of_query(query, positions, faces, points, threads, peers, rounds, title) -> list[dict]:
    scene = hc.Scene()
    scene.add_mesh("mesh", faces)
    detector = hc.Detector(scene, threads=threads)
    ask = detector.winding_numbers if query == "winding numbers" else detector.signed_distances
    ways = {"hpccd": in_turns(positions, lambda vertices: ask(vertices, points, "mesh"))}
    for peer in peers:
        ways[peer.name] = in_turns([p.astype(peer.dtype) for p in positions], of_peer(peer, query, faces, points))
    ms, found = lab.in_turn(title, ways, rounds, clock_of(threads))
    last = positions[rounds % len(positions)]
    numbers, on_surface = detector.winding_numbers(last, points, "mesh")
    inside, counted = numbers != 0, ~on_surface
    distances = np.abs(detector.signed_distances(last, points, "mesh").distance) if query != "winding numbers" else None
    size = np.ptp(last, axis=0).max()
    rows = []
    for way, times in ms.items():
        if query == "winding numbers":
            of = np.asarray(found[way][0] if way == "hpccd" else found[way], float)
            said, off = np.abs(of) > 0.5, None
        else:
            of = np.asarray(found[way].distance if way == "hpccd" else found[way], float)
            said, off = of < 0, float(np.abs(np.abs(of) - distances).max() / size)
        median = float(np.median(times))
        row = {"way": way, "median_ms": median, "least_ms": min(times)}
        row |= {"over_hpccd": median / float(np.median(ms["hpccd"])), "off": off}
        rows.append(row | {"wrong": int(((said != inside) & counted).sum()), "on_surface": int(on_surface.sum())})
    return rows


def in_turns(positions, ask):
    """A function that asks of the next positions at each call."""
    following = itertools.cycle(positions)
    return lambda: ask(next(following))


def of_peer(peer, query, faces, points):
    points, kept = points.astype(peer.dtype), {}
    query = query.replace(" ", "_")

    def ask(vertices):
        if "mesh" not in kept:
            kept["mesh"] = peer.mesh(vertices, faces)
        elif kept["vertices"] is not vertices:
            kept["mesh"] = peer.moved(kept["mesh"], vertices)
        kept["vertices"] = vertices
        return getattr(peer, query)(kept["mesh"], points)

    return ask


def points_of(kind: str, vertices, faces, n: int) -> np.ndarray:
    """Points (n, 3) whose coordinates are float32 numbers, so that all peers get the same."""
    rng = np.random.default_rng(0)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = (high - low).max()
    if kind == "box":
        points = rng.uniform(low, high, (n, 3))
    elif kind == "far":
        points = rng.normal(size=(n, 3))
        points *= size * (rng.uniform(2, 10, n) / np.linalg.norm(points, axis=1))[:, None]
    else:
        corners = vertices[faces[rng.integers(len(faces), size=n)]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        weights = rng.dirichlet((1, 1, 1), n)
        if kind == "near":
            away = size * rng.choice([-1, 1], n) * 10 ** rng.uniform(-6, -2, n)
        else:
            weights[n // 4 : n // 2, 0] = 0  # on an edge
            weights[n // 2 : 3 * n // 4] = (1, 0, 0)
            away = size * 2.0**-24 * rng.integers(-3, 4, n)
        weights /= weights.sum(axis=1)[:, None]
        points = (corners * weights[:, :, None]).sum(axis=1) + away[:, None] * normals
        if kind == "hard":  # the rest: in one line or plane with vertices, along the axes
            rest = len(points) - 3 * n // 4
            points[3 * n // 4 :] = vertices[rng.integers(len(vertices), size=(rest, 3)), np.arange(3)]
    return points.astype(np.float32).astype(np.float64)


# Meshes. Their coordinates are float32 numbers.


def bumpy_sphere(size: float = 1.0, triangles: int = 100_000):
    """Vertices and faces of a star-shaped closed mesh with dents of three sizes."""
    vertices, faces = hc.shapes.icosphere(max(2, round((size * triangles / 20) ** 0.5)))
    x, y, z = vertices.T
    radius = 1 + 0.12 * np.sin(5 * x + 1) * np.cos(6 * y) + 0.08 * np.sin(7 * z + 2 * x)
    radius += 0.03 * np.sin(23 * y) * np.sin(19 * x) * np.sin(21 * z)
    return single(vertices * radius[:, None]), faces


def overlapping_spheres(size: float):
    """One closed mesh that intersects itself: winding numbers 0 to 3."""
    vertices, faces = bumpy_sphere(size, 33_000)
    at = np.array([(0, 0, 0), (0.7, 0.1, 0.2), (0.3, 0.6, -0.1)])
    every = [faces + k * np.uint32(len(vertices)) for k in range(len(at))]
    return single(np.concatenate([vertices + place for place in at])), np.concatenate(every)


def single(vertices) -> np.ndarray:
    return vertices.astype(np.float32).astype(np.float64)


def deformed(vertices) -> list[np.ndarray]:
    """FRAMES positions, the first as given, each waved a little more."""
    wave = 0.01 * np.sin(4 * vertices[:, [1, 2, 0]])
    return [single(vertices + k * wave) for k in range(FRAMES)]


# Intersection curves


def of_curves(result, args, threads, peers):
    for mesh, (parts, faces) in {
        "two bumpy spheres": two_spheres(args.size),
        "tangled cloth": tangled_cloth(args.size),
    }.items():
        scene = hc.Scene()
        for k in range(len(parts)):
            scene.add_mesh(f"mesh {k}", faces, self_collision=len(parts) == 1)
        frames = [np.concatenate(list(moved)) for moved in zip(*map(deformed, parts), strict=True)]
        for state, positions in (("still", frames[:1]), ("deforming", frames)):
            ways = {"hpccd": in_turns(positions, curves_of_hpccd(scene, threads))}
            for peer in peers:
                moved = [p.astype(peer.dtype).reshape(len(parts), -1, 3) for p in positions]
                ways[peer.name] = in_turns(moved, curves_of_peer(peer, faces))
            ms, found = lab.in_turn(f"{mesh}, {state}", ways, args.repeat, clock_of(threads))
            for way, times in ms.items():
                median = float(np.median(times))
                result.add(
                    part="curves",
                    mesh=mesh,
                    triangles=len(parts) * len(faces),
                    state=state,
                    threads=threads,
                    way=way,
                    median_ms=median,
                    least_ms=min(times),
                    over_hpccd=median / float(np.median(ms["hpccd"])),
                    points=sum(len(np.unique(line, axis=0)) for line in found[way]),
                    curves=len(found[way]),
                    length=float(sum(np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in found[way])),
                )


def curves_of_hpccd(scene, threads):
    """A function that returns the points of each curve; the first again at the end of a closed one."""
    detector = hc.Detector(scene, threads=threads, outputs=("points",))

    def ask(vertices):
        curves = detector.intersections(vertices).contours()
        return [np.concatenate([c.points, c.points[:1]]) if c.closed else c.points for c in curves]

    return ask


def curves_of_peer(peer, faces):
    kept = []

    def ask(vertices):
        if not kept:
            kept.extend([[peer.mesh(part, faces) for part in vertices], vertices])
        elif kept[1] is not vertices:
            kept[:] = [[peer.moved(*one) for one in zip(kept[0], vertices, strict=True)], vertices]
        return peer.curves(kept[0])

    return ask


def two_spheres(size: float):
    vertices, faces = bumpy_sphere(size, 50_000)
    return [vertices, single(vertices + (0.55, 0.2, 0.1))], faces


def tangled_cloth(size: float):
    """A sheet that is folded once, and whose upper half waves through the lower one."""
    n = max(12, round((size * 100_000 / 2) ** 0.5)) + 1
    p = shapes.flat(n, n) * (50 / n)
    upper = p[:, 0] > 25
    p[upper, 0] = 50 - p[upper, 0]
    p[:, 2] = 0.5 * np.sin(p[:, 1] / 3) * np.cos(p[:, 0] / 4)
    wave = 0.6 + np.sin(p[:, 1] / 2 + 0.3) * np.cos(p[:, 0] / 3)
    p[upper, 2] += (wave * np.minimum(1, (25 - p[:, 0]) / 3))[upper]
    return [single(p)], shapes.sheet(n, n)


# Containment


def of_containment(result, args, threads):
    """Smallest distances in a stream, and the same with a face taken from each mesh: nothing is inside open meshes."""
    for name in STREAMS:
        source = of_scene(name, args.size)
        step = source.first()
        whole = detector_of(step.meshes, threads)
        opened = detector_of([dataclasses.replace(m, faces=m.faces[:-1]) for m in step.meshes], threads)
        stream = [source.step(k).vertices_t1 for k in source.spread(40)]
        ways = {"closed": along(whole, stream), "open": along(opened, stream)}
        ms, _ = lab.in_turn(name, ways, args.repeat, clock_of(threads))
        closed_ms, open_ms = (float(np.median(times)) / len(stream) for times in ms.values())
        ratio = float(np.median(np.divide(*ms.values())))
        of = {"part": "containment", "mesh": name, "triangles": step.triangles, "threads": threads}
        result.add(**of, median_ms=closed_ms, open_ms=open_ms, over_open=ratio)


def along(detector, stream):
    return lambda: [detector.distances(vertices) for vertices in stream]


def detector_of(meshes, threads):
    scene = hc.Scene()
    for mesh in meshes:
        scene.add_mesh(mesh.name, mesh.faces, n_vertices=mesh.n_vertices, static=mesh.static, self_collision=False)
    return hc.Detector(scene, threads=threads)


# Penetration


def of_penetration(result, args, threads):
    for mesh, (a, b, faces) in penetrating(args.size).items():
        scene = hc.Scene()
        for name in "ab":
            scene.add_mesh(name, faces, self_collision=False)
        detector = hc.Detector(scene, backend="cpu", threads=threads)
        move = 1e-3 * np.ptp(a, axis=0).max() * np.array([0.6, -0.48, 0.64])
        first_ms, warm_ms, ratios, clock, start = [], [], [], clock_of(threads), None
        for k in range(args.repeat + 1):
            vertices = np.concatenate([a + k * move, b])
            detector.intersections(vertices)  # a step of the scene: caches and threads are warm
            for times, option in ((first_ms, None), (warm_ms, start)):
                if times is warm_ms and start is None:
                    continue
                began = clock()
                found = detector.penetration(vertices, "a", "b", start=option)
                times.append(1e3 * (clock() - began))
                ratios.append(found.depth / found.lower_bound if found.lower_bound else np.inf)
                freed = np.concatenate([vertices[: len(a)] + found.translation, b])
                if len(detector.intersections(freed)) or detector.distances(freed)[0].inside:
                    result.failure(f"{mesh} {k}: not free after the translation")
            start = found.translation
        result.add(
            part="penetration",
            mesh=mesh,
            triangles=2 * len(faces),
            threads=threads,
            depth=found.depth,
            lower_bound=found.lower_bound,
            upper_over_lower=float(np.median(ratios)),
            worst_upper_over_lower=max(ratios),
            first_ms=float(np.median(first_ms)),
            warm_ms=float(np.median(warm_ms)),
        )


def penetrating(size: float):
    """Two placements of one mesh each: a, b and their faces."""
    ball, ball_faces = hc.shapes.icosphere(max(2, round(50 * size**0.5)))
    egg = ball * (1, 0.7, 0.5)
    ring, ring_faces = torus(*(max(6, round(n * size**0.5)) for n in (224, 112)))
    bumpy, bumpy_faces = bumpy_sphere(size, 50_000)
    step = of_scene("armadillo-like", size).first()
    knobbly = step.meshes[0]
    body = step.vertices_t0[: knobbly.n_vertices].astype(float)
    body -= body.mean(axis=0)
    return {
        "spheres": (0.9 * ball + (1.2, 0.3, 0.2), ball, ball_faces),
        "spheres, deep": (0.9 * ball + (0.2, 0.1, 0.05), ball, ball_faces),
        "ellipsoids": (egg + (0.6, 0.2, 0.1), egg, ball_faces),
        "tori": (ring + (0.5, 0.1, 0.05), ring, ring_faces),
        "tori, crossing": (ring[:, [0, 2, 1]] * (1, -1, 1) + (0.3, 0.1, 0.2), ring, ring_faces),
        "bumpy spheres": (bumpy + (1.6, 0.3, 0.2), bumpy, bumpy_faces),
        "bumpy spheres, deep": (bumpy + (0.5, 0.2, 0.1), bumpy, bumpy_faces),
        "armadillo-like": (body + 0.6 * np.ptp(body, axis=0) * (1, 0.2, 0), body, knobbly.faces),
        "armadillo-like, deep": (body + 0.2 * np.ptp(body, axis=0) * (1, 0.2, 0.3), body, knobbly.faces),
    }


# Rigid bodies


def of_poses(result, args, threads, peers):
    """Smallest distance and intersections of two spheres, by poses and by positions."""
    vertices, faces = hc.shapes.icosphere(max(2, round((args.size * 1_000_000 / 20) ** 0.5)))
    scene = hc.Scene()
    scene.add_mesh("still", faces, shape=vertices, static=True, self_collision=False)
    scene.add_mesh("moved", faces, shape=vertices, self_collision=False)
    for place, at in (
        ("apart", (3.0, 0.1, 0.2)),
        ("apart, along an axis", (3.0, 0, 0)),
        ("intersecting", (0.9, 0.1, 0.2)),
    ):
        for state in ("still", "moving"):
            poses = [pose_number(at, k) for k in range(FRAMES if state == "moving" else 1)]
            for query in ("distances", "intersections"):
                ways = ways_of_poses(scene, vertices, faces, poses, query, threads, peers)
                ms, found = lab.in_turn(f"{place}, {query}, {state}", ways, args.repeat, clock_of(threads))
                for way, times in ms.items():
                    median = float(np.median(times))
                    of = {"place": place, "query": query, "state": state, "triangles": 2 * len(faces)}
                    of |= {"threads": threads, "way": way, "median_ms": median, "least_ms": min(times)}
                    ratio = median / float(np.median(ms["hpccd"]))
                    result.add(part="poses", **of, over_hpccd=ratio, found=found[way])


def pose_number(at, k: int) -> np.ndarray:
    """The k-th of a motion."""
    turn = np.array([0.02 * k, 0.01 * k, 0.03 * k, 1])
    return np.array([*(np.array(at) + 0.01 * k), *(turn / np.linalg.norm(turn))])


def ways_of_poses(scene, vertices, faces, poses, query, threads, peers) -> dict:
    found_of = {"distances": lambda gaps: gaps[0].distance, "intersections": lambda hits: len(hits.ef)}[query]
    ways = {}
    by_poses, by_positions = (getattr(hc.Detector(scene, threads=threads), query) for _ in range(2))
    positions = [hc.Detector(scene).positions_at([pose]) for pose in poses]
    ways["hpccd"] = in_turns(poses, lambda pose: found_of(by_poses(poses=pose[None])))
    ways["hpccd, positions"] = in_turns(positions, lambda x: found_of(by_positions(x)))
    for peer in peers:
        meshes = [peer.mesh(vertices.astype(peer.dtype), faces) for _ in range(2)]
        ask = peer.nearest if query == "distances" else lambda of, peer=peer: len(peer.curves(of))

        def of_pose(pose, peer=peer, meshes=meshes, ask=ask):
            return ask([meshes[0], peer.posed(meshes[1], pose)])

        ways[peer.name] = in_turns(poses, of_pose)
    return ways
