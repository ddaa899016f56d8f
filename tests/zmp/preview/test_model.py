import numpy as np
import pytest
from scipy.linalg import expm

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewWeights
from bluefoot_mpc.zmp.preview.model import advance, levers, preview_maps
from tests.zmp.preview.straightforward import rollout

CONFIG = PreviewConfig(samples=16, weights=PreviewWeights(position=0.2, velocity=0.01))


@pytest.fixture(scope="module")
def maps():
    return preview_maps(CONFIG)


def test_a_step_is_the_exact_integral():
    rate = np.zeros((4, 4))  # p, v, a and the jerk, which stays
    rate[0, 1] = rate[1, 2] = rate[2, 3] = 1.0
    start = np.array([0.02, -0.1, 0.7, 5.0])
    for time in (0.0, 0.013, 0.04, 0.5):
        wanted = expm(rate * time) @ start
        assert np.array(advance(start[:3], start[3], time)) == pytest.approx(wanted[:3], abs=1e-13)


def test_maps_are_those_of_stepping(maps):
    free, forced = rollout(CONFIG)
    assert maps.free == pytest.approx(free, abs=1e-12)
    assert maps.forced == pytest.approx(forced, abs=1e-12)
    assert maps.lever == CONFIG.height / GRAVITY


def test_the_optimum_beats_every_neighbour(maps):
    rng = np.random.default_rng(0)
    given = 0.05 * rng.normal(size=3 + 3 * CONFIG.samples)
    best = maps.optimum @ given
    for _ in range(50):
        other = best + 10.0 ** rng.uniform(-3, 1) * rng.normal(size=CONFIG.samples)
        assert _cost(maps, given, other) > _cost(maps, given, best)


def test_hessian_and_gradient_are_the_cost_s(maps):
    rng = np.random.default_rng(1)
    given, jerk = 0.05 * rng.normal(size=3 + 3 * CONFIG.samples), rng.normal(size=CONFIG.samples)
    step = rng.normal(size=CONFIG.samples)
    ahead, behind = (_cost(maps, given, jerk + sign * step) for sign in (1.0, -1.0))
    middle = _cost(maps, given, jerk)
    assert 0.5 * (ahead - behind) == pytest.approx(step @ (maps.hessian @ jerk + maps.gradient @ given))
    assert ahead + behind - 2.0 * middle == pytest.approx(step @ maps.hessian @ step)


def test_a_shift_costs_half_its_square(maps):
    rng = np.random.default_rng(2)
    given, shift = 0.05 * rng.normal(size=3 + 3 * CONFIG.samples), 1e-3 * rng.normal(size=CONFIG.samples)
    best = maps.optimum @ given
    more = _cost(maps, given, best + maps.root @ shift) - _cost(maps, given, best)
    assert more == pytest.approx(0.5 * shift @ shift, rel=1e-6)
    identity = maps.root.T @ maps.hessian @ maps.root
    assert identity == pytest.approx(np.eye(CONFIG.samples), abs=1e-8)


def test_levers_put_the_zmp_where_the_force_meets_the_plane():
    rng = np.random.default_rng(3)
    for _ in range(20):
        gravity = np.array([*rng.normal(size=2), -GRAVITY])
        slope, height, rise = 0.2 * rng.normal(size=2), rng.uniform(0.05, 0.2), rng.normal()
        com, moved = 0.1 * rng.normal(size=2), rng.normal(size=2)
        place = np.array([*com, slope @ com + height])
        force = np.array([*moved, slope @ moved + rise]) - gravity
        # place - s force lies on the plane
        normal = np.array([*-slope, 1.0])
        meets = place - (normal @ place) / (normal @ force) * force
        lever = levers(np.array([height]), np.array([rise]), slope, gravity)[0]
        assert com - lever * (moved - gravity[:2]) == pytest.approx(meets[:2], abs=1e-12)


def test_a_slope_is_level_ground_in_horizontal_axes():
    down = np.array([0.0, 0.0, -GRAVITY])
    assert levers(0.1, None, np.array([0.2, -0.1]), down) == levers(0.1, None, None, None) == 0.1 / GRAVITY


def _cost(maps, given, jerk):
    n, weights = CONFIG.samples, CONFIG.weights
    position, velocity, acceleration = (maps.free @ given[:3] + maps.forced @ jerk).reshape(3, n)
    zmp, wanted = position - maps.lever * acceleration, given[3:].reshape(3, n)
    return 0.5 * (
        weights.zmp * np.sum((zmp - wanted[0]) ** 2)
        + weights.position * np.sum((position - wanted[1]) ** 2)
        + weights.velocity * np.sum((velocity - wanted[2]) ** 2)
        + weights.jerk * jerk @ jerk
    )
