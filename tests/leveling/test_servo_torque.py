"""The torque that the servos made: by the load that they report, or from goals and positions alone."""

import numpy as np
import pytest

from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.leveling.servo_torque import ServoTorque
from tests.leveling.bench import DT, SERVO, UNKNOWN
from tests.leveling.trot import trot

ZERO = np.zeros(16)
VOLTAGE = SERVO.nominal_voltage
AHEAD = 20 * SERVO.step_angle
SOFT = SERVO.stall_torque * (SERVO.punch / 1023.0 + (20 - SERVO.compliance_margin) / SERVO.compliance_slope)
"""N·m of a servo whose goal is twenty counts ahead."""


def made(delay=0, goals=(), voltage=VOLTAGE, position=ZERO):
    """Torque of servos that report no load, after goals were sent, one per period."""
    servo, torque = ServoTorque(SERVO, delay), None
    servo.torque(position, UNKNOWN, voltage, DT)
    for goal in goals:
        servo.send(np.full(16, goal))
        torque = servo.torque(position, UNKNOWN, voltage, DT)
    return torque


# With reported loads.


def test_a_load_is_a_share_of_the_stall_torque_at_this_voltage():
    servo = ServoTorque(SERVO, 1)
    servo.torque(ZERO, np.full(16, 0.2), 10.0, DT)
    torque = servo.torque(ZERO, np.full(16, 0.4), 10.0, DT)
    np.testing.assert_allclose(torque, 0.3 * SERVO.stall_torque * 10.0 / VOLTAGE)


def test_the_speed_of_the_period_costs_torque():
    servo = ServoTorque(SERVO, 1)
    servo.torque(ZERO, ZERO, VOLTAGE, DT)
    torque = servo.torque(np.full(16, 0.04), ZERO, VOLTAGE, DT)
    np.testing.assert_allclose(torque, -SERVO.back_emf * 2.0)


def test_goals_say_nothing_where_loads_are_reported():
    servo = ServoTorque(SERVO, 0)
    servo.torque(ZERO, ZERO, VOLTAGE, DT)
    servo.send(np.full(16, AHEAD))
    np.testing.assert_array_equal(servo.torque(ZERO, ZERO, VOLTAGE, DT), 0.0)


def test_a_servo_that_reports_none_is_taken_to_follow_its_goal():
    load = np.full(16, 0.1)
    load[5] = np.nan
    servo = ServoTorque(SERVO, 0)
    servo.torque(ZERO, load, VOLTAGE, DT)
    servo.send(np.full(16, AHEAD))
    torque = servo.torque(ZERO, load, VOLTAGE, DT)
    assert torque[5] == pytest.approx(SOFT)
    np.testing.assert_allclose(np.delete(torque, 5), 0.1 * SERVO.stall_torque)


# Without.


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_goal_acts_after_the_delay(delay):
    goals = [0.0] * 5 + [AHEAD] + [0.0] * 5
    found = [made(delay, goals[: k + 1]) for k in range(len(goals))]
    known = [torque is not None for torque in found]
    assert known == [k >= delay for k in range(len(goals))]
    for k in range(delay, len(goals)):
        np.testing.assert_allclose(found[k], SOFT if k == 5 + delay else 0.0)


def test_a_far_goal_makes_no_more_than_the_motor_can():
    np.testing.assert_allclose(made(0, [1.0]), SERVO.stall_torque)
    np.testing.assert_allclose(made(0, [-1.0], voltage=6.0), -SERVO.stall_torque * 6.0 / VOLTAGE)


def test_inside_the_compliance_margin_there_is_none():
    np.testing.assert_array_equal(made(0, [0.9 * SERVO.compliance_margin * SERVO.step_angle]), 0.0)


def test_the_position_is_that_of_the_middle_of_the_period():
    servo = ServoTorque(SERVO, 0)
    servo.torque(np.full(16, -AHEAD), UNKNOWN, VOLTAGE, DT)
    servo.send(np.full(16, AHEAD))
    speed = 2.0 * AHEAD / DT
    torque = servo.torque(np.full(16, AHEAD), UNKNOWN, VOLTAGE, DT)
    np.testing.assert_allclose(torque, SOFT - SERVO.back_emf * speed)


# Either way.


