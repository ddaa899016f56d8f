"""The summary of a scripted run, against what was scripted."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
import pytest

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.runtime.summary import SUMMARY_KEYS, config_sha256, fell, summarize
from bluefoot_mpc.runtime.window import measurement_window
from bluefoot_mpc.types import Mode, MotionCommand, TrunkPose
from tests.runtime.made_up_run import CONFIG, PERIOD, make_run, record_ticks

MASS = 1.9
SPEED = 0.06
START = 1.0
DEGREE = math.pi / 180.0
CYCLE = 0.5
LAGS = np.array([0.0, 0.5, 0.5, 0.0])
WANTED_RPY = np.array([2.0, -3.0, 0.0]) * DEGREE


def scripted_walk(seconds: float = 9.0, yaw_rate: float = 0.0, heading: float = 0.7) -> RunData:
    """Stand for a second, then walk: 5 mm/s of drift to the left, half a degree of yaw drift,
    1 degree of roll off the command, a sine of 2 degrees in pitch, an estimate 0.3 and 0.4 degrees off."""
    run = make_run(round(seconds / PERIOD), seed=5)
    for k, sample in enumerate(run.truth):
        time = k * PERIOD
        walked = max(0.0, time - START)
        walks = walked > 0.0
        motion = MotionCommand(
            mode=Mode.WALK if walks else Mode.STAND,
            velocity=np.array([SPEED if walks else 0.0, 0.0]),
            yaw_rate=yaw_rate if walks else 0.0,
            trunk=TrunkPose(rpy=WANTED_RPY),
        )
        run.commands[k] = replace(run.commands[k], motion=motion)
        ripple = math.sin(2 * math.pi * time / CYCLE)
        turned = yaw_rate * walked
        rpy = WANTED_RPY + np.array([1.0, 2.0 * ripple, 0.5 * time / seconds]) * DEGREE
        rpy[2] += heading + turned
        off = np.array([0.3, -0.4, 0.0]) * DEGREE
        estimate = replace(run.telemetry[k].estimate, quaternion=quaternion_from_rpy(rpy + off))
        since_lift_off = ((time - START) / CYCLE - LAGS) % 1.0
        swing = (since_lift_off < 0.4) & walks
        # Positive while the leg swings, rising through zero at lift-off.
        y2 = np.where(
            since_lift_off < 0.7, np.minimum(since_lift_off, 0.4 - since_lift_off), since_lift_off - 1.0
        )
        run.telemetry[k] = replace(
            run.telemetry[k],
            mode=motion.mode,
            motion=motion,
            estimate=estimate,
            phase=replace(run.telemetry[k].phase, swing=swing, y2=y2),
        )
        position = position_after(walked, heading, yaw_rate)
        run.truth[k] = replace(
            sample,
            q=np.concatenate([position, quaternion_from_rpy(rpy), np.zeros(16)]),
            com=position,
            momentum=np.concatenate(
                [MASS * (position_after(walked + 1e-6, heading, yaw_rate) - position) * 1e6, np.zeros(3)]
            ),
            foot_height=0.011 * swing,
            motor_torque=np.full(16, 0.5) * (1.0 if k % 2 else -1.0),
            electrical_power=30.0,
        )
    return run


def position_after(walked: float, heading: float, yaw_rate: float) -> np.ndarray:
    drift = 0.005 * walked
    if yaw_rate == 0.0:
        along = SPEED * walked
        x, y = along, drift
    else:
        angle, radius = yaw_rate * walked, SPEED / yaw_rate
        x, y = radius * math.sin(angle), radius * (1.0 - math.cos(angle))
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * x - s * y, s * x + c * y, 0.115])


def test_keys_and_identity() -> None:
    summary = summarize(scripted_walk())
    assert tuple(summary) == SUMMARY_KEYS
    assert {key: summary[key] for key in CONFIG["run"]} == CONFIG["run"]
    assert summary["gait"] == "trot"
    assert summary["versions"]["bluefoot-mpc"]
    assert orjson.loads(orjson.dumps(summary)) == summary


def test_window_starts_two_seconds_after_the_last_change() -> None:
    run = scripted_walk()
    start, end = measurement_window(run)
    assert start == pytest.approx(START + PERIOD + 2.0)
    assert end == run.commands[-1].time
    assert summarize(run)["figures"]["window_s"] == [start, end]


@pytest.mark.parametrize("reason", ["completed", "interrupted"])
def test_the_rest_at_the_end_of_a_run_is_not_measured(reason: str) -> None:
    run = scripted_walk()
    whole = summarize(run)
    resting = MotionCommand(mode=Mode.OFF)
    last = len(run.commands) - 50
    run.commands[last:] = [replace(record, motion=resting) for record in run.commands[last:]]
    run.stop_reason = reason
    cut_short = summarize(run)
    assert cut_short["figures"]["window_s"][1] == run.commands[last - 1].time
    assert (cut_short["gait"], cut_short["speed_ref_mps"]) == ("trot", SPEED)
    assert cut_short["speed_mps"] == pytest.approx(whole["speed_mps"])
    assert summarize(run, window=(3.0, 1e3))["figures"]["window_s"] == [3.0, run.commands[last - 1].time]


def test_straight_walk() -> None:
    summary = summarize(scripted_walk())
    length = summary["figures"]["window_s"][1] - summary["figures"]["window_s"][0]
    expected = {
        "duration_s": 9.0,
        "speed_ref_mps": SPEED,
        "speed_mps": SPEED,
        "distance_m": SPEED * length,
        "lateral_drift_m": 0.005 * length,
        "yaw_drift_deg": 0.5 * length / 9.0,
        "roll_rms_deg": 1.0,
        "pitch_rms_deg": 2.0 / math.sqrt(2.0),
        "roll_peak_deg": 1.0,
        "pitch_peak_deg": 2.0,
        "attitude_error_rms_deg": 0.5,
        "swing_clearance_median_m": 0.011,
        "torque_peak_nm": 0.5,
        "torque_rms_nm": 0.5,
        "energy_j": 30.0 * length,
        "cost_of_transport": 30.0 / (MASS * GRAVITY * SPEED),
    }
    # The drift makes the path a little longer than the commanded axis; mass and angles follow within that.
    assert {key: summary[key] for key in expected} == pytest.approx(expected, rel=0.01)
    assert (summary["fell"], summary["success"], summary["stop_reason"]) == (False, True, "completed")
    assert summary["figures"]["lift_off_lags"] == pytest.approx(LAGS, abs=0.001)
    assert summary["figures"]["cycle_s"] == pytest.approx(CYCLE, abs=0.011)
    assert summary["figures"]["duty_factor"] == pytest.approx(0.6, abs=0.02)


def test_circle() -> None:
    summary = summarize(scripted_walk(yaw_rate=0.3))
    assert summary["speed_mps"] == pytest.approx(SPEED, rel=0.01)
    assert summary["lateral_drift_m"] == pytest.approx(0.0, abs=0.01)
    assert summary["figures"]["yaw_rate_ref_radps"] == 0.3
    assert summary["figures"]["yaw_rate_radps"] == pytest.approx(0.3 + 0.5 * DEGREE / 9.0, rel=1e-3)


def test_zmp_needs_three_feet_in_the_schedule() -> None:
    """In steady motion the point stays under the centre of mass; a trot has four feet down in between."""
    run = scripted_walk(heading=0.0)
    for k, sample in enumerate(run.truth):
        under = np.append(sample.com[:2], 0.0)
        run.truth[k] = replace(
            sample,
            foot_position=np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]) * 0.165
            + under
            + [0, 0, 0.008],
        )
    summary = summarize(run)
    assert summary["zmp_inside_fraction"] == 1.0
    assert summary["zmp_margin_min_m"] == pytest.approx(0.165, abs=1e-3)
    for k, told in enumerate(run.telemetry):
        two = replace(told.phase, swing=np.array([True, False, False, True]))
        run.telemetry[k] = replace(told, phase=two)
    summary = summarize(run)
    assert summary["zmp_inside_fraction"] is None
    assert summary["zmp_margin_min_m"] is None


def test_plan_margin_is_of_the_assumed_zmp_and_the_wanted_feet() -> None:
    run = scripted_walk()
    feet = np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]) * 0.1
    for k, told in enumerate(run.telemetry):
        wanted = replace(told.reference, foot_position=feet, swing=np.zeros(4, dtype=bool))
        run.telemetry[k] = replace(told, reference=wanted, zmp=np.array([0.0, 0.06 if k == 300 else 0.02]))
    assert summarize(run)["zmp_plan_margin_min_m"] == pytest.approx(0.04)


def test_ticks_and_deadlines() -> None:
    run = scripted_walk()
    for k, told in enumerate(run.telemetry):
        run.telemetry[k] = replace(told, tick_us=25000.0 if k == 17 else 300.0)
    summary = summarize(run)
    assert summary["deadline_misses"] == 1
    assert summary["tick_us"] == {"p50": 300.0, "p99": 300.0, "max": 25000.0}


def test_a_run_without_truth_has_no_figures_of_truth() -> None:
    run = scripted_walk()
    run.truth.clear()
    summary = summarize(run)
    unknown = [key for key in SUMMARY_KEYS if summary[key] is None]
    assert "speed_mps" in unknown
    assert "roll_rms_deg" in unknown
    assert summary["fell"] is False
    hottest = max(f.joint_temperature[f.joint_valid].max() for f in run.frames)
    assert summary["servo_temp_max_c"] == hottest
    assert summary["speed_ref_mps"] == SPEED


def test_commands_that_change_until_the_end_leave_no_window() -> None:
    run = scripted_walk()
    for k, record in enumerate(run.commands):
        run.commands[k] = replace(record, motion=replace(record.motion, yaw_rate=1e-3 * k))
    assert summarize(run)["roll_rms_deg"] is None
    assert summarize(run, window=(3.0, 6.0))["roll_rms_deg"] == pytest.approx(1.0)


def test_an_empty_run_has_a_summary() -> None:
    summary = summarize(RunData(stop_reason="the robot did not answer"))
    assert tuple(summary) == SUMMARY_KEYS
    assert summary["success"] is False
    assert summary["duration_s"] == 0.0


def test_scenarios_add_figures_and_judge() -> None:
    summary = summarize(scripted_walk(), success=False, figures={"pushes": np.int64(3), "angle": math.nan})
    assert summary["success"] is False
    assert summary["figures"]["pushes"] == 3
    assert summary["figures"]["angle"] is None


def test_a_log_gives_the_same_summary(tmp_path: Path) -> None:
    run = scripted_walk()
    run.real_time_factor = 11.0 / 3.0
    with Recorder(tmp_path / "log.mcap", run.config, run.period) as recorder:
        record_ticks(recorder, run)
        recorder.finish(run.stop_reason, run.real_time_factor)
    assert summarize(read_log(tmp_path / "log.mcap")) == summarize(run)


def test_hash_of_a_configuration_depends_on_values_only() -> None:
    assert config_sha256({"a": 1.0, "b": {"c": (1, 2)}}) == config_sha256({"b": {"c": [1, 2]}, "a": 1.0})
    assert config_sha256({"a": 1.0}) != config_sha256({"a": 1.0000001})
    assert len(config_sha256({})) == 64


def lying(run: RunData, first: int, last: int, mode: Mode) -> RunData:
    """The trunk touches the floor from tick `first` to `last`, in a mode."""
    for k in range(first, last):
        run.truth[k] = replace(run.truth[k], touching=("trunk",))
        run.telemetry[k] = replace(run.telemetry[k], mode=mode)
    return run


@pytest.mark.parametrize(("mode", "expected"), [(Mode.WALK, True), (Mode.STAND, True), (Mode.SAFE, True)])
def test_touching_the_world_is_a_fall(mode: Mode, expected: bool) -> None:
    assert fell(lying(scripted_walk(3.0), 50, 51, mode)) is expected


def test_sitting_on_the_floor_is_no_fall() -> None:
    run = lying(scripted_walk(3.0), 0, 20, Mode.OFF)
    lying(run, 20, 30, Mode.STAND)  # on the way up
    lying(run, 100, 150, Mode.SIT)
    assert not fell(run)
    assert fell(lying(run, 60, 61, Mode.WALK))


@pytest.mark.parametrize("with_truth", [True, False])
def test_tilting_is_a_fall(with_truth: bool) -> None:
    run = scripted_walk(3.0)
    for degrees, expected in ((44.0, False), (46.0, True)):
        lean = quaternion_from_rpy(np.array([0.0, degrees * DEGREE, 1.0]))
        q = run.truth[70].q.copy()
        q[3:7] = lean
        run.truth[70] = replace(run.truth[70], q=q)
        told = run.telemetry[70]
        run.telemetry[70] = replace(told, estimate=replace(told.estimate, quaternion=lean))
        assert fell(run if with_truth else replace_truth(run)) is expected


def replace_truth(run: RunData) -> RunData:
    return RunData(frames=run.frames, commands=run.commands, telemetry=run.telemetry)
