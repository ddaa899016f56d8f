"""The body as it is planned: configuration and velocity of trunk and joints behind the references."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.types import N_JOINTS, FloatArray, PostureReference

_NQ, _NV = 7 + N_JOINTS, 6 + N_JOINTS


class PlannedBody:
    """Follows the references from tick to tick and differentiates them.

    b' is taken as an inertial frame for the tick: positions are in it, and
    velocities are those over the ground, in its axes.

    Attributes:
        q: (23,) trunk position in b' (m), quaternion xyzw, joints (rad).
        v: (22,) trunk twist in its own axes (m/s, rad/s), joints (rad/s).

    Args:
        servo: the joints' servos; what they cannot follow is no planned speed.
    """

    def __init__(self, servo: ServoParameters) -> None:
        self._fastest = servo.no_load_speed
        self._twist = np.zeros((2, 3))  # over the ground, in axes of b'
        self.reset()

    def reset(self) -> None:
        """Forget the last reference."""
        self.q = np.zeros(_NQ)
        self.q[6] = 1.0
        self.v = np.zeros(_NV)
        self._last: tuple[FloatArray, FloatArray, FloatArray] | None = None

    @property
    def joint_speed(self) -> FloatArray:
        """(16,) rad/s, planned joint speeds."""
        return self.v[6:]

    def step(self, gait: GaitOutput, reference: PostureReference, joints: FloatArray, dt: float) -> None:
        """Take the references of a tick.

        Args:
            gait: the motion of b'.
            reference: wanted trunk and feet.
            joints: (16,) rad, joint angles that reach them.
            dt: s.
        """
        place, rpy = reference.trunk_position, reference.trunk_rpy
        self.q[:3], self.q[3:7], self.q[7:] = place, quaternion_from_rpy(rpy), joints
        if self._last is not None:
            last_place, last_rpy, last_joints = self._last
            (x, y, _), rate = place.tolist(), gait.yaw_rate
            forward, left = gait.velocity.tolist()
            over_ground, turning = self._twist
            over_ground[:] = place - last_place
            # Trunk angles are small: their rates are taken for the angular velocity.
            turning[:] = rpy - last_rpy
            self._twist /= dt
            over_ground += (forward - rate * y, left + rate * x, 0.0)
            turning[2] += rate
            np.dot(self._twist, rotation_from_rpy(rpy), out=self.v[:6].reshape(2, 3))
            speed = (joints - last_joints) / dt
            self.v[6:] = np.minimum(np.maximum(speed, -self._fastest), self._fastest)
        self._last = (place, rpy, joints)
