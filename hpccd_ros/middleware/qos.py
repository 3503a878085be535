# SPDX-License-Identifier: Apache-2.0
"""The QoS of every topic."""

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy


def keep_last(depth: int, *, reliable: bool = True, latched: bool = False) -> QoSProfile:
    """reliable: else best effort. latched: transient local, so that late subscribers receive the last `depth`
    messages."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


# The last topology reaches a node that starts after it was published.
TOPOLOGY = keep_last(1, latched=True)
# The reader keeps several: otherwise the later of two that arrive at once (a conflicting one, that of the next break)
# would replace the earlier before the node has read it. Ten limit the memory that untrusted publishers can use.
TOPOLOGY_INPUT = keep_last(10, latched=True)

# Enough for a reader that is sometimes late (a depth of 2 lost 3 % at 200 Hz); recorders request more.
CONTACTS = keep_last(10)
DISTANCES = CONTACTS
PAIRS = CONTACTS
# The reader's QoS if the parameter contacts_durability is transient_local.
LATCHED_CONTACTS = keep_last(10, latched=True)

# Requests and responses of a service, if the parameter service_introspection publishes them.
SERVICE_EVENTS = keep_last(10)

DIAGNOSTICS = keep_last(10)

# As tf2's listeners request them.
TRANSFORMS = keep_last(100)
TRANSFORMS_STATIC = keep_last(100, latched=True)

# As offered by robot_state_publisher.
DESCRIPTION = keep_last(1, latched=True)

# Viewers need only the newest.
MARKERS = keep_last(1)


def contacts(durability: str) -> QoSProfile:
    """Publisher of contacts. durability: "volatile" or "transient_local"."""
    # Not 1 if latched: a reader that is sometimes late would lose messages that the publisher no longer has.
    return keep_last(CONTACTS.depth, latched=durability == "transient_local")


def stop(timeout: float, depth: int = 1) -> QoSProfile:
    """The topics stop and speed_scale: the reader is notified if no message arrived for `timeout` s. Writer and
    reader may differ, but a reader that requests a shorter time than the writer offers receives nothing.

    Liveliness is manual by topic: it shows that the publishing thread continues. Automatic liveliness would be kept up
    by threads of the middleware while that thread hangs.
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
    """A service whose queue holds this many requests; the default profile of services holds 10."""
    return keep_last(depth)
