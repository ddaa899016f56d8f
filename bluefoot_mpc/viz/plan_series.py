"""What the model-based stages planned, as plain arrays over time; beside it what became of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray, PlanReport
from bluefoot_mpc.viz.series import RunSeries, from_virtual

_MISSING = PlanReport(
    com=np.full((3, 2), np.nan), margin=np.nan, foot_force=np.full((N_LEGS, 3), np.nan),
    torque=np.full(N_JOINTS, np.nan), residual=np.nan,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanSeries:
    """Plans of one run, n ticks; NaN where a stage planned nothing.

    Attributes:
        load: (n, 4) N, planned vertical ground force of each foot.
        load_truth: (n, 4) N, true vertical ground force; NaN without truth.
        torque: (n, 16) N·m, planned joint torques.
        com: (n, 2) m, planned centre of mass, world frame.
        preview: (n,) rung of the ladder that the motion comes from.
        whole_body: (n,) rung that forces and torques come from.
        failures: (n,) problems without an optimum so far.
        late: (n,) ticks so far that took longer than the command period.
    """

    load: FloatArray
    load_truth: FloatArray
    torque: FloatArray
    com: FloatArray
    preview: FloatArray
    whole_body: FloatArray
    failures: FloatArray
    late: FloatArray

    @property
    def has_forces(self) -> bool:
        """True where ground forces and torques were planned."""
        return bool(np.isfinite(self.load).any())

    @property
    def has_motion(self) -> bool:
        """True where a motion of the centre of mass was planned."""
        return bool(np.isfinite(self.com).any())


def extract_plans(run: RunData, series: RunSeries) -> PlanSeries | None:
    """The plans of a run; None where it has none.

    Args:
        run: the run.
        series: its time series, for the number of ticks and the way over ground.
    """
    n = len(series.time)
    telemetry, truth = run.telemetry[:n], run.truth[:n]
    if all(t.plan is None for t in telemetry):
        return None
    plans = [t.plan or _MISSING for t in telemetry]
    load = np.array([plan.foot_force[:, 2] for plan in plans])
    com = np.array([plan.com[0] for plan in plans])
    moved, pushed = np.isfinite(com[:, 0]), np.isfinite(load[:, 0])
    return PlanSeries(
        load=load,
        load_truth=np.array([t.foot_force[:, 2] for t in truth]) if truth else np.full((n, N_LEGS), np.nan),
        torque=np.array([plan.torque for plan in plans]),
        com=_in_world(com, run, series),
        preview=_rungs([plan.preview for plan in plans], moved),
        whole_body=_rungs([plan.whole_body for plan in plans], pushed),
        failures=np.cumsum([float(plan.qp_failures) for plan in plans]),
        late=np.array([float(t.deadline_misses) for t in telemetry]),
    )


def _rungs(values: list[int], known: BoolArray) -> FloatArray:
    return np.where(known, np.array(values, dtype=np.float64), np.nan)


def _in_world(points: FloatArray, run: RunData, series: RunSeries) -> FloatArray:
    """(n, 2) m, points of b' carried over to the ground by the feet that stand, as all plans are drawn."""
    n = len(series.time)
    wanted = np.array([t.reference.foot_position[:, :2] for t in run.telemetry[:n]])
    yaw = series.rpy_truth[:, 2] if series.has_truth else series.rpy_estimate[:, 2]
    return np.asarray(from_virtual(points[None], wanted, series.feet[:, :, :2], series.scheduled, yaw)[0])