@pytest.mark.parametrize("load", [ZERO, UNKNOWN])
def test_at_first_it_is_unknown_and_after_reset_again(load):
    servo = ServoTorque(SERVO, 1)
    first = [True, False, False, False] if load is ZERO else [True, True, False, False]
    for _ in range(2):
        found = []
        for _ in range(4):
            found.append(servo.torque(ZERO, load, VOLTAGE, DT) is None)
            servo.send(ZERO)
        assert found == first
        servo.reset()


def test_what_was_given_is_copied():
    servo, goal, load = ServoTorque(SERVO, 0), np.full(16, AHEAD), np.full(16, 0.4)
    load[0] = np.nan
    servo.torque(ZERO, load, VOLTAGE, DT)
    servo.send(goal)
    goal[:] = load[:] = 0.0
    torque = servo.torque(ZERO, load, VOLTAGE, DT)
    np.testing.assert_allclose(torque[1:], 0.2 * SERVO.stall_torque)
    assert torque[0] == pytest.approx(SOFT)


@pytest.mark.parametrize(
    ("where", "unknown"),
    # A position and a load belong to two periods, a goal to the one in which it acts.
    [("position", [4, 5]), ("goal", [6]), ("load", [4, 5])],
)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_gives_no_torque_and_passes(where, unknown, value):
    servo, rows = ServoTorque(SERVO, 1), []
    with np.errstate(invalid="ignore"):
        for k in range(12):
            now = {"position": ZERO, "load": ZERO if where == "load" else UNKNOWN, "goal": ZERO}
            if k == 4:
                now[where] = np.full(16, value)
            rows.append(servo.torque(now["position"], now["load"], VOLTAGE, DT))
            servo.send(now["goal"])
    if where == "load" and np.isnan(value):
        unknown = []  # goals are known
    if where == "goal" and np.isinf(value):
        unknown = []  # as far as the motor can
    found = [k for k, torque in enumerate(rows) if torque is None]
    assert [k for k in found if k > 1] == unknown
    assert all(np.isfinite(rows[k]).all() for k in range(2, 12) if k not in unknown)


@pytest.fixture(scope="module")
def true_torque():
    """(n, 16) N·m, mean motor torque of every period of a trot, taken at its two ends."""
    torque = np.array([truth.motor_torque for _, _, truth in trot()])
    return 0.5 * (torque[1:] + torque[:-1])


def estimated(delay: int, *, reported: bool) -> np.ndarray:
    """(n, 16) N·m, the same as the compensator would say; NaN where it would not."""
    servo, rows = ServoTorque(SERVO, delay), []
    for frame, output, _ in trot():
        position = output.telemetry.estimate.joint_position
        torque = servo.torque(position, frame.joint_load if reported else UNKNOWN, frame.voltage, DT)
        servo.send(output.command.position)
        rows.append(UNKNOWN if torque is None else torque)
    return np.array(rows)[1:]


def mismatch(estimate: np.ndarray, true: np.ndarray) -> float:
    """RMS of the error over RMS of the torque, while it walks."""
    walking = slice(125, None)
    error, torque = (estimate - true)[walking], true[walking]
    return float(np.sqrt((error**2).mean() / (torque**2).mean()))


# Measured: RMS error 0.20 of the RMS torque, correlation 0.87 to 0.98, means within 0.01 N·m.
@pytest.mark.slow
def test_reported_loads_give_the_true_torque_of_a_trot(true_torque):
    found = estimated(1, reported=True)
    assert mismatch(found, true_torque) < 0.3
    assert min(np.corrcoef(found[125:, k], true_torque[125:, k])[0, 1] for k in range(16)) > 0.8
    np.testing.assert_allclose(found[125:].mean(axis=0), true_torque[125:].mean(axis=0), atol=0.03)


# Measured: 0.38 with one period of delay, which is that of the simulated servos; 1.22 without, 0.60 with
# two, 1.45 with three.
@pytest.mark.slow
def test_goals_give_it_less_well_and_only_with_the_right_delay(true_torque):
    wrong = [mismatch(estimated(delay, reported=False), true_torque) for delay in range(4)]
    assert wrong.index(min(wrong)) == LevelingConfig().delay_ticks
    assert wrong[1] < 0.5
    assert min(wrong[0], wrong[2], wrong[3]) > 1.25 * wrong[1]
