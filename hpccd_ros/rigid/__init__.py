# SPDX-License-Identifier: Apache-2.0
"""Meshes that move by poses or by joints, asked of a detector that knows straight lines only. numpy, the core, no ROS.

What a step needs, in the order of use (an example is in test/rigid/test_bodies.py):

    body = Body.of(vertices)                                # once a mesh
    motions = [ScrewMotion(body, Screw.between(pose_0, pose_1)), Linear(cloth_0, cloth_1), ...]
    cut = fewest_parts(motions, tolerance, most)            # common to all meshes
    margins = [Margin.of(motion, cut.parts) for motion in motions]
    detector.set_separation(a, b, grown(separation, margins[a], margins[b]))     # each pair of meshes
    frames = [np.concatenate([m.vertices(j, cut.parts) for m in motions]) for j in range(cut.parts + 1)]
    contacts = merged([detector.detect(x, y) for x, y in pairwise(frames)], cut.parts)

Pairs of meshes that both go straight, as a cloth with itself, need no cut and no margin: ask them in a detector of
their own, whose scene ignores the other pairs, once for the whole step, and give its answer to `merged` as ``whole``.
The other detector ignores them (a mesh with itself: ``self_collision=False``). Where most triangles are cloth that
saves most of the time of a step that is cut.

Why no contact is missed. At any time t of a part each point of a mesh on its true motion is within `deviation` of where
it would be if the vertices, exact at both ends of the part, went on straight lines (motion.py, screw.py, joints.py);
and that is within `rounding` of where it is on straight lines between the positions as they were computed
(rounding.py): what is true of vertices is true of the points of edges and faces, which are averages of theirs with
fixed weights. So two features that on their true motions come within d of each other at t are, on the lines that the
detector is given, within

    d' = d + B_a + B_b + rho_a + rho_b

at the same t: they are reported, no later than it is true. And what is reported at d' is, on the true motions and at
the time that is reported, within d' + B_a + B_b + rho_a + rho_b, which is the excess of at most twice the bound.
"""
