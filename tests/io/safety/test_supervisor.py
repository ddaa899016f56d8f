from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.io.safety import SafetyConfig, SafetySupervisor
from bluefoot_mpc.types import SafetyLevel
from tests.io.safety.scripted import FakeRobot, goal, make_frame


@pytest.fixture
def fake():
    return FakeRobot()


@pytest.fixture
def supervisor(fake):
    made = SafetySupervisor(fake, np.full(16, -1.0), np.full(16, 1.0), SafetyConfig())
    made.reset()
    return made


def test_the_supervisor_is_a_robot_itself(supervisor):
    assert isinstance(supervisor, Robot)


def test_goals_are_clamped_to_limits_and_slew(supervisor, fake):
    supervisor.step(goal(0.9))
    np.testing.assert_allclose(fake.sent[-1].position, SafetyConfig().max_goal_rate * 0.02)
    for _ in range(20):
        supervisor.step(goal(5.0))
    np.testing.assert_allclose(fake.sent[-1].position, 1.0)


@pytest.mark.parametrize("field", ["position", "speed", "torque_limit"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_command_that_is_not_finite_is_discarded_and_stops_the_robot(supervisor, fake, field, value):
    supervisor.step(goal(0.1))
    good = fake.sent[-1]
    bad = getattr(goal(0.2), field).copy()
    bad[5] = value
    supervisor.step(replace(goal(0.2), **{field: bad}))
    np.testing.assert_array_equal(fake.sent[-1].position, good.position)
    assert supervisor.request.level is SafetyLevel.STOP
    assert "FR_hip_pitch" in supervisor.request.reasons[0]
    supervisor.step(goal(0.1))
    assert supervisor.request.level is SafetyLevel.STOP  # a NaN is never forgotten


def test_the_first_command_may_be_nan(supervisor, fake):
    supervisor.step(goal(np.nan))
    np.testing.assert_array_equal(fake.sent[-1].position, 0.0)


def test_reset_forgets_every_fault(supervisor):
    supervisor.step(goal(np.nan))
    supervisor.reset()
    assert supervisor.request.level is SafetyLevel.NONE


def test_a_servo_that_did_not_answer_is_not_slewed_from_nowhere(fake):
    valid = np.ones(16, dtype=bool)
    valid[3] = False
    position = np.where(valid, 0.1, np.nan)
    fake.next = make_frame(joint_valid=valid, joint_position=position)
    made = SafetySupervisor(fake, np.full(16, -1.0), np.full(16, 1.0), SafetyConfig())
    made.reset()
    made.step(goal(np.nan))
    held = fake.sent[-1]
    np.testing.assert_array_equal(held.position, np.where(valid, 0.1, 0.0))
    np.testing.assert_array_equal(held.torque_limit, np.where(valid, 1.0, 0.0))
    made.step(goal(0.9))
    expected = np.where(valid, 0.1 + SafetyConfig().max_goal_rate * 0.02, 0.9)
    np.testing.assert_allclose(fake.sent[-1].position, expected)


def test_goals_are_limited_from_where_the_joints_were_found(fake):
    fake.next = make_frame(joint_position=np.full(16, -0.5))
    made = SafetySupervisor(fake, np.full(16, -1.0), np.full(16, 1.0), SafetyConfig())
    made.reset()
    made.step(goal(0.9))
    np.testing.assert_allclose(fake.sent[-1].position, -0.5 + SafetyConfig().max_goal_rate * 0.02)


@pytest.mark.parametrize("first", [0.1, np.nan])
def test_nothing_that_comes_after_a_stop_gives_torque_back(supervisor, fake, first):
    supervisor.step(goal(first))
    supervisor.stop()
    for value in (np.nan, 0.1, np.nan):
        supervisor.step(goal(value))
        np.testing.assert_array_equal(fake.sent[-1].torque_limit, 0.0)


def test_torque_limits_and_speeds_are_kept_in_range(supervisor, fake):
    supervisor.step(replace(goal(0.1, torque=3.0), speed=np.full(16, -2.0)))
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, 1.0)
    np.testing.assert_array_equal(fake.sent[-1].speed, 0.0)
    supervisor.step(goal(0.1, torque=-1.0))
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, 0.0)


def test_a_voltage_that_is_unknown_counts_for_nothing(supervisor, fake):
    for frame in (make_frame(voltage=np.nan), make_frame(voltage=3.0, voltage_valid=False)):
        fake.next = frame
        for _ in range(500):
            supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.NONE


def test_stop_latches_the_torque_off(supervisor, fake):
    supervisor.stop()
    supervisor.step(goal(0.1))
    assert fake.stops == 1
    np.testing.assert_array_equal(fake.sent[-1].torque_limit, 0.0)


@pytest.mark.parametrize(("degrees", "level"), [(60.0, 0), (66.0, SafetyLevel.SIT), (69.0, SafetyLevel.STOP)])
def test_heat(supervisor, fake, degrees, level):
    heat = np.full(16, 30.0)
    heat[2] = degrees
    fake.next = make_frame(joint_temperature=heat)
    supervisor.step(goal(0.0))
    assert supervisor.request.level == level
    if level:
        assert "FL_knee" in supervisor.request.reasons[0]


def test_voltage_is_filtered_before_it_counts(supervisor, fake):
    supervisor.step(goal(0.0))
    fake.next = make_frame(voltage=9.0)
    supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.NONE
    for _ in range(60):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.SIT
    for _ in range(200):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.STOP


def test_lost_joint_readings_make_it_sit_and_are_forgiven(supervisor, fake):
    valid = np.ones(16, dtype=bool)
    valid[:8] = False
    fake.next = make_frame(joint_valid=valid)
    for _ in range(25):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.SIT
    fake.next = make_frame()
    for _ in range(100):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.NONE


def test_a_few_lost_readings_are_no_reason_to_sit(supervisor, fake):
    valid = np.ones(16, dtype=bool)
    valid[[2, 9]] = False  # an eighth, for ever
    fake.next = make_frame(joint_valid=valid)
    for _ in range(500):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.NONE


def test_a_fault_that_lasts_is_told_once(supervisor, fake):
    for _ in range(5):
        supervisor.step(goal(np.nan))
    fake.next = make_frame(joint_temperature=np.full(16, 66.0))
    for _ in range(5):
        supervisor.step(goal(0.0))
    assert supervisor.request.level is SafetyLevel.STOP  # the worse of the two
    assert len(supervisor.request.reasons) == 2


def test_thresholds_must_be_in_order():
    with pytest.raises(ConfigurationError, match="sit threshold"):
        SafetyConfig(voltage_sit=9.0, voltage_stop=9.6)
