"""A wheeled robot in motion: lagging motors, limited speeds, wheels that take time to steer.

The motion is always one that the wheels permit at the angles they have: it is
the part of the wanted one in the null space of C1, and wheel speeds follow from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.constraints import free_twists, rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.robot import WheeledRobot, checked
from bluefoot_mpc.wheels.steered import SteeredSet
from bluefoot_mpc.wheels.wheel import castor_rate, rolling_row

_CASTOR_STEP = 0.2
"""Largest swing of a castor in one step of integration, as a share of its time constant."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DriveLimits:
    """What motors and steering can do."""

    time_constant: float = 0.08  # s, wheel speed after a change of what is wanted; 0 is none
    wheel_speed: float = 20.0  # rad/s, of driven wheels; more is scaled down, all wheels alike
    wheel_acceleration: float = 200.0  # rad/s², of driven wheels
    steering_rate: float = 3.0  # rad/s

    def __post_init__(self) -> None:
        require_nonnegative(time_constant=self.time_constant)
        require_positive(
            wheel_speed=self.wheel_speed, wheel_acceleration=self.wheel_acceleration,
            steering_rate=self.steering_rate,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class DriveState:
    """What the robot does after a step.

    Attributes:
        twist: (3,) m/s forward, m/s left, rad/s, robot's frame; no wheel slips or slides with it.
        wheel_speed: (n,) rad/s.
        wheel_angle: (n,) rad turned since the start.
        steering: (n,) rad, turns of wheels that turn, castors too; 0 for others.
        tilt: rad, nose-down, of a robot that balances; 0 for others.
        fallen: whether a robot that balances has fallen.
    """

    twist: FloatArray
    wheel_speed: FloatArray
    wheel_angle: FloatArray
    steering: FloatArray
    tilt: float = 0.0
    fallen: bool = False


class WheelDrive:
    """Drives a robot that stands on its wheels.

    Attributes:
        robot: its wheels.
        limits: of motors and steering.
        state: after the last step.

    Raises:
        ConfigurationError: the robot's fixed wheels allow no motion, or no wheel is driven.
    """

    def __init__(self, robot: WheeledRobot, limits: DriveLimits | None = None) -> None:
        self.robot = robot
        self.limits = limits or DriveLimits()
        self._scale = np.array([1.0, 1.0, robot.size])
        self._fixed = sliding_matrix(robot, kinds=("fixed",))
        if free_twists(self._fixed, robot.size).shape[1] == 0:
            raise ConfigurationError(
                f"robot '{robot.name}' cannot move: the axes of its fixed wheels do not meet in one point "
                "(rank of C1 is 3); put them on one axle, or use steered wheels, castors or Swedish wheels"
            )
        self._driven = np.array([wheel.driven for wheel in robot.wheels])
        if not self._driven.any():
            raise ConfigurationError(f"robot '{robot.name}' has no driven wheel: set driven=True for one")
        self._radii = np.array([wheel.drive_radius for wheel in robot.wheels])
        self.reset()

    def reset(self) -> None:
        """Stand still with straight wheels, as after construction."""
        n = len(self.robot.wheels)
        self._steered = SteeredSet(self.robot)
        self.state = DriveState(
            twist=np.zeros(3), wheel_speed=np.zeros(n), wheel_angle=np.zeros(n), steering=np.zeros(n)
        )
        self._lay(self.state.steering)

    def step(self, wanted: FloatArray, dt: float) -> DriveState:
        """Move on by `dt` (s) towards a wanted twist.

        Args:
            wanted: (3,) m/s forward, m/s left, rad/s, robot's frame. What the wheels do not permit is
                left out (the nearest permitted twist counts), and what is too fast is scaled down whole.
            dt: s.

        Raises:
            ConfigurationError: a number is not finite, or `dt` is not positive.
        """
        require_positive(dt=dt)
        twist = checked(wanted, 3, f"wanted twist of robot '{self.robot.name}'", "m/s, m/s, rad/s")
        before = self.state
        steering = before.steering
        if self._steered.wheels:
            steering, free = self._steered.advance(twist, steering, self.limits.steering_rate * dt)
            self._lay(steering, free)
        aim = self._limited(self._project(twist))
        kept = self._limited(self._project(before.twist))
        share = 1.0 if self.limits.time_constant == 0.0 else -math.expm1(-dt / self.limits.time_constant)
        change = share * (aim - kept)
        fastest = self._fastest(change)
        most = self.limits.wheel_acceleration * dt
        now = kept + (change if fastest <= most else change * (most / fastest))
        steering = self._swung(steering, now, dt)
        speed = self._rolling @ now / self._radii
        self.state = DriveState(
            twist=now,
            wheel_speed=speed,
            wheel_angle=before.wheel_angle + 0.5 * dt * (before.wheel_speed + speed),
            steering=steering,
        )
        return self.state

    def _lay(self, steering: FloatArray, free: FloatArray | None = None) -> None:
        """Constraints at these angles."""
        if free is None:
            free = free_twists(sliding_matrix(self.robot, steering), self.robot.size)
        self._basis = free * self._scale[:, None]
        self._rolling = rolling_matrix(self.robot, steering)

    def _project(self, twist: FloatArray) -> FloatArray:
        """(3,) the nearest twist that the wheels permit."""
        return np.asarray(self._basis @ (self._basis.T @ (self._scale * twist)) / self._scale)

    def _fastest(self, twist: FloatArray) -> float:
        """Speed of the fastest driven wheel (rad/s)."""
        return float(np.abs(self._rolling @ twist / self._radii)[self._driven].max())

    def _limited(self, twist: FloatArray) -> FloatArray:
        """(3,) the twist, slower where a driven wheel would turn too fast; its direction stays."""
        fastest = self._fastest(twist)
        return twist if fastest <= self.limits.wheel_speed else twist * (self.limits.wheel_speed / fastest)

    def _swung(self, steering: FloatArray, twist: FloatArray, dt: float) -> FloatArray:
        """(n,) steering with castors swung on by `dt`, in steps short against their own time constant."""
        castors = self.robot.indices("castor")
        if not castors:
            return steering
        angles = steering.copy()
        for index in castors:
            wheel = self.robot.wheels[index]
            fastest = math.hypot(twist[0], twist[1]) + (wheel.length + abs(wheel.offset)) * abs(
                float(twist[2])
            )
            steps = max(1, math.ceil(dt * fastest / abs(wheel.offset) / _CASTOR_STEP))
            for _ in range(steps):
                middle = angles[index] + 0.5 * dt / steps * castor_rate(wheel, twist, float(angles[index]))
                angles[index] += dt / steps * castor_rate(wheel, twist, float(middle))
            self._rolling[index] = rolling_row(wheel, float(angles[index]))
        return angles
