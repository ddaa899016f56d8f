import dataclasses
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx import Narx, NarxConfig
from bluefoot_mpc.leveling.narx.config import bold_driver, low_pass
from bluefoot_mpc.settings import build, dump_toml, to_table


def test_toml_round_trip():
    config = NarxConfig(hidden=(7, 9), delays=3, feedback="target", rate=0.02)
    assert build(NarxConfig, tomllib.loads(dump_toml(to_table(config)))) == config


def test_the_papers_numbers_are_the_default():
    config = NarxConfig()
    assert config.hidden == (50, 50)
    assert (config.beta, config.zeta, config.mse_weight) == (1e-4, 5e-4, 0.01)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"rate_min": 0.03, "rate_max": 0.03}, ("empty", "rate_min", "rate_max", "beta = 0")),
        ({"rate_min": 0.1, "rate_max": 0.01}, ("empty", "lower rate_min or raise rate_max")),
        ({"rate": 0.5}, ("outside", "0.5", "0.03")),
        ({"rate": 1e-6}, ("outside", "1e-05")),
        ({"rate": float("nan")}, ("rate",)),
        ({"rate_min": 0.0}, ("rate_min", "positive")),
        ({"hidden": (50, 0)}, ("hidden[1]", "at least 1")),
        ({"hidden": (50,)}, ("hidden", "two layers")),
        ({"hidden": (200_000, 50)}, ("hidden[0] = 200000", "at most 1000")),
        ({"hidden": (50, 1001)}, ("hidden[1] = 1001", "at most 1000")),
        ({"delays": 0}, ("delays", "at least 1")),
        ({"delays": 101}, ("delays = 101", "at most 100")),
        ({"delays": 99_999_999_999_999_999_999}, ("delays", "at most 100")),
        ({"beta": 1.0}, ("beta", "below 1")),
        ({"beta": -1e-4}, ("beta",)),
        ({"zeta": float("inf")}, ("zeta",)),
        ({"mse_weight": 0.0}, ("mse_weight",)),
        ({"mse_weight": 1.5}, ("mse_weight", "0..1")),
        ({"weight_scale": -1.0}, ("weight_scale",)),
        ({"gradient_bound": -1.0}, ("gradient_bound",)),
        ({"value_bound": 0.0}, ("value_bound",)),
        ({"weight_bound": float("nan")}, ("weight_bound",)),
        ({"error_bound": 0.0}, ("error_bound",)),
        ({"seed": -1}, ("seed",)),
    ],
)
def test_impossible_values_are_named(values, words):
    with pytest.raises(ConfigurationError) as error:
        NarxConfig(**values)
    for word in words:
        assert word in str(error.value)


def test_the_largest_network_can_be_made():
    network = Narx(NarxConfig(hidden=(1000, 1000), delays=100), np.ones(3), np.ones(2))
    assert network.predict(np.ones(3)).valid


def test_an_unknown_feedback_lists_the_valid_ones():
    with pytest.raises(ConfigurationError, match="output, target"):
        build(NarxConfig, {"feedback": "own"})


def test_bold_driver_goes_the_right_way():
    config = NarxConfig(beta=1e-2, zeta=0.5)
    assert bold_driver(0.01, True, config) == pytest.approx(0.01 * (1 - 1e-2), rel=1e-15)
    assert bold_driver(0.01, False, config) == pytest.approx(0.01 * (1 + 0.5e-2), rel=1e-15)


@given(
    st.lists(st.booleans(), max_size=200),
    st.floats(0.0, 0.99),
    st.floats(0.0, 100.0),
)
def test_bold_driver_stays_in_its_bounds(steps, beta, zeta):
    config = NarxConfig(beta=beta, zeta=zeta)
    rate = config.rate
    for grew in steps:
        rate = bold_driver(rate, grew, config)
        assert config.rate_min <= rate <= config.rate_max


def test_bold_driver_reaches_both_bounds():
    config = NarxConfig(beta=0.1, zeta=1.0)
    up = down = config.rate
    for _ in range(200):
        up, down = bold_driver(up, False, config), bold_driver(down, True, config)
    assert (up, down) == (config.rate_max, config.rate_min)


def test_low_pass_follows_a_constant_error():
    mse = 0.0
    for _ in range(100):
        mse = low_pass(mse, 4.0, 0.01)
    assert mse == pytest.approx(4.0 * (1.0 - 0.99**100), rel=1e-12)
    assert low_pass(3.0, 3.0, 0.01) == pytest.approx(3.0)


def test_the_configuration_is_frozen():
    with pytest.raises(dataclasses.FrozenInstanceError):
        NarxConfig().rate = 0.02
