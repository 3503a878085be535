# SPDX-License-Identifier: Apache-2.0
"""A robot from its URDF: a mesh for each link, the pairs that are not tested, and their motion. No ROS.

In the order of use (an example is in test/robots/test_robot.py):

    robot = Robot.of(urdf_text, srdf_text, name="arm", geometry="collision", resolver=local_path)
    for mesh in robot.meshes: ...                       # arm/LINK: topology, body, vertices in the link's frame
    robot.ignored_pairs                                 # names of meshes: neighbours, and what the SRDF disables
    start = robot.kinematics.state(positions, base)     # positions: {name of a joint: value}
    end = robot.kinematics.state(positions_later, base)
    motions = robot.motions(start, end)                 # one for each mesh, for hpccd_core.rigid
    robot.placements(end)                               # the same for frames of the scene: detect makes the motions
"""
