"""What the safety supervisor asks for."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class SafetyLevel(enum.IntEnum):
    """How far the supervisor wants the robot to step back; higher is more urgent."""

    NONE = 0
    HOLD = 1
    SIT = 2
    STOP = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyRequest:
    """What the supervisor asks of the controller on the next tick.

    Attributes:
        level: how far to step back.
        reasons: one sentence each, naming cause and evidence.
    """

    level: SafetyLevel = SafetyLevel.NONE
    reasons: tuple[str, ...] = ()
