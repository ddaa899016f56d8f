"""One millisecond of servo motors side by side: the law of `bluefoot_mpc.model.servo` on arrays.

Source: ROBOTIS' AX-12A e-manual (compliance margin, slope, punch, torque limit).
Arrays are made once and written in place: numpy on sixteen numbers costs what
its calls cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.io.emulation.shafts import MIDDLE, ShaftDrive
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import FULL_DUTY, SPEED_UNIT, current_per_torque, winding_resistance
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

STEP = 1e-3
"""s, physics step."""

_NO_RAMP = 1e9
_LOAD_FRICTION_SPEED = 0.5
"""rad/s at which the load-dependent friction has halved, as in the simulator."""
_HEAT_STEPS = 20


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
    """One joint of its own. Slope, margin and punch are the registers', not the parameters'."""

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


class ShaftBank:
    """Motors and joints as arrays (n,), one supply.

    Attributes:
        angle: rad.
        speed: rad/s.
        duty: share of the supply voltage on each motor, -1..1.
        torque: N·m, motor torque after back-EMF, before friction.
        temperature: °C.
        voltage: V at the servos.
        open_voltage: V of the supply without load.
        still: steps in a row in which nothing moved and no goal was on its way.
    """

    def __init__(self, configs: Sequence[ShaftConfig], supply: Supply) -> None:
        n = len(configs)
        self.angle = np.array([c.angle for c in configs])
        self.speed, self.duty, self.torque = np.zeros(n), np.zeros(n), np.zeros(n)
        self.voltage = self.open_voltage = supply.voltage
        self.still = 0
        self._resistance = supply.resistance
        self._standby = n * supply.standby_current
        self._set_constants(configs)
        self.temperature = self._ambient.copy()
        self._goal, self._profile, self._play = np.zeros(n), np.zeros(n), np.zeros(n)
        self._ramp = np.full(n, _NO_RAMP)
        self._limit, self._live, self._punch = np.zeros(n), np.zeros(n), np.zeros(n)
        self._wheel_duty = np.full(n, np.nan)
        self._has_wheels = False
        self._margin = np.ones((2, n))
        self._slope = np.full((2, n), 1.0 / 32.0)
        self._is_lopsided = False
        self._implicit = np.ones(n)
        self._scale = np.zeros(n)
        self._loss_sum = np.zeros(n)
        self._loss_steps = 0
        self._a, self._b, self._c = np.zeros(n), np.zeros(n), np.zeros(n)
        # Constants as arrays: numpy takes longer over a Python number.
        self._zero, self._half, self._one = np.zeros(n), np.full(n, 0.5), np.ones(n)
        self._dt, self._fading = np.full(n, STEP), np.full(n, 1.0 / _LOAD_FRICTION_SPEED)
        self._mask = np.zeros(n, dtype=np.bool_)
        self._drives = [ShaftDrive()] * n
        self._is_underway = True
        for index in range(n):
            self._set_gains(index, ShaftDrive())

    def apply(self, i: int, drive: ShaftDrive) -> None:
        """Take the registers of joint `i`."""
        self.still = 0
        before, self._drives[i] = self._drives[i], drive
        if drive.enabled and not before.enabled:
            # A servo that is switched on starts its ramp from where it stands.
            self._profile[i] = np.floor(self.angle[i] * self._counts_per_rad[i] + 0.5)
        self._goal[i] = drive.goal - MIDDLE
        self._is_underway = True
        if drive.speed != before.speed or drive.is_wheel:
            ramp = (drive.speed & 1023) * (SPEED_UNIT * STEP) * self._counts_per_rad[i]
            self._ramp[i] = ramp if drive.speed and not drive.is_wheel else _NO_RAMP
        if drive.is_wheel or _gains(drive) != _gains(before):
            self._set_gains(i, drive)

    def _set_gains(self, i: int, drive: ShaftDrive) -> None:
        """Everything of the registers but goal and moving speed."""
        live = 1.0 if drive.enabled else 0.0
        self._live[i] = live
        self._limit[i] = live * drive.torque_limit / FULL_DUTY
        self._wheel_duty[i] = self._free_running(drive) if drive.is_wheel else np.nan
        self._has_wheels = not bool(np.isnan(self._wheel_duty).all())
        self._margin[:, i] = drive.margin
        self._slope[0, i] = self._gain[i] / drive.slope[0]
        self._slope[1, i] = self._gain[i] / drive.slope[1]
        is_alike = np.array_equal(*self._margin) and np.array_equal(*self._slope)
        self._is_lopsided = not is_alike
        self._punch[i] = drive.punch / FULL_DUTY
        # An open bridge carries no current, so a limp servo does not brake.
        damping = self._viscous[i] + live * self._back_emf[i]
        self._implicit[i] = 1.0 / (1.0 + self._step_per_inertia[i] * damping)
        self._scale[i] = self._step_per_inertia[i] * self._implicit[i]

    def step(self) -> None:
        """One millisecond of all joints."""
        a, b, c = self._a, self._b, self._c
        angle, speed, duty, torque = self.angle, self.speed, self.duty, self.torque
        self._follow()
        # Error in counts, of the position as the servo's own converter sees it.
        np.multiply(angle, self._counts_per_rad, out=a)
        np.add(a, self._half, out=a)
        np.floor(a, out=a)
        np.subtract(self._profile, a, out=a)
        self._duty_of(a)
        np.multiply(duty, self._stall_per_volt, out=a)
        np.multiply(a, self.voltage, out=a)
        np.multiply(speed, self._back_emf, out=b)
        np.subtract(a, b, out=torque)
        np.multiply(torque, self._live, out=torque)
        if self._has_backlash:
            self._disengage(a)
        friction = self._friction()
        if self._has_gravity:
            a -= self._gravity * np.sin(angle - self._gravity_angle)
        # Damping implicitly, then as much friction as stops the joint and no more.
        np.multiply(a, self._scale, out=a)
        np.multiply(speed, self._implicit, out=b)
        np.add(a, b, out=a)
        np.multiply(friction, self._scale, out=c)
        np.abs(a, out=b)
        np.subtract(b, c, out=b)
        np.maximum(b, self._zero, out=b)
        np.copysign(b, a, out=speed)
        np.multiply(speed, self._dt, out=b)
        np.add(angle, b, out=angle)
        self.still = 0 if self._is_underway or speed.any() else self.still + 1
        self._draw()

    def rest(self, steps: int) -> None:
        """Let time pass while everything stands still: only heat flows."""
        self._heat()
        self._warm(self._loss * self.torque**2, steps * STEP)

    def _set_constants(self, configs: Sequence[ShaftConfig]) -> None:
        servos = [c.servo for c in configs]
        column = np.array
        self._counts_per_rad = column([1.0 / s.step_angle for s in servos])
        self._gain = column([c.gain for c in configs])
        self._stall_per_volt = column([s.stall_torque / s.nominal_voltage for s in servos])
        self._speed_per_volt = column([s.no_load_speed / s.nominal_voltage for s in servos])
        self._back_emf = column([s.back_emf for s in servos])
        self._viscous = column([s.viscous_friction for s in servos])
        self._coulomb = column([s.coulomb_friction for s in servos])
        self._load_friction = column([s.load_friction for s in servos])
        inertia = column([s.armature + c.load_inertia for s, c in zip(servos, configs, strict=True)])
        self._step_per_inertia = STEP / inertia
        self._gravity = column([c.gravity for c in configs])
        self._gravity_angle = column([c.gravity_angle for c in configs])
        self._has_gravity = bool(self._gravity.any())
        self._half_play = np.radians([0.5 * s.backlash_deg for s in servos])
        self._has_backlash = bool(self._half_play.any())
        self._current_per_torque = column([current_per_torque(s) for s in servos])
        self._loss = column([winding_resistance(s) * current_per_torque(s) ** 2 for s in servos])
        self._cooling = column([-1.0 / s.thermal_time_constant for s in servos])
        self._thermal_resistance = column([s.thermal_resistance for s in servos])
        self._ambient = column([s.ambient for s in servos])

    def _free_running(self, drive: ShaftDrive) -> float:
        """Duty in wheel mode: the speed register is a share of full duty, bit 10 turns clockwise."""
        share = min(drive.speed & 1023, drive.torque_limit) / FULL_DUTY if drive.enabled else 0.0
        return -share if drive.speed & 1024 else share

    def _follow(self) -> None:
        """Move the goals that the motors see towards those of the registers, at the moving speed."""
        if not self._is_underway:
            return
        np.subtract(self._profile, self._ramp, out=self._a)
        np.add(self._profile, self._ramp, out=self._b)
        np.maximum(self._goal, self._a, out=self._a)
        np.minimum(self._a, self._b, out=self._profile)
        self._is_underway = not np.array_equal(self._profile, self._goal)

    def _duty_of(self, error: FloatArray) -> None:
        """Twin of `bluefoot_mpc.model.servo.duty`, with registers of each joint and side.

        A goal that lies counter-clockwise of the joint uses the CCW registers.
        """
        duty, beyond = self.duty, self._b
        margin, slope = self._margin[0], self._slope[0]
        if self._is_lopsided:
            ccw = error > 0.0
            margin, slope = np.where(ccw, self._margin[1], margin), np.where(ccw, self._slope[1], slope)
        np.abs(error, out=beyond)
        np.subtract(beyond, margin, out=beyond)
        np.greater(beyond, self._zero, out=self._mask)
        np.multiply(beyond, slope, out=beyond)
        np.add(beyond, self._punch, out=beyond)
        np.minimum(beyond, self._limit, out=beyond)
        np.multiply(beyond, self._mask, out=beyond)
        np.copysign(beyond, error, out=duty)
        if self._has_wheels:
            np.copyto(duty, self._wheel_duty, where=~np.isnan(self._wheel_duty))

    def _friction(self) -> FloatArray:
        """Dry friction (N·m): Coulomb, and near standstill a share of the transmitted torque."""
        b, c = self._b, self._c
        np.multiply(self.speed, self._fading, out=b)
        np.multiply(b, b, out=b)
        np.add(b, self._one, out=b)
        np.abs(self.torque, out=c)
        np.multiply(c, self._load_friction, out=c)
        np.divide(c, b, out=c)
        np.add(c, self._coulomb, out=c)
        return c

    def _disengage(self, drive: FloatArray) -> None:
        """Pass on nothing while a pinion lies between its gear's flanks.

        A rotor without load runs at the drive's no-load speed, so it crosses the
        gap at the difference to the output's speed.
        """
        half = self._half_play
        moved = self._play + STEP * (self._speed_per_volt * self.voltage * self.duty - self.speed)
        self._play = np.minimum(np.maximum(moved, -half), half)
        engaged = np.abs(moved) >= half
        self.torque *= engaged
        # What the damping takes is given back where nothing is passed on.
        np.copyto(drive, self.torque + self._live * self._back_emf * self.speed)

    def _draw(self) -> None:
        """Supply's voltage under the motors' current, and their heat."""
        np.multiply(self.duty, self.torque, out=self._a)
        np.maximum(self._a, self._zero, out=self._a)
        drawn = self._standby + float(self._a.dot(self._current_per_torque))
        self.voltage = max(0.0, self.open_voltage - self._resistance * drawn)
        np.multiply(self.torque, self.torque, out=self._b)
        np.add(self._loss_sum, self._b, out=self._loss_sum)
        self._loss_steps += 1
        if self._loss_steps >= _HEAT_STEPS:
            self._heat()

    def _heat(self) -> None:
        """Temperatures after the steps summed up."""
        if self._loss_steps:
            self._warm(self._loss * self._loss_sum / self._loss_steps, self._loss_steps * STEP)
            self._loss_sum[:] = 0.0
            self._loss_steps = 0

    def _warm(self, loss: FloatArray, seconds: float) -> None:
        """One exact first-order step under a loss (W)."""
        settled = self._ambient + self._thermal_resistance * loss
        self.temperature = settled + (self.temperature - settled) * np.exp(self._cooling * seconds)


def _gains(drive: ShaftDrive) -> tuple[object, ...]:
    """What changes rarely."""
    return drive.enabled, drive.torque_limit, drive.is_wheel, drive.margin, drive.slope, drive.punch
