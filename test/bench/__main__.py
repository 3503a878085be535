# SPDX-License-Identifier: Apache-2.0
"""Measure hpccd on this machine, from a checkout; print tables and write JSON.

  make bench BENCH_ARGS="scaling"           or: PYTHONPATH=test python -m bench scaling
  python -m bench <subject> --help          scenes, options and examples of one subject

Most subjects take generated scenes (`hpccd scene --list`), the files of the folder HPCCD_DATA, or any recording of
`hpccd record`; --help of a subject says which. Variants alternate on the same steps. Close other programs first; the
result includes the load of the machine.
"""

import argparse
import importlib
import os
import sys
from pathlib import Path

from hpccd_ros.base.errors import UserError
from hpccd_ros.bench import command

# Module of this package -> what it measures.
SUBJECTS = {
    "peer": "all and first contacts, compared with ipctk",
    "scaling": "speed-up over one thread against threads (Fig. 6 and 7), for each method",
    "methods": "the methods and instruction sets compared: time, and equality of the results",
    "size": "how time and memory grow with the number of triangles",
    "memory": "peak memory and bytes per triangle",
    "worlds": "many worlds in one call on CPUs, compared with one call per world",
    "ropes": "ropes as edges, compared with thin triangles and with cloth",
    "options": "the time that each option of a smaller model saves",
    "distance": "separation, proximity, intersections, smallest distances, compared with plain detection",
    "step": "first contacts, collision-free step and trial steps, compared with all contacts",
    "motion": "a collision-free motion of each vertex, compared with one step size for all",
    "inside": "winding numbers, signed distances, intersection curves, compared with peers; containment; penetration",
    "accuracy": "hard elementary and distance queries: false negatives and positives of each tier",
    "gpu": "the GPU backend: ms per frame with and without transfers, many worlds, stages",
    "rigid": "meshes moved by poses and joints: contacts compared with the truth, bounds, cost",
    "record": "the writer of recordings with and without --sync: throughput, CPU time, waiting messages",
    "ros": "the node over DDS: latency compared with an echo, sustained rate, overload",
    "robot": "a robot beside a cloth over DDS, moved by joint states: results per second, latency",
    "stop": "the topic stop over DDS: random approaches, silence, publisher and node killed",
    "soak": "forty minutes of mixed load on the node: memory, counts, results",
}


# Import paths of subjects and of the processes that they start.
TEST = Path(__file__).resolve().parents[1]
FOLDERS = [TEST, TEST / "support", TEST.parent / "build" / "oracle", TEST.parent / "examples" / "cloth_on_ball"]


def main(words: list[str]) -> int:
    folders = [str(folder) for folder in FOLDERS]
    sys.path += [folder for folder in folders if folder not in sys.path]
    os.environ["PYTHONPATH"] = os.pathsep.join(folders)
    parser = argparse.ArgumentParser("python -m bench", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    subparsers = parser.add_subparsers(dest="benchmark", metavar="<subject>", required=True)
    for name, summary in SUBJECTS.items():
        subparser = subparsers.add_parser(name, help=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
        if name not in words:
            continue
        try:
            module = importlib.import_module(f"bench.{name}")
        except ImportError as error:
            if "_oracle" not in str(error):
                raise
            print(f"bench: {name} compares with the oracles, which are not built; run `make oracle`", file=sys.stderr)
            return 2
        subparser.description = module.__doc__
        module.configure(subparser)
        subparser.set_defaults(run_benchmark=module.run, parser=subparser)
    args = parser.parse_args(words)
    try:
        return command.measured(args)
    except UserError as error:
        print(f"bench: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("bench: interrupted", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
