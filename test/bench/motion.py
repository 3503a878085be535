# SPDX-License-Identifier: Apache-2.0
"""A collision-free motion of each vertex, compared with one step size for all.

  python -m bench motion                       twisted rods, a body between rollers: their steps of least step size
  python -m bench motion rod-twist-like --peer ipctk   compared with its planar divide-and-truncate
  python -m bench motion cloth-ball --backend gpu

step: collision_free_step(). mean, smallest: of the factors of collision_free_motion(); smallest / step is at least 0.9.
moved: the sum of the lengths that vertices move, divided by that of the whole motion. touching: contacts of the motion
to the result, by exact detection. / detect: the time divided by that of detect().
"""

from __future__ import annotations

import importlib

import numpy as np

import hpccd_core as hc
from bench import lab
from bench.peer import silent_stdout

COLUMNS = {
    "scene": "scene",
    "step": "number",
    "way": "way",
    "step size": "step",
    "mean factor": "mean",
    "smallest / step": "smallest_over_step",
    "moved": "moved",
    "touching": "touching",
    "ms": "median_ms",
    "/ detect": "over_detect",
}


def configure(parser):
    lab.configure(parser, ("rod-twist-like", "armadillo-like"), steps=4)
    lab.backend_options(parser)


def run(args) -> lab.Report:
    lab.require_backend(args)
    result, sources = lab.begin(args)
    for source in sources:
        for number, step in hardest(source, args.steps):
            of_step(result, args, source.name, number, step)
    lab.show(f"a collision-free motion, {args.backend}", COLUMNS, result.rows)
    return result


def hardest(source, count: int):
    """The steps, of every fourth, that can be taken least far, but not from a contact."""
    sizes = {}
    for number in range(3, source.n_steps, 4):
        if (step := source.step(number)) is None:
            continue
        step = step.as_one_mesh()
        size = detector_of(step).collision_free_step(step.vertices_t0, step.vertices_t1)
        if 0 < size < 1:
            sizes[number] = size
    return [(number, source.step(number).as_one_mesh()) for number in sorted(sizes, key=sizes.get)[:count]]


def detector_of(step, **options) -> hc.Detector:
    return hc.Detector(step.scene(), **options)


def of_step(result, args, name, number, step):
    start, end = step.vertices_t0.astype(float), step.vertices_t1.astype(float)
    detector = detector_of(step, backend=args.backend, threads=args.threads)
    ways = {}
    if args.peer:
        ways["ipctk"] = planar_of_ipctk(step.faces(), start, end, args.threads or lab.cores())
    ways |= {
        "after ipctk": lambda: detector.detect(start, end),  # with cold caches
        "detect": lambda: detector.detect(start, end),
        "step": lambda: detector.collision_free_step(start, end),
        "motion": lambda: detector.collision_free_motion(start, end),
    }
    ms, found = lab.in_turn(f"{name} {number}", ways, args.repeat)
    size, motion = found["step"], found["motion"]
    ends = {"step": start + 0.9 * size * (end - start), "motion": motion.vertices, "ipctk": found.get("ipctk")}
    way = np.linalg.norm(end - start, axis=1)
    moving = way > 0
    for of, to in ends.items():
        if to is None:
            continue
        kept = np.linalg.norm(to - start, axis=1)
        factors = np.divide(kept, way, out=np.ones_like(way), where=moving)
        touching = len(detector.detect(start, to))
        result.add(
            scene=name,
            number=number,
            way=of,
            step=size,
            mean=float(factors[moving].mean()),
            smallest_over_step=float(factors.min()) / size,
            moved=float(kept.sum() / way.sum()),
            touching=touching,
            median_ms=float(np.median(ms[of])),
            over_detect=float(np.median(ms[of]) / np.median(ms["detect"])),
        )
        if of == "motion" and touching > len(motion.stuck):
            result.failure(f"{name} {number}: {touching} contacts in the motion to the result")


def planar_of_ipctk(faces, start, end, threads: int):
    """A function that returns ipctk's ends: its trust region is updated at the start, then the step is filtered."""
    try:
        kit = importlib.import_module("ipctk")
    except ImportError as error:
        raise lab.UserError(f"ipctk: cannot be imported ({error}); pip install 'hpccd[bench]', or ipctk") from error
    kit.set_logger_level(kit.LoggerLevel.off)
    faces = faces.astype(np.int32)
    mesh = kit.CollisionMesh(start, kit.edges(faces), faces)
    start = np.asfortranarray(start)
    farthest = float(np.linalg.norm(end - start, axis=1).max())  # the radius that its warm_start_time_step takes

    def filtered():
        kit.set_num_threads(threads)
        region = kit.ogc.TrustRegion(farthest / 2)
        region.trust_region_inflation_radius = farthest
        dx = np.asfortranarray(end - start)
        with silent_stdout():
            region.update(mesh, start, kit.NormalCollisions(), broad_phase=kit.LBVH())
            region.planar_filter_step(mesh, start, dx)
        return np.ascontiguousarray(start + dx)

    return filtered
