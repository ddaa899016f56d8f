import numpy as np
import pytest

from bluefoot_mpc.model import servo as law
from bluefoot_mpc.model.parameters import load_parameters


@pytest.fixture(scope="module")
def servo():
    return load_parameters().servo


def test_counts_and_angles_are_inverse_inside_the_range(servo):
    counts = np.arange(-512.0, 512.0)
    assert np.array_equal(law.to_counts(servo, law.to_angle(servo, counts)), counts)
    assert np.degrees(servo.step_angle) == pytest.approx(0.293, abs=5e-4)


def test_counts_stay_inside_the_range(servo):
    assert law.to_counts(servo, np.array([-9.0, 9.0])).tolist() == [-512.0, 511.0]


def test_small_speed_limit_does_not_become_unlimited(servo):
    limits = law.quantise_speed_limit(np.array([0.0, 1e-4, 1.0, 99.0]))
    assert limits[0] == 0.0
    assert limits[1] == law.SPEED_UNIT
    assert limits[2] == pytest.approx(1.0, abs=0.5 * law.SPEED_UNIT)
    assert limits[3] == pytest.approx(1023 * 0.111 * 2 * np.pi / 60)


def test_duty_has_margin_punch_slope_and_clamp(servo):
    duty = law.duty(servo, np.array([0.0, 1.0, -1.0, 2.0, -17.0, 40.0]))
    assert duty[:3].tolist() == [0.0, 0.0, 0.0]
    assert duty[3] == pytest.approx(32 / 1023 + 1 / 32)
    assert duty[4] == pytest.approx(-32 / 1023 - 16 / 32)
    assert duty[5] == 1.0
    assert law.duty(servo, np.array([40.0]), 0.25)[0] == 0.25


def test_motor_makes_stall_torque_at_rest_and_none_at_no_load_speed(servo):
    assert law.motor_torque(servo, np.ones(1), np.zeros(1), 12.0)[0] == pytest.approx(1.5)
    assert law.motor_torque(servo, np.ones(1), np.zeros(1), 10.8)[0] == pytest.approx(1.35)
    assert law.motor_torque(servo, np.ones(1), np.full(1, 6.178), 12.0)[0] == pytest.approx(0.0, abs=1e-12)


def test_envelope_is_full_duty(servo):
    speed = np.array([-3.0, 0.0, 2.0])
    low, high = law.torque_envelope(servo, speed, 11.1)
    assert high == pytest.approx(law.motor_torque(servo, np.ones(3), speed, 11.1))
    assert low == pytest.approx(law.motor_torque(servo, -np.ones(3), speed, 11.1))


def test_goal_for_torque_makes_that_torque(servo):
    position, torque, speed = np.array([0.2, -0.7]), np.array([0.6, -0.4]), np.array([0.5, -1.0])
    goal = law.goal_for_torque(servo, position, torque, speed)
    made = servo.stiffness * (goal - position) - servo.back_emf * speed
    assert made == pytest.approx(torque)


def test_heat_settles_and_takes_its_time_constant(servo):
    start, loss = np.full(1, servo.ambient), np.full(1, 5.0)
    assert law.heat(servo, start, loss, 1e5)[0] == pytest.approx(25.0 + 40.0)
    assert law.heat(servo, start, loss, 300.0)[0] == pytest.approx(25.0 + 40.0 * (1 - np.exp(-1)))
    halves = law.heat(servo, law.heat(servo, start, loss, 10.0), loss, 10.0)
    assert halves == pytest.approx(law.heat(servo, start, loss, 20.0), abs=1e-12)
