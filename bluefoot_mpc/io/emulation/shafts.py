"""The small protocol between an emulated servo and the joint that it turns.

An emulator owns registers; who owns the physics (a single joint of its own, or
all joints of a simulated robot) stands behind `Shafts`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

MIDDLE = 512
"""Position count of the middle of a servo's range."""
COUNT = math.radians(300.0) / 1023.0
"""rad of one position count (AX-12A e-manual)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ShaftDrive:
    """What a servo's registers ask of its motor.

    Attributes:
        enabled: torque enable; False is limp, whatever the rest says.
        goal: counts 0..1023; 512 is the middle.
        speed: counts of the moving-speed register, 0..1023, 0 = no limit; in wheel mode 0..2047, bit 10 = CW.
        torque_limit: 0..1023 of full duty.
        is_wheel: wheel mode: `speed` is a share of full duty, `goal` means nothing.
        margin: counts, compliance margins CW and CCW.
        slope: counts at full duty, compliance slopes CW and CCW: 2, 4, … 128.
        punch: 0..1023, least duty outside the margin.
    """

    enabled: bool = False
    goal: int = 512
    speed: int = 0
    torque_limit: int = 1023
    is_wheel: bool = False
    margin: tuple[int, int] = (1, 1)
    slope: tuple[int, int] = (32, 32)
    punch: int = 32


@dataclass(frozen=True, kw_only=True, slots=True)
class ShaftState:
    """What a servo can sense of its joint, not yet quantised.

    Attributes:
        angle: rad from the middle (count 512), counter-clockwise positive.
        speed: rad/s.
        load: duty of the motor, -1..1, counter-clockwise positive.
        temperature: °C.
        voltage: V at the servo.
    """

    angle: float
    speed: float
    load: float
    temperature: float
    voltage: float


class Shafts(Protocol):
    """Joints behind servos, by index from 0."""

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s); a time that is past changes nothing."""
        ...

    def drive(self, index: int, drive: ShaftDrive) -> None:
        """Let a servo's registers act from now on."""
        ...

    def state(self, index: int) -> ShaftState:
        """The joint as it is now."""
        ...
