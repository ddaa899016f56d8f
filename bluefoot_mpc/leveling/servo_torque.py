"""What torque the servos made: their own law on the goals that were in force."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import duty, motor_torque
from bluefoot_mpc.types import N_JOINTS, FloatArray


class ServoTorque:
    """Remembers goals until they reach the servos, and gives the torque that followed.

    Args:
        servo: parameters.
        delay: command periods from sending a goal to the servo's acting on it.
    """

    def __init__(self, servo: ServoParameters, delay: int) -> None:
        self._servo = servo
        self._goals = np.zeros((delay + 1, N_JOINTS))
        self._before = np.zeros(N_JOINTS)
        self.reset()

    def reset(self) -> None:
        """Forget goals and positions."""
        self._goals[:] = 0.0
        self._before[:] = 0.0
        self._sent = 0
        self._seen = False

    def torque(self, position: FloatArray, speed: FloatArray, voltage: float) -> FloatArray | None:
        """(16,) N·m, motor torque over the period that just ended; None while the goals in it are unknown.

        Args:
            position: (16,) rad, joints now.
            speed: (16,) rad/s, joints now.
            voltage: V at the servos.
        """
        known = self._seen and self._sent >= len(self._goals)
        made = None
        if known:
            middle = 0.5 * (self._before + position)
            counts = (self._goals[0] - middle) / self._servo.step_angle
            made = motor_torque(self._servo, duty(self._servo, counts), speed, voltage)
        self._before[:] = position
        self._seen = True
        return made

    def send(self, goals: FloatArray) -> None:
        """Take the (16,) rad goals that are sent now."""
        self._goals[:-1] = self._goals[1:]
        self._goals[-1] = goals
        self._sent = min(self._sent + 1, len(self._goals))
