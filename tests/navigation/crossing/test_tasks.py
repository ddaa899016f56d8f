"""Tasks that come and go in any order: rough ground, others, none; and a robot that may not walk."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.control.guidance import Guidance
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.navigation.crossing.crosser import FeetState
from bluefoot_mpc.types import CrossingPhase, Guide, GuideTask, Mode, MotionCommand
from tests.navigation.crossing.bench import DT, QUICK, ROBOT, estimate, frame

GOALS = (np.array([[1.5, 0.0]]), np.array([[0.6, 0.1]]), np.array([[-1.0, 0.0]]), np.zeros((0, 2)))
TASKS = (None, GuideTask.CROSS, GuideTask.CROSS, GuideTask.CROSS, GuideTask.SWEEP, GuideTask.WANDER)


def made():
    return Guidance(NavigationConfig(), CrossingConfig(think_ticks=2, follower=QUICK), ROBOT)


def wander_through_tasks(guidance, seed, ticks=300):
    """Each tick's velocity, trunk and report, for a robot that stays and sees nothing."""
    rng, motion, walks, told = np.random.default_rng(seed), MotionCommand(), True, []
    for k in range(ticks):
        if rng.random() < 0.08:
            task = TASKS[rng.integers(len(TASKS))]
            guide = None if task is None else Guide(task=task, waypoints=GOALS[rng.integers(len(GOALS))])
            motion = MotionCommand(mode=Mode.WALK, guide=guide)
        walks = walks if rng.random() > 0.05 else not walks
        feet = FeetState(resting=bool(rng.random() < 0.95), waiting="" if rng.random() < 0.9 else "FL: none")
        state = estimate(k * DT, (0.01 * k, 0.0, 0.0))
        if rng.random() < 0.02:
            state = dataclasses.replace(state, position=np.full(3, np.nan))
        wanted, _, _ = guidance.step(motion, frame(k * DT), state, walks=walks, dt=DT, feet=feet)
        told.append((motion.guide, walks, wanted, guidance.crossing, guidance.ground))
    return told


@pytest.mark.parametrize("seed", range(3))
def test_whatever_comes_after_what_the_decision_is_a_number_and_old_ground_is_not_stepped_on(seed):
    for guide, walks, wanted, crossing, ground in wander_through_tasks(made(), seed):
        assert np.isfinite([*wanted.velocity, wanted.yaw_rate, *wanted.trunk.rpy]).all()
        if guide is None or guide.task is GuideTask.WANDER:
            assert ground is None
            assert crossing is None
        if not walks:
            assert crossing is None


def test_after_a_reset_all_is_as_at_first():
    used = made()
    first = wander_through_tasks(used, 5)
    used.reset()
    for before, after in zip(first, wander_through_tasks(used, 5), strict=True):
        assert before[2].velocity.tolist() == after[2].velocity.tolist()
        assert before[2].trunk.rpy.tolist() == after[2].trunk.rpy.tolist()
        assert repr(before[3]) == repr(after[3])


def test_a_robot_that_was_told_to_stand_amid_its_way_goes_on_when_it_may():
    guidance = made()
    motion = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.CROSS, waypoints=GOALS[0]))
    phases, reasons = [], []
    for k in range(220):
        state = estimate(k * DT, (0.0, 0.0, 0.0))
        walks = not 6 < k < 200
        guidance.step(motion, frame(k * DT), state, walks=walks, dt=DT, feet=FeetState(resting=True))
        phases.append(guidance.crossing.phase if guidance.crossing else None)
        reasons.append(guidance.crossing.reason if guidance.crossing else "")
    assert phases[5] is CrossingPhase.SWEEP
    assert set(phases[7:200]) == {None}
    assert set(phases[200:207]) == {CrossingPhase.SWEEP}  # a sweep of its own, not the end of the old one
    assert not any(reasons[:207])
