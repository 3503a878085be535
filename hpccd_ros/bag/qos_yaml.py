# SPDX-License-Identifier: Apache-2.0
"""QoS of recorded topics, in the YAML form that rosbag2 (Jazzy, bag version 9) reads."""

import yaml

# rosbag2's spelling of "no limit" for a duration.
INFINITE = {"sec": 9223372036, "nsec": 854775807}


def offered_qos(profiles) -> list[dict]:
    """rosbag2 maps of the rclpy QoSProfile objects that the publishers of a topic offer, equal ones once.

    rosbag2 rejects a map with a missing key, so every key is written. The deadline, lifespan and lease of a
    publisher are left unlimited: a player at another rate would break them.
    """
    maps = []
    for profile in profiles:
        entry = {
            # Endpoint information does not contain history and depth (it has UNKNOWN, 0).
            "history": "keep_last",
            "depth": max(1, profile.depth),
            "reliability": profile.reliability.name.lower(),
            "durability": profile.durability.name.lower(),
            "deadline": INFINITE,
            "lifespan": INFINITE,
            "liveliness": "automatic",
            "liveliness_lease_duration": INFINITE,
            "avoid_ros_namespace_conventions": False,
        }
        if entry not in maps:
            maps.append(entry)
    return maps


def to_yaml(data) -> str:
    """YAML without anchors and aliases, which rosbag2's own reader need not resolve."""
    return yaml.dump(data, Dumper=_PlainDumper, sort_keys=False)


# The emitter in C, where PyYAML is built with it, takes a tenth of the time: messages must not wait for metadata.
class _PlainDumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):
    def ignore_aliases(self, data):
        return True
