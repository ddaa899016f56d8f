"""Laws of the AX-12A that simulator, controllers and drivers share.

Source: ROBOTIS' AX-12A e-manual (registers, compliance, punch). The servo drives
its motor with a duty cycle that grows with the position error, so at the shaft
``torque = duty * V / V_nominal * stall - back_emf * speed - friction``.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.types import FloatArray

SPEED_UNIT = 0.111 * 2.0 * math.pi / 60.0
"""rad/s of one count of the moving-speed and present-speed registers."""

FULL_DUTY = 1023.0
"""Counts of the punch, load and torque-limit registers at full duty."""

SHUTDOWN_TEMPERATURE = 70.0
"""°C at which the servo switches its torque off (register 11)."""


def to_counts(servo: ServoParameters, angle: FloatArray) -> FloatArray:
    """Angles (rad) as whole position counts, zero at the servo's centre, inside its range."""
    counts = np.floor(angle * (1.0 / servo.step_angle) + 0.5)
    half = servo.steps // 2
    # Two ufuncs: np.clip takes three times as long on a few numbers.
    return np.asarray(np.minimum(np.maximum(counts, -half), half - 1))


def to_angle(servo: ServoParameters, counts: FloatArray) -> FloatArray:
    """Position counts from the servo's centre as angles, rad."""
    return counts * servo.step_angle


def quantise_speed_limit(speed: FloatArray) -> FloatArray:
    """Moving-speed limits as the register holds them, rad/s.

    Zero means *no limit* to the servo, so a small positive limit becomes one
    count instead of zero.
    """
    counts = np.clip(np.floor(np.abs(speed) / SPEED_UNIT + 0.5), 1.0, FULL_DUTY)
    return np.where(speed == 0.0, 0.0, counts * SPEED_UNIT)


def duty(servo: ServoParameters, error: FloatArray, limit: FloatArray | float = 1.0) -> FloatArray:
    """Duty cycle for a position error.

    Nothing inside the compliance margin; outside, the ramp of the compliance
    slope starts at the punch.

    Args:
        servo: parameters.
        error: goal minus present position, counts.
        limit: torque limit, fraction of full duty.
    """
    beyond = np.abs(error) - servo.compliance_margin
    ramp = servo.punch / FULL_DUTY + beyond / servo.compliance_slope
    return np.where(beyond > 0.0, np.sign(error) * np.minimum(ramp, limit), 0.0)


def motor_torque(
    servo: ServoParameters, duty_cycle: FloatArray, speed: FloatArray, voltage: float
) -> FloatArray:
    """Torque of the motor at the output shaft before friction, N·m.

    Args:
        servo: parameters.
        duty_cycle: -1..1.
        speed: rad/s of the shaft.
        voltage: V at the servo.
    """
    return servo.stall_torque * voltage / servo.nominal_voltage * duty_cycle - servo.back_emf * speed


def current_per_torque(servo: ServoParameters) -> float:
    """Current in the winding per motor torque at the shaft, A/(N·m)."""
    return servo.stall_current / servo.stall_torque


def winding_resistance(servo: ServoParameters) -> float:
    """Resistance of the winding and its driver, Ω: nominal voltage over stall current."""
    return servo.nominal_voltage / servo.stall_current


def heat(servo: ServoParameters, temperature: FloatArray, loss: FloatArray, dt: float) -> FloatArray:
    """Temperatures (°C) after `dt` seconds of a winding loss (W): one exact first-order step."""
    settled = servo.ambient + servo.thermal_resistance * loss
    return settled + (temperature - settled) * math.exp(-dt / servo.thermal_time_constant)


def goal_for_torque(
    servo: ServoParameters, position: FloatArray, torque: FloatArray, speed: FloatArray | float = 0.0
) -> FloatArray:
    """Goal positions (rad) at which the servo makes `torque` at `position` and `speed`.

    The linear part of the law: no margin, friction or clamp.

    Args:
        servo: parameters.
        position: rad.
        torque: N·m wanted at the shaft.
        speed: rad/s of the shaft; its back-EMF is made up for.
    """
    return position + (torque + servo.back_emf * speed) / servo.stiffness


def torque_envelope(
    servo: ServoParameters, speed: FloatArray, voltage: float
) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest motor torque (N·m) that the voltage can make at a shaft speed (rad/s)."""
    stall = servo.stall_torque * voltage / servo.nominal_voltage
    lost = servo.back_emf * speed
    return -stall - lost, stall - lost
