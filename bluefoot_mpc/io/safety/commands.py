"""The watchdog over the operator: what an old command still means.

Ages are measured on the robot's monotonic clock, from when a command arrived,
so a jump of anybody's wall clock changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import Mode, MotionCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class CommandWatchdogConfig:
    """How old a command may be, and what it means after that."""

    rest_after: float = 0.3  # s; older: no velocity
    stand_after: float = 1.0  # s; older: stand
    sit_after: float = 5.0  # s; older: sit
    off_after: float = 30.0  # s; older: torque off

    def __post_init__(self) -> None:
        require_positive(rest_after=self.rest_after)
        ages = (self.rest_after, self.stand_after, self.sit_after, self.off_after)
        if sorted(set(ages)) != list(ages):
            raise ConfigurationError(f"ages must rise from rest to off, not {ages}")


class CommandWatchdog:
    """Makes a command tamer the older it is; it never makes a robot stand up or walk.

    Attributes:
        notice: what it makes of the command and why; empty while the command is fresh.

    Args:
        config: ages.
    """

    def __init__(self, config: CommandWatchdogConfig | None = None) -> None:
        self._config = config or CommandWatchdogConfig()
        self.notice = ""

    def step(self, command: MotionCommand, age: float) -> MotionCommand:
        """What a command of this age still means.

        Args:
            command: the newest command of the operator.
            age: s since it arrived, on the robot's clock; NaN, or a time still to come, counts as for ever.
        """
        config = self._config
        # Clocks of one machine never differ by more than rounding: what comes from the future is wrong.
        if not age >= -1e-6:
            age = np.inf
        if age <= config.rest_after:
            self.notice = ""
            return command
        if age <= config.stand_after:
            self.notice = f"no command for {config.rest_after:g} s: no velocity"
            return replace(command, velocity=np.zeros(2), yaw_rate=0.0, guide=None)
        if age <= config.sit_after:
            self.notice = f"no command for {config.stand_after:g} s: stand"
            return MotionCommand(mode=_tamer(command.mode, Mode.STAND), gait=command.gait)
        if age <= config.off_after:
            self.notice = f"no command for {config.sit_after:g} s: sit"
            return MotionCommand(mode=_tamer(command.mode, Mode.SIT), gait=command.gait)
        self.notice = f"no command for {config.off_after:g} s: torque off"
        return MotionCommand(mode=Mode.OFF, gait=command.gait)


_TAMENESS = {Mode.WALK: 0, Mode.STAND: 1, Mode.SIT: 2, Mode.SAFE: 3, Mode.OFF: 4}


def _tamer(one: Mode, other: Mode) -> Mode:
    return max(one, other, key=_TAMENESS.__getitem__)
