# SPDX-License-Identifier: Apache-2.0
"""Detection with a separation d, proximity within d, intersections and smallest distances, each compared with plain
detection of the same step.

  python -m bench distance                       the files of HPCCD_DATA, twisted rods, a body between rollers
  python -m bench distance cloth-ball --separations 1e-3,1e-2
  python -m bench distance data --peer ipctk     compared with ipctk (pip install ipctk)
  python -m bench distance data --backend gpu --arrays device   positions on the GPU (torch or cupy)

Choose d below the shortest edges of the scene. Default values above its median edge are skipped.
"/ plain" is the time divided by that of plain detection. "us a pair more" is thread time per additional pair, in
microseconds: pairs beyond the contacts (with a separation: beyond 1.5 times the contacts), time beyond half of plain
detection (with a separation: beyond twice). Queries of one frame use the end of the step.
"""

from __future__ import annotations

import dataclasses

import numpy as np

import hpccd_core as hc
from bench import lab
from bench.device import to_device
from bench.peer import NOTE, PeerRunner
from hpccd_ros.bench import measure
from hpccd_ros.bench.measure import Runner
from hpccd_ros.bench.sources import Step

PLAIN = "plain"
BY_DISTANCE = ("separation", "proximity")
QUERIES = (*BY_DISTANCE, "intersections", "distances")
SEPARATIONS = "1e-5,1e-4,1e-3,1e-2"
# By query: how many times the time of plain detection, and how many pairs for each contact, are free.
ALLOWED = {"separation": (2.0, 1.5), "proximity": (0.5, 1.0)}
COLUMNS = {
    "scene": "scene",
    "query": "query",
    "d": lambda row: None if row["distance"] is None else f"{row['distance']:g}",
    "pairs": lab.whole("pairs"),
    "ms": "step_ms",
    "/ plain": "over_plain",
    "us a pair more": "us_a_pair_beyond",
    "x ipctk": "times_faster_than_ipctk",
}


class Gaps(list):
    """Smallest distances, with a hash to compare calls by, as the other results have one."""

    @property
    def hash(self) -> int:
        return hash(tuple((gap.distance, gap.kind, gap.features) for gap in self)) & (1 << 64) - 1


@dataclasses.dataclass(frozen=True)
class Question:
    """query: one of QUERIES, or PLAIN; distance: None where the query has none."""

    query: str
    distance: float | None = None

    @property
    def name(self) -> str:
        return self.query if self.distance is None else f"{self.query} {self.distance!r}"

    def runner(self, options: dict, change=None, name: str | None = None) -> Runner:
        own = {"minimum_separation": self.distance} if self.query == "separation" else {}
        return Runner(name or self.name, {**options, **own}, self.ask, change)

    def ask(self, detector: hc.Detector, step: Step):
        if self.query == "proximity":
            return detector.proximity(step.vertices_t1, self.distance)
        if self.query == "intersections":
            return detector.intersections(step.vertices_t1)
        if self.query == "distances":
            return Gaps(detector.distances(step.vertices_t1))
        return measure.detect(detector, step)


def configure(parser):
    lab.configure(parser, ("data", "rod-twist-like", "armadillo-like"), steps=2)
    add = parser.add_argument
    add("--separations", metavar="D,...", help=f"in units of the scene (default: {SEPARATIONS} up to its median edge)")
    add("--queries", default=",".join(QUERIES), metavar="NAME,...", help="default: %(default)s")
    lab.backend_options(parser)
    lab.tier_option(parser, default="exact")


def run(args) -> lab.Report:
    distances = lab.numbers("--separations", SEPARATIONS if args.separations is None else args.separations, float)
    queries = lab.listed("--queries", args.queries, QUERIES)
    lab.require_backend(args, accuracy=args.accuracy)
    result, sources = lab.begin(args)
    threads = args.threads or lab.cores()
    options = {"accuracy": args.accuracy, "backend": args.backend, "threads": args.threads}
    change = Step.as_one_mesh if args.peer else to_device if args.arrays == "device" else None
    for source in sources:
        edge = median_edge(source.first())
        chosen = [d for d in distances if d <= edge or args.separations is not None]
        if beyond := [f"{d:g}" for d in distances if d not in chosen]:
            result.note(f"{source.name}: d {', '.join(beyond)} left out, beyond its median edge of {edge:.2g}")
        asked = [Question(PLAIN)]
        for query in queries:
            asked += [Question(query, d) for d in chosen] if query in BY_DISTANCE else [Question(query)]
        runners = [question.runner(options, change) for question in asked]
        for question in asked if args.peer else ():
            if question.query not in (PLAIN, "distances"):
                query = "earliest" if question.query == "separation" else question.query
                runners.append(PeerRunner(threads, query, question.distance or 0.0, f"ipctk {question.name}"))
                result.note(NOTE)
        _rows(result, args, source, runners, asked, edge)
    lab.show(f"distance queries, {args.accuracy}, {args.backend}, {threads} threads", COLUMNS, result.rows)
    return result


def _rows(result, args, source, runners, asked, edge):
    result.note(measure.NOTE)
    series = measure.measure(source, runners, args.repeat, args.steps)
    plain, threads = series[PLAIN].times() | {"pairs": series[PLAIN].contacts()}, args.threads or lab.cores()
    triangles = source.step(next(iter(series[PLAIN].by_step))).triangles
    for question in asked:
        one, peer = series[question.name], series.get(f"ipctk {question.name}")
        for text in measure.disagreements({question.name: one}):
            result.failure(f"{source.name}: {question.name}: results differ between calls: {text}")
        row = one.row()
        row |= {"pairs": row.pop("contacts"), "query": question.query, "distance": question.distance}
        for key, of in (("over_plain", "step_ms"), ("least_over_plain", "least_ms")):
            row[key] = row[of] / plain[of]
        if question.query in ALLOWED:
            row["us_a_pair_beyond"] = us_a_pair_beyond(question.query, row, plain, threads)
        if peer:
            row |= {"ipctk_ms": peer.times()["step_ms"], "ipctk_pairs": peer.contacts()}
            row["times_faster_than_ipctk"] = row["ipctk_ms"] / row["step_ms"]
        result.add(scene=source.name, triangles=triangles, median_edge=edge, **row)


def us_a_pair_beyond(query: str, row: dict, plain: dict, threads: int) -> float | None:
    of_plain, of_contacts = ALLOWED[query]
    beyond = row["pairs"] - of_contacts * plain["pairs"]
    ms = row["step_ms"] - of_plain * plain["step_ms"]
    return max(0.0, 1e3 * threads * ms / beyond) if beyond > 0 else None


def median_edge(step) -> float:
    faces, xyz = step.faces(), step.vertices_t1
    return float(np.median(np.linalg.norm(xyz[faces] - xyz[np.roll(faces, 1, axis=1)], axis=2)))
