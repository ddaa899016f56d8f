"""``bluefoot servo test`` and ``identify``: the commands that move servos."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

from rich import box
from rich.table import Table

from bluefoot_mpc.cli.outcome import FAILED, OK, Outcome
from bluefoot_mpc.cli.servo import open_ports
from bluefoot_mpc.cli.servo_arguments import ExerciseCommand, IdentifyCommand
from bluefoot_mpc.cli.servo_dialog import Answers, bar
from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.calibration import joint_of_id
from bluefoot_mpc.io.commissioning.checks import require_sound
from bluefoot_mpc.io.commissioning.exercise import ExerciseConfig, ExerciseResult, exercise_all
from bluefoot_mpc.io.commissioning.ports import limp_afterwards
from bluefoot_mpc.io.commissioning.record import record_steps
from bluefoot_mpc.io.commissioning.setup import bus_of
from bluefoot_mpc.io.commissioning.steps import StepPlan, StepRecord
from bluefoot_mpc.io.commissioning.survey import parse_ids
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.settings import build, dump_toml, require_range
from bluefoot_mpc.tuning.identify import (
    GROUPS,
    NAMES,
    Identified,
    fragment,
    median_fit,
)
from bluefoot_mpc.tuning.identify import (
    identify as fit_steps,
)
from bluefoot_mpc.tuning.identify_model import Bench
from bluefoot_mpc.tuning.identify_page import load_steps, save_picture, save_steps

_COUNTS_PER_DEGREE = 1023.0 / 300.0
_SPEED_COUNT = 0.666
"""°/s of one count of the moving-speed register (0.111 rpm)."""
_UNITS = {
    "stiffness": (1.0, "N·m/rad"), "coulomb_friction": (1e3, "mN·m"), "viscous_friction": (1e3, "mN·m·s/rad"),
    "armature": (1e3, "g·m²"), "latency": (1e3, "ms"),
}  # fmt: skip


def test(command: ExerciseCommand) -> Outcome:
    """Move one servo after another."""
    ids = parse_ids(command.ids)
    config = ExerciseConfig(
        amplitude=round(command.amplitude * _COUNTS_PER_DEGREE), torque_limit=command.torque_limit,
        speed=round(command.speed / _SPEED_COUNT),
    )  # fmt: skip
    dialog = Answers(yes=command.yes, terminal_only=True)
    with open_ports(command) as ports:
        require_sound(ports, ids)
        _agree(dialog, f"{len(ids)} servos will move by {command.amplitude:g}°. Does the robot hang free?")
        buses = {servo: bus_of(ports, servo) for servo in ids}
        with limp_afterwards(ports, ids), bar("test", len(ids)) as progress:
            results = exercise_all(buses, ports.clock, config, progress)
    faults = [result for result in results if result.fault]
    data = {"servos": [dataclasses.asdict(r) for r in results], "success": not faults, "torque": "off"}
    page: list[Any] = [_test_table(results)]
    page += [f"servo {r.servo} ({joint_of_id(r.servo)}): {r.fault}. {r.mend}" for r in faults]
    page.append(f"{len(results) - len(faults)} of {len(results)} servos follow; torque is off")
    return Outcome(status=FAILED if faults else OK, data=data, page=tuple(page))


def identify(command: IdentifyCommand) -> Outcome:
    """Record steps and fit them."""
    bench = Bench(
        servo=load_parameters(command.model).servo, load_inertia=command.load_inertia,
        load_moment=command.load_moment, load_angle=math.radians(command.load_angle),
    )  # fmt: skip
    if command.steps is not None:
        records = load_steps(command.steps)
    else:
        records = _recorded(command)
        save_steps(records, command.out / "steps.json")
    found = _fits(records, bench)
    files = [str(save_picture(one, bench, command.out)) for one in found]
    middle = median_fit(found)
    table = fragment(middle, bench.servo)
    file = command.out / "servo.toml"
    _write(file, table, found)
    doubtful = [one for one in found if not one.trusted]
    data = {
        "servos": [_fit_data(one) for one in found], "median": dataclasses.asdict(middle),
        "config": table, "file": file, "pictures": files, "success": not doubtful,
    }  # fmt: skip
    page: list[Any] = [_fit_table(found, middle)]
    page += [_doubt(one) for one in doubtful]
    page += [f"wrote {file}: bluefoot run walk --config {file}", *(f"wrote {name}" for name in files)]
    return Outcome(status=FAILED if doubtful else OK, data=data, page=tuple(page))


def _recorded(command: IdentifyCommand) -> list[StepRecord]:
    """Steps of every servo, one after the other."""
    ids = parse_ids(command.ids)
    plan = build(StepPlan, {
        "amplitudes_deg": list(_numbers(command.amplitudes)), "repeats": command.repeats,
        "torque_limit": command.torque_limit, "middle": command.middle,
    })  # fmt: skip
    dialog = Answers(yes=command.yes, terminal_only=True)
    records: list[StepRecord] = []
    with open_ports(command) as ports:
        require_sound(ports, ids)
        most = max(plan.amplitudes_deg)
        _agree(dialog, f"{len(ids)} servos will step by up to ±{most:g}° at full speed. Are they free?")
        with limp_afterwards(ports, ids), bar("steps", len(ids) * len(plan.goals())) as progress:
            for servo in ids:
                records += record_steps(bus_of(ports, servo), servo, plan, ports.clock, progress)
    return records


def _fits(records: Sequence[StepRecord], bench: Bench) -> list[Identified]:
    ids = sorted({record.servo for record in records})
    with bar("fit", len(ids) * (GROUPS + 1)) as progress:
        return [
            fit_steps([r for r in records if r.servo == servo], bench, progress=progress) for servo in ids
        ]


def _write(file: Any, table: dict[str, Any], found: Sequence[Identified]) -> None:
    ids = ", ".join(str(one.servo) for one in found)
    head = (
        f"# Median of servos {ids}, from: bluefoot servo identify\n"
        "# Load it with: bluefoot run SCENARIO --config FILE\n"
        "# The latency is that of bus and servo alone.\n"
    )
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(head + dump_toml(table), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


def _agree(dialog: Answers, question: str) -> None:
    if not dialog.confirm(question):
        raise DeviceError("not agreed: no servo was moved")


def _numbers(text: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise ConfigurationError(f"--amplitudes = '{text}' is not of the form 2,4,8 in degrees") from None
    for number in numbers:
        require_range(1.0, 60.0, **{"--amplitudes": number})
    return numbers


def _test_table(results: Sequence[ExerciseResult]) -> Table:
    table = Table(
        title="Servos, moved one by one", title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for heading in (
        "ID",
        "joint",
        "asked\n°",
        "reached\n°",
        "back\n°",
        "time\ns",
        "peak\nload %",
        "°C",
        "V",
        "",
    ):
        table.add_column(heading, justify="left" if heading == "joint" else "right", no_wrap=True)
    for result in results:
        asked, there, back = (x / _COUNTS_PER_DEGREE for x in (result.asked, *result.reached))
        table.add_row(
            str(result.servo), joint_of_id(result.servo), f"{asked:+.1f}", f"{there:+.1f}", f"{back:+.1f}",
            "" if math.isnan(result.time) else f"{result.time:.2f}", f"{100.0 * result.peak_load:.0f}",
            str(result.temperature), f"{result.voltage:.1f}", "follows" if not result.fault else "FAULT",
        )  # fmt: skip
    return table


def _fit_table(found: Sequence[Identified], middle: Any) -> Table:
    table = Table(title="Identified servos (± standard error)", title_justify="left", box=box.SIMPLE_HEAD)
    table.padding = (0, 1, 0, 0)
    table.add_column("servo", justify="right")
    for name in NAMES:
        table.add_column(f"{name.replace('_', ' ')}\n{_UNITS[name][1]}", justify="right")
    table.add_column("residual\ncounts", justify="right")
    for one in found:
        cells = [_cell(name, getattr(one.fit, name), getattr(one.spread, name)) for name in NAMES]
        table.add_row(str(one.servo), *cells, f"{one.residual:.2f}")
    table.add_section()
    table.add_row("median", *(_cell(name, getattr(middle, name), math.nan) for name in NAMES), "")
    return table


def _cell(name: str, value: float, spread: float) -> str:
    scale = _UNITS[name][0]
    more = "" if math.isnan(spread) else f"±{scale * spread:.1g}"
    return f"{scale * value:.3g}{more}"


def _fit_data(one: Identified) -> dict[str, Any]:
    return {
        "servo": one.servo, "joint": joint_of_id(one.servo), "fit": dataclasses.asdict(one.fit),
        "standard_error": dataclasses.asdict(one.spread), "residual_counts": one.residual,
        "at_bounds": one.bounds, "steps": len(one.records),
    }  # fmt: skip


def _doubt(one: Identified) -> str:
    if one.bounds:
        return (
            f"servo {one.servo}: {', '.join(one.bounds)} ended at the edge of what is possible; the steps do "
            "not fit the law of an AX-12A. Check supply and load, then identify again"
        )
    return (
        f"servo {one.servo}: residual {one.residual:.1f} counts; the fitted curve is not the measured one. "
        "Look at the picture; check --load-inertia and --load-moment"
    )
