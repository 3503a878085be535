# SPDX-License-Identifier: Apache-2.0
"""The quality of service of every topic, in one place."""

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy


def _profile(depth: int, *, reliable: bool = True, latched: bool = False) -> QoSProfile:
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


# The last topology reaches a node that starts after it was published.
TOPOLOGY = _profile(1, latched=True)
# The reader keeps several: of two that come at once, the later (a conflicting one, that of the next break) would else
# replace the earlier before the node has seen it. Ten bound what a stranger can make the node hold.
TOPOLOGY_INPUT = _profile(10, latched=True)

# Enough for a reader that is late now and then (a depth of 2 lost 3 % at 200 Hz); recorders ask for more.
CONTACTS = _profile(10)

DIAGNOSTICS = _profile(10)

# As tf2's own listeners ask for them.
TRANSFORMS = _profile(100)
TRANSFORMS_STATIC = _profile(100, latched=True)

# A viewer wants the newest only.
MARKERS = _profile(1)


def vertices(reliability: str, depth: int) -> QoSProfile:
    """Subscription to vertices. reliability: "reliable" or "best_effort"."""
    return _profile(depth, reliable=reliability == "reliable")


def requests(depth: int) -> QoSProfile:
    """A service in whose queue so many requests find room; the usual profile of services holds 10."""
    return _profile(depth)
