import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.control.servo_map import Feed, ServoMapConfig, derating, goals, least_derating
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.servo import motor_torque

SERVO = load_parameters().servo
WIDE = ServoMapConfig(max_shift=10.0)


def made(goal, joints, speed, voltage):
    """(16,) N·m that servos make on the way to `goal`: duty in proportion to the error, less back-EMF."""
    share = SERVO.stiffness / SERVO.stall_torque * (goal - joints)
    return motor_torque(SERVO, share, speed, voltage)


@pytest.mark.parametrize("voltage", [9.6, 11.1, 12.0, 12.6])
@pytest.mark.parametrize("seed", range(5))
def test_goals_invert_the_servos_law_at_any_torque_speed_and_voltage(seed, voltage):
    rng = np.random.default_rng(seed)
    joints, torque = rng.uniform(-1.5, 1.5, 16), rng.uniform(-1.5, 1.5, 16)
    speed = rng.uniform(-5.0, 5.0, 16)
    goal = goals(SERVO, joints, Feed(torque=torque, speed=speed), voltage, WIDE)
    np.testing.assert_allclose(made(goal, joints, speed, voltage), torque, atol=1e-12)


def test_nothing_fed_leaves_the_goals_at_the_joints():
    joints = np.linspace(-1.0, 1.0, 16)
    feed = Feed(torque=np.zeros(16), speed=np.zeros(16))
    np.testing.assert_array_equal(goals(SERVO, joints, feed, 11.1, ServoMapConfig()), joints)


def test_a_share_of_the_speed_makes_up_for_that_share_of_back_emf():
    joints, speed = np.zeros(16), np.full(16, 2.0)
    feed = Feed(torque=np.zeros(16), speed=0.4 * speed)
    goal = goals(SERVO, joints, feed, SERVO.nominal_voltage, WIDE)
    lost = made(goal, joints, speed, SERVO.nominal_voltage)
    np.testing.assert_allclose(lost, -0.6 * SERVO.back_emf * speed, atol=1e-12)


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_goals_never_run_further_ahead_than_configured(sign):
    feed = Feed(torque=np.full(16, sign * 40.0), speed=np.zeros(16))
    config = ServoMapConfig(max_shift=0.1)
    np.testing.assert_array_equal(goals(SERVO, np.zeros(16), feed, 12.0, config), sign * 0.1)


def test_hot_servos_are_asked_for_less():
    config = ServoMapConfig(derate_from=50.0, derate_to=70.0)
    temperature = np.array([20.0, 50.0, 55.0, 65.0, 70.0, 90.0, np.nan, np.inf])
    expected = [1.0, 1.0, 0.75, 0.25, 0.0, 0.0, 1.0, 1.0]
    np.testing.assert_allclose(derating(temperature, config), expected)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mixing": 1.1}, "mixing"), ({"back_emf": -0.1}, "back_emf"), ({"max_shift": 0.0}, "max_shift"),
        ({"derate_from": 66.0}, "derate_from = 66 must be below derate_to = 65"),
        ({"mixing": float("nan")}, "mixing"),
    ],
)  # fmt: skip
def test_impossible_values_are_refused(change, message):
    with pytest.raises(ConfigurationError, match=message):
        ServoMapConfig(**change)


def test_a_stiffer_servo_needs_less_shift():
    feed = Feed(torque=np.ones(16), speed=np.zeros(16))
    stiff = dataclasses.replace(SERVO, compliance_slope=0.5 * SERVO.compliance_slope)
    ratio = goals(stiff, np.zeros(16), feed, 12.0, WIDE) / goals(SERVO, np.zeros(16), feed, 12.0, WIDE)
    np.testing.assert_allclose(ratio, SERVO.stiffness / stiff.stiffness)
    assert np.all(ratio < 1.0)


@pytest.mark.parametrize("hottest", [20.0, 55.0, 60.0, 70.0, float("nan")])
def test_the_least_share_is_that_of_the_hottest_servo(hottest):
    config, temperature = ServoMapConfig(derate_from=55.0, derate_to=65.0), np.full(16, 30.0)
    temperature[3] = hottest
    assert least_derating(temperature, config) == derating(temperature, config).min()
