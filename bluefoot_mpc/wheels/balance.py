"""A two-wheeled robot that balances: it sees through noisy sensors, and follows a twist.

Encoders, gyro and accelerometer feed a Kalman filter of the tilting body; a
linear-quadratic regulator turns its estimate and the reference into motor
torques (the structure of the second document's picture after Ooi, 2003). The
body moves by the full equations, in small steps.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.balance_config import BalanceConfig
from bluefoot_mpc.wheels.balance_sensing import BalanceFilter, Imu
from bluefoot_mpc.wheels.drive import DriveState, WheelDrive
from bluefoot_mpc.wheels.ready import READY, balancing
from bluefoot_mpc.wheels.regulator import discrete_lqr, discretised
from bluefoot_mpc.wheels.robot import WheeledRobot, checked
from bluefoot_mpc.wheels.wheel import rolling_row

_PHYSICS_STEP = 1e-3  # s, at most


class BalancingDrive:
    """Drives the balancing robot; the same `step` as `WheelDrive`.

    Attributes:
        robot: its two wheels.
        config: body, sensors, regulator.
        state: after the last step.
        body_state: (4,) truth: axle's path m, speed m/s, tilt rad, tilt rate rad/s.
        estimate: (4,) the same, as the Kalman filter has it.
    """

    def __init__(
        self, robot: WheeledRobot | None = None, config: BalanceConfig | None = None, seed: int = 0
    ) -> None:
        self.config = config or BalanceConfig()
        self.robot = robot or balancing(radius=self.config.body.wheel_radius)
        self._half_track = _half_track(self.robot, self.config.body.wheel_radius)
        self._seed = seed
        body = self.config.body
        self._gain = discrete_lqr(
            *discretised(*body.linear(), self.config.period),
            np.diag(self.config.state_weights), np.array([[self.config.torque_weight]]),
        )[0]  # fmt: skip
        lever = self._half_track / body.wheel_radius
        damping = body.friction * lever**2 / self.config.yaw_inertia
        yaw = np.array([[0.0, 1.0], [0.0, -damping]]), np.array([[0.0], [lever / self.config.yaw_inertia]])
        self._yaw_damping, self._yaw_effort = damping, lever / self.config.yaw_inertia
        self._yaw_gain = discrete_lqr(
            *discretised(*yaw, self.config.period),
            np.diag(self.config.yaw_weights), np.array([[self.config.yaw_torque_weight]]),
        )[0]  # fmt: skip
        self.reset()

    def reset(self) -> None:
        """Upright and at rest, with the sensors' errors drawn anew from the same seed."""
        self._imu = Imu(self.config, np.random.default_rng(self._seed))
        self._filter = BalanceFilter(self.config)
        self.body_state = np.zeros(4)
        self._yaw = np.zeros(2)  # heading rad, yaw rate rad/s
        self._reference = np.zeros(4)  # path m, speed m/s, heading rad, yaw rate rad/s
        self._torques = np.zeros(2)  # N·m: sum, and right less left
        self._until_control = 0.0
        self.state = self._state(np.zeros(2), np.zeros(2), fallen=False)

    @property
    def estimate(self) -> FloatArray:
        """(4,) the filter's estimate of `body_state`."""
        return self._filter.state[:4].copy()

    @property
    def motor_torque(self) -> FloatArray:
        """(2,) N·m of the left and the right motor."""
        total, difference = self._torques.tolist()
        return 0.5 * np.array([total - difference, total + difference])

    def push(self, impulse: float) -> None:
        """Strike the body's centre of mass forward with an impulse (N·s)."""
        body, tilt = self.config.body, float(self.body_state[2])
        coupling = body.body_mass * body.body_height * math.cos(tilt)
        mass = [[body.rolling_mass, coupling], [coupling, body.tilting_inertia]]
        lever = body.body_height * math.cos(tilt)
        change = np.linalg.solve(mass, [impulse, impulse * lever])
        self.body_state = self.body_state + np.array([0.0, change[0], 0.0, change[1]])

    def step(self, wanted: FloatArray, dt: float) -> DriveState:
        """Balance for `dt` (s) on the way to a wanted twist.

        Args:
            wanted: (3,) m/s forward, m/s left (it cannot), rad/s, robot's frame.
            dt: s, any.

        Raises:
            ConfigurationError: a number is not finite, or `dt` is not positive.
        """
        require_positive(dt=dt)
        twist = checked(wanted, 3, f"wanted twist of robot '{self.robot.name}'", "m/s, m/s, rad/s")
        if self.state.fallen:
            return self.state
        before = np.array([self.body_state[0], self._yaw[0]])
        left = dt
        while left > 1e-9:
            if self._until_control <= 1e-9:
                self._control(twist)
                self._until_control = self.config.period
            step = min(_PHYSICS_STEP, left, self._until_control)
            self._advance(step)
            left -= step
            self._until_control -= step
            if abs(self.body_state[2]) > self.config.fall_angle:
                self.body_state = self.body_state * np.array([1.0, 0.0, 1.0, 0.0])
                self._yaw[1] = 0.0
                self.state = self._state(self.state.wheel_angle, self._moved(before), fallen=True)
                return self.state
        self.state = self._state(self.state.wheel_angle, self._moved(before), fallen=False)
        return self.state

    def _moved(self, before: FloatArray) -> FloatArray:
        return np.array([self.body_state[0], self._yaw[0]]) - before

    def _state(self, turned: FloatArray, moved: FloatArray, *, fallen: bool) -> DriveState:
        speed, rate = float(self.body_state[1]), float(self._yaw[1])
        return DriveState(
            twist=np.array([speed, 0.0, rate]),
            wheel_speed=self._wheels(speed, rate),
            wheel_angle=turned + self._wheels(*moved.tolist()),
            steering=np.zeros(2),
            tilt=float(self.body_state[2]),
            fallen=fallen,
        )

    def _wheels(self, ahead: float, turn: float) -> FloatArray:
        """(2,) what both wheels turn for a way ahead and a turn, or for their rates."""
        across = self._half_track * turn
        return np.array([ahead - across, ahead + across]) / self.config.body.wheel_radius

    def _advance(self, dt: float) -> None:
        """Body and yaw by one step of physics."""
        self.body_state = self.config.body.advanced(self.body_state, float(self._torques[0]), dt)
        heading, rate = self._yaw.tolist()
        push = self._yaw_effort * float(self._torques[1])
        decay = math.exp(-self._yaw_damping * dt)
        share = dt if self._yaw_damping == 0.0 else (1.0 - decay) / self._yaw_damping
        later = decay * rate + share * push
        self._yaw = np.array([heading + 0.5 * dt * (rate + later), later])

    def _control(self, wanted: FloatArray) -> None:
        """Read the sensors, estimate, and set the torques for the next period."""
        config = self.config
        total = float(self._torques[0])
        wheels = self._wheels(float(self.body_state[0]), float(self._yaw[0])) - self.body_state[2]
        reading = self._imu.read(self.body_state, float(self._yaw[1]), wheels, total)
        x = self._filter.step(reading, total)
        heading = 0.5 * config.body.wheel_radius * float(reading.encoders[1] - reading.encoders[0])
        heading /= self._half_track
        self._lead(wanted, float(x[0]), heading)
        path, speed, aim, rate = self._reference.tolist()
        error = np.array([x[0] - path, x[1] - speed, x[2], x[3]])
        hold = config.body.friction * speed / config.body.wheel_radius
        turn = -float(self._yaw_gain @ [heading - aim, reading.yaw_rate - rate])
        turn += self._yaw_damping / self._yaw_effort * rate
        limit = 2.0 * config.torque_limit
        total = max(-limit, min(limit, hold - float(self._gain @ error)))
        spare = limit - abs(total)  # to stay upright comes first
        self._torques = np.array([total, max(-spare, min(spare, turn))])

    def _lead(self, wanted: FloatArray, path: float, heading: float) -> None:
        """Move the reference on by one period, within its limits and not far ahead of the robot."""
        config, dt = self.config, self.config.period
        _, speed, _, rate = self._reference.tolist()
        aim = max(-config.max_speed, min(config.max_speed, float(wanted[0])))
        turn = max(-config.max_yaw_rate, min(config.max_yaw_rate, float(wanted[2])))
        most, most_turn = config.max_acceleration * dt, config.max_yaw_acceleration * dt
        speed += max(-most, min(most, aim - speed))
        rate += max(-most_turn, min(most_turn, turn - rate))
        ahead, left = self._reference[[0, 2]] + dt * np.array([speed, rate])
        lag = config.max_lag
        self._reference = np.array(
            [
                max(path - lag, min(path + lag, ahead)), speed,
                max(heading - lag, min(heading + lag, left)), rate,
            ]
        )  # fmt: skip


