"""``bluefoot deploy``: the robot's torque behind gates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from bluefoot_mpc.cli.deploy_arguments import DeployCommand
from bluefoot_mpc.cli.deploy_gates import (
    Gate,
    calibration_gate,
    person_gate,
    robot_gate,
    tried,
    untried,
    validation_gate,
)
from bluefoot_mpc.cli.outcome import OK, Outcome
from bluefoot_mpc.cli.run import outcome_of
from bluefoot_mpc.cli.servo_dialog import findings_data, findings_table
from bluefoot_mpc.evaluation.validation_subject import resolve_for_robot
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import Calibration, load_calibration
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.scenarios import RunOptions, find_scenario, run_commanded
from bluefoot_mpc.scenarios.config import Resolved

REFUSED = 3
_STATES = {True: ("open", "green"), False: ("SHUT", "bold red"), None: ("not tried", "yellow")}


def deploy(command: DeployCommand) -> Outcome:
    """Try every gate; where all are open, run the scenario on the robot."""
    options = RunOptions(**command.run_fields())
    resolved = resolve_for_robot(find_scenario(command.scenario), options)
    devices = resolved.stages.devices
    if not command.dry_run:
        _require_ports(resolved)
    model = resolved.parameters.name
    gates = [validation_gate(resolved, options, command.records, command.validate_words())]
    gate, calibration = calibration_gate(devices, model)
    gates.append(gate)
    if command.dry_run or not any(gate.refuses for gate in gates):
        gates.append(robot_gate(devices, calibration, model))
    else:
        gates.append(untried("robot", "not checked: a gate before it is shut"))
    if command.dry_run:
        gates.append(untried("person", "would be asked on the terminal"))
        return _shown(gates, resolved, "dry run: nothing was switched on")
    if not any(gate.refuses for gate in gates):
        agreed = command.yes_i_am_at_the_robot
        gates.append(person_gate(model, _about(resolved), agreed=agreed))
        gates += _unchanged(devices.calibration, calibration)
    if any(gate.is_open is not True for gate in gates):
        return _shown(gates, resolved, "not deployed: no torque was on")
    outcome = outcome_of(run_commanded(resolved.scenario.source, resolved, options))
    data = {**outcome.data, "gates": _plain(gates)}
    return Outcome(status=outcome.status, data=data, page=outcome.page)


def _require_ports(resolved: Resolved) -> None:
    devices = resolved.stages.devices
    for given, option, what in (
        (devices.ports, "--port", "servos"),
        (devices.board_port, "--board", "sensor board"),
    ):
        if not given:
            raise ConfigurationError(
                f"{option} is missing: the device file of the {what}, say /dev/ttyUSB0 "
                "(or [devices] in --config; --dry-run needs none)"
            )


def _unchanged(file: str, calibration: Calibration | None) -> list[Gate]:
    """A gate that is shut where somebody changed the calibration while a person was asked."""
    if load_calibration(file) == calibration:
        return []
    text = f"{file} was changed after it was checked"
    finding = Finding(part="calibration", text=text, mend="Deploy again", severity=Severity.REFUSAL)
    return [tried("calibration", [finding])]


def _about(resolved: Resolved) -> str:
    """What is about to happen, in a sentence."""
    devices, scenario = resolved.stages.devices, resolved.scenario
    ports = ", ".join(devices.ports) or "a port that is not given"
    return (
        f"The robot '{resolved.parameters.name}' on {ports} is about to move: scenario "
        f"'{scenario.name}', {scenario.config.duration:g} s, controller {resolved.run.controller}."
    )


def _steps(resolved: Resolved) -> list[str]:
    """What is done once all gates are open."""
    devices, safety = resolved.stages.devices, resolved.stages.safety
    ports = ", ".join(devices.ports) or "the servos' port"
    return [
        f"open {ports} at {devices.baud} bit/s and {devices.board_port or 'the board'}; low-latency mode",
        "switch the servos' supply on; check every servo, voltage, latency and sensors once more",
        f"arm: goal = present position, {100 * safety.arming_torque:.0f} % torque, "
        f"up to 100 % within {safety.arming_time:g} s",
        f"stand up, then scenario '{resolved.scenario.name}' for {resolved.scenario.config.duration:g} s, "
        f"{1e3 * devices.period:g} ms a command",
        "sit down, torque off three times and verified, supply off",
    ]


def _shown(gates: Sequence[Gate], resolved: Resolved, end: str) -> Outcome:
    """The gates as data and as a page."""
    shut = [gate.name for gate in gates if gate.refuses]
    status = REFUSED if shut else OK
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for gate in gates:
        word, style = _STATES[gate.is_open]
        table.add_row(gate.name, Text(word, style=style))
    findings = [finding for gate in gates for finding in gate.findings]
    steps = _steps(resolved)
    verdict = (
        Text(f"REFUSED by: {', '.join(shut)}; {end}", style="bold red")
        if shut
        else Text(f"no gate is shut; {end}", style="green")
    )
    page: tuple[RenderableType, ...] = (
        _about(resolved), "", table, findings_table(findings, "Findings"),
        "With all gates open:", *(f" {number}. {step}" for number, step in enumerate(steps, 1)), "", verdict,
    )  # fmt: skip
    data = {
        "gates": _plain(gates), "steps": steps, "shut": shut, "allowed": not shut,
        "dry_run": end.startswith("dry"), "exit_status": status,
    }  # fmt: skip
    return Outcome(status=status, data=data, page=page)


def _plain(gates: Sequence[Gate]) -> list[dict[str, Any]]:
    return [
        {"name": gate.name, "open": gate.is_open, "findings": findings_data(gate.findings)} for gate in gates
    ]
