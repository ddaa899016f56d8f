from __future__ import annotations

import numpy as np
import pytest

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.packing import envelope, pack, stretches
from bluefoot_mpc.viz.series import extract, from_virtual


def test_truth_and_estimate_are_both_there(run: RunData) -> None:
    series = extract(run, 1.5)
    n = len(run.telemetry)
    assert series.q.shape == (n, 23)
    assert series.has_truth
    np.testing.assert_allclose(series.rpy_truth, series.rpy_estimate, atol=0.01)
    np.testing.assert_allclose(series.torque, [t.motor_torque for t in run.truth])
    assert series.duration == pytest.approx(n * 0.02 - 0.02)


def test_hardware_run_is_drawn_from_the_estimate(hardware_run: RunData) -> None:
    series = extract(hardware_run, 1.5)
    assert not series.has_truth
    assert np.isnan(series.rpy_truth).all()
    assert np.isfinite(series.feet).all()
    np.testing.assert_allclose(series.torque, 1.5 * np.array([f.joint_load for f in hardware_run.frames]))
    standing = series.feet[10]
    np.testing.assert_allclose(standing[:, 2], 0.0, atol=0.005)


def test_empty_and_ragged_runs(run: RunData) -> None:
    assert extract(RunData(), 1.5).q.shape == (0, 23)
    ragged = RunData(
        frames=run.frames[:9], commands=run.commands[:9], telemetry=run.telemetry[:8], truth=run.truth[:7]
    )
    assert len(extract(ragged, 1.5).time) == 7
    assert (
        len(
            extract(
                RunData(frames=run.frames[:1], commands=run.commands[:1], telemetry=run.telemetry[:1]), 1.5
            ).time
        )
        == 1
    )


def test_reference_meets_the_trunk_where_the_feet_are_as_planned(run: RunData) -> None:
    series = extract(run, 1.5)
    walking = np.flatnonzero(series.walking)[30:]
    # The synthetic robot follows its plan, but for the noise-free heading of up to 0.6 degrees.
    assert np.abs(series.reference[walking] - series.q[walking, :2]).max() < 0.004


def test_virtual_frame_turns_with_the_heading() -> None:
    feet = np.array([[[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]]])
    yaw = np.array([0.5 * np.pi])
    turned = np.stack([3.0 - feet[..., 1], 4.0 + feet[..., 0]], axis=-1)
    stance = np.array([[True, False, False, True]])
    point = from_virtual(np.array([[[0.1, 0.05]]]), feet, turned, stance, yaw)
    np.testing.assert_allclose(point, [[[2.95, 4.1]]], atol=1e-12)


def test_envelope_keeps_peaks() -> None:
    time = np.arange(10_000) * 0.02
    values = np.zeros((10_000, 2))
    values[1234, 0], values[7777, 1] = 5.0, -3.0
    thin_time, thin = envelope(time, values, 1000)
    assert len(thin_time) == len(thin) <= 1000
    assert (thin.max(), thin.min()) == (5.0, -3.0)
    assert np.all(np.diff(thin_time) > 0.0)


def test_stretches_and_packing() -> None:
    time = np.arange(6) * 0.1
    active = np.array([True, True, False, False, True, True])
    np.testing.assert_allclose(stretches(active, time, 0.1), [(0.0, 0.2), (0.4, 0.6)])
    assert stretches(np.zeros(0, dtype=bool), np.zeros(0), 0.1) == []
    assert pack(np.zeros((2, 3)))["shape"] == "2, 3"
