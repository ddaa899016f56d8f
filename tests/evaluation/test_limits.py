import pytest

from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.exceptions import ConfigurationError

VALUES = [0.2, 0.9, 0.3]


def test_a_worst_limit_asks_the_seed_that_is_nearest_to_breaking_it():
    assert Limit(figure="x", bound=0.9).holds(VALUES)
    assert not Limit(figure="x", bound=0.8).holds(VALUES)
    assert Limit(figure="x", bound=0.2, side="min").holds(VALUES)
    assert not Limit(figure="x", bound=0.3, side="min").holds(VALUES)


def test_a_median_limit_lets_a_seed_be_worse():
    limit = Limit(figure="x", bound=0.3, over="median", unit="°")
    assert limit.value(VALUES) == 0.3
    assert limit.holds(VALUES)
    assert not limit.holds([0.2, 0.9, 0.31])
    assert limit.describe() == "median ≤ 0.3 °"


def test_a_share_limit_counts_seeds():
    limit = Limit(figure="falls", bound=0, over="share", share=0.95)
    assert limit.holds([0.0] * 19 + [1.0])
    assert not limit.holds([0.0] * 18 + [1.0] * 2)
    assert limit.value([0.0, 1.0]) == 0.5
    assert limit.describe() == "≤ 0 in ≥ 95 % of the runs"


@pytest.mark.parametrize("over", ["worst", "median", "share"])
def test_what_is_unknown_does_not_hold(over):
    limit = Limit(figure="x", bound=1.0, over=over)
    assert not limit.holds([])
    assert not limit.holds([0.5, None])


def test_a_share_of_nothing_is_refused():
    with pytest.raises(ConfigurationError, match="share"):
        Limit(figure="x", bound=1.0, over="share", share=0.0)
