# SPDX-License-Identifier: Apache-2.0
"""What is installed here: versions, backends and accuracy tiers that can be used, processor, DDS settings.

hpccd info           for people; put it into bug reports
hpccd info --json    for programs
"""


def configure(parser):
    parser.add_argument("--json", action="store_true", help="as one JSON object")


def run(args) -> int:
    from hpccd_ros.commands import installation

    return installation.main(args)
