"""Counts of the AX-12A's registers as SI units and back; count 512 is the middle of its range.

Source: ROBOTIS e-manual, AX-12A: 300° over 1023 counts, 0.111 rpm a count,
bit 10 of speed and load is the direction (set: clockwise). Values are converted
as they are, never clipped: a measured nonsense stays visible.
"""

from __future__ import annotations

import math

from bluefoot_mpc.model.servo import FULL_DUTY, SPEED_UNIT

__all__ = [
    "DELAY_UNIT",
    "DIRECTION",
    "FULL_DUTY",
    "MIDDLE",
    "POSITION_UNIT",
    "SPEED_UNIT",
    "angle_from_counts",
    "baud_from_register",
    "counts_from_angle",
    "delay_from_register",
    "load_from_register",
    "register_from_baud",
    "register_from_speed",
    "register_from_torque_limit",
    "signed",
    "speed_from_register",
    "unsigned",
    "voltage_from_register",
]

MIDDLE = 512
"""Position count of the middle."""

POSITION_UNIT = math.radians(300.0) / 1023.0
"""Rad of one position count (0.293°)."""

DIRECTION = 1 << 10
"""Bit of the speed and load registers that is set for clockwise."""

DELAY_UNIT = 2e-6
"""s of one count of the return-delay register."""


def angle_from_counts(counts: float) -> float:
    """Angle from the middle, rad, counter-clockwise positive."""
    return (counts - MIDDLE) * POSITION_UNIT


def counts_from_angle(angle: float) -> int:
    """Nearest position count of an angle from the middle (rad), not limited to the servo's range."""
    return math.floor(angle / POSITION_UNIT + 0.5) + MIDDLE


def signed(value: int) -> int:
    """Speed or load register as a signed count, counter-clockwise positive."""
    return -(value & ~DIRECTION) if value & DIRECTION else value


def unsigned(count: int) -> int:
    """A signed count as the speed or load register holds it."""
    return (-count) | DIRECTION if count < 0 else count


def speed_from_register(value: int) -> float:
    """Present speed, rad/s, counter-clockwise positive."""
    return signed(value) * SPEED_UNIT


def register_from_speed(speed: float) -> int:
    """Moving-speed register for a speed limit (rad/s): a small one becomes 1, for 0 means *no limit*."""
    if speed == 0.0:
        return 0
    return int(min(max(math.floor(abs(speed) / SPEED_UNIT + 0.5), 1), FULL_DUTY))


def load_from_register(value: int) -> float:
    """Present load, fraction of full duty, counter-clockwise positive; the servo infers it from its duty."""
    return signed(value) / FULL_DUTY


def register_from_torque_limit(fraction: float) -> int:
    """Torque-limit register for a fraction of full duty, 0..1."""
    return math.floor(fraction * FULL_DUTY + 0.5)


def voltage_from_register(value: int) -> float:
    """V."""
    return value * 0.1


def baud_from_register(value: int) -> float:
    """bit/s of the baud-rate register."""
    return 2e6 / (value + 1)


def register_from_baud(baud: float) -> int:
    """Baud-rate register nearest to a rate in bit/s; 1 Mbit/s is 1."""
    return round(2e6 / baud) - 1


def delay_from_register(value: int) -> float:
    """Seconds of the return-delay register."""
    return value * DELAY_UNIT
