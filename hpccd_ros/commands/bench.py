# SPDX-License-Identifier: Apache-2.0
"""Measure speed, scaling, memory and accuracy on this machine; print tables, write JSON, CSV and pictures.

  hpccd bench cpu n-body-like-lr            ms a frame and where they go, in under a minute
  hpccd bench cpu data --peer ipctk         side by side with ipctk
  hpccd bench scaling                       speed-up against threads, for each method
  hpccd bench distance                      what a separation, proximity, intersections cost
  hpccd bench step                          how far a step may go: first contacts, collision-free step, trial steps
  hpccd bench rigid                         meshes moved by poses and joints: the truth, the bounds, the cost
  hpccd bench gpu data --parts device,worlds
                                            results that stay on the GPU, many worlds in one call
  hpccd bench accuracy                      what each tier costs, and where it errs
  hpccd bench accuracy run.mcap --choose "misses<1e-4"
                                            the cheapest setting that is good enough for what you recorded
  hpccd bench limit                         where the time goes, beside the least that this machine needs
  hpccd bench <benchmark> --help            scenes, options and examples of one benchmark

Every benchmark takes generated scenes (`hpccd scene --list`), the files of the folder HPCCD_DATA, or any recording of
`hpccd record`. Variants run in turn on the same steps; close other programs first: the result says how busy they were.
"""

import argparse
import importlib

# The module of each, in hpccd_ros.bench, and what it measures.
BENCHMARKS = {
    "cpu": ("core.cpu", "ms a frame of each scene (Table 1), its components, and a peer beside it"),
    "gpu": ("core.gpu", "the GPU backend: ms a frame, with transfers and without, many worlds, stages, floors"),
    "scaling": ("core.scaling", "speed-up over one thread against threads (Fig. 6 and 7), for each method"),
    "methods": ("core.methods", "the methods and instruction sets compared: time, and equality of the results"),
    "size": ("core.size", "how time and memory grow with the number of triangles"),
    "worlds": ("core.worlds", "many worlds in one call on CPUs, beside detectors that are asked one world at a time"),
    "ropes": ("core.ropes", "ropes as edges, beside thin triangles and beside cloth with as many edges"),
    "memory": ("core.memory", "peak memory and bytes per triangle"),
    "limit": ("core.limit", "where the time of a step goes, beside the least that this machine needs for the work"),
    "options": ("core.options", "what each way to model less saves"),
    "distance": ("core.distance", "separation, proximity, intersections, smallest distances beside plain detection"),
    "step": ("core.step", "how far a step may go: first contacts, free step and trial steps beside all contacts"),
    "rigid": ("core.rigid", "meshes moved by poses and joints: found contacts against the truth, bounds, cost"),
    "ros": ("ros.node", "the node over DDS: latency beside that of an echo, sustained rate, overload"),
    "robot": ("ros.robot", "a robot beside a cloth over DDS, moved by joint states: answers a second, latency"),
    "stop": ("ros.stop", "the topic stop over DDS: random approaches, silence, publisher and node killed"),
    "soak": ("ros.soak.command", "half an hour of mixed load on the node: memory, counts, answers"),
    "accuracy": ("core.accuracy", "the tiers: time, wrong answers, error of times; sweeps of scale and offset"),
}


def configure(parser):
    subparsers = parser.add_subparsers(dest="benchmark", metavar="<benchmark>", required=True)
    for name, (place, summary) in BENCHMARKS.items():
        try:
            module = importlib.import_module(f"hpccd_ros.bench.{place}")
        except ModuleNotFoundError as error:
            if error.name not in ("fuzz", "oracle"):
                raise
            continue  # needs the oracles of a checkout: PYTHONPATH=test:build/oracle
        subparser = subparsers.add_parser(name, help=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
        subparser.description = module.__doc__
        module.configure(subparser)
        subparser.set_defaults(run_benchmark=module.run, parser=subparser)


def run(args) -> int:
    return args.run_benchmark(args)
