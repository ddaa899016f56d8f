"""What the pipeline hands from stage to stage; whole runs are in `test_closed_loop`."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import BLIND, Pipeline
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import BodyState, Mode, SafetyLevel, SafetyRequest
from bluefoot_mpc.zmp.placement import PlacementConfig
from tests.control.closed_loop import mode, walk
from tests.io.safety.scripted import make_frame

DT = 0.02


@pytest.fixture(scope="module")
def model():
    return load_robot()


STILL = PlacementConfig(enabled=False)


class Bench:
    """A pipeline whose estimate is set by hand, and what it gave to the gait."""

    def __init__(self, model, monkeypatch, **config):
        self.pipeline = Pipeline(model, ControlConfig(**config), DT)
        self.joints = model.stance_joints
        feet = model.parameters.stance.foot_position - np.array([0.0, 0.0, 0.115])
        self.estimate = BodyState(
            time=0.0, position=np.zeros(3), quaternion=np.array([0.0, 0.0, 0.0, 1.0]), rpy=np.zeros(3),
            linear_velocity=np.zeros(3), angular_velocity=np.zeros(3), joint_position=self.joints,
            joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool), foot_position_in_base=feet,
            height=0.112,
        )  # fmt: skip
        self.inputs = []
        gait_step = self.pipeline._gait.step
        monkeypatch.setattr(self.pipeline._estimator, "step", lambda frame: self.estimate)
        monkeypatch.setattr(
            self.pipeline._gait,
            "step",
            lambda inputs, dt: (self.inputs.append(inputs), gait_step(inputs, dt))[1],
        )

    def run(self, seconds, motion, safety=None, **estimate):
        self.estimate = replace(
            self.estimate, **{k: np.array(v) if isinstance(v, list) else v for k, v in estimate.items()}
        )
        outputs = [
            self.pipeline.step(make_frame(joint_position=self.joints), motion, safety)
            for _ in range(round(seconds / DT))
        ]
        return outputs[-1]


@pytest.fixture
def bench(model, monkeypatch):
    made = Bench(model, monkeypatch)
    made.run(1.2, mode(Mode.STAND))
    return made


def test_the_sway_is_no_error_of_speed(model, monkeypatch):
    bench = Bench(model, monkeypatch)
    bench.run(1.2, mode(Mode.STAND))
    planner = bench.pipeline._trunk
    bench.run(DT, walk(0.05, gait="walk"), linear_velocity=[0.0, 0.0, 0.0])
    for _ in range(200):
        measured = [0.05 + planner.velocity[0], planner.velocity[1], 0.0]
        bench.run(DT, walk(0.05, gait="walk"), linear_velocity=measured)
    sway = np.ptp([inputs.velocity for inputs in bench.inputs[-150:]], axis=0)
    np.testing.assert_allclose(sway, 0.0, atol=1e-9)


def test_it_stands_up_before_it_walks(model, monkeypatch):
    bench = Bench(model, monkeypatch)
    assert bench.run(0.98, walk(0.06)).telemetry.mode is Mode.STAND
    assert bench.run(0.06, walk(0.06)).telemetry.mode is Mode.WALK


def test_odometry_is_turned_by_tilt_and_by_the_trunks_yaw(model, monkeypatch):
    bench = Bench(model, monkeypatch, zmp=STILL)
    bench.run(1.2, mode(Mode.STAND))
    looking_left = replace(mode(Mode.STAND), trunk=walk(rpy=[0.0, 0.0, 0.3]).trunk)
    bench.run(1.0, looking_left, rpy=[0.0, 0.0, 0.3])
    c, s, ct, st = np.cos(0.3), np.sin(0.3), np.cos(0.2), np.sin(0.2)
    # The robot goes straight on as commanded while its trunk looks left: nothing to correct ...
    forward = walk(0.05, rpy=[0.0, 0.0, 0.3])
    bench.run(2.0, forward, linear_velocity=[0.05 * c, -0.05 * s, 0.0])
    np.testing.assert_allclose(bench.inputs[-1].velocity, [0.05, 0.0], atol=1e-12)
    # ... and a trunk that tips while it goes forward sees some of that speed downwards ...
    bench.run(1.0, forward, rpy=[0.0, 0.2, 0.3], linear_velocity=[0.05 * c * ct, -0.05 * s, 0.05 * c * st])
    np.testing.assert_allclose(bench.inputs[-1].velocity, [0.05, 0.0], atol=1e-12)


def test_a_trunk_that_looks_elsewhere_does_not_turn_the_robot(bench):
    bench.run(0.5, walk(0.05))
    for step in range(1, 41):
        yaw = min(0.3, 0.6 * DT * step)
        bench.run(DT, walk(0.05, rpy=[0.0, 0.0, 0.3]), rpy=[0.0, 0.0, max(0.0, yaw - 0.6 * DT)])
    assert bench.pipeline._trunk.yaw == pytest.approx(0.3)
    assert abs(bench.inputs[-1].yaw_rate) < 0.02
    bench.run(0.5, walk(0.05, rpy=[0.0, 0.0, 0.3]), rpy=[0.0, 0.0, 0.4])  # a turn that nobody wanted
    assert bench.inputs[-1].yaw_rate < -0.07


def test_feet_and_trunk_go_to_the_gait_in_the_virtual_robots_frame(bench, model):
    bench.run(2.0, walk(0.05, position=[0.02, 0.0, 0.0], rpy=[0.0, 0.0, 0.2]), rpy=[0.0, 0.0, 0.2])
    inputs = bench.inputs[-1]
    np.testing.assert_allclose(inputs.trunk_position[:2], bench.pipeline._trunk.position[:2], atol=1e-5)
    assert inputs.trunk_position[2] == 0.112  # as estimated, and not as wanted
    c, s = np.cos(0.2), np.sin(0.2)
    feet = bench.estimate.foot_position_in_base
    turned = np.column_stack([c * feet[:, 0] - s * feet[:, 1], s * feet[:, 0] + c * feet[:, 1]])
    np.testing.assert_allclose(inputs.foot_position[:, :2], turned + inputs.trunk_position[:2], atol=1e-12)
    np.testing.assert_allclose(inputs.foot_position[:, 2], 0.112 - 0.115, atol=1e-12)


def test_commanded_rates_are_no_fall(bench):
    bench.run(0.1, walk(0.05, rpy=[0.3, 0.0, 0.0]), angular_velocity=[0.6, 0.1, 0.0])
    # The trunk follows at 0.6 rad/s, one tick later than it was wanted.
    np.testing.assert_allclose(bench.inputs[-1].tilt_rate_error, [0.0, 0.1], atol=0.01)


def test_rates_are_seen_in_the_virtual_robots_frame(bench):
    bench.run(1.0, walk(0.05, rpy=[0.0, 0.0, 0.3]), rpy=[0.0, 0.0, 0.3], angular_velocity=[0.5, 0.0, 0.0])
    expected = [0.5 * np.cos(0.3), 0.5 * np.sin(0.3)]
    np.testing.assert_allclose(bench.inputs[-1].tilt_rate_error, expected, atol=1e-9)


def test_a_blind_estimate_ends_motion_and_reflex_and_is_told_once(bench):
    bench.run(0.5, walk(0.05))
    outputs = [bench.run(DT, walk(0.05), healthy=False, angular_velocity=[2.0, 0.0, 0.0]) for _ in range(3)]
    assert [output.telemetry.events.count(BLIND) for output in outputs] == [1, 0, 0]
    np.testing.assert_array_equal(bench.inputs[-1].velocity, 0.0)
    np.testing.assert_array_equal(bench.inputs[-1].tilt_rate_error, 0.0)
    assert outputs[-1].telemetry.mode is Mode.WALK
    output = bench.run(DT, walk(0.05), healthy=True)
    assert np.hypot(*bench.inputs[-1].velocity) > 0.04
    assert BLIND not in output.telemetry.events


@pytest.mark.parametrize("tilt", [[0.9, 0.0, 0.0], [0.0, -0.9, 0.0], [0.6, 0.6, 0.0], [np.pi, 0.0, 0.0]])
def test_a_fall_makes_it_safe_and_limp_and_halts_the_gait(bench, tilt):
    bench.run(0.5, walk(0.05))
    output = bench.run(0.6, walk(0.05), rpy=tilt)
    assert output.telemetry.mode is Mode.SAFE
    assert bench.inputs[-1].halt
    np.testing.assert_array_equal(output.command.torque_limit, 0.0)


def test_a_tilt_that_is_no_fall_is_none(bench):
    assert bench.run(0.5, walk(0.05), rpy=[0.0, 0.7, 0.0]).telemetry.mode is Mode.WALK


def test_a_yaw_is_no_tilt(bench):
    assert bench.run(0.5, walk(0.05), rpy=[0.0, 0.0, 3.0]).telemetry.mode is Mode.WALK


def test_motion_is_cut_while_the_gait_is_told_to_end(bench):
    bench.run(0.5, walk(0.05))
    bench.run(0.1, mode(Mode.STAND))
    assert bench.pipeline._modes.ending > 0.0
    # The command comes back before the feet are down: first they come to rest.
    output = bench.run(DT, walk(0.05))
    np.testing.assert_array_equal(output.telemetry.motion.velocity, 0.0)


def test_a_stop_ends_the_gait_at_once_and_a_hold_ends_it_gently(bench):
    bench.run(0.5, walk(0.05))
    bench.run(DT, walk(0.05), SafetyRequest(level=SafetyLevel.HOLD, reasons=("silence",)))
    assert not bench.inputs[-1].halt
    output = bench.run(DT, walk(0.05), SafetyRequest(level=SafetyLevel.STOP, reasons=("empty", "hot")))
    assert bench.inputs[-1].halt
    assert output.telemetry.events == ("mode walk -> safe empty; hot",)


def test_the_trunk_keeps_its_pose_in_every_mode(bench):
    output = bench.run(1.0, mode(Mode.STAND))
    stand = replace(mode(Mode.STAND), trunk=walk(rpy=[0.1, 0.0, 0.0]).trunk)
    output = bench.run(1.0, stand, rpy=[0.1, 0.0, 0.0])
    assert output.telemetry.reference.trunk_rpy[0] == pytest.approx(0.1, abs=0.02)


def test_a_stance_out_of_reach_is_refused(model):
    with pytest.raises(ConfigurationError, match="stance is out of reach"):
        Pipeline(model, ControlConfig(posture=PostureConfig(stance_x=0.4)), DT)


def test_blind_over_rough_ground_no_foot_lifts_any_more(bench, monkeypatch):
    bench.run(0.2, walk(0.02))
    bench.run(DT, walk(0.02), healthy=False)
    assert not bench.inputs[-1].halt
    guidance = bench.pipeline._guidance
    guide = guidance.step

    def over_rough_ground(*args, **kwargs):
        found = guide(*args, **kwargs)
        guidance.ground = object()
        return found

    monkeypatch.setattr(guidance, "step", over_rough_ground)
    monkeypatch.setattr(bench.pipeline._placer, "step", lambda *_: None)
    bench.run(DT, walk(0.02))
    assert bench.inputs[-1].halt
    bench.run(DT, walk(0.02), healthy=True)
    assert not bench.inputs[-1].halt
    assert bench.inputs[-1].rough
