"""What the pipeline makes of a guided task; the navigator itself is tested where it stands."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control import guidance
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.navigation.navigator import Decision
from bluefoot_mpc.types import (
    BodyState,
    Guide,
    Guided,
    GuideTask,
    Mode,
    MotionCommand,
    NavigationReport,
    SafetyLevel,
    SafetyRequest,
    TrunkPose,
)
from tests.control.closed_loop import mode
from tests.io.safety.scripted import make_frame

DT = 0.02
WANDER = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.WANDER, speed=0.2))


class ScriptedNavigator:
    """Decides the same on every tick and notes what it was asked."""

    def __init__(self, config, mounts):
        self.steps, self.resets, self.begins, self.guided = [], 0, 0, Guided.FIELD
        self.yaw_rate = 0.3

    def begin(self):
        self.begins += 1

    def reset(self):
        self.resets += 1

    def step(self, guide, frame, estimate, dt):
        self.steps.append((guide, frame, estimate))
        report = NavigationReport(
            guided=self.guided, reason="why", velocity=np.array([0.1, 0.02]), yaw_rate=0.3, pitch=0.05,
            field=np.zeros(2), potential=0.0, mixing=0.0, marker=np.full(3, math.nan),
            marker_position=np.full(3, math.nan), marker_age=math.inf, clearance=math.inf,
        )  # fmt: skip
        return Decision(velocity=np.array([0.1, 0.02]), yaw_rate=self.yaw_rate, pitch=0.05, report=report)


@pytest.fixture
def pipeline(monkeypatch):
    monkeypatch.setattr(guidance, "Navigator", ScriptedNavigator)
    robot = load_robot()
    made = Pipeline(robot, ControlConfig(), DT)
    feet = robot.parameters.stance.foot_position - np.array([0.0, 0.0, 0.115])
    made.estimate = BodyState(
        time=0.0, position=np.zeros(3), quaternion=np.array([0.0, 0.0, 0.0, 1.0]), rpy=np.zeros(3),
        linear_velocity=np.zeros(3), angular_velocity=np.zeros(3), joint_position=robot.stance_joints,
        joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool), foot_position_in_base=feet, height=0.112,
    )  # fmt: skip
    monkeypatch.setattr(made._estimator, "step", lambda frame: made.estimate)
    made.frame = make_frame(joint_position=robot.stance_joints)
    for _ in range(100):
        made.step(made.frame, mode(Mode.STAND))
    return made


def run(pipeline, motion, ticks=3, safety=None):
    return [pipeline.step(pipeline.frame, motion, safety) for _ in range(ticks)][-1].telemetry


def test_navigation_decides_velocity_turn_and_trunk_whatever_trunk_is_commanded(pipeline):
    tilted = replace(WANDER, trunk=TrunkPose(rpy=np.array([0.02, 0.01, 0.1])))
    telemetry = run(pipeline, tilted)
    np.testing.assert_array_equal(telemetry.motion.velocity, [0.1, 0.02])
    assert telemetry.motion.yaw_rate == 0.3
    np.testing.assert_allclose(telemetry.motion.trunk.rpy, [0.0, 0.05, 0.0])
    assert telemetry.navigation.guided is Guided.FIELD
    guide, frame, estimate = pipeline._guidance._navigator.steps[-1]
    assert guide is tilted.guide
    assert frame is pipeline.frame
    assert estimate is pipeline.estimate


def test_without_a_task_navigation_is_not_asked(pipeline):
    assert run(pipeline, replace(WANDER, guide=None)).navigation is None
    assert pipeline._guidance._navigator.steps == []
    run(pipeline, WANDER)
    telemetry = run(pipeline, replace(WANDER, guide=None), ticks=2)
    assert telemetry.navigation is None
    np.testing.assert_array_equal(telemetry.motion.velocity, 0.0)


@pytest.mark.parametrize(("gap", "forgets"), [(3.0, False), (30.0, True)])
def test_the_surroundings_outlast_a_gap_in_the_radio_but_no_long_pause(pipeline, gap, forgets):
    run(pipeline, WANDER)
    resets = pipeline._guidance._navigator.resets
    run(pipeline, replace(WANDER, guide=None))
    pipeline.frame = replace(pipeline.frame, time=pipeline.frame.time + gap)
    run(pipeline, WANDER)
    assert pipeline._guidance._navigator.resets == resets + forgets
    assert pipeline._guidance._navigator.begins == (not forgets)  # the task itself is a new one


@pytest.mark.parametrize("cause", ["mode", "supervisor", "estimate"])
def test_a_robot_that_must_not_walk_does_not_whatever_navigation_wants(pipeline, cause):
    run(pipeline, WANDER)
    asked = len(pipeline._guidance._navigator.steps)
    motion, safety = WANDER, None
    if cause == "mode":
        motion = replace(WANDER, mode=Mode.STAND)
    elif cause == "supervisor":
        safety = SafetyRequest(level=SafetyLevel.SIT, reasons=("test",))
    else:
        pipeline.estimate = replace(pipeline.estimate, healthy=False)
    telemetry = run(pipeline, motion, safety=safety)
    np.testing.assert_array_equal(telemetry.motion.velocity, 0.0)
    assert telemetry.motion.yaw_rate == 0.0
    assert telemetry.navigation is None
    assert len(pipeline._guidance._navigator.steps) <= asked + 1


def test_trouble_and_arrival_are_told_once_when_they_begin(pipeline):
    def told(guided, ticks):
        pipeline._guidance._navigator.guided = guided
        outputs = [pipeline.step(pipeline.frame, WANDER, None).telemetry for _ in range(ticks)]
        return [e for telemetry in outputs for e in telemetry.events if e.startswith("navigation")]

    assert told(Guided.FIELD, 3) == []
    assert told(Guided.BLIND, 3) == ["navigation: nothing to go by, the robot stands: why"]
    assert told(Guided.FIELD, 1) == []
    assert told(Guided.ARRIVED, 2) == ["navigation: at the end of the way: why"]


def test_a_decision_that_is_no_number_is_not_walked(pipeline):
    run(pipeline, WANDER)
    pipeline._guidance._navigator.yaw_rate = math.nan
    telemetry = run(pipeline, replace(WANDER, velocity=np.array([0.1, 0.0]), yaw_rate=0.2))
    assert telemetry.motion.yaw_rate == 0.0
    np.testing.assert_array_equal(telemetry.motion.velocity, 0.0)
    assert any("no number" in event for event in telemetry.events)
