# SPDX-License-Identifier: Apache-2.0
"""rclpy.init, and one sentence instead of a traceback if ROS does not start."""

import os
import re
import sys
import tempfile
import warnings
from pathlib import Path

import rclpy
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.logging import get_logging_directory
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from hpccd_ros.base.errors import UserError
from hpccd_ros.base.quoting import LONGEST_MESSAGE, listed, shortened

# Exit status of the node.
NOT_CONFIGURED, WRONG_PARAMETERS, NO_SECURITY = 1, 2, 3

_NO_LOG_FILE = "--disable-external-lib-logs"
# Errors of rclpy's C++ part, whose classes are not in its public interface.
_OF_RCL = ("RCLError", "NodeError", "UnknownROSArgsError")
_FILE = "a parameter file is YAML as config/hpccd.yaml: node name or /**, ros__parameters, names and values"
_REMEDIES = {
    "Sequence should be of same type": "the entries of a list need one type: write 0.0, not 0, beside 0.5",
    "remap rule": "write -r FROM:=TO",
    "parameter override rule": "write -p NAME:=VALUE, and texts with a colon in quotes: -p NAME:=\"['a:b']\"",
    "Error parsing": f"{_FILE}; quote values that contain a colon",  # libyaml rejects it within brackets and braces
    "params file": _FILE,
    "--params-file flag": "write --params-file FILE",
    "ROS_DOMAIN_ID": "set it to 0 .. 232, or unset it",
    "resolve peer": "set ROS_STATIC_PEERS to names or addresses with ; between them, or unset it",
}
LAST_DOMAIN = 232


def init(arguments: list[str] | None = None) -> None:
    """rclpy.init without signal handlers; ``arguments``: with the name of the program, default: those of the process.

    If rcl's log file cannot be written, ROS starts without one and reports it: rcl itself would not start.
    Raises UserError for a domain that Fast DDS would end the process for, and rclpy's own errors: see `start_failure`.
    """
    domain = os.environ.get("ROS_DOMAIN_ID", "")
    if domain.isdecimal() and int(domain) > LAST_DOMAIN:
        raise UserError(f"ROS_DOMAIN_ID: {shortened(domain)} is outside 0 .. {LAST_DOMAIN}")
    # Follows the error of a node that cannot be created, and does not contain the reason.
    warnings.filterwarnings("ignore", "Failed to fini rosout publisher", RuntimeWarning)
    arguments = list(sys.argv if arguments is None else arguments)
    if _NO_LOG_FILE not in arguments and (why := _no_log_file()):
        print(f"hpccd: no log file is written: {why}; set ROS_LOG_DIR to a folder that can be written", file=sys.stderr)
        arguments += ["--ros-args", _NO_LOG_FILE]
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)


def reject_other_arguments(arguments: list[str] | None = None) -> None:
    """Raises UserError for arguments that are not of ROS, which rcl ignores; ``arguments``: as in `init`."""
    if others := remove_ros_args(arguments)[1:]:
        raise UserError(
            f"unknown arguments {listed(others)}: ROS arguments come after --ros-args, for example "
            "--ros-args --params-file config/hpccd.yaml; --help shows more"
        )


def start_failure(error: Exception) -> tuple[int, str] | None:
    """(exit status of the node, reason and remedy), or None for an error of another kind.

    error: raised by `init` or the creation of a node.
    """
    if why := unmet_demand(error):
        return NO_SECURITY, why
    if isinstance(error, UserError):
        return WRONG_PARAMETERS, str(error)
    if isinstance(error, UnicodeEncodeError):
        return WRONG_PARAMETERS, "an argument is not UTF-8: write it so"
    if isinstance(error, NameValidationException):
        return WRONG_PARAMETERS, f"{_sentence(error).rstrip(' ^')}; give another namespace or node name"
    if isinstance(error, ParameterException):
        return WRONG_PARAMETERS, _sentence(error)
    if type(error).__name__ not in _OF_RCL:
        return None
    if type(error).__name__ == "UnknownROSArgsError":
        remedy = "leave them out, or write --params-file FILE, -p NAME:=VALUE or -r FROM:=TO"
        return WRONG_PARAMETERS, f"unknown ROS arguments {_sentence(error)}: {remedy}"
    text = _sentence(error)
    remedy = next((f"; {remedy}" for part, remedy in _REMEDIES.items() if part in text), "")
    wrong = text.startswith(("failed to initialize", "error creating node: invalid node"))
    return WRONG_PARAMETERS if wrong else NOT_CONFIGURED, text.removeprefix("failed to initialize rcl: ") + remedy


def _sentence(error: Exception) -> str:
    """On one line, without positions in rcl's sources."""
    text = re.sub(r",? at [\w./-]+\.[ch](pp)?:\d+", "", " ".join(str(error).split()))
    return shortened(text.strip(" ,."), LONGEST_MESSAGE)


def _no_log_file() -> str | None:
    try:
        folder = Path(get_logging_directory())
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return None
    except RuntimeError as error:  # rclpy's: neither HOME nor ROS_LOG_DIR is set
        return _sentence(error)
    except UnicodeDecodeError as error:  # rclpy's: it decodes every path as UTF-8
        return f"{shortened(error.object)[1:]}: the name of the folder is not UTF-8"
    except OSError as error:
        return f"{folder}: {error.strerror}"


def unmet_demand(error: Exception) -> str | None:
    """Why security prevents the start, and the remedy; None if it is not required or the error is another one.

    error: raised by rclpy.init or the creation of a node. With ROS_SECURITY_ENABLE=true rcl ends there both if keys are
    missing (ROS_SECURITY_STRATEGY=Enforce) and if the DDS implementation has no security plugins (any strategy).
    """
    if os.environ.get("ROS_SECURITY_ENABLE") != "true" or type(error).__name__ not in ("RCLError", "NodeError"):
        return None
    text = " ".join(str(error).split())
    why = f"DDS security is required (ROS_SECURITY_ENABLE=true) and not available, so nothing is started: {text}"
    if "security libraries" in text:
        return (
            f"{why}. The Fast DDS of the Python wheels is built without security; use a ROS 2 installation whose DDS "
            "has it, or unset ROS_SECURITY_ENABLE to run without protection"
        )
    return (
        f"{why}. Create a keystore with an enclave for the node from config/security/policy.xml (docs/security.md) "
        "and name them with ROS_SECURITY_KEYSTORE and --ros-args --enclave"
    )
