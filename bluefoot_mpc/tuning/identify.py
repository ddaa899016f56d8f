"""From recorded steps of servos to the parameters that make the simulator step like them.

The fit is a least-squares fit of `mujoco.sysid` over positions. Steps of a free
shaft show ratios of torque to inertia only, so the scale is the data sheet's
stall torque; on a bench with a known weight the weight's moment enters the fit.
"""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.commissioning.steps import StepRecord
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.tuning.identify_model import Bench, ServoFit, StepBench
from bluefoot_mpc.types import BoolArray, FloatArray

NAMES = ("stiffness", "coulomb_friction", "viscous_friction", "armature", "latency")
"""What is fitted, in the order of vectors."""
GROUPS = 4
"""Parts of the steps that are left out in turn, to see how far the fit depends on them."""

_TAIL = 0.02
"""s of readings that count after the last change of a reading: a shaft that rests tells nothing more."""
_LATENCY_SCALE = 0.02
_FD_STEP = 0.01
_TOLERANCE = 1e-5
"""Relative change of variables or of the cost at which a fit ends: far below what readings can tell."""
_POOR_FIT = 1.5
"""Counts of rms residual above which the law does not describe the servo."""

SYSID_NEEDS = ("absl-py", "colorama", "tabulate", "pyyaml")
"""Packages without which `mujoco.sysid` is empty."""

_Progress = Callable[[], None]


@dataclass(frozen=True, kw_only=True, slots=True)
class Identified:
    """What was found for one servo.

    Attributes:
        servo: its ID.
        fit: the parameters.
        spread: standard error of each, from fits without a quarter of the steps each.
        residual: counts, rms of measured minus fitted; reading whole counts alone makes 0.29.
        bounds: names of parameters that ended at the edge of what was allowed.
        records: the steps.
        curves: (n,) counts, fitted position at each reading, one array a step.
    """

    servo: int
    fit: ServoFit
    spread: ServoFit
    residual: float
    bounds: tuple[str, ...]
    records: tuple[StepRecord, ...]
    curves: tuple[FloatArray, ...]

    @property
    def trusted(self) -> bool:
        """Whether the law describes the servo: small residual, nothing at its edge."""
        return self.residual < _POOR_FIT and not self.bounds


@dataclass(frozen=True, kw_only=True, slots=True)
class IdentifyConfig:
    """How to fit."""

    iterations: int = 40  # most steps of the optimiser
    groups: int = GROUPS  # fits for the spread; 0 = none

    def __post_init__(self) -> None:
        require_range(1, 1000, iterations=self.iterations)
        require_range(0, 16, groups=self.groups)
        if self.groups == 1:
            raise ConfigurationError("groups = 1: a spread needs at least 2 groups, or 0 for none")


def identify(
    records: Sequence[StepRecord],
    bench: Bench,
    config: IdentifyConfig | None = None,
    progress: _Progress = lambda: None,
) -> Identified:
    """Fit one servo.

    Args:
        records: its steps.
        bench: what is known.
        config: how to fit.
        progress: called after every fit, `GROUPS` + 1 times.

    Raises:
        DeviceError: the shaft did not move, so there is nothing to fit.
    """
    config = config or IdentifyConfig()
    _check(records)
    fit = _fitted(records, bench, config.iterations, start_of(bench.servo))
    progress()
    parts = []
    for group in range(config.groups):
        kept = [r for k, r in enumerate(records) if k % config.groups != group]
        parts.append(vector(_fitted(kept, bench, config.iterations, fit)))
        progress()
    curves = StepBench(records, bench).at_readings(fit)
    errors = np.concatenate([
        (curve - r.position)[_moving(r)] for curve, r in zip(curves, records, strict=True)
    ])  # fmt: skip
    return Identified(
        servo=records[0].servo, fit=fit, spread=_of_vector(_jackknife(parts)),
        residual=float(np.sqrt(np.mean(errors**2))), bounds=_at_bounds(fit, bench.servo),
        records=tuple(records), curves=tuple(curves),
    )  # fmt: skip


def start_of(servo: ServoParameters) -> ServoFit:
    """Where the fit starts: the parameter file, and a latency of a few milliseconds."""
    return ServoFit(
        stiffness=servo.stiffness, coulomb_friction=servo.coulomb_friction,
        viscous_friction=servo.viscous_friction, armature=servo.armature, latency=0.005,
    )  # fmt: skip


def limits_of(servo: ServoParameters) -> tuple[ServoFit, ServoFit]:
    """Lowest and highest values that the fit may reach."""
    low = ServoFit(
        stiffness=0.2 * servo.stiffness,
        coulomb_friction=0.0,
        viscous_friction=0.0,
        armature=2e-4,
        latency=0.0,
    )
    high = ServoFit(
        stiffness=5.0 * servo.stiffness, coulomb_friction=0.3 * servo.stall_torque,
        viscous_friction=servo.back_emf, armature=0.03, latency=0.1,
    )  # fmt: skip
    return low, high


def vector(fit: ServoFit) -> FloatArray:
    """(5,) the parameters in the order of `NAMES`."""
    return np.array([getattr(fit, name) for name in NAMES])


def median_fit(found: Sequence[Identified]) -> ServoFit:
    """The middle of several servos, each parameter by itself: the simulator has one for all."""
    return _of_vector(np.median([vector(one.fit) for one in found], axis=0))


