# SPDX-License-Identifier: Apache-2.0
"""Measure your own recording or mesh file, or a generated scene, on this machine; print tables and write JSON.

  hpccd bench cpu run.mcap                  ms a step of a recording, and its stages
  hpccd bench gpu run.mcap                  CPU, hybrid and GPU side by side
  hpccd bench accuracy run.mcap --choose "misses<1e-4"
                                            the cheapest setting that is accurate enough for this recording
  hpccd bench <benchmark> --help            options and examples of one benchmark

Close other programs first: the result says how busy they were.
"""

import argparse
import importlib

BENCHMARKS = {
    "cpu": "ms a step of each scene and its stages",
    "gpu": "CPU, hybrid and GPU side by side, with transfers and without",
    "accuracy": "the tiers: time, missed and spurious contacts, error of times; the cheapest one that is good enough",
}


def configure(parser):
    subparsers = parser.add_subparsers(dest="benchmark", metavar="<benchmark>", required=True)
    for name, summary in BENCHMARKS.items():
        subparser = subparsers.add_parser(name, help=summary, formatter_class=argparse.RawDescriptionHelpFormatter)
        module = importlib.import_module(f"hpccd_ros.bench.{name}")
        subparser.description = module.__doc__
        module.configure(subparser)
        subparser.set_defaults(run_benchmark=module.run, parser=subparser)


def run(args) -> int:
    from hpccd_ros.bench import command

    return command.measured(args)
