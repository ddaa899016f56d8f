"""Solvers that fail on purpose while the robot walks: it goes on, stands or sits, and never falls."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import Fallback, Mode, SensorFrame
from tests.control.closed_loop import after, play, walk
from tests.control.failing import (
    always_solving,
    break_preview,
    break_whole_body,
    failures,
    finite,
    rungs,
)

pytestmark = pytest.mark.slow

SOLVED, NEAREST, SHIFTED = Fallback.SOLVED, Fallback.NEAREST, Fallback.SHIFTED
STANCE, SIT = Fallback.STANCE, Fallback.SIT


@pytest.fixture(scope="module")
def model():
    return load_robot()


def trot(time):
    return walk(0.06)


def slow_walk(time):
    return walk(0.03, gait="walk")


def distance(trace, start, end):
    """M forward between two times, s."""
    inside = trace.position[trace.between(start, end), 0]
    return inside[-1] - inside[0]


@pytest.mark.parametrize("kind", ["failed", "infeasible", "late"])
def test_without_a_solver_forces_come_from_the_nearest_point_and_the_robot_walks_on(model, monkeypatch, kind):
    failure = break_whole_body(monkeypatch, helpers=False)
    trace = play(model, failure.during(trot, 2.5, 4.0, kind), 4.5, control=always_solving())
    assert rungs(trace, "whole_body") == [SOLVED, NEAREST, SOLVED]
    assert failures(trace) == 75
    assert trace.modes == [Mode.STAND, Mode.WALK]
    assert distance(trace, 2.5, 4.0) == pytest.approx(0.09, rel=0.15)
    assert trace.tilt_deg.max() < 1.5
    assert finite(trace)
    assert not trace.fell


@pytest.mark.parametrize("kind", ["nan", "rubbish"])
def test_what_a_solver_wrongly_calls_solved_never_moves_the_robot(model, monkeypatch, kind):
    failure = break_whole_body(monkeypatch, helpers=False)
    trace = play(model, failure.during(trot, 2.5, 3.5, kind), 4.0, control=always_solving())
    assert failures(trace) == 50
    assert finite(trace)
    assert trace.tilt_deg.max() < 3.0
    assert not trace.fell


def test_a_gap_of_some_ticks_is_bridged_by_the_last_forces(model, monkeypatch):
    failure = break_whole_body(monkeypatch, helpers=True)
    trace = play(model, failure.during(trot, 2.5, 2.6), 4.0, control=always_solving())
    assert rungs(trace, "whole_body") == [SOLVED, SHIFTED, SOLVED]
    assert failures(trace) == 5
    assert trace.modes == [Mode.STAND, Mode.WALK]
    assert distance(trace, 2.5, 4.0) == pytest.approx(0.09, rel=0.15)


def test_half_a_second_without_a_plan_makes_the_robot_stand_and_then_walk_again(model, monkeypatch):
    failure = break_whole_body(monkeypatch, helpers=True)
    trace = play(model, failure.during(trot, 2.5, 3.0), 7.5, control=always_solving())
    assert rungs(trace, "whole_body") == [SOLVED, SHIFTED, STANCE, SOLVED]
    standing = ~trace.walking & trace.between(2.5, 6.0)
    assert standing.any()
    assert not trace.swing[standing].any()
    assert trace.walking[-1]
    assert trace.tilt_deg.max() < 1.5
    assert not trace.fell


@pytest.mark.parametrize(
    ("gait", "speed", "start"), [("trot", 0.06, 2.5), ("trot", 0.3, 3.07), ("walk", 0.03, 3.3)]
)
def test_a_long_time_without_a_plan_makes_the_robot_sit_feet_first(model, monkeypatch, gait, speed, start):
    failure = break_whole_body(monkeypatch, helpers=True)
    source = failure.during(lambda t: walk(speed, gait=gait), start, start + 4.5)
    trace = play(model, source, start + 11.5, control=always_solving())
    assert rungs(trace, "whole_body") == [SOLVED, SHIFTED, STANCE, SIT, SOLVED]
    assert failures(trace) >= 225
    assert Mode.SIT in trace.modes
    failing = trace.between(start, start + 4.5)
    assert trace.height[failing][-10:].max() < 0.08
    assert not trace.swing[failing & (trace.height < 0.09)].any()
    # It gets up and goes on when there are plans again.
    assert trace.modes[-2:] == [Mode.STAND, Mode.WALK]
    assert trace.walking[-1]
    assert trace.tilt_deg.max() < (2.5 if speed < 0.2 else 4.0)
    assert finite(trace)
    assert "no plan from the whole-body problem for too long" in trace.events


def test_without_a_solver_the_preview_approximates_and_the_robot_walks_on(model, monkeypatch):
    failure = break_preview(monkeypatch, helpers=False)
    trace = play(model, failure.during(slow_walk, 3.0, 6.0), 7.0, control=preset("mpc"))
    assert set(rungs(trace, "preview")) <= {SOLVED, NEAREST}
    assert NEAREST in rungs(trace, "preview")
    assert failures(trace) > 10
    assert trace.modes == [Mode.STAND, Mode.WALK]
    assert not trace.fell
    assert trace.tilt_deg.max() < 2.0


def test_some_ticks_without_a_preview_are_bridged_by_the_last_plan(model, monkeypatch):
    failure = break_preview(monkeypatch, helpers=True)
    trace = play(model, failure.during(slow_walk, 4.0, 4.16), 6.0, control=preset("mpc"))
    assert rungs(trace, "preview") == [SOLVED, SHIFTED, SOLVED]
    assert trace.modes == [Mode.STAND, Mode.WALK]
    assert trace.tilt_deg.max() < 2.0
    assert not trace.fell


@pytest.mark.parametrize("start", [4.0, 4.2, 4.5, 4.8])
def test_a_lost_preview_ends_the_walk_and_the_robot_stands(model, monkeypatch, start):
    failure = break_preview(monkeypatch, helpers=True)
    trace = play(model, failure.during(slow_walk, start, 7.9), 12.0, control=preset("mpc"))
    assert rungs(trace, "preview")[:3] == [SOLVED, SHIFTED, STANCE]
    # At rest there is nothing to solve: the robot tries again after a while, not with every tick.
    stood = [Mode.WALK, Mode.STAND]
    assert trace.modes[:3] == [Mode.STAND, *stood]
    assert trace.modes.count(Mode.STAND) <= 3
    halted = trace.between(start + 0.9, start + 2.0)
    assert not trace.swing[halted].any()
    assert trace.walking[-1]
    assert trace.events.count("no plan from the preview") == trace.modes.count(Mode.STAND) - 1
    assert trace.tilt_deg.max() < 4.0
    assert finite(trace)
    assert not trace.fell


def test_a_trot_does_not_care_for_the_preview(model, monkeypatch):
    failure = break_preview(monkeypatch, helpers=True)
    trace = play(model, failure.during(trot, 0.0, 9.0), 3.0, control=preset("mpc"))
    assert failures(trace) == 0
    assert trace.walking[-1]


def nothing_but_nan(frame: SensorFrame) -> SensorFrame:
    nan = np.full_like(frame.imu.gyro, np.nan)
    return replace(
        frame,
        joint_position=np.full(16, np.nan),
        joint_speed=np.full(16, np.nan),
        joint_temperature=np.full(16, np.nan),
        voltage=float("nan"),
        imu=replace(frame.imu, gyro=nan, accel=nan, magnetometer=nan),
    )


@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_frames_without_a_number_in_them_give_finite_commands_and_no_fall(model, gait):
    source = after((0.0, walk(0.03, gait=gait)))
    trace = play(model, source, 8.0, control=preset("mpc"), fault=(nothing_but_nan, 3.0, 3.3))
    assert finite(trace)
    assert not trace.fell
    assert trace.tilt_deg.max() < 3.0
    assert trace.walking[-1]


@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_a_reset_pipeline_plans_the_same_again_bit_for_bit(model, gait):
    other = "walk" if gait == "trot" else "trot"
    source = after((0.0, walk(0.05, gait=gait)), (2.0, walk(0.05, gait=other)))
    trace = play(model, source, 4.0, control=preset("mpc"), seed=2)
    pipeline = Pipeline(model, preset("mpc"), 0.02)
    for _ in range(2):
        pipeline.reset()
        for k, (frame, output) in enumerate(zip(trace.frames, trace.outputs, strict=True)):
            again = pipeline.step(frame, source(k * 0.02))
            np.testing.assert_array_equal(again.command.position, output.command.position)
            if output.telemetry.plan is not None:
                np.testing.assert_array_equal(again.telemetry.plan.torque, output.telemetry.plan.torque)
                np.testing.assert_array_equal(again.telemetry.plan.com, output.telemetry.plan.com)
