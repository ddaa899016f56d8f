import numpy as np
import pytest

from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController, PreviewWeights
from bluefoot_mpc.zmp.preview.kajita import gain_map, preview_gain
from bluefoot_mpc.zmp.preview.model import advance, preview_maps
from tests.zmp.preview.scenes import inputs, walk

LONG = PreviewConfig(samples=75, weights=PreviewWeights(position=0.05, velocity=1e-3))


def test_the_gain_is_the_optimum_of_a_long_horizon():
    gain, maps = preview_gain(LONG), preview_maps(LONG)
    first = maps.optimum[0]
    assert -gain.state == pytest.approx(first[:3], rel=1e-3)
    n = LONG.samples
    ahead = first[3:].reshape(3, n).T
    scale = np.abs(ahead).max(axis=0)
    assert np.abs(gain.preview - ahead)[: n // 2] / scale == pytest.approx(0.0, abs=1e-3)


def test_the_law_brings_every_start_to_rest():
    config = PreviewConfig()
    gain = preview_gain(config)
    state = np.array([0.03, 0.2, -1.0])
    for _ in range(200):
        state = np.array(advance(state, -gain.state @ state, config.interval))
    assert np.abs(state).max() < 1e-4


def test_the_map_steps_the_law_along_the_horizon():
    config = PreviewConfig(samples=8)
    gain, jerks = preview_gain(config), gain_map(config)
    rng = np.random.default_rng(0)
    given = rng.normal(size=3 + 24)
    wanted = given[3:].reshape(3, 8).T
    state = given[:3]
    for jerk in jerks @ given:
        assert jerk == pytest.approx(-gain.state @ state + np.sum(gain.preview * wanted))
        state = np.array(advance(state, jerk, config.interval))
        wanted = np.vstack([wanted[1:], wanted[-1:]])


def test_the_controller_offers_it_by_name():
    config = PreviewConfig(law="kajita")
    plan = PreviewController(config).step(inputs(walk(config), state=np.zeros((3, 2))), 0.02)
    best = PreviewController(PreviewConfig(law="unconstrained")).step(
        inputs(walk(config), state=np.zeros((3, 2))), 0.02
    )
    assert plan.iterations == 0
    assert plan.zmp[:10] == pytest.approx(best.zmp[:10], abs=2e-3)
    assert not np.array_equal(plan.zmp, best.zmp)
