import math

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.ready import READY, forward_wheel
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

STEERED = tuple(forward_wheel("steered", 0.1, y) for y in (0.1, -0.1))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wheels": ()}, "no wheels"),
        ({"linked": ((0, 2),)}, "linked wheel 2"),
        ({"linked": ((0, 1), (1, 0))}, "more than one"),
        ({"linked": ((0,),)}, "two wheels or more"),
        ({"steering_limit": 0.0}, "positive"),
        ({"steering_limit": math.nan}, "positive"),
    ],
)
def test_impossible_robots_are_refused(changes, words):
    with pytest.raises(ConfigurationError, match=words):
        WheeledRobot(**({"name": "wrong", "wheels": STEERED} | changes))


def test_size_is_the_longest_arm_and_never_zero():
    assert WheeledRobot(name="pair", wheels=STEERED).size == pytest.approx(math.hypot(0.1, 0.1))
    assert WheeledRobot(name="one", wheels=(Wheel(kind="fixed", alpha=0.0),)).size == 1.0


def test_every_ready_robot_is_made_under_its_own_name():
    assert set(READY) == {
        "differential", "tricycle", "ackermann", "bicycle", "omni", "mecanum", "omni_steer", "two_steer",
        "balancing",
    }  # fmt: skip
    for name, make in READY.items():
        robot = make()
        assert robot.name == name
        assert any(wheel.driven for wheel in robot.wheels)
