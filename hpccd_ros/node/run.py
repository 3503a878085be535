# SPDX-License-Identifier: Apache-2.0
"""The process of the node: start it from the arguments, run it until SIGINT or SIGTERM."""

import gc
import sys

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.task import Future

from hpccd_ros.middleware import environment, ros_start, stop_signals
from hpccd_ros.middleware.executors import GuardedExecutor, LeanExecutor, UnreadableExecutor
from hpccd_ros.node.node import HpccdNode
from hpccd_ros.params.values import ParameterError


class _Executor(UnreadableExecutor, GuardedExecutor, LeanExecutor):
    """No callback ends the node, lost messages are reported, and few turns are made in between."""


def main(argv: list[str] | None = None, node_type: type[HpccdNode] = HpccdNode) -> int:
    """Run the node until SIGINT or SIGTERM; node_type: a class built on HpccdNode, to look into it.

    Returns the exit status: 0 ended by a signal, 1 could not be configured, 2 invalid parameters or arguments, 3 DDS
    security is required and not available.
    """
    stop = Future()
    stop_signals.watch(lambda: stop.set_result(None))
    environment.prepare()
    try:
        ros_start.init(argv)
        ros_start.reject_other_arguments(argv)
        node = node_type()
    except ParameterError as error:
        return _not_started(ros_start.WRONG_PARAMETERS, str(error))
    except Exception as error:
        if (rejected := ros_start.start_failure(error)) is None:
            raise
        return _not_started(*rejected)
    executor = _Executor(node.errors)
    executor.add_node(node)
    try:
        if node.get_parameter("autostart").value and not stop.done():
            for transition in (node.trigger_configure, node.trigger_activate):
                if transition() != TransitionCallbackReturn.SUCCESS:
                    return 1
        gc.freeze()  # what stands for good: looking it through for garbage took 17 ms in the middle of a stream
        stop_signals.spin(executor, stop)
    except ExternalShutdownException:
        pass
    finally:
        node.close()
        executor.shutdown(timeout_sec=1.0)
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _not_started(status: int, why: str) -> int:
    print(f"hpccd: {why}", file=sys.stderr)
    rclpy.try_shutdown()
    return status
