#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Move a ball so that it just misses a tilting sheet: gradient descent on the first time of impact (PyTorch)."""

import torch

import hpccd_core as hc
from hpccd_core import shapes
from hpccd_core import torch as hct

(sheet, sheet_faces), (ball, ball_faces) = shapes.grid(20, 20), shapes.icosphere(4)
scene = hc.Scene()
scene.add_mesh("sheet", sheet_faces)
scene.add_mesh("ball", ball_faces, self_collision=False)
detector = hc.Detector(scene, outputs=("normals", "weights"))

x, y, _ = torch.from_numpy(sheet).T
wave = 0.1 * torch.sin(7 * x) * torch.cos(5 * y)
start = torch.stack([x, y, wave + 1.5 + 0.3 * x], dim=1)
end = torch.stack([x, y, wave + 0.5 - 0.4 * x], dim=1)
ball = 0.3 * torch.from_numpy(ball)

centre = torch.tensor([0.2, 0.1, 0.7], dtype=torch.float64, requires_grad=True)
for iteration in range(100):
    with_ball = [torch.cat([positions, ball + centre]) for positions in (start, end)]
    time = hct.first_time_of_impact(detector, *with_ball)
    if time > 1:  # infinite: nothing touches
        break
    (slope,) = torch.autograd.grad(time, centre)
    with torch.no_grad():
        centre += (1.001 - time) / slope.square().sum() * slope  # Polyak's step length, to a time just beyond the step
    print(f"{iteration}: first impact at {time.item():.4f}")

(gap,) = (gap for gap in detector.distances(with_ball[1].detach()) if gap.mesh_a != gap.mesh_b)
position = ", ".join(f"{number:.3f}" for number in centre)
print(f"missed by {gap.distance:.4f}, with its centre at {position}")
