# SPDX-License-Identifier: Apache-2.0
"""A perspective camera that frames a set of points, z up."""

import numpy as np


class Camera:
    """Looks at the middle of `points` (N,3) from `azimuth` and `elevation` (degrees; azimuth 0 = from +x).

    field_of_view: vertical, degrees; small ones flatten. size: (width, height) in pixels. All points are in view.
    """

    def __init__(self, points, size, azimuth=-60.0, elevation=24.0, field_of_view=24.0, margin=1.04):
        self.size = size
        a, e = np.radians([azimuth, elevation])
        self.backward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        self.right = np.array([-np.sin(a), np.cos(a), 0.0])
        self.up = np.cross(self.backward, self.right)
        axes = np.stack([self.right, self.up, self.backward])
        tangent = np.tan(np.radians(field_of_view) / 2) / margin
        aspect = size[0] / size[1]
        seen = np.asarray(points, dtype=np.float64) @ axes.T
        # Each point must lie between the side planes of the view: |x - eye_x| <= across * (eye_z - z). The eye is
        # where the tightest of these, taken for all points, meet; the same for y.
        x, y, z = seen.T
        across = tangent * aspect
        right, left = np.max(x + across * z), np.min(x - across * z)
        top, bottom = np.max(y + tangent * z), np.min(y - tangent * z)
        distance = max((right - left) / (2 * across), (top - bottom) / (2 * tangent))
        distance = max(distance, z.max() + 1e-6 * (1 + abs(z.max())))
        self.eye = axes.T @ np.array([(right + left) / 2, (top + bottom) / 2, distance])
        self._axes = axes
        self._scale = size[1] / (2 * np.tan(np.radians(field_of_view) / 2))

    def project(self, points):
        """(N,3) -> (N,3): x right and y down in pixels, and the distance from the eye along the view."""
        local = (np.asarray(points, dtype=np.float64) - self.eye) @ self._axes.T
        depth = -local[:, 2]
        x = self.size[0] / 2 + self._scale * local[:, 0] / depth
        y = self.size[1] / 2 - self._scale * local[:, 1] / depth
        return np.stack([x, y, depth], axis=1)


class LightCamera:
    """Parallel projection along `direction` (towards the light) that covers `points`: for shadow maps."""

    def __init__(self, points, direction, resolution):
        direction = np.asarray(direction, dtype=np.float64)
        self.direction = direction / np.linalg.norm(direction)
        helper = np.array([1.0, 0.0, 0.0]) if abs(self.direction[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        right = np.cross(helper, self.direction)
        right /= np.linalg.norm(right)
        self._axes = np.stack([right, np.cross(self.direction, right), -self.direction])
        local = np.asarray(points) @ self._axes.T
        self._low = local.min(axis=0)
        self.extent = float((local[:, :2].max(axis=0) - self._low[:2]).max()) or 1.0
        self._scale = (resolution - 3) / self.extent
        self.size = (resolution, resolution)

    def project(self, points):
        """(N,3) -> (N,3): pixel x and y of the map, and depth from the light."""
        local = np.asarray(points) @ self._axes.T - self._low
        local[:, :2] = local[:, :2] * self._scale + 1.5
        return local
