from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.estimation import Estimator, EstimatorConfig, RestConfig
from bluefoot_mpc.estimation.filter import initial_state
from bluefoot_mpc.estimation.inertial import Sample
from bluefoot_mpc.estimation.rest import KNOWN_BIAS, RestState, advance_rest, at_rest
from bluefoot_mpc.model.parameters import GRAVITY

from .synthetic_motion import PERFECT, Motion, geometry, make_run

CONFIG = RestConfig()
LONG = RestState(np.zeros(16), CONFIG.time + 0.1)
STANDING = [True] * 4


def samples(rate, spread=0.0):
    return [
        Sample(0.005 * k, (rate + sign * spread, 0.0, 0.0), (0.0, 0.0, GRAVITY))
        for k, sign in enumerate((1.0, -1.0, 1.0, -1.0))
    ]


def known_to(deviation):
    state = initial_state((0.0, 0.0, 0.0, 1.0), 0.05, EstimatorConfig())
    covariance = state.covariance.copy()
    covariance[18:21, 18:21] = deviation**2 * np.eye(3)
    return state._replace(covariance=covariance)


def test_all_of_it_must_rest():
    state = known_to(0.001)
    assert at_rest(LONG, STANDING, samples(0.0), state, CONFIG)
    assert not at_rest(RestState(np.zeros(16), CONFIG.time - 0.01), STANDING, samples(0.0), state, CONFIG)
    assert not at_rest(LONG, [True, True, False, True], samples(0.0), state, CONFIG)
    assert not at_rest(LONG, STANDING, [], state, CONFIG)
    assert not at_rest(LONG, STANDING, samples(0.0, 1.1 * CONFIG.rate_spread), state, CONFIG)


@pytest.mark.parametrize(("deviation", "allowed"), [(0.001, CONFIG.rate), (0.01, CONFIG.rate + 0.03)])
def test_a_slow_turn_is_no_rest_as_far_as_the_bias_is_known(deviation, allowed):
    assert (deviation < KNOWN_BIAS) == (allowed == CONFIG.rate)
    state = known_to(deviation)
    assert at_rest(LONG, STANDING, samples(0.99 * allowed), state, CONFIG)
    assert not at_rest(LONG, STANDING, samples(1.01 * allowed), state, CONFIG)


def test_rest_is_counted_from_the_last_move():
    state = RestState(np.zeros(16), 0.1)
    assert advance_rest(state, CONFIG.joint_move, np.ones(16), 0.02, CONFIG).time == pytest.approx(0.12)
    moved = advance_rest(state, 1.01 * CONFIG.joint_move, np.ones(16), 0.02, CONFIG)
    assert moved.time == 0.0
    np.testing.assert_array_equal(moved.joints, 1.0)


def test_a_foot_is_used_once_it_has_stood_still_for_its_probation():
    run = make_run(Motion(duration=1.0), PERFECT, 0)
    for probation in (0, 1, 4):
        config = EstimatorConfig()
        config = replace(config, contact=replace(config.contact, probation=probation))
        estimator = Estimator(geometry(), config)
        used = []
        for frame in run.frames[:10]:
            estimator.step(frame)
            used.append(estimator.feet_used == (0, 1, 2, 3))
        # The first frame starts, the next plants the feet: from then on they are on probation.
        assert used.index(True) == probation + 2
        assert all(used[probation + 2 :])


def test_a_jump_of_the_clock_makes_the_heading_doubtful():
    run = make_run(Motion(duration=1.0), PERFECT, 0)
    estimator = Estimator(geometry(), EstimatorConfig())
    for frame in run.frames[:40]:
        estimator.step(frame)
    before = estimator.covariance[2, 2]
    late = run.frames[40]
    estimator.step(replace(late, time=late.time + 5.0))
    assert estimator.covariance[2, 2] > before + 0.01**2
