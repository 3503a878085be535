# SPDX-License-Identifier: Apache-2.0
"""The simulated scenes: a square cloth above a spinning ball, or with a corner pinched between the ball and a plate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hpccd_core import shapes
from hpccd_ros.scenes.exactmath import axis_angle, random_stream, rotate
from hpccd_ros.scenes.scene import Mesh

# How far (m) a pinched corner extends beyond the top of the ball, along both sides of the cloth.
PINCHED = 0.1
# Largest small step times the frequency of a vertex on one spring.
STIFFNESS = 0.8


@dataclass(frozen=True)
class Setup:
    """Metres, kilograms, seconds; the ball's centre is the origin, z points up."""

    cells: int  # along a side of the cloth: 2 * cells**2 triangles
    ball_frequency: int = 10  # 20 * ball_frequency**2 triangles
    side: float = 2.4
    density: float = 0.2  # kg/m^2, of a light cotton
    stretch: float = 150.0  # N/m, of the springs along the threads
    shear: float = 20.0  # along the diagonals
    bend: float = 0.5  # between every second vertex
    drag: float = 5.0  # 1/s, of the air: it holds back what hangs free, so that the cloth winds round the ball
    gravity: float = 9.81
    ball_radius: float = 0.5
    spin: float = 5.0  # rad/s about z, reached at spin_ramp
    spin_ramp: float = 0.3
    drop_height: float = 0.05
    offset: tuple[float, float] = (0.06, -0.03)  # of the cloth's centre: the folds fall unevenly
    friction_ball: float = 0.8
    friction_cloth: float = 0.3
    period: float = 0.01  # of a move
    has_plate: bool = False  # above the ball, at rest

    @classmethod
    def pinched(cls, cells: int, **others) -> Setup:
        """A corner of the cloth lies between the ball and a plate that is closer than the thickness. The rest falls."""
        middle = 0.5 * cls.side - PINCHED
        return cls(cells, offset=(middle, middle), has_plate=True, **others)

    @property
    def spacing(self) -> float:
        """Between neighbouring threads of the grid."""
        return self.side / self.cells

    @property
    def mass(self) -> float:
        """Mass of a vertex."""
        return self.density * self.side * self.side / (self.cells + 1) ** 2

    @property
    def substeps(self) -> int:
        """Small steps of a move: one sweep over the springs follows waves that take no less than a step a thread, and
        no energy is made. So a finer cloth needs more of them."""
        return math.ceil(self.period * math.sqrt(self.stretch / self.mass) / STIFFNESS)

    @property
    def thickness(self) -> float:
        """Distance at which surfaces push each other away: below a fold's sharpest bend, two neighbours apart."""
        return 0.2 * self.spacing

    @property
    def reach(self) -> float:
        """How near pairs must come in a trial move to be given to the solver: what it moves elsewhere stays in sight.
        Below the shortest edge, or neighbours would count."""
        return 1.75 * self.thickness

    @property
    def clearance(self) -> float:
        """No move may bring anything nearer: the next never starts in touch, and rounding to float32 is far below."""
        return 0.25 * self.thickness

    def angle(self, time: float) -> float:
        """Rotation of the ball (rad)."""
        ramp = min(time, self.spin_ramp)
        return self.spin * (0.5 * ramp * ramp / self.spin_ramp + (time - ramp))

    @property
    def plate_gap(self) -> float:
        """Between the plate and the top of the ball: room for the clearance on both sides, not for the thickness."""
        return 0.8 * self.thickness

    def ball(self):
        """(V,3) float64 vertices at time 0, (F,3) uint32 faces."""
        vertices, faces = shapes.icosphere(self.ball_frequency)
        return vertices * self.ball_radius, faces

    def turned(self, ball: np.ndarray, time: float) -> np.ndarray:
        """The ball's vertices at `time`."""
        return rotate(axis_angle(np.array([0.0, 0.0, 1.0]), self.angle(time)), ball)

    def plate(self):
        """(V,3) float64 vertices and (F,3) uint32 faces of the plate; none where there is no plate."""
        vertices, faces = shapes.grid(1, 1)
        vertices = vertices * (2.0 * PINCHED) + [0.0, 0.0, self.ball_radius + self.plate_gap]
        return (vertices, faces) if self.has_plate else (vertices[:0], faces[:0])

    def meshes(self) -> tuple[Mesh, ...]:
        """The cloth and the obstacles, in the order of their vertices."""
        (cloth, cloth_faces), (ball, ball_faces), (plate, plate_faces) = self.cloth(0), self.ball(), self.plate()
        meshes = (
            Mesh("cloth", cloth_faces, len(cloth)),
            Mesh("ball", ball_faces, len(ball), self_collision=False),
            Mesh("plate", plate_faces, len(plate), self_collision=False),
        )
        return meshes if self.has_plate else meshes[:2]

    @property
    def ignored_pairs(self) -> tuple[tuple[str, str], ...]:
        """The ball and the plate are closer than the reach, and such pairs move no vertex of the cloth."""
        return (("ball", "plate"),) if self.has_plate else ()

    def cloth(self, seed: int):
        """(V,3) float64 vertices at rest above the ball, (F,3) uint32 faces."""
        vertices, faces = shapes.grid(self.cells, self.cells)
        vertices = vertices * (0.5 * self.side)
        # Noise far below a cell breaks the symmetry that would forbid the cloth to buckle.
        noise = 0.02 * self.spacing * random_stream(seed).random_sample(len(vertices))
        vertices[:, 0] += self.offset[0]
        vertices[:, 1] += self.offset[1]
        height = 0.5 * self.plate_gap if self.has_plate else self.drop_height
        vertices[:, 2] = self.ball_radius + height + noise
        return vertices, faces
