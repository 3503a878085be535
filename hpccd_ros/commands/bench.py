# SPDX-License-Identifier: Apache-2.0
"""Measure a recording, a mesh file or a generated scene on this machine; print tables and write JSON.

  hpccd bench cpu run.mcap                  ms a step of a recording, and its stages
  hpccd bench gpu run.mcap                  CPU, hybrid and GPU side by side
  hpccd bench accuracy run.mcap --choose "misses<1e-4"
                                            the cheapest setting within this error
  hpccd bench <benchmark> --help            options and examples of one benchmark

Close other programs first; the result includes the load of the machine.
"""

import importlib

BENCHMARKS = {
    "cpu": "ms per step of each scene, and of each stage",
    "gpu": "CPU, hybrid and GPU compared, with and without transfers",
    "accuracy": "tiers compared: time, false negatives and positives, error of times; the cheapest within bounds",
}


def configure(parser):
    subparsers = parser.add_subparsers(dest="benchmark", metavar="<benchmark>", required=True)
    for name, summary in BENCHMARKS.items():
        subparser = subparsers.add_parser(name, help=summary)
        module = importlib.import_module(f"hpccd_ros.bench.{name}")
        subparser.description = module.__doc__
        module.configure(subparser)
        subparser.set_defaults(run_benchmark=module.run, parser=subparser)


def run(args) -> int:
    from hpccd_ros.bench import command

    return command.measured(args)
