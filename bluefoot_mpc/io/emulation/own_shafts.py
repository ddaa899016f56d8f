"""Single joints for emulated servos: a motor on the bench, each with parameters of its own.

The law is that of `bluefoot_mpc.model.servo` (AX-12A e-manual: compliance slope,
margin and punch), with a rotor that has inertia, dry and viscous friction, and
optionally a weight on a lever. Steps of 1 ms; friction is solved implicitly, so
a joint that sticks stands still exactly.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.shafts import ShaftDrive, ShaftState
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import FULL_DUTY, SPEED_UNIT, current_per_torque, winding_resistance
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

STEP = 1e-3
"""s, physics step."""

MIDDLE = 512
"""Position count of angle zero."""

_REST_CHECK = 64
"""Steps after which joints that stand still are no longer stepped, only cooled."""
_NO_RAMP = 1e9
_LOAD_FRICTION_SPEED = 0.1
"""rad/s at which the load-dependent friction has halved."""


def bench_servo() -> ServoParameters:
    """The AX-12A at 12 V with the friction of its identified neighbours (estimates)."""
    return ServoParameters(
        stall_torque=1.5, no_load_speed=6.178, nominal_voltage=12.0, steps=1024, range_deg=300.0,
        compliance_slope=32.0, compliance_margin=1.0, punch=32.0, armature=0.0035, coulomb_friction=0.05,
        viscous_friction=0.005, load_friction=0.15, backlash_deg=0.0, stall_current=1.5,
        thermal_resistance=8.0, thermal_time_constant=300.0, ambient=25.0,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class ShaftConfig:
    """One joint of its own."""

    servo: ServoParameters = field(default_factory=bench_servo)
    gain: float = 1.0  # factor on the duty per count of error
    load_inertia: float = 0.0  # kg·m² on the shaft besides the rotor
    gravity: float = 0.0  # N·m that a weight on the shaft makes when its lever is level
    gravity_angle: float = 0.0  # rad at which the weight hangs straight down
    latency: float = 0.0  # s from a register's change to the motor
    angle: float = 0.0  # rad at the start

    def __post_init__(self) -> None:
        require_positive(gain=self.gain)
        require_nonnegative(load_inertia=self.load_inertia, latency=self.latency)
        require_finite(gravity=self.gravity, gravity_angle=self.gravity_angle, angle=self.angle)


@dataclass(frozen=True, kw_only=True, slots=True)
class Supply:
    """What feeds all joints together."""

    voltage: float = 12.0  # V without load
    resistance: float = 0.06  # Ω
    standby_current: float = 0.05  # A of each servo

    def __post_init__(self) -> None:
        require_positive(voltage=self.voltage)
        require_nonnegative(resistance=self.resistance, standby_current=self.standby_current)


class OwnShafts:
    """Joints of their own behind emulated servos, advanced lazily.

    Args:
        joints: how many equal joints, or one configuration for each.
        supply: what feeds them.
    """

    def __init__(self, joints: int | Sequence[ShaftConfig], supply: Supply | None = None) -> None:
        configs = [ShaftConfig() for _ in range(joints)] if isinstance(joints, int) else list(joints)
        if not configs:
            raise ConfigurationError("shafts without a joint: give at least one")
        self.configs = tuple(configs)
        self.supply = supply or Supply()
        n = len(configs)
        self._set_constants(configs)
        self._angle = np.array([c.angle for c in configs])
        self._speed = np.zeros(n)
        self._duty = np.zeros(n)
        self._torque = np.zeros(n)
        self._temperature = self._ambient.copy()
        self._voltage = self.supply.voltage
        self._open_voltage = self.supply.voltage
        self._profile = np.zeros(n)
        self._drives: list[ShaftDrive] = [ShaftDrive() for _ in configs]
        self._waiting: deque[tuple[float, int, ShaftDrive]] = deque()
        self._time: float | None = None  # of the newest step
        self._asked = 0.0
        self._still = 0
        self._allocate(n)

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s); the first call sets where time begins."""
        if self._time is None:
            self._time = self._asked = time
            return
        if time <= self._asked:
            return
        self._asked = time
        while self._time + STEP <= time:
            if self._waiting and self._waiting[0][0] <= self._time:
                self._apply_waiting(self._time)
            if self._still >= _REST_CHECK:
                self._rest(time)
                continue
            self._step()
            self._time += STEP

    def drive(self, index: int, drive: ShaftDrive) -> None:
        """Let a servo's registers act, after the joint's latency."""
        latency = self.configs[index].latency
        if latency == 0.0:
            self._apply(index, drive)
            return
        self._waiting.append((self._asked + latency, index, drive))
        if len(self._waiting) > 1 and self._waiting[-2][0] > self._waiting[-1][0]:
            self._waiting = deque(sorted(self._waiting, key=lambda entry: entry[0]))

    def state(self, index: int) -> ShaftState:
        """The joint now, between two steps by its speed."""
        speed = float(self._speed[index])
        behind = 0.0 if self._time is None else self._asked - self._time
        return ShaftState(
            angle=float(self._angle[index]) + speed * behind,
            speed=speed,
            load=float(self._duty[index]),
            temperature=float(self._temperature[index]),
            voltage=self._voltage,
        )

    def set_supply(self, voltage: float) -> None:
        """Change the supply's voltage (V) without load."""
        require_nonnegative(voltage=voltage)
        self._open_voltage = voltage
        self._still = 0

    def set_temperature(self, index: int, temperature: float) -> None:
        """Put a motor to a temperature, °C."""
        self._temperature[index] = temperature

    def turn(self, index: int, angle: float) -> None:
        """Put a joint to an angle (rad), at rest, as a hand would."""
        self._angle[index] = angle
        self._speed[index] = 0.0
        self._still = 0

    def torque(self, index: int) -> float:
        """Motor torque now, N·m, after back-EMF and before friction."""
        return float(self._torque[index])

    def _set_constants(self, configs: Sequence[ShaftConfig]) -> None:
        servos = [c.servo for c in configs]

        def column(values: list[float]) -> FloatArray:
            return np.array(values, dtype=np.float64)

        self._counts_per_rad = column([1.0 / s.step_angle for s in servos])
        self._gain = column([c.gain for c in configs])
        self._stall_per_volt = column([s.stall_torque / s.nominal_voltage for s in servos])
        self._back_emf = column([s.back_emf for s in servos])
        self._viscous = column([s.viscous_friction for s in servos])
        self._coulomb = column([s.coulomb_friction for s in servos])
        self._load_friction = column([s.load_friction for s in servos])
        inertia = column([s.armature + c.load_inertia for s, c in zip(servos, configs, strict=True)])
        self._step_per_inertia = STEP / inertia
        self._gravity = column([c.gravity for c in configs])
        self._gravity_angle = column([c.gravity_angle for c in configs])
        self._has_gravity = bool(np.any(self._gravity != 0.0))
        self._current_per_torque = column([current_per_torque(s) for s in servos])
        self._loss = column([winding_resistance(s) * current_per_torque(s) ** 2 for s in servos])
        self._cooling = column([-1.0 / s.thermal_time_constant for s in servos])
        self._thermal_resistance = column([s.thermal_resistance for s in servos])
        self._ambient = column([s.ambient for s in servos])

    def _allocate(self, n: int) -> None:
        """Registers as arrays, and space to work in."""
        self._goal = np.zeros(n)
        self._ramp = np.full(n, _NO_RAMP)
        self._limit = np.zeros(n)
        self._live = np.zeros(n)
        self._wheel_duty = np.zeros(n)
        self._wheels = False
        self._margin = np.ones((2, n))
        self._slope = np.full((2, n), 1.0 / 32.0)
        self._punch = np.zeros(n)
        self._damping = self._viscous.copy()
        self._implicit = 1.0 / (1.0 + self._step_per_inertia * self._damping)
        self._loss_sum = np.zeros(n)
        self._loss_steps = 0
        for index, drive in enumerate(self._drives):
            self._apply(index, drive)

    def _apply_waiting(self, time: float) -> None:
        while self._waiting and self._waiting[0][0] <= time:
            _, index, drive = self._waiting.popleft()
            self._apply(index, drive)

    def _apply(self, i: int, drive: ShaftDrive) -> None:
        """Registers of joint `i` as numbers that a step works with."""
        before, self._drives[i] = self._drives[i], drive
        self._still = 0
        live = drive.enabled
        self._goal[i] = drive.goal - MIDDLE
        if live and not before.enabled:
            # A servo that is switched on starts its ramp from where it stands.
            self._profile[i] = math.floor(self._angle[i] * self._counts_per_rad[i] + 0.5)
        if live == before.enabled and replace(drive, goal=before.goal) == before:
            return
        self._live[i] = live
        self._limit[i] = drive.torque_limit / FULL_DUTY if live else 0.0
        ramp = drive.speed * SPEED_UNIT * STEP * self._counts_per_rad[i]
        self._ramp[i] = ramp if drive.speed else _NO_RAMP
        share = min((drive.speed & 1023) / FULL_DUTY, drive.torque_limit / FULL_DUTY)
        self._wheel_duty[i] = (-share if drive.speed & 1024 else share) if drive.is_wheel and live else np.nan
        self._wheels = not bool(np.all(np.isnan(self._wheel_duty)))
        self._margin[:, i] = drive.margin
        self._slope[:, i] = self._gain[i] / np.array(drive.slope, dtype=np.float64)
        self._punch[i] = drive.punch / FULL_DUTY
        # An open bridge carries no current, so a limp servo does not brake.
        self._damping[i] = self._viscous[i] + (self._back_emf[i] if live else 0.0)
        self._implicit[i] = 1.0 / (1.0 + self._step_per_inertia[i] * self._damping[i])

    def _step(self) -> None:
        """One millisecond of all joints."""
        angle, speed, live = self._angle, self._speed, self._live
        self._profile = np.minimum(
            np.maximum(self._goal, self._profile - self._ramp), self._profile + self._ramp
        )
        error = self._profile - np.floor(angle * self._counts_per_rad + 0.5)
        duty = self._duty = self._duty_of(error)
        drive = (self._stall_per_volt * self._voltage) * duty
        torque = self._torque = live * (drive - self._back_emf * speed)
        friction = self._coulomb + self._load_friction * np.abs(torque) / (
            1.0 + (speed * (1.0 / _LOAD_FRICTION_SPEED)) ** 2
        )
        if self._has_gravity:
            drive = drive - self._gravity * np.sin(angle - self._gravity_angle)
        scale = self._step_per_inertia * self._implicit
        free = speed * self._implicit + drive * scale
        slowed = np.abs(free) - friction * scale
        new = self._speed = np.where(slowed > 0.0, np.copysign(slowed, free), 0.0)
        angle += STEP * new
        self._still = 0 if new.any() or (self._profile != self._goal).any() else self._still + 1
        drawn = float(np.dot(self._current_per_torque, np.maximum(duty * torque, 0.0)))
        supply = self.supply
        self._voltage = max(
            0.0, self._open_voltage - supply.resistance * (drawn + len(duty) * supply.standby_current)
        )
        self._loss_sum += torque * torque
        self._loss_steps += 1
        if self._loss_steps >= 20:
            self._heat()

    def _duty_of(self, error: FloatArray) -> FloatArray:
        """Twin of `bluefoot_mpc.model.servo.duty` with margins, slopes and punch of each joint and side.

        A goal that lies counter-clockwise of the joint uses the CCW registers.
        """
        ccw = error > 0.0
        beyond = np.abs(error) - np.where(ccw, self._margin[1], self._margin[0])
        ramp = self._punch + beyond * np.where(ccw, self._slope[1], self._slope[0])
        duty = np.where(beyond > 0.0, np.copysign(np.minimum(ramp, self._limit), error), 0.0)
        if self._wheels:
            duty = np.where(np.isnan(self._wheel_duty), duty, self._wheel_duty)
        return duty * self._live

    def _heat(self) -> None:
        """Temperatures after the steps summed up: one exact first-order step."""
        seconds = self._loss_steps * STEP
        loss = self._loss * self._loss_sum / self._loss_steps
        self._warm(loss, seconds)
        self._loss_sum[:] = 0.0
        self._loss_steps = 0

    def _warm(self, loss: FloatArray, seconds: float) -> None:
        settled = self._ambient + self._thermal_resistance * loss
        self._temperature = settled + (self._temperature - settled) * np.exp(self._cooling * seconds)

    def _rest(self, time: float) -> None:
        """All joints stand still and nothing changes: only heat flows, until `time` or the next change."""
        now = self._time or 0.0
        until = min(time, self._waiting[0][0]) if self._waiting else time
        steps = max(1, math.floor((until - now) / STEP + 1e-9))
        if self._loss_steps:
            self._heat()
        self._warm(self._loss * self._torque**2, steps * STEP)
        self._time = now + steps * STEP
