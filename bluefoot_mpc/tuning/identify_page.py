"""Measured against fitted steps as pictures, and the recorded steps as a file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import joint_of_id
from bluefoot_mpc.io.commissioning.steps import StepRecord
from bluefoot_mpc.model.servo import to_angle
from bluefoot_mpc.tuning.identify import Identified
from bluefoot_mpc.tuning.identify_model import Bench
from bluefoot_mpc.viz.style import COMMAND, ESTIMATE, NEUTRAL, figure_style

_COLUMNS = 4


def save_picture(found: Identified, bench: Bench, folder: Path) -> Path:
    """Draw every step of a servo, readings as dots and the fit as a line.

    Raises:
        ConfigurationError: the picture cannot be written.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415

    rows = -(-len(found.records) // _COLUMNS)
    with figure_style():
        figure = Figure(figsize=(11.0, 1.0 + 1.7 * rows), layout="constrained")
        axes = figure.subplots(rows, _COLUMNS, sharex=True, squeeze=False).ravel()
        for axis, record, curve in zip(axes, found.records, found.curves, strict=False):
            _draw(axis, record, curve, bench)
        for axis in axes[len(found.records) :]:
            axis.set_axis_off()
        axes[0].legend(loc="best")
        figure.suptitle(_title(found))
        file = folder / f"servo_{found.servo}.png"
        try:
            folder.mkdir(parents=True, exist_ok=True)
            figure.savefig(file, dpi=110)
        except OSError as error:
            raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error
    return file


def save_steps(records: Sequence[StepRecord], file: Path) -> None:
    """Write recorded steps as JSON, so that they can be fitted again (``--steps``).

    Raises:
        ConfigurationError: the file cannot be written.
    """
    table = [
        {name: _plain(getattr(record, name)) for name in record.__dataclass_fields__} for record in records
    ]
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(table) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot write {file}: {error.strerror or error}") from error


def load_steps(file: Path) -> list[StepRecord]:
    """Read steps that `save_steps` wrote.

    Raises:
        ConfigurationError: the file is missing or is something else.
    """
    try:
        table = json.loads(file.read_text(encoding="utf-8"))
        if not isinstance(table, list) or not table:
            raise ValueError("there are none")
        return [_record(row) for row in table]
    except OSError as error:
        raise ConfigurationError(f"cannot read {file}: {error.strerror or error}") from error
    except (ValueError, TypeError, KeyError) as error:
        raise ConfigurationError(
            f"{file} holds no recorded steps ({error}): give the steps.json of an earlier identification"
        ) from error


def _record(row: Any) -> StepRecord:
    arrays = {name: np.array(row[name], dtype=np.float64) for name in ("time", "position")}
    if (
        arrays["time"].ndim != 1
        or arrays["time"].shape != arrays["position"].shape
        or not arrays["time"].size
    ):
        raise ValueError("times and positions do not belong together")
    return StepRecord(**{**row, **arrays})


def _draw(axis: Any, record: StepRecord, curve: Any, bench: Bench) -> None:
    step = bench.servo.step_angle
    middle = 0.5 * bench.servo.steps
    for values, style in (
        (record.position, {"color": NEUTRAL, "marker": ".", "ms": 2.0, "ls": "none", "label": "measured"}),
        (curve, {"color": ESTIMATE, "label": "fitted"}),
    ):
        axis.plot(1e3 * record.time, np.degrees(to_angle(bench.servo, np.asarray(values) - middle)), **style)
    axis.axhline(np.degrees(step * (record.goal - middle)), color=COMMAND, lw=0.8, ls="--", label="goal")
    axis.set_xlabel("ms")
    axis.set_ylabel("deg")


def _title(found: Identified) -> str:
    fit = found.fit
    return (
        f"servo {found.servo} ({joint_of_id(found.servo)}): stiffness {fit.stiffness:.2f} N·m/rad, "
        f"Coulomb {fit.coulomb_friction:.3f} N·m, viscous {fit.viscous_friction:.4f} N·m·s/rad, "
        f"armature {1e3 * fit.armature:.2f} g·m², latency {1e3 * fit.latency:.1f} ms, "
        f"residual {found.residual:.2f} counts"
    )


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value
