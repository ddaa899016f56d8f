import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.couplings import COUPLINGS
from bluefoot_mpc.gait.figures import Sampling, cpg_series, footfall_pattern, transition_series
from tests.gait.walker import REFERENCE, STANCE


@pytest.mark.parametrize("gait", COUPLINGS)
def test_series_is_a_closed_cycle(gait: str) -> None:
    series = cpg_series(gait, Sampling(duration=5.0, config=REFERENCE))
    assert series.time.shape == (1000,)
    assert series.y1.shape == series.y2.shape == (1000, 4)
    radius = np.hypot(series.y1, series.y2)
    assert 0.6 < radius.min() < radius.max() < 1.4
    if gait == "trot":
        np.testing.assert_allclose(series.y2[:, 0], series.y2[:, 3], atol=0.01)
        np.testing.assert_allclose(series.y2[:, 1], series.y2[:, 2], atol=0.01)
    else:
        assert (series.y2 > 0.0).sum(axis=1).max() == 1


@pytest.mark.parametrize(("first", "second"), [("trot", "walk"), ("walk", "trot")])
def test_transition_goes_from_one_pattern_to_the_other(first: str, second: str) -> None:
    series = transition_series(first, second, 2.0, Sampling(duration=12.0, config=REFERENCE))
    assert series.gait == f"{first} to {second}"
    assert series.blend[0] == 0.0
    assert series.blend[-1] == 1.0
    together = np.abs(series.y2[:, 0] - series.y2[:, 3])
    head, tail = together[:300].max(), together[-300:].max()
    assert (head < 0.02) == (first == "trot")
    assert (tail < 0.02) == (second == "trot")
    assert (series.y2 > 0.0).sum(axis=1).max() <= 2


@pytest.mark.parametrize(("gait", "least", "duty"), [("trot", 2, 0.64), ("walk", 3, 0.78)])
def test_footfall_pattern_at_40_mm_per_s(gait: str, least: int, duty: float) -> None:
    pattern = footfall_pattern(gait, STANCE, Sampling(dt=0.01, config=REFERENCE))
    assert pattern.stance.sum(axis=1).min() == least
    np.testing.assert_allclose(pattern.duty, duty, atol=0.04)
    if gait == "walk":
        lifts = [
            (leg, k)
            for leg in range(4)
            for k in np.flatnonzero(pattern.stance[:-1, leg] & ~pattern.stance[1:, leg])
        ]
        order = [leg for leg, _ in sorted(lifts, key=lambda item: item[1])]
        start = order.index(1)
        assert order[start : start + 4] == [1, 2, 0, 3]  # FR, RL, FL, RR


def test_bad_arguments_are_refused() -> None:
    with pytest.raises(UnknownNameError):
        cpg_series("pace")
    with pytest.raises(ConfigurationError, match="duration"):
        Sampling(duration=-1.0)
