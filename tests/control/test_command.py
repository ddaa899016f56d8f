import numpy as np
import pytest

from bluefoot_mpc.control.command import usable
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand, TrunkPose

GOOD = MotionCommand(
    mode=Mode.WALK, velocity=np.array([0.05, 0.01]), yaw_rate=0.1, gait="walk",
    trunk=TrunkPose(position=np.array([0.01, 0.0, 0.0]), rpy=np.array([0.0, 0.1, 0.0])),
)  # fmt: skip


def test_a_good_command_goes_through_as_it_is():
    assert usable(GOOD, MotionCommand()) == (GOOD, ())
    assert usable(GOOD, MotionCommand())[0] is GOOD


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_bad_speed_is_no_speed(bad):
    for velocity, rate in (([bad, 0.0], 0.0), ([0.0, bad], 0.0), ([0.05, 0.0], bad)):
        broken = MotionCommand(mode=Mode.WALK, velocity=np.array(velocity), yaw_rate=rate, trunk=GOOD.trunk)
        motion, events = usable(broken, MotionCommand())
        np.testing.assert_array_equal(motion.velocity, 0.0)
        assert motion.yaw_rate == 0.0
        assert motion.trunk is GOOD.trunk
        assert len(events) == 1
        assert "velocity" in events[0]


@pytest.mark.parametrize("field", ["position", "rpy"])
def test_a_bad_pose_is_the_last_good_one(field):
    broken = TrunkPose(**{field: np.array([0.0, 0.0, np.nan])})
    motion, events = usable(MotionCommand(velocity=GOOD.velocity, trunk=broken), GOOD)
    assert motion.trunk is GOOD.trunk
    np.testing.assert_array_equal(motion.velocity, GOOD.velocity)
    assert len(events) == 1
    assert "trunk" in events[0]


@pytest.mark.parametrize("field", ["speed", "distance", "waypoints"])
def test_a_task_that_is_not_finite_is_none_and_the_robot_rests(field):
    bad = np.array([[1.0, 0.0], [np.nan, 0.0]]) if field == "waypoints" else np.inf
    guide = Guide(task=GuideTask.GOTO, **{field: bad})
    motion, events = usable(MotionCommand(mode=Mode.WALK, velocity=GOOD.velocity, guide=guide), GOOD)
    assert motion.guide is None
    np.testing.assert_array_equal(motion.velocity, 0.0)
    assert len(events) == 1
    assert "guided task" in events[0]


@pytest.mark.parametrize(
    "made", [{"speed": 0.0}, {"speed": -0.2}, {"distance": 0.0}, {"waypoints": np.zeros(3)},
             {"waypoints": np.zeros((2, 3))}],
)  # fmt: skip
def test_a_task_that_makes_no_sense_is_none(made):
    motion, events = usable(MotionCommand(guide=Guide(task=GuideTask.GOTO, **made)), GOOD)
    assert motion.guide is None
    assert len(events) == 1


def test_a_good_task_goes_through():
    motion = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.GOTO, waypoints=np.array([[1.0, 2.0]])))
    assert usable(motion, GOOD) == (motion, ())
