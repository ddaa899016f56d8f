"""A ground station in a run: telemetry goes down, orders and perhaps motion come up."""

from __future__ import annotations

from typing import Protocol

from bluefoot_mpc.control.pipeline import ControlOutput
from bluefoot_mpc.io.safety import SafetyState
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.io.station.source import CommandSource, LinkSource
from bluefoot_mpc.types import Mode, MotionCommand, SafetyRequest, SensorFrame, TruthSample

LIMP = frozenset({"disarmed", "checking", "stopped", "emergency"})
"""States of the supervisor in which no torque is on."""
EMERGENCY = "emergency"


class Supervised(Protocol):
    """What a station wants to know of the safety supervisor, and may ask of it."""

    @property
    def state(self) -> SafetyState:
        """How far the robot may move."""
        ...

    @property
    def request(self) -> SafetyRequest:
        """What it has against going on."""
        ...

    def emergency(self, reason: str) -> None:
        """Torque off at once, from any thread."""
        ...


class StationedRun:
    """A ground station in a run: telemetry goes down, orders and perhaps motion come up.

    It is itself the source of commands, and an observer of the loop.

    Args:
        link: the station.
        own: the run's own commands; when they end, so does the run.
        leads: True where the station commands, as long as the run's own commands last.
        powered: True for robots that are disarmed for good by a stop: the run then ends.
        direct: True for robots that bear to be stopped by another thread than the loop's; for others
            (everything on a virtual clock) the loop itself does it, on its next tick.
    """

    def __init__(
        self,
        link: StationLink,
        own: CommandSource,
        *,
        leads: bool = False,
        powered: bool = False,
        direct: bool = False,
    ) -> None:
        self._link, self._own, self._powered, self._direct = link, own, powered, direct
        self._led = LinkSource(link) if leads else None
        self._supervisor: Supervised | None = None

    def attach(self, supervisor: Supervised) -> None:
        """Tell whose state is published, and who carries out an emergency stop."""
        self._supervisor = supervisor
        if self._direct:
            self._link.on_emergency(supervisor.emergency)

    def __call__(self, time: float) -> MotionCommand | None:
        """The command; none but rest once the operator has stopped the robot."""
        link = self._link
        if link.emergency_requested and self._supervisor is not None and self._state != EMERGENCY:
            self._supervisor.emergency("asked for by the ground station")
        if link.arm_requested:
            link.arm_done(self._refusal())
        if link.stop_requested or link.emergency_requested:
            return None if self._powered and self._state in LIMP else MotionCommand(mode=Mode.OFF)
        motion = self._own(time)
        return motion if motion is None or self._led is None else self._led(time)

    def observe(self, frame: SensorFrame, output: ControlOutput, truth: TruthSample | None) -> None:
        """Publish a tick; returns at once."""
        supervisor = self._supervisor
        reasons = supervisor.request.reasons if supervisor is not None else ()
        telemetry = output.telemetry
        if not self._powered and telemetry.mode is Mode.OFF and not output.command.torque_limit.any():
            self._link.publish(telemetry, frame, "disarmed", reasons)
        else:
            self._link.publish(telemetry, frame, self._state, reasons)

    @property
    def _state(self) -> str:
        return "" if self._supervisor is None else str(self._supervisor.state)

    def _refusal(self) -> str:
        """Why the robot cannot be armed now; empty where it is."""
        if self._state in LIMP:
            return f"this run is over ({self._state}); start it again to arm the robot"
        return ""
