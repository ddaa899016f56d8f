"""What a powered robot knows of itself beyond its sensor frames, for the supervisor to act on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from bluefoot_mpc.io.findings import Finding
from bluefoot_mpc.io.safety.guard import GuardState


@dataclass(frozen=True, kw_only=True, slots=True)
class Health:
    """The state of devices, as of the newest frame.

    Attributes:
        power_on: what the power board says of the servos' supply; None where no board says anything.
        shut_down: joints (0..15) whose servo reports overload or overheating: it has switched its
            own torque off and would come back only by a new torque limit.
        restarted: joints whose servo lost its power and came back, with its registers at their
            defaults and its torque off. They stay listed until the robot is armed anew.
        silent: joints whose servo does not answer as it should: people are told, and the supervisor
            counts for itself when it has been too long.
        put_off: joints whose servo this period had no time to ask, on a slow adapter: not lost, only older.
        guard: what the guard on the bus thread does; None without one.
        watched: False when the watchdog process is gone; None without one.
        findings: anything else that people should know; those that refuse make the robot sit down.
    """

    power_on: bool | None = None
    shut_down: tuple[int, ...] = ()
    restarted: tuple[int, ...] = ()
    silent: tuple[int, ...] = ()
    put_off: tuple[int, ...] = ()
    guard: GuardState | None = None
    watched: bool | None = None
    findings: tuple[Finding, ...] = ()


@runtime_checkable
class Watched(Protocol):
    """A robot that can tell its health; asked once per step, from the control thread."""

    def health(self) -> Health:
        """The newest health; never blocks, never raises."""
        ...
