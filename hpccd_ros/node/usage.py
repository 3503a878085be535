# SPDX-License-Identifier: Apache-2.0
"""What `hpccd_node --help` prints."""

HELP = """\
usage: hpccd_node [-h] [--version] [--ros-args ROS_ARGUMENTS ...]
       python -m hpccd_ros.node, or ros2 run hpccd hpccd_node: the same

Continuous collision detection as a ROS 2 node: meshes in, contacts out. The node runs until Ctrl-C (SIGINT) or SIGTERM.

  hpccd_node --ros-args --params-file my.yaml
  hpccd_node --ros-args -p meshes:="[cloth, ball]"        topics meshes/cloth/vertices, meshes/ball/vertices, ...
  hpccd_node --ros-args --params-file my.yaml -p accuracy:=balanced -p stop_distance:=0.05
  hpccd_node --ros-args --params-file my.yaml -r __ns:=/arm -r contacts:=/arm_contacts

options:
  -h, --help            show this help and exit
  --version             show the version and exit

ROS arguments, all after --ros-args:
  --params-file FILE    parameters in YAML; may be repeated, later files win
  -p NAME:=VALUE        one parameter; a text with a colon in quotes twice: "['robot:cloth:0.01']"
  -r FROM:=TO           another name for a topic or service; __ns:=/NAMESPACE and __node:=NAME for those of the node
  --log-level LEVEL     debug, info, warn, error or fatal

Parameters: docs/parameters.md lists all with their defaults, config/hpccd.yaml is a file to copy, and with the node
running `hpccd param list` shows their values. `hpccd status` says what the node receives, and what is wrong.

exit status: 0 ended as told, 1 cannot be configured, 2 wrong arguments or parameters, 3 DDS security is missing
"""
