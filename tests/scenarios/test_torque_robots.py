"""The same whole-body code on Solo12, Go2 and ANYmal: nothing in it is made for BlueFoot."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.library import LIBRARY, library_folder, load_library_robot
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.scenarios.torque_robots import PHASES, BalanceConfig, balance_reference, run_balance
from bluefoot_mpc.wbc import WholeBodyConfig

# The virtual machine instead of C: nothing to build for three more robots.
BODY = WholeBodyConfig(codegen=False)
SHORT = BalanceConfig(duration=4.0, squat=0.1, sway=0.08, period=1.2, body=BODY)


@pytest.fixture(scope="module", autouse=True)
def _needs_robots():
    try:
        library_folder()
    except ConfigurationError:
        pytest.skip("example-robot-data is not installed")


@pytest.mark.parametrize("name", LIBRARY)
def test_other_robots_stand_squat_and_sway(name):
    robot = load_library_robot(name)
    run = run_balance(robot, SHORT)
    weight = run.mass * GRAVITY
    assert not run.fell
    assert run.time[-1] == pytest.approx(SHORT.duration - SHORT.control_period)
    for phase in PHASES:
        assert run.error(phase).max() < 3e-3
    assert np.degrees(run.tilt.max()) < 0.5
    assert run.solved.all()
    # They did move, and carried themselves: all feet push, on average the weight.
    moved = np.ptp(run.com, axis=0)
    assert moved[:2].min() > SHORT.sway * robot.height
    assert moved[2] > SHORT.squat * robot.height
    assert run.force[5:, :, 2].min() > 0.02 * weight
    assert run.force[5:].sum(axis=1).mean(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.03 * weight)


@pytest.mark.parametrize("name", LIBRARY)
def test_a_pushed_robot_comes_back(name):
    config = dataclasses.replace(SHORT, duration=1.5, squat=0.0, sway=0.0, push=0.2)
    run = run_balance(load_library_robot(name), config)
    assert not run.fell
    assert run.error().max() > 5e-3
    assert np.degrees(run.tilt.max()) > 0.2
    end = run.time > 1.0
    assert run.error()[end].max() < 1e-3
    assert np.degrees(run.tilt[end]).max() < 0.02


def test_the_solver_takes_over_where_limits_are_met_and_agrees_elsewhere():
    robot = load_library_robot("go2")
    brisk = dataclasses.replace(SHORT, duration=1.5, sway=0.2, period=0.6)
    run = run_balance(robot, brisk)
    assert np.count_nonzero(run.iterations) > 50
    assert run.solved.all()
    assert not run.fell
    gentle = dataclasses.replace(SHORT, duration=1.0, squat=0.03, sway=0.0)
    free = run_balance(robot, gentle)
    body = dataclasses.replace(BODY, free_first=False, solver="proxsuite")
    solved = run_balance(robot, dataclasses.replace(gentle, body=body))
    assert not free.iterations.any()
    assert solved.iterations.all()
    assert np.abs(solved.torque - free.torque).max() < 1e-3


def test_a_robot_without_strength_falls_and_says_so():
    weak = dataclasses.replace(BODY, torque_share=0.05)
    run = run_balance(load_library_robot("go2"), dataclasses.replace(SHORT, body=weak))
    assert run.fell
    assert run.time[-1] < 0.5
    assert 0.0 < run.com[-1, 2] < 0.55 * run.com[0, 2]


def test_a_robot_without_named_feet_is_an_error_that_lists_frames():
    robot = load_library_robot("anymal")
    for feet in (("LF_FOOT", "paw"), ("LF_FOOT", "paw", "RF_FOOT")):
        with pytest.raises(ConfigurationError, match="'paw' for a foot.*LF_FOOT"):
            run_balance(dataclasses.replace(robot, feet=feet), SHORT)
    with pytest.raises(ConfigurationError, match="at least one"):
        run_balance(dataclasses.replace(robot, feet=()), SHORT)


def test_the_reference_starts_and_ends_at_rest_and_its_derivatives_are_right():
    config = BalanceConfig(duration=10.0)
    start = np.array([0.01, -0.02, 0.4])
    reference = balance_reference(start, config)
    for now in (0.0, 1.9, 6.0, 10.0):
        position, velocity, acceleration = reference(now)
        assert position == pytest.approx(start)
        assert np.concatenate([velocity, acceleration]) == pytest.approx(np.zeros(6), abs=1e-9)
    step = 1e-4
    for now in np.arange(0.3, 9.9, 0.217):
        before, (_, velocity, acceleration), after = (reference(now + d) for d in (-step, 0.0, step))
        assert velocity == pytest.approx((after[0] - before[0]) / (2 * step), abs=1e-6)
        assert acceleration == pytest.approx((after[1] - before[1]) / (2 * step), abs=1e-4)
    times = np.arange(0.0, 10.0, 0.01)
    moved = np.array([reference(t)[0] for t in times]) - start
    assert np.abs(moved).max(axis=0) == pytest.approx([0.04, 0.04, 0.048], rel=0.02)


@pytest.mark.parametrize("wrong", [{"duration": 0.0}, {"squat": -0.1}, {"control_period": float("nan")}])
def test_impossible_motions_are_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        BalanceConfig(**wrong)
