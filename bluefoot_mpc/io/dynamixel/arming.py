"""Torque on, in the one order that is safe, and torque off, whatever happens.

On: read where each joint is, make that its goal with a low torque limit, enable,
and read everything back. A write to goal position may switch torque on by itself
(not in the manuals, treated as true): so the limit is written first of all.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence

from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.checks import CheckConfig, check_servos
from bluefoot_mpc.io.dynamixel.errors import EepromRefusedError, LatchedError, ServoError
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.dynamixel.units import register_from_torque_limit
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity
from bluefoot_mpc.io.link import LinkError
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.types import N_JOINTS

__all__ = ["CheckConfig", "arm", "check_servos", "torque_off"]

log = logging.getLogger(__name__)

OFF_REPEATS = 3
OFF_PAUSE = 0.002
"""Seconds between two broadcasts: longer than a reply with which one of them may collide."""

HOLD_TOLERANCE = 12
"""Counts (3.5°) by which a joint may have moved between reading it and enabling it: it hangs or settles."""

_ENABLE = AX12A["torque_enable"]
_GOAL = AX12A["goal_position"]
_SPEED = AX12A["moving_speed"]
_LIMIT = AX12A["torque_limit"]
_PRESENT = AX12A["present_position"]


def arm(
    buses: Sequence[ServoBus],
    layout: ServoLayout,
    torque_limit: float,
    joints: Iterable[int] | None = None,
    speed: int = 0,
) -> None:
    """Hold every joint where it is, with a low torque limit. The latch must have been released.

    Args:
        buses: the ports, in the order of the layout's indices.
        layout: which servo drives which joint.
        torque_limit: fraction of stall torque.
        joints: those to arm; all where not given.
        speed: moving-speed register, counts, 0 = unlimited.

    Raises:
        NotArmedError: a servo refused, or the latch closed meanwhile; every torque is off again.
    """
    require_range(0.0, 1.0, torque_limit=torque_limit)
    chosen = range(N_JOINTS) if joints is None else tuple(joints)
    limit = register_from_torque_limit(torque_limit)
    for joint in chosen:
        bus = buses[layout.ports[joint]]
        try:
            finding = _arm_one(bus, layout, joint, limit, speed)
        except (ServoError, LinkError, LatchedError, EepromRefusedError) as error:
            finding = _refusal(layout.part(joint), str(error), "")
        if finding is not None:
            raise NotArmedError([finding, *_problems(torque_off(buses, layout))])


def _arm_one(bus: ServoBus, layout: ServoLayout, joint: int, limit: int, speed: int) -> Finding | None:
    """Arm one servo; what is wrong with it, or None.

    Raises:
        ServoError, LatchedError, LinkLostError: it does not answer, refuses, or must not move.
    """
    servo, part = layout.ids[joint], layout.part(joint)
    present = bus.read(servo, _PRESENT)
    if not _GOAL.low <= present <= _GOAL.high:
        return _refusal(part, f"present position {present} is no count of an AX-12A", "Replace it")
    bus.write_verified(servo, _LIMIT, limit)
    bus.write_verified(servo, _SPEED, speed)
    bus.write_verified(servo, _GOAL, present)
    bus.write_verified(servo, _ENABLE, 1)
    block = bus.read_block(servo, _ENABLE.address, _PRESENT.end - _ENABLE.address)
    held = {_ENABLE: 1, _GOAL: present, _SPEED: speed, _LIMIT: limit}
    for register, value in held.items():
        found = register.decode(block, _ENABLE.address)
        if found != value:
            text = f"{register.name.replace('_', ' ')} is {found} after arming instead of {value}"
            return _refusal(part, text, "Look at its error bits, then at its cable")
    moved = _PRESENT.decode(block, _ENABLE.address) - present
    if abs(moved) > HOLD_TOLERANCE:
        return _refusal(
            part, f"it moved by {moved} counts while it was enabled", "Hold the robot still and retry"
        )
    return None


def torque_off(buses: Sequence[ServoBus], layout: ServoLayout) -> list[Finding]:
    """Take torque from every servo: three broadcasts, then register 24 of each. Never raises.

    Returns:
        A finding for each servo that is not known to be limp, or one that says that all are.
    """
    findings = broadcast_off(buses)
    for joint in range(N_JOINTS):
        if layout.ports[joint] < len(buses):
            findings += _verify_off(buses[layout.ports[joint]], layout.ids[joint], layout.part(joint))
    return findings or [Finding(part="servos", text="torque is off, each one asked")]


def broadcast_off(buses: Sequence[ServoBus]) -> list[Finding]:
    """Torque off to all, three times, without asking back; from any thread. Never raises."""
    findings: dict[str, Finding] = {}
    for repeat in range(OFF_REPEATS):
        for bus in buses:
            try:
                if repeat:
                    bus.clock.sleep_until(bus.clock.now() + OFF_PAUSE)
                bus.broadcast(_ENABLE, 0)
            except LinkError as error:
                mend = "Cut the servos' power: they hold their torque until then"
                findings[bus.name] = _refusal(f"port {bus.name}", f"torque off cannot be sent: {error}", mend)
    return list(findings.values())


def _verify_off(bus: ServoBus, servo: int, part: str) -> list[Finding]:
    mend = "Cut the servos' power"
    try:
        if bus.read(servo, _ENABLE) == 0:
            return []
        # It did not hear three broadcasts: once more, to it alone.
        bus.write_verified(servo, _ENABLE, 0)
    except (ServoError, LinkError) as error:
        return [_refusal(part, f"it is not known whether its torque is off: {error}", mend)]
    return []


def _problems(findings: Iterable[Finding]) -> list[Finding]:
    return [finding for finding in findings if finding.severity is Severity.REFUSAL]


def _refusal(part: str, text: str, mend: str) -> Finding:
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)
