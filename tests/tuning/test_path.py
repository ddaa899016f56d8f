import itertools

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.table import GaitTable
from bluefoot_mpc.settings import build
from bluefoot_mpc.tuning.path import Candidate, gait_table, roughness, smooth_path
from bluefoot_mpc.tuning.space import Parameter, Space, trot_space

SPACE = Space(parameters=(Parameter(name="a", keys=("x.a",), low=0.0, high=2.0),))


def test_roughness_counts_in_widths_of_the_ranges():
    assert roughness({"a": 0.5}, {"a": 1.5}, SPACE) == pytest.approx(0.25)


def test_the_path_is_the_cheapest_of_all():
    rng = np.random.default_rng(3)
    found = {
        speed: [Candidate({"a": float(a)}, float(c)) for a, c in rng.uniform(0, 2, (4, 2))]
        for speed in (0.1, 0.2, 0.4)
    }

    def total(path, weight):
        steps = zip(path, path[1:], (0.1, 0.2), strict=False)
        rough = sum(weight * 0.1 / d * roughness(p.values, q.values, SPACE) for p, q, d in steps)
        return sum(p.cost for p in path) + rough

    for weight in (0.0, 1.0, 30.0):
        expected = min(itertools.product(*found.values()), key=lambda path: total(path, weight))
        assert list(smooth_path(found, SPACE, weight).values()) == list(expected)


def test_a_speed_without_candidates_is_refused():
    with pytest.raises(ConfigurationError, match="one candidate"):
        smooth_path({0.1: []}, SPACE, 1.0)


def test_columns_fit_the_gaits_table():
    low = {p.name: p.low for p in trot_space().parameters}
    high = {p.name: p.high for p in trot_space().parameters}
    table = build(GaitTable, gait_table({0.4: high, 0.06: low}))
    assert table.speed == (0.06, 0.4)
    assert table.step_height == (low["step_height"], high["step_height"])
    assert table.mixing == (low["mixing"], high["mixing"])
