# SPDX-License-Identifier: Apache-2.0
"""What to say where DDS security is demanded and cannot be had. The node then does not start: it fails closed."""

import os


def unmet_demand(error: Exception) -> str | None:
    """Why nothing is started, and what to do; None where security is not demanded or the error is another one.

    error: raised by rclpy.init or the creation of a node. With ROS_SECURITY_ENABLE=true rcl ends there both if keys are
    missing (ROS_SECURITY_STRATEGY=Enforce) and if the DDS implementation has no security plugins (any strategy).
    """
    if os.environ.get("ROS_SECURITY_ENABLE") != "true" or type(error).__name__ not in ("RCLError", "NodeError"):
        return None
    text = " ".join(str(error).split())
    why = f"DDS security is demanded (ROS_SECURITY_ENABLE=true) and cannot be had, so nothing is started: {text}"
    if "security libraries" in text:
        return (
            f"{why}. The Fast DDS of the Python wheels is built without security; use a ROS 2 installation whose DDS "
            "has it, or unset ROS_SECURITY_ENABLE to run without protection"
        )
    return (
        f"{why}. Create a keystore with an enclave for the node from config/security/policy.xml (docs/security.md) "
        "and name them with ROS_SECURITY_KEYSTORE and --ros-args --enclave"
    )
