"""What trunk levelling did, as plain arrays over time; beside it what was really there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray, LevelReport
from bluefoot_mpc.viz.series import RunSeries

_MISSING = LevelReport(
    share=0.0, training=False, stopped="", disturbance=np.full(3, np.nan), measured=np.full(3, np.nan),
    torque=np.full(N_JOINTS, np.nan), contact_force=np.full((N_LEGS, 3), np.nan), mse=np.nan, rate=np.nan,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelSeries:
    """Levelling of one run, n ticks; NaN where it reported nothing.

    Attributes:
        share: (n,) how far it acts on the goals, 0 to 1.
        training: (n,) True where the network learnt.
        stopped: (n,) True where it had disengaged itself.
        predicted: (n, 3) rad/s², what was predicted for the period that ends at each tick, base frame.
        measured: (n, 3) rad/s², what that period turned out to hold.
        load: (n, 4) N, estimated vertical ground force of each foot.
        load_truth: (n, 4) N, true vertical ground force; NaN without truth.
        mse: (n,) low-passed squared error of the network; NaN without one.
        rate: (n,) its learning rate; NaN without one.
    """

    share: FloatArray
    training: BoolArray
    stopped: BoolArray
    predicted: FloatArray
    measured: FloatArray
    load: FloatArray
    load_truth: FloatArray
    mse: FloatArray
    rate: FloatArray

    @property
    def acts(self) -> BoolArray:
        """(n,) True where it acts, fading included."""
        return self.share > 0.0

    @property
    def has_network(self) -> bool:
        """True where a network predicts."""
        return bool(np.isfinite(self.mse).any())

    @property
    def predicts(self) -> bool:
        """True where anything at all is predicted: attitude feedback alone predicts nothing."""
        return bool(np.nan_to_num(self.predicted).any())


def extract_leveling(run: RunData, series: RunSeries) -> LevelSeries | None:
    """What levelling did in a run; None where there was none.

    Args:
        run: the run.
        series: its time series, for the number of ticks.
    """
    n = len(series.time)
    telemetry, truth = run.telemetry[:n], run.truth[:n]
    if all(record.level is None for record in telemetry):
        return None
    reports = [record.level or _MISSING for record in telemetry]
    predicted = np.array([report.disturbance for report in reports])
    return LevelSeries(
        share=np.array([report.share for report in reports]),
        training=np.array([report.training for report in reports], dtype=np.bool_),
        stopped=np.array([bool(report.stopped) for report in reports], dtype=np.bool_),
        # A tick predicts the period that begins with it, and measures the one that ends with it.
        predicted=np.vstack([np.full((1, 3), np.nan), predicted[:-1]]),
        measured=np.array([report.measured for report in reports]),
        load=np.array([report.contact_force[:, 2] for report in reports]),
        load_truth=np.array([t.foot_force[:, 2] for t in truth]) if truth else np.full((n, N_LEGS), np.nan),
        mse=np.array([report.mse for report in reports]),
        rate=np.array([report.rate for report in reports]),
    )
