# SPDX-License-Identifier: Apache-2.0
"""What rosbag2 wants to know of a recording: its BagMetadata, version 9 (Jazzy)."""

from collections import Counter

from hpccd_ros.bag import message_definitions
from hpccd_ros.bag.bag_file import BagFile, Topic


def of_bag(files: list[BagFile], topics: list[Topic]) -> dict:
    """All of it, of the given files."""
    return without_files(files, topics) | {
        "relative_file_paths": [f.path.name for f in files],
        "files": [of_file(f) for f in files],
    }


def of_file(file: BagFile) -> dict:
    """What it says of one file."""
    return {
        "path": file.path.name,
        "starting_time": {"nanoseconds_since_epoch": file.start},
        "duration": {"nanoseconds": file.end - file.start},
        "message_count": file.message_count,
    }


def without_files(files: list[BagFile], topics: list[Topic]) -> dict:
    """All but its two lists of files."""
    used = [f for f in files if f.message_count]
    start = min((f.start for f in used), default=0)
    end = max((f.end for f in used), default=0)
    counts: Counter[str] = Counter()
    for file in files:
        counts.update(file.counts)
    return {
        "version": 9,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": end - start},
        "starting_time": {"nanoseconds_since_epoch": start},
        "message_count": counts.total(),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": message_definitions.type_hash(topic.type_name),
                },
                "message_count": counts[topic.name],
            }
            for topic in topics
        ],
        # MCAP compresses its own chunks; these two keys are about compression around the file.
        "compression_format": "",
        "compression_mode": "",
        "custom_data": None,
        "ros_distro": "jazzy",
    }
