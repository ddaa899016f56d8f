"""The potential field against a plain loop over the rays, and what it leads to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation.potential_field import (
    Field,
    FieldConfig,
    Pace,
    PotentialField,
    advance,
    field,
    forces,
    weights,
)
from bluefoot_mpc.types import FloatArray
from tests.navigation.bench import BEARINGS

CONFIG = FieldConfig()


def printed_field(bearing: FloatArray, distance: FloatArray, config: FieldConfig) -> Field:
    """The law as it is written, ray by ray."""
    x = y = potential = 0.0
    view = math.radians(config.view_deg)
    for phi, far in zip(bearing.tolist(), distance.tolist(), strict=True):
        weight = (1.0 - abs(phi / view)) ** config.exponent if abs(phi) < view else 0.0
        excess = far - config.wanted_distance
        if excess < 0.0:
            force = -config.push * excess**2
        else:
            force = excess * (1.0 - math.exp(-config.pull * excess**2))
        x += weight * force * math.cos(phi)
        y += weight * force * math.sin(phi)
        potential += config.speed_gain * weight * force if force > 0.0 else 0.0
    return Field(force=np.array((x, y)), potential=potential)


@pytest.mark.parametrize("seed", range(5))
def test_field_equals_the_law_ray_by_ray(seed: int) -> None:
    rng = np.random.default_rng(seed)
    distance = rng.uniform(0.05, 5.6, BEARINGS.size)
    expected = printed_field(BEARINGS, distance, CONFIG)
    found = field(BEARINGS, distance, CONFIG)
    np.testing.assert_allclose(found.force, expected.force, rtol=1e-12)
    assert found.potential == pytest.approx(expected.potential, rel=1e-12)


def test_kept_weights_give_the_same_field_also_after_other_bearings() -> None:
    law, rng = PotentialField(CONFIG), np.random.default_rng(3)
    for bearing in (BEARINGS, BEARINGS[::3].copy(), BEARINGS):
        distance = rng.uniform(0.1, 5.6, bearing.size)
        np.testing.assert_array_equal(
            law.step(bearing, distance).force, field(bearing, distance, CONFIG).force
        )


def test_weights_are_one_ahead_and_zero_beyond_the_view() -> None:
    found = weights(np.radians([-120.0, -90.0, -45.0, 0.0, 45.0, 89.0, 90.0]), CONFIG)
    np.testing.assert_allclose(found[[0, 1, 6]], 0.0)
    assert found[3] == 1.0
    assert found[2] == found[4] == pytest.approx(0.5**0.25)


def test_near_things_push_and_far_ones_pull() -> None:
    near, edge, far = forces(np.array([0.3, 0.5, 2.0]), CONFIG)
    assert near == pytest.approx(-0.1 * 0.2**2)
    assert edge == 0.0
    assert far == pytest.approx(1.5, rel=1e-6)


def test_a_mirrored_sweep_gives_the_mirrored_force() -> None:
    distance = np.random.default_rng(1).uniform(0.1, 5.6, 681)
    bearing = np.linspace(-2.0, 2.0, 681)
    one, other = field(bearing, distance, CONFIG), field(bearing, distance[::-1], CONFIG)
    np.testing.assert_allclose(one.force, other.force * (1.0, -1.0), atol=1e-9)


def test_pace_goes_a_tenth_of_the_way_with_each_sweep() -> None:
    now = Field(force=np.array((0.0, 2.0)), potential=0.09)
    pace = advance(Pace(0.0, 0.0), now, CONFIG)
    assert pace.speed == pytest.approx(0.1 * (0.09 + 0.010))
    assert pace.yaw_rate == pytest.approx(0.1 * 0.4 / math.pi * 0.5 * math.pi)
    for _ in range(200):
        pace = advance(pace, now, CONFIG)
    assert pace.speed == pytest.approx(0.10)
    assert pace.yaw_rate == pytest.approx(0.2)


def test_no_force_turns_nowhere() -> None:
    assert advance(Pace(0.0, 0.0), Field(np.zeros(2), 0.0), CONFIG).yaw_rate == 0.0


@pytest.mark.parametrize("wrong", [{"pull": 0.0}, {"view_deg": 200.0}, {"speed_share": 0.0}])
def test_impossible_parameters_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError):
        FieldConfig(**wrong)
