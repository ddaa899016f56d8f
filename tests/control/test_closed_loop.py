"""The whole controller on the simulated robot: modes, motion and trunk pose in closed loop."""

import numpy as np
import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.io.safety import SafetyConfig, SafetySupervisor
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import Mode, SafetyLevel, SafetyRequest
from tests.control.closed_loop import Trace, after, mode, play, walk

pytestmark = pytest.mark.slow

STAND = mode(Mode.STAND)


@pytest.fixture(scope="module")
def model():
    return load_robot()


def mean_velocity(trace: Trace, start: float, heading: float = 0.0) -> np.ndarray:
    """(2,) m/s along and to the left of a world heading, from `start` to the end."""
    inside = trace.between(start, np.inf)
    way = np.diff(trace.position[inside][[0, -1], :2], axis=0)[0] / np.diff(trace.time[inside][[0, -1]])[0]
    c, s = np.cos(heading), np.sin(heading)
    return np.array([c * way[0] + s * way[1], c * way[1] - s * way[0]])


def test_every_mode_is_reached_and_left_again(model):
    source = after(
        (0.0, STAND), (0.5, walk(0.06)), (2.5, STAND), (4.0, mode(Mode.SIT)), (6.0, mode(Mode.OFF)),
        (7.5, STAND), (9.5, walk(0.06)),
    )  # fmt: skip
    trace = play(model, source, 10.5)
    assert trace.modes == [Mode.STAND, Mode.WALK, Mode.STAND, Mode.SIT, Mode.OFF, Mode.STAND, Mode.WALK]
    assert trace.tilt_deg.max() < 2.0
    height = dict(zip(np.round(trace.time, 2).tolist(), trace.height, strict=True))
    assert height[2.4] > 0.115
    assert height[5.9] < 0.08  # sits
    assert height[7.4] < 0.045  # limp, on its belly
    assert height[9.4] > 0.115  # up again
    torque = np.array([output.command.torque_limit[0] for output in trace.outputs])
    assert np.all(torque[trace.between(0.0, 6.0)] == 1.0)
    assert np.all(torque[trace.between(7.0, 7.4)] == 0.0)
    assert np.all(torque[trace.between(8.1, 10.5)] == 1.0)
    assert trace.swing[-50:].any()


@pytest.mark.parametrize("gait", ["trot", "walk"])
@pytest.mark.parametrize("stop", [2.5, 2.63, 2.77])
def test_walking_ends_with_all_feet_down_under_the_trunk(model, gait, stop):
    trace = play(model, after((0.0, walk(0.06, gait=gait)), (stop, STAND)), 6.0)
    at_rest = np.flatnonzero(~trace.walking & (trace.time > stop))
    assert at_rest.size
    end = at_rest[0]
    assert trace.time[end] - stop < 3.0
    assert trace.modes == [Mode.STAND, Mode.WALK, Mode.STAND]
    # No foot stays in the air, and none is left behind.
    assert not trace.swing[end:].any()
    assert trace.frames[-1].contact.all()
    feet = trace.outputs[-1].telemetry.reference.foot_position
    np.testing.assert_allclose(np.abs(feet[:, :2]), 0.165, atol=0.003)
    np.testing.assert_array_equal(feet[:, 2], 0.0)
    # The trunk may still sway back over the feet; these stay.
    standing = np.array([truth.foot_position for truth in trace.truth[end + 25 :]])
    assert np.ptp(standing, axis=0).max() < 0.004
    assert np.abs(trace.trunk_over_feet[-1]).max() < 0.006
    assert not trace.fell


@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_walks_again_when_the_command_comes_back_before_it_stood_still(model, gait):
    source = after((0.0, walk(0.06, gait=gait)), (2.0, STAND), (2.1, walk(0.06, gait=gait)))
    trace = play(model, source, 8.0)
    assert not trace.fell
    assert mean_velocity(trace, 5.5)[0] == pytest.approx(0.06, rel=0.15)


@pytest.mark.parametrize("gait", ["trot", "walk"])
@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_turns_in_place(model, gait, rate):
    trace = play(model, lambda t: walk(yaw_rate=rate, gait=gait), 8.0)
    inside = trace.between(2.0, np.inf)
    seen = np.diff(trace.yaw[inside][[0, -1]])[0] / np.diff(trace.time[inside][[0, -1]])[0]
    assert seen == pytest.approx(rate, rel=0.05)
    assert np.hypot(*trace.position[-1, :2]) < 0.04
    assert trace.tilt_deg.max() < 2.5