def make_drive(kind: str, seed: int = 0) -> WheelDrive | BalancingDrive:
    """A drive for a ready robot, by its name.

    Args:
        kind: of `bluefoot_mpc.wheels.ready.READY`.
        seed: of the noise of a balancing robot's sensors.

    Raises:
        UnknownNameError: there is no such robot.
    """
    if kind not in READY:
        raise UnknownNameError("robot on wheels", kind, READY)
    return BalancingDrive(seed=seed) if kind == "balancing" else WheelDrive(READY[kind]())


def _half_track(robot: WheeledRobot, radius: float) -> float:
    """Half the distance of the two wheels (m).

    Raises:
        ConfigurationError: the robot is not a pair of fixed wheels of this radius on one axle through P.
    """
    expected = balancing(robot.wheels[0].length or 1.0, radius)
    alike = len(robot.wheels) == 2 and all(
        w.kind == "fixed" and np.allclose(rolling_row(w), rolling_row(e)) and w.radius == radius
        for w, e in zip(robot.wheels, expected.wheels, strict=True)
    )
    if not alike:
        raise ConfigurationError(
            f"robot '{robot.name}' cannot balance: two fixed wheels on one axle through P, left then right, "
            f"with the body's wheel radius of {radius} m are wanted, as `ready.balancing` makes them"
        )
    return robot.wheels[0].length
