"""What must hold before a servo gets torque from a commissioning command, and why none answers."""

from __future__ import annotations

from collections.abc import Sequence

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import servo_ids
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.commissioning.survey import Survey, find_bauds, survey
from bluefoot_mpc.io.dynamixel.arming import CheckConfig, check_servos
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.findings import Finding, NotArmedError, Severity


def check_ids(
    ports: ServoPorts, ids: Sequence[int], config: CheckConfig | None = None, found: Survey | None = None
) -> list[Finding]:
    """Findings on servos by ID, before torque; writes nothing.

    Args:
        ports: where they hang.
        ids: which ones, of 1..16.
        config: what is asked of them.
        found: where each answers; looked up where not given.

    Raises:
        ConfigurationError: an ID that belongs to no joint.
        LinkLostError: a port is gone.
    """
    robot = servo_ids()
    strange = [servo for servo in ids if servo not in robot]
    if strange:
        raise ConfigurationError(
            f"--ids: {strange[0]} belongs to no joint; this command works on {robot[0]}..{robot[-1]}. "
            "Give the servo one of these: bluefoot servo setup --new-id"
        )
    found = found or survey(ports, ids)
    findings = check_servos(ports.buses, layout_of(ports, found), config, [robot.index(s) for s in ids])
    return [*findings, *silence(ports, ids, found), *answering_twice(found)]


def require_sound(ports: ServoPorts, ids: Sequence[int], config: CheckConfig | None = None) -> Survey:
    """The servos, all fit to get torque.

    Raises:
        NotArmedError: one is not; names servo, finding and mend.
    """
    found = survey(ports, ids)
    findings = check_ids(ports, ids, config, found)
    if any(finding.severity is Severity.REFUSAL for finding in findings):
        raise NotArmedError(findings)
    return found


def layout_of(ports: ServoPorts, found: Survey) -> ServoLayout:
    """Ports of the robot's servos as they answered; the first port for those that did not."""
    names = [bus.name for bus in ports.buses]
    where = [found.servos[s].port if s in found.servos else names[0] for s in servo_ids()]
    return ServoLayout(ids=servo_ids(), ports=tuple(names.index(name) for name in where))


def silence(ports: ServoPorts, ids: Sequence[int], found: Survey) -> list[Finding]:
    """Where no servo answers at all: whether they do at another baud rate."""
    if found.servos or found.garbled:
        return []
    part = " and ".join(f"port {bus.name}" for bus in ports.buses)
    bauds = {baud: heard for baud, heard in find_bauds(ports, ids).items() if baud != ports.baud}
    if not bauds:
        text = f"no servo answers on IDs {ids[0]}..{ids[-1]}, at no standard baud rate"
        mend = "Switch the servos' power on, check the adapter and the cable to the first servo"
        return [Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)]
    baud, heard = max(bauds.items(), key=lambda entry: len(entry[1]))
    text = f"no servo answers at {ports.baud} bit/s, {len(heard)} of {len(ids)} answer at {baud}"
    mend = f"Use --baud {baud}, or bring them to {ports.baud}: bluefoot servo setup --baud {baud} --new-baud"
    return [Finding(part=part, text=text, mend=f"{mend} {ports.baud}", severity=Severity.REFUSAL)]


def answering_twice(found: Survey) -> list[Finding]:
    """IDs that answer on more than one port."""
    return [
        Finding(
            part=f"servo {servo}", text=f"answers on {' and '.join(where)}",
            mend="Give one of them another ID: bluefoot servo setup --new-id", severity=Severity.REFUSAL,
        )
        for servo, where in found.twice.items()
    ]  # fmt: skip
