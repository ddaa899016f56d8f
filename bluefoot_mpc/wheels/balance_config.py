"""What a balancing robot is made of: body, sensors, regulator."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.wheels.pendulum import WheeledPendulum


@dataclass(frozen=True, kw_only=True, slots=True)
class BalanceSensors:
    """Errors of the sensors on the body."""

    gyro_noise: float = 0.01  # rad/s, standard deviation of a sample
    gyro_bias: float = 0.02  # rad/s, bound of the constant bias, drawn evenly
    accelerometer_noise: float = 0.1  # m/s²
    accelerometer_bias: float = 0.03  # m/s², bound
    accelerometer_height: float = 0.05  # m above the axle
    encoder_steps: int = 1440  # per turn of the wheel against the body

    def __post_init__(self) -> None:
        require_nonnegative(
            gyro_noise=self.gyro_noise, gyro_bias=self.gyro_bias, accelerometer_bias=self.accelerometer_bias,
            accelerometer_noise=self.accelerometer_noise,
        )  # fmt: skip
        require_positive(encoder_steps=self.encoder_steps)


@dataclass(frozen=True, kw_only=True, slots=True)
class BalanceConfig:
    """Body, sensors and regulator of a balancing robot."""

    body: WheeledPendulum = field(default_factory=WheeledPendulum)
    sensors: BalanceSensors = field(default_factory=BalanceSensors)
    yaw_inertia: float = 0.006  # kg·m², of the whole robot, with the wheels' rotation
    torque_limit: float = 0.35  # N·m, of each motor
    period: float = 0.005  # s, of the controller
    max_speed: float = 0.5  # m/s, reference
    max_acceleration: float = 0.5  # m/s², reference
    max_yaw_rate: float = 2.0  # rad/s, reference
    max_yaw_acceleration: float = 4.0  # rad/s²
    max_lag: float = 0.2  # m, and rad of heading, that the reference runs ahead
    fall_angle: float = 1.0  # rad, tilt at which it lies on the floor
    state_weights: tuple[float, float, float, float] = (8.0, 2.0, 20.0, 0.5)
    torque_weight: float = 20.0
    yaw_weights: tuple[float, float] = (4.0, 0.2)
    yaw_torque_weight: float = 20.0

    def __post_init__(self) -> None:
        require_positive(
            yaw_inertia=self.yaw_inertia, torque_limit=self.torque_limit, period=self.period,
            max_speed=self.max_speed, max_acceleration=self.max_acceleration, max_yaw_rate=self.max_yaw_rate,
            max_yaw_acceleration=self.max_yaw_acceleration, max_lag=self.max_lag, fall_angle=self.fall_angle,
            torque_weight=self.torque_weight, yaw_torque_weight=self.yaw_torque_weight,
        )  # fmt: skip
        if not 0.0 < self.fall_angle < math.pi / 2.0:
            raise ConfigurationError(f"fall_angle = {self.fall_angle} rad must be below pi/2")
