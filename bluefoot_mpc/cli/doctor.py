"""``bluefoot doctor``: one table of findings, each with its mend."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from bluefoot_mpc.cli.doctor_arguments import DoctorCommand
from bluefoot_mpc.cli.doctor_software import check_software
from bluefoot_mpc.cli.outcome import OK, Outcome
from bluefoot_mpc.cli.servo import REFUSED, open_ports
from bluefoot_mpc.cli.servo_dialog import findings_data, findings_table
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io import calibration as cal
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.commissioning import doctor as examine
from bluefoot_mpc.io.commissioning.survey import parse_ids
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.link import Link, LinkError
from bluefoot_mpc.io.serial_link import SerialLink
from bluefoot_mpc.model.parameters import load_parameters

_NO_SERVOS = "not checked: give the servos' port with --port"


def doctor(command: DoctorCommand) -> Outcome:
    """Check what is named, and the software where no device is."""
    config = examine.DoctorConfig(seconds=command.seconds)
    findings: list[Finding] = []
    if not (command.port or command.board or command.lidar):
        findings += check_software()
    if command.board is not None:
        findings += _on_port(
            f"board {command.board}", command.board, command.board_baud,
            lambda link, clock: examine.check_board(link, clock, config),
        )  # fmt: skip
    findings += _servos(command, config)
    if command.lidar is not None:
        findings += _on_port(f"LIDAR {command.lidar}", command.lidar, command.lidar_baud, examine.check_lidar)
    worst = max(finding.severity for finding in findings)
    count = Counter(finding.severity.name.lower() for finding in findings)
    told = ", ".join(f"{count[s.name.lower()]} {s.name.lower()}" for s in Severity if count[s.name.lower()])
    verdict = "must not be armed" if worst is Severity.REFUSAL else "nothing refuses"
    return Outcome(
        status=REFUSED if worst is Severity.REFUSAL else OK,
        data={"findings": findings_data(findings), "success": worst is not Severity.REFUSAL, "count": count},
        page=(findings_table(findings, "BlueFoot doctor"), f"{told}: {verdict}"),
    )


def _servos(command: DoctorCommand, config: examine.DoctorConfig) -> list[Finding]:
    """Calibration, and the bus where it is named."""
    calibration, findings = _calibration(command)
    model = load_parameters(command.model).name
    if not command.port:
        if calibration is not None:
            findings += cal.findings(calibration, model)
        return [*findings, Finding(part="servos", text=_NO_SERVOS, severity=Severity.NOTE)]
    ids = parse_ids(command.ids)
    try:
        with open_ports(command) as ports:
            return [*examine.check_bus(ports, ids, calibration, model, config), *findings]
    except DeviceError as error:
        return [*findings, _refusal(f"port {', '.join(command.port)}", str(error))]


def _calibration(command: DoctorCommand) -> tuple[cal.Calibration | None, list[Finding]]:
    """The calibration, and what is wrong with its file."""
    part, file = "calibration", command.calibration
    if file is None and not cal.DEFAULT_FILE.is_file():
        if not command.port:
            return None, []
        text = f"there is no {cal.DEFAULT_FILE} here, and none is named"
        return None, [_refusal(part, text, "Make one: bluefoot servo calibrate, or name it: --calibration")]
    try:
        return cal.load_calibration(file or cal.DEFAULT_FILE), []
    except ConfigurationError as error:
        return None, [_refusal(part, str(error))]


def _on_port(
    part: str, port: str, baud: int, check: Callable[[Link, MonotonicClock], list[Finding]]
) -> list[Finding]:
    """A check of a device on a port of its own."""
    clock = MonotonicClock()
    try:
        return check(SerialLink(port, baud, clock), clock)
    except LinkError as error:
        return [_refusal(part, str(error))]


def _refusal(part: str, text: str, mend: str = "") -> Finding:
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)
