"""What torque the servos made over the last period: by the load they report, or by the goals they had."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import duty, motor_torque
from bluefoot_mpc.types import N_JOINTS, FloatArray


class ServoTorque:
    """Gives the torque of the period that just ended, servo by servo.

    A reported load is the motor's duty cycle, whatever the latency of goals. A
    servo that reports none is taken to follow its own law on the goal that was
    in force, one latency old.

    Args:
        servo: parameters.
        delay: command periods from sending a goal to the servo's acting on it.
    """

    def __init__(self, servo: ServoParameters, delay: int) -> None:
        self._servo = servo
        self._goals = np.full((delay + 1, N_JOINTS), np.nan)
        self._position = np.full(N_JOINTS, np.nan)
        self._load = np.full(N_JOINTS, np.nan)

    def reset(self) -> None:
        """Forget goals, positions and loads."""
        for memory in (self._goals, self._position, self._load):
            memory[...] = np.nan

    def torque(self, position: FloatArray, load: FloatArray, voltage: float, dt: float) -> FloatArray | None:
        """(16,) N·m, mean motor torque over the period that just ended; None while one is unknown.

        Args:
            position: (16,) rad, joints now.
            load: (16,) duty as reported now, NaN where no report came.
            voltage: V at the servos.
            dt: s, length of the period.
        """
        servo = self._servo
        middle = 0.5 * (self._position + position)
        speed = (position - self._position) / dt
        driven = 0.5 * (self._load + load)
        silent = np.isnan(driven)
        if silent.any():
            # The servo's law answers zero to an error that is no number.
            error = (self._goals[0] - middle) / servo.step_angle
            driven = np.where(silent, np.where(np.isnan(error), np.nan, duty(servo, error)), driven)
        self._position[:], self._load[:] = position, load
        made = motor_torque(servo, driven, speed, voltage)
        return made if np.isfinite(made).all() else None

    def send(self, goals: FloatArray) -> None:
        """Take the (16,) rad goals that are sent now."""
        self._goals[:-1] = self._goals[1:]
        self._goals[-1] = goals
