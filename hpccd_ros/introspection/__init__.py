# SPDX-License-Identifier: Apache-2.0
"""The commands status, echo and param, which ask running nodes. With the wheels there is no `ros2` program."""
