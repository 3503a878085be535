# SPDX-License-Identifier: Apache-2.0
"""What a recording tells of the node beside its messages, so that a replay needs nothing else."""

from collections.abc import Callable

from hpccd_ros.base.version import package_version
from hpccd_ros.record.recorded_topics import Wanted


def recording_info(node: str, parameters: dict, wanted: list[Wanted], resolve: Callable[[str], str]) -> dict:
    """JSON-able. node: full name; parameters: {full name: value}; resolve: relative -> remapped absolute topic name."""
    return {
        "format": 1,
        "hpccd": package_version(),
        "node": node,
        "parameters": parameters,
        # The role of each topic, whatever it was remapped to.
        "topics": {resolve(topic.name): topic.name for topic in wanted},
    }
