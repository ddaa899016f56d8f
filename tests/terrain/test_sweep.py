"""Levels of a sweep, and the law that goes through them."""

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.sweep import SweepConfig, advance, levels, line_ahead, pitch_for
from tests.terrain.flat_floor import HEIGHT, MOUNTS, floor_scan, trunk

LIFT = MOUNTS.lidar[2]


def test_levels_even_in_pitch_are_the_thesis_own():
    config = SweepConfig(spacing="pitch", count=8, pitch_min_deg=10.0, pitch_max_deg=30.0)
    expected = [math.radians(20.0 * k / 8 + 10.0) for k in range(9)]
    np.testing.assert_allclose(levels(config, HEIGHT, LIFT), expected, atol=1e-12)


def test_the_line_ahead_is_where_the_middle_ray_meets_the_floor():
    for pitch in np.radians((11.0, 20.0, 31.0)):
        position, quaternion = trunk(pitch)
        scan = floor_scan(position, quaternion)
        ray = np.interp(0.0, scan.bearing, scan.distance)
        lens = math.cos(pitch) * MOUNTS.lidar[0] + math.sin(pitch) * LIFT
        assert line_ahead(pitch, HEIGHT, LIFT) == pytest.approx(lens + math.cos(pitch) * ray, abs=1e-5)


def test_levels_even_along_the_ground_have_lines_one_step_apart():
    config = SweepConfig(ground_step=0.014)
    found = levels(config, HEIGHT, LIFT)
    assert np.degrees(found[[0, -1]]) == pytest.approx((config.pitch_min_deg, config.pitch_max_deg))
    assert (np.diff(found) > 0.0).all()
    gaps = -np.diff(line_ahead(found, HEIGHT, LIFT))
    np.testing.assert_allclose(gaps, gaps[0], rtol=1e-9)
    assert 0.012 < gaps[0] <= 0.014
    np.testing.assert_allclose(pitch_for(line_ahead(found, HEIGHT, LIFT), HEIGHT, LIFT), found, atol=1e-12)


@pytest.mark.parametrize("height", [math.nan, math.inf, -0.1, 0.0])
def test_without_a_height_levels_are_even_in_pitch(height):
    found = levels(SweepConfig(), height, LIFT)
    np.testing.assert_allclose(np.diff(found), np.ptp(found) / (len(found) - 1), rtol=1e-9)


def test_the_law_integrates_the_error_within_its_rate_and_its_lead():
    config = SweepConfig(rate_gain=4.0, max_rate=0.5, max_lead_deg=3.0)
    assert advance(0.30, 0.32, 0.31, 0.02, config) == pytest.approx(0.30 + 4.0 * 0.01 * 0.02)
    assert advance(0.30, 0.32, 0.32, 0.02, config) == 0.30
    assert advance(0.30, 0.32, -1.0, 0.02, config) == pytest.approx(0.30 + 0.5 * 0.02)
    wanted = 0.30
    for _ in range(500):  # a trunk that does not move
        wanted = advance(wanted, 0.32, 0.20, 0.02, config)
    assert wanted == pytest.approx(0.32 + math.radians(3.0))


def test_the_law_stays_where_the_estimate_is_no_number():
    assert advance(0.30, 0.32, math.nan, 0.02, SweepConfig()) == 0.30


@pytest.mark.parametrize(
    "wrong",
    [
        {"pitch_min_deg": 31.0, "pitch_max_deg": 11.0},
        {"pitch_max_deg": 60.0},
        {"ground_step": 0.0},
        {"dwell_scans": 0},
        {"rate_gain": -1.0},
        {"slack": 1.5},
        {"raised": math.nan},
    ],
)
def test_impossible_sweeps_are_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        SweepConfig(**wrong)


def test_a_level_far_away_is_gone_to_at_the_rate():
    assert advance(0.0, 0.2, 0.0, 0.002, SweepConfig(max_rate=0.5)) == pytest.approx(0.001)
