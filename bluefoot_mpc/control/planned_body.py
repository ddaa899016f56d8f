"""The body as it is planned: configuration and velocity of trunk and joints behind the references."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import FloatArray, PostureReference


class PlannedBody:
    """Follows the references from tick to tick and differentiates them.

    Attributes:
        q: (23,) trunk position in b' (m), quaternion xyzw, joints (rad).
        joint_speed: (16,) rad/s, planned joint speeds.

    Args:
        geometry: the legs.
    """

    def __init__(self, geometry: LegGeometry) -> None:
        self._fastest = 12.0
        self.reset()

    def reset(self) -> None:
        """Forget the last reference."""
        self.q = np.zeros(23)
        self.joint_speed = np.zeros(16)
        self._joints: FloatArray | None = None

    def step(self, reference: PostureReference, joints: FloatArray, dt: float) -> None:
        """Take the references of a tick.

        Args:
            reference: wanted trunk and feet.
            joints: (16,) rad, joint angles that reach them.
            dt: s.
        """
        self.q[:3] = reference.trunk_position
        self.q[3:7] = quaternion_from_rpy(reference.trunk_rpy)
        self.q[7:] = joints
        if self._joints is not None:
            speed = (joints - self._joints) / dt
            self.joint_speed = np.minimum(np.maximum(speed, -self._fastest), self._fastest)
        self._joints = joints
