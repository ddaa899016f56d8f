import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.safety import CommandWatchdog, CommandWatchdogConfig
from bluefoot_mpc.types import Mode, MotionCommand, TrunkPose

WALK = MotionCommand(
    mode=Mode.WALK, velocity=np.array([0.06, 0.01]), yaw_rate=0.1, gait="walk",
    trunk=TrunkPose(rpy=np.array([0.0, 0.1, 0.0])),
)  # fmt: skip


@pytest.fixture
def watchdog():
    return CommandWatchdog()


@pytest.mark.parametrize("age", [0.0, 0.1, 0.3, -1e-9])
def test_a_fresh_command_is_passed_on_as_it_is(watchdog, age):
    assert watchdog.step(WALK, age) is WALK
    assert watchdog.notice == ""


@pytest.mark.parametrize(
    ("age", "mode", "words"),
    [(0.31, Mode.WALK, "no velocity"), (1.0, Mode.WALK, "no velocity"), (1.01, Mode.STAND, "stand"),
     (5.0, Mode.STAND, "stand"), (5.01, Mode.SIT, "sit"), (30.0, Mode.SIT, "sit"),
     (30.1, Mode.OFF, "torque off"), (1e9, Mode.OFF, "torque off"), (np.inf, Mode.OFF, "torque off"),
     (np.nan, Mode.OFF, "torque off"), (-1.0, Mode.OFF, "torque off")],
)  # fmt: skip
def test_an_old_command_means_less(watchdog, age, mode, words):
    command = watchdog.step(WALK, age)
    assert command.mode is mode
    assert not command.velocity.any()
    assert command.yaw_rate == 0.0
    assert words in watchdog.notice
    assert command.gait == "walk"


@pytest.mark.parametrize("mode", list(Mode))
@given(age=st.floats(0.0, 100.0))
def test_nothing_makes_a_robot_stand_up_or_walk(mode, age):
    tame = [Mode.WALK, Mode.STAND, Mode.SIT, Mode.SAFE, Mode.OFF]
    command = CommandWatchdog().step(MotionCommand(mode=mode), age)
    assert tame.index(command.mode) >= tame.index(mode)


def test_a_new_command_ends_it(watchdog):
    watchdog.step(WALK, 10.0)
    assert watchdog.step(WALK, 0.0) is WALK
    assert watchdog.notice == ""


def test_a_trunk_pose_is_kept_until_the_robot_is_told_to_stand(watchdog):
    assert watchdog.step(WALK, 0.5).trunk is WALK.trunk
    assert not watchdog.step(WALK, 2.0).trunk.rpy.any()


def test_ages_must_rise():
    with pytest.raises(ConfigurationError, match="must rise"):
        CommandWatchdogConfig(stand_after=0.2)
