"""What follows from a powered robot's own account of its health."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.io.safety.faults import Fault, Response
from bluefoot_mpc.io.safety.guard import GuardState
from bluefoot_mpc.io.safety.health import Health
from bluefoot_mpc.types import JOINTS, N_JOINTS, BoolArray


class HealthMonitor:
    """Judges the robot's own account.

    Attributes:
        dead: (16,) servos that must not get torque back before the robot is armed anew.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget every fault."""
        self.dead: BoolArray = np.zeros(N_JOINTS, dtype=bool)
        self._without_power = 0.0
        self._had_power = False

    def step(self, health: Health, dt: float) -> list[Fault]:
        """Judge an account that came `dt` (s) after the last one."""
        faults = [
            *self._lost(health.shut_down, "switched off by itself (overload or overheating)", "Let it cool"),
            *self._lost(health.restarted, "back after a loss of power, without torque", "Check the plug"),
        ]
        self._had_power = self._had_power or health.power_on is True
        self._without_power = self._without_power + dt if health.power_on is False else 0.0
        if self._without_power > (0.0 if self._had_power else _POWER_ON_TIME):
            text = "the power board has switched the servos off. Check its switch and fuse, then arm anew"
            faults.append(Fault(key="power", response=Response.EMERGENCY, text=text))
        if health.guard in _GUARDED:
            faults.append(Fault(key=f"guard {health.guard}", response=_GUARDED[health.guard], text=_AWAY))
        for key, who in _named(health.silent):
            text = f"{who} not answering as expected. Check plugs and adapter"
            faults.append(Fault(key=f"silent {key}", response=Response.WARN, text=text))
        if health.watched is False:
            text = "the watchdog beside the robot's program is gone. Sit the robot down and start anew"
            faults.append(Fault(key="watchdog", response=Response.SIT, text=text))
        for finding in health.findings:
            if finding.severity >= Severity.WARNING:
                refused = finding.severity is Severity.REFUSAL
                response = Response.SIT if refused else Response.WARN
                key = f"{finding.part} {response.name}"
                faults.append(Fault(key=key, response=response, text=str(finding)))
        return faults

    def _lost(self, joints: tuple[int, ...], what: str, mend: str) -> list[Fault]:
        self.dead[list(joints)] = True
        return [
            Fault(
                key=f"{what} {key}", response=Response.STOP, text=f"{who} {what}: no torque. {mend}, arm anew"
            )
            for key, who in _named(joints)
        ]


def _named(joints: tuple[int, ...]) -> list[tuple[str, str]]:
    """Keys and subjects of messages: one for each servo, or one for all where there are many."""
    if len(joints) > _MANY:
        return [("many", f"{len(joints)} of {N_JOINTS} servos are")]
    return [(str(joint), f"servo {JOINTS[joint]} is") for joint in joints]


_MANY = 4
"""Servos that are named one by one."""
_POWER_ON_TIME = 0.5
"""s after arming within which the board must say that the servos' supply is on."""
_GUARDED = {GuardState.SINK: Response.STOP, GuardState.OFF: Response.EMERGENCY}
_AWAY = (
    "the control thread was away for too long: the guard below it lowers the robot and switches it off. "
    "Look for what keeps the machine busy"
)
