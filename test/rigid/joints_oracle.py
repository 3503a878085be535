# SPDX-License-Identifier: Apache-2.0
"""Joints and the bounds of their links as hpccd_core/rigid/joints.py derives them, in plain Python: what the core gives
is compared with it to the last bit."""

import math
from functools import cached_property

import numpy as np

from hpccd_core.rigid import rounding
from hpccd_core.rigid.rounding import in_order
from hpccd_core.rigid.transform import IDENTITY, Rigid, rotated


def moved(joint, value):
    """From the joint's own frame at 0 to that at ``value``."""
    if joint.turns:
        return Rigid(np.append(joint.axis * math.sin(value / 2), math.cos(value / 2)), np.zeros(3))
    return Rigid(IDENTITY.quaternion, joint.axis * value if joint.kind == "prismatic" else np.zeros(3))


def poses(joints, values, base):
    """Of each joint's link."""
    found = []
    for joint, value in zip(joints, values.tolist(), strict=True):
        before = base if joint.parent < 0 else found[joint.parent]
        found.append(before.after(joint.origin).after(moved(joint, value)))
    return found


class Link:
    """The link of joint number ``link`` of a JointStep, with the geometry ``body``."""

    def __init__(self, step, link, body):
        self.step, self.link, self.body = step, link, body
        self.way = []
        while link >= 0:
            self.way.insert(0, link)
            link = step.joints[link].parent

    def deviation(self, parts):
        return rounding.up(min(self._acceleration / (8.0 * parts * parts), 2.0 * self._span))

    def rounding(self, parts):
        values = in_order(abs(self.step.start[k]) + abs(self.step.speed[k]) for k in self.way)
        return rounding.at_chain(len(self.way), self._reach, float(values))

    @cached_property
    def _reach(self):
        """From the origin of the world to the farthest point that the link may have in this step."""
        return rounding.up(rounding.length(self.step.base.shift) + self._beyond(self.way))

    @cached_property
    def _span(self):
        """From the origin of the first joint that moves to the farthest point that the link may have in this step."""
        moving = [place for place, k in enumerate(self.way) if self._moves(k)]
        if not moving:
            return 0.0
        first, *others = self.way[moving[0] :]
        return rounding.up(self._slid(first) + self._beyond(others))

    def _beyond(self, joints):
        """The body, with all offsets and slides of these joints of its way."""
        offsets = in_order(rounding.length(self.step.joints[k].origin.shift) + self._slid(k) for k in joints)
        return self.body.radius + float(offsets)

    def _slid(self, k):
        slides = self.step.joints[k].kind == "prismatic"
        return max(abs(float(self.step.start[k])), abs(float(self.step.end[k]))) if slides else 0.0

    def _moves(self, k):
        return self.step.joints[k].kind != "fixed" and self.step.speed[k] != 0.0

    @cached_property
    def _slack(self):
        """What a length computed from the poses of the middle may be off."""
        return 8.0 * self.rounding(2)

    @cached_property
    def _acceleration(self):
        """Not below max |x''| of all its points through the step."""
        moving = [k for k in self.way if self._moves(k)]
        turning = [self.step.joints[k].turns for k in moving]
        speed = [abs(float(self.step.speed[k])) for k in moving]
        if not any(turning):
            return 0.0
        before, turned = [], 0.0
        for s, turns in zip(speed, turning, strict=True):
            before.append(turned)
            turned += s if turns else 0.0
        reach = self._distances(moving, speed)
        second = third = 0.0
        for turns, d, s, g in zip(turning, speed, before, reach, strict=True):
            second += g * (d * (2 * s + d) if turns else 2 * s * d)
            third += g * (d * (3 * s * (s + d) + d * d) if turns else 3 * s * s * d)
        return rounding.up(min(second, self._in_the_middle(moving) + third / 2))

    @cached_property
    def _middle(self):
        """Of each joint in the middle of the step: its axis, and a point of it."""
        return [
            (_vector(rotated(pose.rotation(), joint.axis)), _vector(pose.shift))
            for joint, pose in zip(self.step.joints, self._poses, strict=True)
        ]

    @cached_property
    def _poses(self):
        return poses(self.step.joints, self.step.start + self.step.speed * 0.5, self.step.base)

    def _distances(self, moving, speed):
        """G of each moving joint."""
        axes, centre = self._middle, self._centre
        found, swept = [], 0.0
        for k, d in zip(reversed(moving), reversed(speed), strict=True):
            distance = 1.0
            if self.step.joints[k].turns:
                axis, origin = axes[k]
                distance = length(_cross(axis, _less(centre, origin))) + self.body.girth + self._slack + swept
            found.append(distance)
            swept += distance * d / 2
        return found[::-1]

    def _in_the_middle(self, moving):
        """Not below |x''| of any of its points at t = 1/2."""
        axes, centre = self._middle, self._centre
        of_centre = turning = of_turning = (0.0, 0.0, 0.0)
        total = slides = 0.0
        for k in moving:
            axis, origin = axes[k]
            d = float(self.step.speed[k])
            own = _times(d, axis)
            if self.step.joints[k].turns:
                column = _cross(own, _less(centre, origin))
                of_centre = _plus(of_centre, _cross(_plus(_times(2.0, turning), own), column))
                of_turning = _plus(of_turning, _cross(turning, own))
                turning = _plus(turning, own)
                total += abs(d)
            else:
                of_centre = _plus(of_centre, _cross(_times(2.0, turning), own))
                slides += abs(d)
        spin = length(of_turning) + length(turning) ** 2
        # An axis is off by the slack's part of the reach; each product of two of them by as much, times the turns.
        lost = self._slack * (total * total + 2 * total * slides / max(self._reach, 1e-100))
        return rounding.up(length(of_centre) + spin * self.body.girth + lost)

    @cached_property
    def _centre(self):
        pose = self._poses[self.link]
        return _vector(pose.apply(self.body.centre[None, :])[0])


def _vector(array):
    x, y, z = array.tolist()
    return x, y, z


def _plus(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _less(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(k, a):
    return k * a[0], k * a[1], k * a[2]


def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def length(a):
    """Not below it."""
    squared = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    return rounding.up(math.sqrt(squared)) + rounding.TINY if any(a) else 0.0
