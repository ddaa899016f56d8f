"""Virtual robot: a frame on the ground that moves exactly as commanded.

Its frame is the robot-relative frame b'. Planar vectors are complex numbers,
x + iy, so that a rotation is a product.
"""

from __future__ import annotations

import cmath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]


class VirtualPose(NamedTuple):
    """Pose of the virtual robot in the world of the odometry start.

    Attributes:
        centre: x + iy, m.
        yaw: rad, not wrapped.
    """

    centre: complex = 0j
    yaw: float = 0.0

    def to_world(self, point: complex) -> complex:
        """A point of b' in world coordinates."""
        return self.centre + cmath.rect(1.0, self.yaw) * point

    def to_local(self, point: complex) -> complex:
        """A point of the world in b' coordinates."""
        return (point - self.centre) * cmath.rect(1.0, -self.yaw)

    def from_frame(self, other: VirtualPose, points: ComplexArray) -> ComplexArray:
        """Points in the b' of `other`, any shape, m, in this b'."""
        shift = (other.centre - self.centre) * cmath.rect(1.0, -self.yaw)
        return np.asarray(shift + cmath.rect(1.0, other.yaw - self.yaw) * points)

    def moved(self, velocity: complex, yaw_rate: float, dt: float) -> VirtualPose:
        """The pose after a constant twist, integrated exactly.

        Args:
            velocity: m/s in the heading frame (b').
            yaw_rate: rad/s.
            dt: s.
        """
        step = velocity * dt * chord(yaw_rate * dt)
        return VirtualPose(
            centre=self.centre + cmath.rect(1.0, self.yaw) * step, yaw=self.yaw + yaw_rate * dt
        )


def chord(angle: float) -> complex:
    """Displacement over path length while turning by `angle`: (e^{iφ} - 1) / (iφ)."""
    if abs(angle) < 1e-4:
        return complex(1.0 - angle * angle / 6.0, 0.5 * angle)
    return (cmath.rect(1.0, angle) - 1.0) / complex(0.0, angle)


def carried(point: complex, velocity: complex, yaw_rate: float, time: float) -> complex:
    """Where a point fixed in b' will be after `time`, in the b' of now."""
    angle = yaw_rate * time
    return velocity * time * chord(angle) + cmath.rect(1.0, angle) * point


def point_velocity(point: complex, velocity: complex, yaw_rate: float) -> complex:
    """Velocity over ground of a point fixed in b', m/s in b'."""
    return velocity + complex(0.0, yaw_rate) * point
