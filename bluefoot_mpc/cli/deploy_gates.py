"""The gates between a configuration and the robot's torque, each with its findings."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bluefoot_mpc.evaluation.validation_gate import demand_of, differences, judge
from bluefoot_mpc.evaluation.validation_record import records_folder
from bluefoot_mpc.evaluation.validation_subject import Subject, code_now, subject_in, subject_of
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io import calibration as cal
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.commissioning.doctor import DoctorConfig, check_bus
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.commissioning.supply import ServoSupply
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.serial_link import SerialLink
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.making import BOARD_BAUD
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import Resolved

CONFIRMED = "yes"
"""What a person may type instead of the robot's name."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Gate:
    """One gate.

    Attributes:
        name: what is asked for.
        findings: what was found; a refusal keeps it shut.
        is_open: whether it lets through; None where it was not tried.
    """

    name: str
    findings: tuple[Finding, ...]
    is_open: bool | None

    @property
    def refuses(self) -> bool:
        """True where it was tried and is shut."""
        return self.is_open is False


def tried(name: str, findings: Sequence[Finding]) -> Gate:
    """A gate that is open unless a finding refuses."""
    shut = any(finding.severity is Severity.REFUSAL for finding in findings)
    return Gate(name=name, findings=tuple(findings), is_open=not shut)


def untried(name: str, why: str, mend: str = "") -> Gate:
    """A gate that nobody has tried."""
    finding = Finding(part=name, text=why, mend=mend, severity=Severity.NOTE)
    return Gate(name=name, findings=(finding,), is_open=None)


def validation_gate(resolved: Resolved, options: RunOptions, records: Path | None, mend: str) -> Gate:
    """Whether a record allows this configuration, this code and this motion.

    Args:
        resolved: what would be run.
        options: from which that was resolved.
        records: folder of the records; None for the usual one.
        mend: the command that makes a record.
    """
    subject = subject_in(resolved)
    verdict = judge(records_folder(records), subject, code_now(), demand_of(resolved.scenario), mend)
    findings = list(verdict.findings)
    if verdict.record is not None:
        text = f"passed on {verdict.record.made}: {verdict.record.file}"
        findings.insert(0, Finding(part="validation", text=text))
    elif changes := list(differences(_own(options).identity(), subject.identity())):
        text = f"the scenario itself changes the configuration: {'; '.join(changes[:5])}"
        note = "Write these keys into the file of --config, and validate that file"
        findings.append(Finding(part="validation", text=text, mend=note, severity=Severity.NOTE))
    return tried("validation", findings)


def _own(options: RunOptions) -> Subject:
    """The configuration without what a scenario changes of it."""
    return subject_of(replace(options, duration=None, gait=None, speed=None))


def calibration_gate(config: DevicesConfig, model: str) -> tuple[Gate, cal.Calibration | None]:
    """Whether the calibration file holds for this robot, and the calibration."""
    try:
        calibration = cal.load_calibration(config.calibration)
    except ConfigurationError as error:
        text, _, mend = str(error).partition("; ")
        return tried("calibration", [_refusal("calibration", text, mend)]), None
    return tried("calibration", cal.findings(calibration, model)), calibration


def robot_gate(config: DevicesConfig, calibration: cal.Calibration | None, model: str) -> Gate:
    """Whether board, servos, their set-up and the timing are such that the robot may be armed.

    Reads only. The board switches the servos' supply on for it, and off again; no torque.
    """
    name = "robot"
    if not config.ports:
        return untried(name, "not checked: no port is given", "Give the servos' port with --port")
    if not config.board_port:
        return untried(name, "not checked: no board is given", "Give the sensor board's port with --board")
    clock = MonotonicClock()
    ids = cal.servo_ids() if calibration is None else calibration.ids
    try:
        with contextlib.ExitStack() as stack:
            ports = stack.enter_context(ServoPorts(config.ports, config.baud, clock=clock))
            link = SerialLink(config.board_port, BOARD_BAUD, clock)
            supply = stack.enter_context(ServoSupply(link, clock))
            found = check_bus(ports, ids, calibration, model, DoctorConfig(seconds=1.0))
            found += supply.findings()
    except DeviceError as error:
        return tried(name, [_refusal(name, str(error), "Look closer with: bluefoot doctor")])
    return tried(name, found)


def person_gate(name: str, what: str, *, agreed: bool) -> Gate:
    """Whether a person at the robot agrees, on a terminal.

    Args:
        name: of the robot.
        what: is about to happen, in a sentence.
        agreed: the command line says so.
    """
    part = "person"
    if agreed:
        return tried(part, [Finding(part=part, text="at the robot, says the command line")])
    if not _is_terminal():
        mend = "Start it in a terminal at the robot, or add --yes-i-am-at-the-robot where that is true"
        return tried(part, [_refusal(part, "nobody can be asked: standard input is no terminal", mend)])
    print(
        f"{what}\nIs somebody at the robot, its surroundings free, the emergency switch in reach?\n"
        f"Type the robot's name ({name}) or '{CONFIRMED}' to switch the torque on: ",
        end="", file=sys.stderr, flush=True,
    )  # fmt: skip
    answer = sys.stdin.readline().strip().lower()
    if answer in (CONFIRMED, name.lower()):
        return tried(part, [Finding(part=part, text="confirmed")])
    return tried(part, [_refusal(part, "did not confirm", f"Type {name} or {CONFIRMED}")])


def _is_terminal() -> bool:
    try:
        return sys.stdin.isatty()
    except (AttributeError, ValueError):  # no standard input at all, or a closed one
        return False


def _refusal(part: str, text: str, mend: str) -> Finding:
    return Finding(part=part, text=text, mend=mend, severity=Severity.REFUSAL)
