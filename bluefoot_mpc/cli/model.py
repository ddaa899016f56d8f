"""``bluefoot model``: parity of the engines, URDF, range of motion, power budget."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from rich.table import Table

from bluefoot_mpc.cli.arguments import CheckCommand, PowerCommand, RomCommand, UrdfCommand
from bluefoot_mpc.cli.outcome import FAILED, OK, Outcome
from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.model.parameters import RobotParameters, load_parameters
from bluefoot_mpc.model.power import energy_report, power_budget
from bluefoot_mpc.model.resources import model_file
from bluefoot_mpc.model.rom import study_range_of_motion
from bluefoot_mpc.model.urdf import make_urdf
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.sim.parity import check_parity
from bluefoot_mpc.viz.rom import save_rom_pictures


def check(command: CheckCommand) -> Outcome:
    """Compare Pinocchio and MuJoCo."""
    report = check_parity(load_parameters(command.model), n=command.states, seed=command.seed)
    table = Table(title=f"Pinocchio against MuJoCo, {report.states} random states", title_justify="left")
    table.add_column("quantity")
    table.add_column("largest relative error", justify="right")
    for name, error in report.errors.items():
        table.add_row(
            name.replace("_", " "), f"{error:.1e}", style="" if error <= report.tolerance else "red"
        )
    verdict = "agree" if report.agree else "DISAGREE"
    line = f"{report.mass:.3f} kg; the engines {verdict} (tolerance {report.tolerance:.0e})"
    data = {**dataclasses.asdict(report), "agree": report.agree, "worst": report.worst}
    return Outcome(status=OK if report.agree else FAILED, data=data, page=(table, line))


def urdf(command: UrdfCommand) -> Outcome:
    """Export the URDF, or check the one that ships."""
    text = make_urdf(load_parameters(command.model))
    source = model_file(command.model or "bluefoot")
    if command.check:
        return _check_urdf(text, command.out or source.with_suffix(".urdf"), source, command.model)
    if command.out is None:
        return Outcome(data={"urdf": text}, page=(text.rstrip("\n"),))
    _write(command.out, text)
    return Outcome(data={"file": command.out, "source": source}, page=(f"wrote {command.out}",))


def rom(command: RomCommand) -> Outcome:
    """Study the range of motion and draw it."""
    study = study_range_of_motion(load_parameters(command.model))
    files = save_rom_pictures(study, command.out)
    figures = study.figures()
    table = Table(title=f"Range of motion of {study.robot}, feet planted", title_justify="left")
    table.add_column("trunk")
    table.add_column(f"ankle direction fixed at {figures['ankle_direction_deg']:.0f}°", justify="right")
    table.add_column("ankle direction free", justify="right")
    for label, key, unit in (("along x or y", "shift", "cm"), ("roll or pitch", "tilt", "deg")):
        cells = (f"±{figures[f'{key}_{ankle}_{unit}']:.1f} {unit}" for ankle in ("fixed", "free"))
        table.add_row(label, *cells)
    page = (table, "\n".join(f"wrote {file}" for file in files))
    return Outcome(data={**figures, "files": files}, page=page)


def power(command: PowerCommand) -> Outcome:
    """Show the power budget."""
    parameters = load_parameters(command.model)
    if command.log is not None:
        return _drawn(parameters, command.log)
    budget = power_budget(parameters.power)
    table = Table(title=f"Power of {parameters.name}", title_justify="left")
    for heading in ("consumer", "net", "V", "A", "W"):
        table.add_column(heading, justify="left" if heading == "consumer" else "right")
    for row in budget.rows:
        table.add_row(row.name, str(row.net), f"{row.voltage:g}", f"{row.current:g}", f"{row.power:.3f}")
    table.add_section()
    table.add_row("losses (regulation, radio)", "", "", "", f"{budget.losses:.3f}")
    table.add_row("nominal", "", "", "", f"{budget.nominal:.3f}")
    table.add_row("worst case", "", "", "", f"{budget.worst:.3f}")
    lines = [
        f"{budget.capacity:g} Wh, all packs pooled: {budget.nominal_run_time:.1f} min nominal, "
        f"{budget.worst_run_time:.1f} min in the worst case",
        *(
            f"net {net.net}, own packs: {net.power:.1f} W from {net.capacity:g} Wh, {net.run_time:.1f} min"
            for net in budget.nets
        ),
    ]
    return Outcome(data=dataclasses.asdict(budget), page=(table, "\n".join(lines)))


def _drawn(parameters: RobotParameters, file: Path) -> Outcome:
    log = read_log(file)
    if len(log.truth) < 2:
        raise LogError(f"{file} holds no record of the servos' power: only simulated runs have one")
    use = energy_report(parameters.power, log.stack("truth", "time"), log.stack("truth", "electrical_power"))
    lines = (
        f"servos {use.servo_mean_power:.1f} W on average, {use.servo_peak_power:.1f} W at most; "
        f"whole robot {use.mean_power:.1f} W over {use.duration:.1f} s",
        f"{use.energy:.0f} J, {100.0 * use.charge_share:.2f} % of the charge",
        f"at this rate {use.pooled_run_time:.0f} min with all packs pooled, "
        f"{use.servo_run_time:.0f} min for the servos on their own packs",
    )
    return Outcome(data=dataclasses.asdict(use), page=("\n".join(lines),))


def _check_urdf(text: str, file: Path, source: Path, model: str | None) -> Outcome:
    there = file.is_file()
    fresh = there and file.read_text(encoding="utf-8") == text
    again = " ".join(["bluefoot model urdf", *(["--model", model] if model else []), "--out", str(file)])
    state = "is out of date; write it anew" if there else "does not exist; write it"
    line = f"{file} is up to date" if fresh else f"{file} {state} with: {again}"
    data = {"file": file, "source": source, "up_to_date": fresh}
    return Outcome(status=OK if fresh else FAILED, data=data, page=(line,))


def _write(file: Path, text: str) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error