def fragment(fit: ServoFit, servo: ServoParameters) -> dict[str, Any]:
    """The part of a configuration that makes the simulator's servos like the fit (``--config``).

    Args:
        fit: the parameters.
        servo: the parameter file that the stall torque was taken from.

    Returns:
        Tables ``model.servo`` and ``sim``. The compliance slope is the one that
        has the fitted stiffness, whatever the register says.
    """
    effective = servo.stall_torque / (fit.stiffness * servo.step_angle)
    return {
        "model": {
            "servo": {
                "compliance_slope": round(effective, 3),
                "armature": round(fit.armature, 6),
                "coulomb_friction": round(fit.coulomb_friction, 5),
                "viscous_friction": round(fit.viscous_friction, 5),
            }
        },
        "sim": {"latency": round(fit.latency, 4)},
    }


def _check(records: Sequence[StepRecord]) -> None:
    if not records:
        raise ConfigurationError("no recorded steps: there is nothing to fit")
    moved = sum(bool(np.ptp(r.position) >= 0.5 * abs(r.goal - r.start)) for r in records)
    if moved < 0.8 * len(records):
        raise DeviceError(
            f"servo {records[0].servo} followed only {moved} of {len(records)} steps: nothing to fit. "
            "Check that its horn turns freely and its supply is on (bluefoot servo test)"
        )


def _moving(record: StepRecord) -> BoolArray:
    """(n,) readings until shortly after the last one that changed."""
    changes = np.flatnonzero(np.diff(record.position) != 0.0)
    last = record.time[changes[-1] + 1] if len(changes) else record.time[0]
    return np.asarray(record.time <= last + _TAIL)


def _trimmed(record: StepRecord) -> StepRecord:
    """A record without its tail at rest."""
    kept = _moving(record)
    return dataclasses.replace(record, time=record.time[kept], position=record.position[kept])


def _scales(servo: ServoParameters) -> tuple[FloatArray, FloatArray]:
    """(5,) scale and (5,) offset of the fit's variables: value = scale * x - offset, x near 1.

    Viscous friction and latency may be next to nothing; with the back-EMF and
    some milliseconds added, a relative step of the variable is never too small.
    """
    offset = np.array([0.0, 0.0, servo.back_emf, 0.0, _LATENCY_SCALE])
    scale = vector(start_of(servo)) + offset
    scale[1] = max(scale[1], 0.01 * servo.stall_torque)
    return scale, offset


def _fitted(records: Sequence[StepRecord], bench: Bench, iterations: int, start: ServoFit) -> ServoFit:
    """Least squares over all readings of moving shafts."""
    scale, offset = _scales(bench.servo)
    low, high = ((vector(end) + offset) / scale for end in limits_of(bench.servo))
    moving = [_trimmed(record) for record in records]
    simulated = StepBench(moving, bench)
    begin = np.clip((vector(start) + offset) / scale, low + 1e-3 * (high - low), high - 1e-3 * (high - low))

    def residual(x: FloatArray, _: Any = None) -> tuple[list[FloatArray], None, None]:
        curves = simulated.at_readings(_of_vector(np.ravel(x) * scale - offset))
        return [curve - r.position for curve, r in zip(curves, moving, strict=True)], None, None

    options = {"diff_step": _FD_STEP, "x_scale": "jac", "xtol": _TOLERANCE, "ftol": _TOLERANCE}
    sysid = load_sysid()
    if sysid is None:
        found = least_squares(
            lambda x: np.concatenate(residual(x)[0]),
            begin,
            bounds=(low, high),
            max_nfev=iterations,
            **options,
        ).x
        return _of_vector(found * scale - offset)
    parameters = sysid.ParameterDict({
        name: sysid.Parameter(name, begin[k], low[k], high[k]) for k, name in enumerate(NAMES)
    })  # fmt: skip
    # Its back end tells about every iteration, and that cannot be switched off.
    with contextlib.redirect_stdout(io.StringIO()):
        fitted, _ = sysid.optimize(
            parameters, residual, optimizer="scipy", verbose=False, max_iters=iterations, **options
        )
    return _of_vector(fitted.as_vector() * scale - offset)


def load_sysid() -> Any:
    """`mujoco.sysid`, or None: what it needs itself (`SYSID_NEEDS`) are optional parts of MuJoCo.

    Its least squares are SciPy's, so that without it the same fit is made directly.
    """
    # Its type marker makes checkers take MuJoCo for nothing but this package: imported by name.
    sysid: Any = importlib.import_module("mujoco.sysid")
    return sysid if hasattr(sysid, "optimize") else None


def _jackknife(parts: Sequence[FloatArray]) -> FloatArray:
    """(5,) standard errors from fits that each left one group out; NaN without any."""
    if not parts:
        return np.full(len(NAMES), np.nan)
    values = np.array(parts)
    count = len(parts)
    spread = np.sum((values - values.mean(axis=0)) ** 2, axis=0)
    return np.asarray(np.sqrt((count - 1) / count * spread))


def _at_bounds(fit: ServoFit, servo: ServoParameters) -> tuple[str, ...]:
    """Parameters that ended at a bound other than zero: friction and latency may well be nothing."""
    low, high = limits_of(servo)
    names = []
    for name in NAMES:
        value, least, most = (getattr(one, name) for one in (fit, low, high))
        room = 0.01 * (most - least)
        if value > most - room or (least > 0.0 and value < least + 0.1 * least):
            names.append(name)
    return tuple(names)


def _of_vector(values: FloatArray) -> ServoFit:
    table: Mapping[str, float] = dict(zip(NAMES, (float(value) for value in values), strict=True))
    return ServoFit(**table)
