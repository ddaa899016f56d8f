import numpy as np
import pytest

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.types import TrunkPose

CONFIG = PostureConfig()


def test_the_pose_follows_at_limited_speed_and_inside_its_bounds():
    pose = np.zeros(6)
    wanted = TrunkPose(position=np.array([0.02, -0.5, 0.0]), rpy=np.array([0.1, 0.0, 2.0]))
    for _ in range(500):
        before = pose
        pose = posture.follow_pose(pose, wanted, 0.02, CONFIG)
        assert np.all(np.abs(pose - before)[:3] <= CONFIG.max_rate * 0.02 + 1e-12)
        assert np.all(np.abs(pose - before)[3:] <= CONFIG.max_turn_rate * 0.02 + 1e-12)
    np.testing.assert_allclose(pose, [0.02, -CONFIG.max_offset, 0.0, 0.1, 0.0, CONFIG.max_tilt])


def test_the_trim_removes_a_constant_tilt():
    trim, disturbance = np.zeros(2), np.array([0.02, -0.015])
    for _ in range(3000):
        trim = posture.trim_level(trim, disturbance + trim, CONFIG.level_gain, CONFIG.level_bound, 0.02)
    np.testing.assert_allclose(disturbance + trim, 0.0, atol=1e-4)


def test_the_trim_is_bounded():
    trim = np.zeros(2)
    for _ in range(10000):
        trim = posture.trim_level(trim, np.array([1.0, -1.0]), CONFIG.level_gain, CONFIG.level_bound, 0.02)
    np.testing.assert_allclose(np.abs(trim), CONFIG.level_bound)


def test_the_stance_is_the_robots_unless_replaced():
    robot = load_parameters().stance
    assert posture.stance(robot, PostureConfig()).trunk_height == robot.trunk_height
    changed = posture.stance(robot, PostureConfig(trunk_height=0.13, stance_y=0.15))
    assert changed.trunk_height == 0.13
    np.testing.assert_allclose(changed.feet[0], [robot.foot_x, 0.15, 0.0])


@pytest.mark.parametrize("bad", [{"trunk_height": -0.1}, {"max_rate": 0.0}, {"level_gain": -1.0}])
def test_impossible_values_are_refused(bad):
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        PostureConfig(**bad)