@pytest.mark.parametrize("gait", ["trot", "walk"])
@pytest.mark.parametrize(("forward", "left"), [(0.0, 0.04), (0.0, -0.04), (-0.04, 0.0), (0.03, 0.03)])
def test_walks_in_every_direction(model, gait, forward, left):
    trace = play(model, lambda t: walk(forward, left, gait=gait), 10.0)
    assert not trace.fell
    # The walk's trunk sways by 20 mm, which a mean over six seconds does not quite lose.
    np.testing.assert_allclose(
        mean_velocity(trace, 4.0), [forward, left], atol=0.005 if gait == "trot" else 0.01
    )
    assert np.abs(trace.yaw).max() < 0.06


POSES = {
    "roll": ([0.0, 0.0, 0.0], [0.12, 0.0, 0.0]),
    "pitch": ([0.0, 0.0, 0.0], [0.0, -0.12, 0.0]),
    "yaw": ([0.0, 0.0, 0.0], [0.0, 0.0, 0.2]),
    "place": ([0.02, -0.015, 0.01], [0.0, 0.0, 0.0]),
}


@pytest.mark.parametrize("name", POSES)
@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_the_trunk_takes_its_pose_while_walking_and_the_way_stays_the_same(model, gait, name):
    position, rpy = POSES[name]
    source = after((0.0, walk(0.05, gait=gait)), (2.0, walk(0.05, gait=gait, position=position, rpy=rpy)))
    trace = play(model, source, 9.0)
    inside = trace.between(5.0, np.inf)
    np.testing.assert_allclose(trace.rpy[inside].mean(axis=0), rpy, atol=0.035)
    assert trace.height[inside].mean() == pytest.approx(0.121 + position[2], abs=0.003)
    np.testing.assert_allclose(mean_velocity(trace, 5.0), [0.05, 0.0], atol=0.01)
    offset = trace.trunk_over_feet[inside].mean(axis=0)
    np.testing.assert_allclose(offset, position[:2], atol=0.012)
    assert not trace.fell


def test_a_gait_change_and_a_stop_at_once(model):
    source = after((0.0, walk(0.05)), (3.0, walk(0.05, gait="walk")), (3.6, STAND))
    trace = play(model, source, 8.0)
    assert not trace.fell
    assert trace.modes[-1] is Mode.STAND
    assert trace.frames[-1].contact.all()


@pytest.mark.parametrize(
    ("level", "last"),
    [(SafetyLevel.HOLD, Mode.STAND), (SafetyLevel.SIT, Mode.SIT), (SafetyLevel.STOP, Mode.SAFE)],
)
def test_the_supervisor_ends_a_walk_feet_first(model, level, last):
    robot = SimRobot(model, SimConfig())
    safety = SafetySupervisor(robot, model.lower, model.upper, SafetyConfig())
    pipeline = Pipeline(model, ControlConfig(), robot.period)
    frame, trace = safety.reset(), Trace()
    for k in range(350):
        request = SafetyRequest(level=level, reasons=("a reason",)) if k >= 107 else SafetyRequest()
        trace.add(frame, pipeline.step(frame, walk(0.08), request), robot.truth())
        frame = safety.step(trace.outputs[-1].command)
    assert trace.modes == [Mode.STAND, Mode.WALK, last]
    entered = next(k for k, out in enumerate(trace.outputs) if k > 107 and out.telemetry.mode is last)
    sinking = np.flatnonzero(trace.height < 0.112)
    if level is SafetyLevel.HOLD:
        assert not sinking.size
    else:
        # SAFE is entered at once, but the body sinks only when the feet are down.
        landed = np.flatnonzero(trace.swing.any(axis=1))[-1]
        assert sinking[0] > max(entered, landed)
    assert trace.tilt_deg.max() < 2.0
    limp = trace.outputs[-1].command.torque_limit.max() == 0.0
    assert limp == (level is SafetyLevel.STOP)


def test_the_same_run_twice_is_the_same_bit_for_bit(model):
    source = after((0.0, walk(0.06)), (1.0, walk(0.06, yaw_rate=0.2, rpy=[0.05, 0.0, 0.1])))
    one, two = (play(model, source, 2.0, seed=3) for _ in range(2))
    for a, b in zip(one.outputs, two.outputs, strict=True):
        np.testing.assert_array_equal(a.command.position, b.command.position)


def test_a_reset_pipeline_gives_the_same_commands_again(model):
    trace = play(model, lambda t: walk(0.06, rpy=[0.0, 0.05, 0.1]), 2.0)
    pipeline = Pipeline(model, ControlConfig(), 0.02)
    for _ in range(2):
        pipeline.reset()
        for frame, output in zip(trace.frames, trace.outputs, strict=True):
            again = pipeline.step(frame, walk(0.06, rpy=[0.0, 0.05, 0.1]), SafetyRequest())
            np.testing.assert_array_equal(again.command.position, output.command.position)
