import numpy as np
import pytest

from bluefoot_mpc.evaluation.comparison import bootstrap_mean, compare
from bluefoot_mpc.exceptions import ConfigurationError


def figures(values, falls=None):
    return {k: {"x": value, "falls": float(k in (falls or ()))} for k, value in enumerate(values)}


def rng():
    return np.random.default_rng(5)


def test_a_constant_ratio_has_no_spread():
    theirs = np.linspace(0.5, 2.0, 20)
    found = compare("x", figures(0.6 * theirs), figures(theirs), rng())
    assert found.ratio.value == pytest.approx(0.6)
    assert (found.ratio.low, found.ratio.high) == pytest.approx((0.6, 0.6))
    assert found.pairs == 20
    assert found.reduces_by(0.4 - 1e-9)
    assert not found.reduces_by(0.41)
    assert found.difference.value == pytest.approx(-0.4 * theirs.mean())


def test_pairs_make_the_interval_narrower_than_the_spread_of_the_seeds():
    draw = rng()
    theirs = draw.uniform(0.5, 3.0, 20)
    ours = theirs - 0.2 + 0.02 * draw.standard_normal(20)
    found = compare("x", figures(ours), figures(theirs), draw)
    assert found.difference.value == pytest.approx(-0.2, abs=0.02)
    assert found.difference.low < found.difference.value < found.difference.high
    assert found.difference.high - found.difference.low < 0.05


def test_the_interval_holds_the_mean_about_as_often_as_it_says():
    draw = np.random.default_rng(1)
    hits = 0
    for _ in range(100):
        interval = bootstrap_mean(draw.normal(1.0, 0.5, 20), draw)
        hits += interval.low <= 1.0 <= interval.high
    assert 86 <= hits <= 99


def test_falls_and_unknown_figures_are_left_out_on_both_sides():
    ours = figures([1.0, 1.0, None, 1.0, 50.0, 1.0], falls=[4])
    theirs = figures([2.0, 2.0, 2.0, 2.0, 2.0, 90.0], falls=[5])
    found = compare("x", ours, theirs, rng())
    assert (found.pairs, found.left_out) == (3, 3)
    assert found.ratio.value == pytest.approx(0.5)


def test_too_few_pairs_say_nothing():
    found = compare("x", figures([1.0, 1.0]), figures([2.0, 2.0]), rng())
    assert found.ratio is None
    assert found.difference is None
    assert not found.reduces_by(0.1)


def test_a_zero_has_a_difference_but_no_ratio():
    found = compare("x", figures([1.0, 1.0, 1.0]), figures([0.0, 1.0, 1.0]), rng())
    assert found.ratio is None
    assert found.difference.value == pytest.approx(1.0 / 3.0)


def test_other_seeds_are_no_pairs():
    with pytest.raises(ConfigurationError, match="same seeds"):
        compare("x", figures([1.0]), figures([1.0, 2.0]), rng())
