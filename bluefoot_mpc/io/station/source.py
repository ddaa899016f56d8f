"""One form for everything that commands: keyboard, gamepad, script and link are functions of time."""

from __future__ import annotations

from typing import Protocol

from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.safety import CommandWatchdog
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.types import MotionCommand

_GAP = 1.0
"""s; a shorter silence is a gap that radios have, a longer one a fault."""


class CommandSource(Protocol):
    """Wanted motion over time; the control loop asks once a tick."""

    def __call__(self, time: float, /) -> MotionCommand | None:
        """The command at `time` (s since the start of the run), or None to end the run."""
        ...


class LinkSource:
    """Commands of a ground station, as tame as their age makes them.

    Args:
        link: the station.
        watchdog: what old commands still mean.
        clock: that of the link; the time of the run plays no part.
    """

    def __init__(
        self, link: StationLink, watchdog: CommandWatchdog | None = None, clock: Clock | None = None
    ) -> None:
        self._link, self._watchdog = link, watchdog or CommandWatchdog()
        self._clock = clock or MonotonicClock()
        self._notice = ""

    def __call__(self, time: float) -> MotionCommand:
        """The station's command now."""
        wanted, age = self._link.command(self._clock.now())
        command = self._watchdog.step(wanted, age)
        if self._watchdog.notice != self._notice:
            self._notice = self._watchdog.notice
            if self._notice:
                self._link.say(self._notice, fault=age > _GAP)
        return command
