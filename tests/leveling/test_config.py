"""Impossible settings of the compensator are refused with their name."""

import math

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.config import TUNED, AttitudeGains, LevelingConfig, LevelingLimits, ScheduleConfig
from bluefoot_mpc.settings import build, to_table


@pytest.mark.parametrize("mix", [0.0, 1.0, -1.0, 1.5, math.nan, math.inf])
def test_a_mix_outside_of_its_range_is_refused(mix):
    with pytest.raises(ConfigurationError, match=r"mix = .*between 0 and 1.*--level none"):
        LevelingConfig(mix=mix)


@pytest.mark.parametrize("mix", [1e-6, 0.125, 0.999])
def test_a_mix_inside_is_not(mix):
    assert LevelingConfig(mix=mix).mix == mix


@pytest.mark.parametrize("ticks", [-1, 11])
def test_a_delay_outside_of_its_range_is_refused(ticks):
    with pytest.raises(ConfigurationError, match="delay_ticks"):
        LevelingConfig(delay_ticks=ticks)


@pytest.mark.parametrize("name", ["tilt", "tilt_rate", "heading", "heading_rate"])
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_gains_must_be_numbers_that_are_not_negative(name, value):
    with pytest.raises(ConfigurationError, match=name):
        AttitudeGains(**{name: value})


def test_gains_that_nobody_sets_are_those_tuned_for_the_share():
    rows = sorted(TUNED)
    for mix, tilt, tilt_rate in rows:
        assert AttitudeGains().in_force(mix) == (tilt, tilt_rate)
    (low, first, _), (high, second, _) = rows[:2]
    assert AttitudeGains().in_force(0.5 * (low + high))[0] == pytest.approx(0.5 * (first + second))
    assert AttitudeGains().in_force(1e-6) == rows[0][1:]
    assert AttitudeGains().in_force(0.9) == rows[-1][1:]


def test_gains_that_somebody_sets_are_in_force_at_every_share():
    assert AttitudeGains(tilt=0.0, tilt_rate=7.0).in_force(0.25) == (0.0, 7.0)
    assert AttitudeGains(tilt=5.0).in_force(0.25) == (5.0, AttitudeGains().in_force(0.25)[1])


@pytest.mark.parametrize("name", ["start", "off", "on", "learn_time"])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_times_must_be_numbers_that_are_not_negative(name, value):
    with pytest.raises(ConfigurationError, match=name):
        ScheduleConfig(**{name: value})


@pytest.mark.parametrize("value", [0.0, -0.1, math.nan])
def test_a_fade_takes_time(value):
    with pytest.raises(ConfigurationError, match="fade"):
        ScheduleConfig(fade=value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("disturbance", 0.0), ("shift", -0.1), ("shift", math.nan), ("clamped", 0.0),
        ("tilt_deg", -1.0), ("tilt_deg", 46.0), ("tilt_deg", math.nan),
    ],
)  # fmt: skip
def test_limits_that_limit_nothing_are_refused(name, value):
    with pytest.raises(ConfigurationError, match=name):
        LevelingLimits(**{name: value})


@pytest.mark.parametrize(
    ("table", "names"),
    [
        ({"psi": "oracle"}, ["persistence", "network", "model", "zero"]),
        ({"form": "pure"}, ["mixed", "residual"]),
        ({"mass_matrix": "true"}, ["nominal", "model"]),
        ({"schedule": {"learn": "sometimes"}}, ["off", "always", "never"]),
        ({"gain": 1.0}, ["gains", "mix"]),
    ],
)
def test_wrong_names_are_answered_with_the_right_ones(table, names):
    with pytest.raises(ConfigurationError) as error:
        build(LevelingConfig, table, "leveling")
    for name in names:
        assert name in str(error.value)


def test_a_configuration_comes_back_from_its_table():
    config = LevelingConfig(
        enabled=True, mix=0.35, psi="model", form="residual", schedule=ScheduleConfig(off=10.0, on=10.0)
    )
    assert build(LevelingConfig, to_table(config), "leveling") == config
