"""``bluefoot servo scan`` and ``setup``."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich import box
from rich.table import Table

from bluefoot_mpc.cli.outcome import OK, Outcome
from bluefoot_mpc.cli.servo_arguments import ScanCommand, ServoArguments, SetupCommand
from bluefoot_mpc.cli.servo_dialog import Answers, bar, findings_data, findings_table
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.calibration import joint_of_id, load_calibration, now_text, save_calibration
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.commissioning import setup as setting_up
from bluefoot_mpc.io.commissioning.checks import silence
from bluefoot_mpc.io.commissioning.ports import STANDARD_BAUDS, ServoPorts, split_ports
from bluefoot_mpc.io.commissioning.supply import ServoSupply
from bluefoot_mpc.io.commissioning.survey import (
    ServoFacts,
    Survey,
    find_bauds,
    parse_ids,
    survey,
    survey_findings,
)
from bluefoot_mpc.io.serial_link import SerialLink

REFUSED = 3
"""Exit status where the device is not as it must be."""
NOTHING_WRITTEN = "nothing was written"


@contextlib.contextmanager
def open_ports(command: ServoArguments, *, allow_eeprom: bool = False) -> Iterator[ServoPorts]:
    """The ports of a command, and the servos' supply where the sensor board switches it.

    Raises:
        ConfigurationError: no port is given, or a wrong baud rate.
        LinkError: a port cannot be opened.
        DeviceError: the board does not switch the supply on.
    """
    names = split_ports(command.port)
    setting_up.check_baud(command.baud)
    clock = MonotonicClock()
    with contextlib.ExitStack() as stack:
        ports = stack.enter_context(ServoPorts(names, command.baud, allow_eeprom=allow_eeprom, clock=clock))
        if command.board is not None:
            stack.enter_context(ServoSupply(SerialLink(command.board, command.board_baud, clock), clock))
        yield ports


def scan(command: ScanCommand) -> Outcome:
    """Show what is there."""
    ids = parse_ids(command.ids)
    with open_ports(command) as ports:
        with bar("scan", len(ids)) as progress:
            found = survey(ports, ids, progress)
        findings = [*survey_findings(found)]
        bauds: dict[int, tuple[int, ...]] = {}
        if command.all_bauds:
            with bar("baud rates", len(STANDARD_BAUDS)) as progress:
                bauds = find_bauds(ports, ids, progress)
        else:
            silent = silence(ports, ids, found)
            findings = silent or findings
    data = {
        "servos": [_facts_data(facts) for facts in found.servos.values()],
        "missing": found.missing, "garbled": _by_text(found.garbled), "bauds": _by_text(bauds),
        "findings": findings_data(findings), "success": not findings,
    }  # fmt: skip
    page: list[Any] = [_scan_table(found)] if found.servos else []
    if findings:
        page.append(findings_table(findings, "What is wrong"))
    page += [f"{len(heard)} servos answer at {baud} bit/s: {_list(heard)}" for baud, heard in bauds.items()]
    page.append(f"{len(found.servos)} of {len(ids)} servos answer at {command.baud} bit/s")
    return Outcome(status=REFUSED if findings else OK, data=data, page=tuple(page))


def setup(command: SetupCommand) -> Outcome:
    """Write what has to be written, after asking."""
    ids = parse_ids(command.ids)
    dialog = Answers(yes=command.yes, terminal_only=True)
    config = setting_up.SetupConfig(return_delay_us=command.return_delay)
    with open_ports(command, allow_eeprom=True) as ports:
        if command.new_id is not None:
            return _new_id(command, ports, ids, dialog)
        if command.new_baud is not None:
            return _new_baud(command, ports, ids, dialog)
        with bar("look", len(ids)) as progress:
            found = survey(ports, ids, progress)
        _require_some(ports, ids, found)
        changes = setting_up.plan(found, config)
        if not changes:
            return Outcome(
                data={"changes": [], "written": False, "servos": ids},
                page=(f"{len(ids)} servos are set up already, {NOTHING_WRITTEN}",),
            )
        if not command.yes:
            dialog.say(_plan_text(changes))
        if not dialog.confirm(f"Write {len(changes)} registers of permanent memory?"):
            raise DeviceError(f"not agreed: {NOTHING_WRITTEN}")
        with bar("write", len(changes)) as progress:
            setting_up.apply(ports, changes, progress)
    data = {"changes": [dataclasses.asdict(c) for c in changes], "written": True, "servos": ids}
    line = f"{len(changes)} registers written and read back; torque is off"
    return Outcome(data=data, page=(_plan_table(changes), line))


def _new_id(command: SetupCommand, ports: ServoPorts, ids: Sequence[int], dialog: Answers) -> Outcome:
    if len(ids) != 1 or command.new_id is None:
        raise ConfigurationError("--new-id changes one servo: name its present ID, for example --ids 1")
    old, new = ids[0], command.new_id
    _require_some(ports, ids, survey(ports, ids))
    question = f"Servo {old} ({joint_of_id(old)}) becomes servo {new} ({joint_of_id(new)}). Write it?"
    if not dialog.confirm(question):
        raise DeviceError(f"not agreed: {NOTHING_WRITTEN}")
    # A file that cannot be read must be known before anything is written.
    calibration = load_calibration(command.calibration) if command.calibration.is_file() else None
    facts = setting_up.change_id(ports, old, new)
    if calibration is not None:
        save_calibration(dataclasses.replace(calibration, setup=now_text()), command.calibration)
    page = [f"servo {old} is now {facts.part}"]
    if calibration is not None:
        page.append(f"{command.calibration} no longer holds. Calibrate again: bluefoot servo calibrate")
    stale = None if calibration is None else str(command.calibration)
    data = {"old_id": old, "new_id": new, "stale_calibration": stale}
    return Outcome(data=data, page=tuple(page))


def _new_baud(command: SetupCommand, ports: ServoPorts, ids: Sequence[int], dialog: Answers) -> Outcome:
    baud = command.new_baud or 0
    setting_up.check_baud(baud)
    found = survey(ports, ids)
    _require_some(ports, ids, found)
    setting_up.plan(found, setting_up.SetupConfig())  # refuses what is missing or locked
    if not dialog.confirm(f"Bring {len(ids)} servos from {command.baud} to {baud} bit/s?"):
        raise DeviceError(f"not agreed: {NOTHING_WRITTEN}")
    setting_up.change_baud(ports, ids, baud)
    line = f"{len(ids)} servos answer at {baud} bit/s: from now on use --baud {baud}"
    return Outcome(data={"old_baud": command.baud, "new_baud": baud, "servos": ids}, page=(line,))


def _require_some(ports: ServoPorts, ids: Sequence[int], found: Survey) -> None:
    """Tell a wrong baud rate from missing servos."""
    for finding in silence(ports, ids, found):
        raise DeviceError(f"{finding}; {NOTHING_WRITTEN}")


def _plan_table(changes: Sequence[setting_up.Change]) -> Table:
    table = Table(title="Permanent memory", title_justify="left")
    for heading in ("servo", "register", "was", "becomes"):
        table.add_column(heading, justify="left" if heading == "register" else "right")
    for change in changes:
        table.add_row(
            f"{change.servo} ({joint_of_id(change.servo)})", change.register.replace("_", " "),
            str(change.old), str(change.new),
        )  # fmt: skip
    return table


def _plan_text(changes: Sequence[setting_up.Change]) -> str:
    lines = [f"  servo {c.servo}: {c.register.replace('_', ' ')} {c.old} -> {c.new}" for c in changes]
    return "\n".join(("Permanent memory (EEPROM) that will be written, torque off:", *lines))


def _scan_table(found: Survey) -> Table:
    table = Table(title="Servos", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for heading in ("ID", "joint", "model", "firm-\nware", "posi-\ntion", "V", "°C", "load\n%",
                    "delay\nµs", "limits", "tor-\nque", "errors"):  # fmt: skip
        left = heading in ("joint", "errors")
        table.add_column(heading, justify="left" if left else "right", no_wrap=heading != "errors")
    for facts in found.servos.values():
        table.add_row(*_cells(facts))
    return table


def _cells(facts: ServoFacts) -> tuple[str, ...]:
    low, high = facts.limits
    return (
        str(facts.id), facts.joint, str(facts["model_number"]), str(facts["firmware_version"]),
        str(facts["present_position"]), f"{facts.voltage:.1f}", str(facts["present_temperature"]),
        f"{100.0 * facts.load:+.0f}", str(2 * facts["return_delay_time"]), f"{low}..{high}",
        "on" if facts["torque_enable"] else "off", facts.errors,
    )  # fmt: skip


def _facts_data(facts: ServoFacts) -> dict[str, Any]:
    return {
        "id": facts.id, "joint": facts.joint, "port": facts.port, "error": facts.error,
        "errors": facts.errors, **facts.registers,
    }  # fmt: skip


def _by_text(table: Mapping[int, Any]) -> dict[str, Any]:
    """A table for JSON, whose keys are texts."""
    return {str(key): value for key, value in table.items()}


def _list(ids: Sequence[int]) -> str:
    return ", ".join(map(str, ids))
