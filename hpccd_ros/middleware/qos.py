# SPDX-License-Identifier: Apache-2.0
"""The quality of service of every topic, in one place."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy


def keep_last(depth: int, *, reliable: bool = True, latched: bool = False) -> QoSProfile:
    """reliable: else best effort. latched: transient local, so that who comes late gets the last `depth` too."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


# The last topology reaches a node that starts after it was published.
TOPOLOGY = keep_last(1, latched=True)
# The reader keeps several: of two that come at once, the later (a conflicting one, that of the next break) would else
# replace the earlier before the node has seen it. Ten bound what a stranger can make the node hold.
TOPOLOGY_INPUT = keep_last(10, latched=True)

# Enough for a reader that is late now and then (a depth of 2 lost 3 % at 200 Hz); recorders ask for more.
CONTACTS = keep_last(10)
DISTANCES = CONTACTS
PAIRS = CONTACTS
# The reader's end, where parameter contacts_durability has them latched.
LATCHED_CONTACTS = keep_last(10, latched=True)

# The requests that a service got and its answers, where parameter service_introspection publishes them.
SERVICE_EVENTS = keep_last(10)

DIAGNOSTICS = keep_last(10)

# As tf2's own listeners ask for them.
TRANSFORMS = keep_last(100)
TRANSFORMS_STATIC = keep_last(100, latched=True)

# As robot_state_publisher offers it.
DESCRIPTION = keep_last(1, latched=True)

# A viewer wants the newest only.
MARKERS = keep_last(1)


def contacts(durability: str) -> QoSProfile:
    """Publisher of contacts. durability: "volatile" or "transient_local"."""
    # Not 1 where they are latched: a reader that is late now and then would lose what the publisher holds no longer.
    return keep_last(CONTACTS.depth, latched=durability == "transient_local")


def stop(timeout: float, depth: int = 1) -> QoSProfile:
    """Of the topic stop: the reader hears of it where nothing came for `timeout` s. Writer and reader may differ: a
    reader that asks for a shorter one than the writer offers is not served at all.

    Liveliness by topic: it says that the thread which publishes goes on. An automatic one would be kept up by threads
    of the middleware while that thread is stuck.
    """
    profile = keep_last(depth, latched=True)
    profile.deadline = Duration(seconds=timeout)
    profile.liveliness = LivelinessPolicy.MANUAL_BY_TOPIC
    profile.liveliness_lease_duration = Duration(seconds=timeout)
    return profile


def vertices(reliability: str, depth: int) -> QoSProfile:
    """Subscription to vertices. reliability: "reliable" or "best_effort"."""
    return keep_last(depth, reliable=reliability == "reliable")


def joint_states(reliability: str) -> QoSProfile:
    """Subscription to joint states, which come more often than frames. reliability: "reliable" or "best_effort"."""
    return keep_last(100, reliable=reliability == "reliable")


def requests(depth: int) -> QoSProfile:
    """A service in whose queue so many requests find room; the usual profile of services holds 10."""
    return keep_last(depth)
