"""Height, pitch and roll of the trunk over the plane of its feet."""

import math

import numpy as np
import pytest

from bluefoot_mpc.control.support import SupportConfig, SupportPlane
from bluefoot_mpc.geometry import rotation_from_rpy

FEET = np.array([[0.16, 0.15, 0.0], [0.16, -0.15, 0.0], [-0.16, 0.15, 0.0], [-0.16, -0.15, 0.0]])
DT = 0.02


def followed(feet, config=None, seconds=20.0, walking=True) -> SupportPlane:
    plane = SupportPlane(config or SupportConfig())
    for _ in range(round(seconds / DT)):
        plane.step(feet, DT, walking=walking)
    return plane


@pytest.mark.parametrize(("roll", "pitch"), [(0.08, 0.0), (0.0, 0.1), (0.0, -0.1), (-0.05, 0.06)])
def test_a_share_of_one_makes_the_trunk_parallel_to_its_feet(roll, pitch):
    feet = FEET @ rotation_from_rpy(np.array([roll, pitch, 0.0])).T + (0.0, 0.0, 0.02)
    plane = followed(feet, SupportConfig(even_deg=0.0, tilt_share=1.0, max_tilt_deg=15.0))
    assert plane.level == pytest.approx(0.02, abs=1e-6)
    np.testing.assert_allclose(plane.tilt, (roll, pitch), atol=0.001)


def test_the_tilt_is_a_share_bounded_and_slow():
    steep = FEET + np.outer(FEET[:, 0], (0.0, 0.0, math.tan(0.2)))
    assert followed(steep, SupportConfig(even_deg=0.0, tilt_share=0.4)).tilt[1] == pytest.approx(
        -0.08, abs=1e-3
    )
    bounded = followed(steep, SupportConfig(even_deg=0.0, tilt_share=1.0, max_tilt_deg=5.0))
    assert bounded.tilt[1] == pytest.approx(-math.radians(5.0), abs=1e-3)
    config = SupportConfig(even_deg=0.0, tilt_share=0.4, tilt_time=2.0)
    assert followed(steep, config, seconds=2.0).tilt[1] == pytest.approx(
        -0.08 * (1.0 - math.exp(-1.0)), abs=1e-3
    )


def test_it_goes_level_where_the_feet_rest():
    steep = FEET + np.outer(FEET[:, 0], (0.0, 0.0, 0.2))
    plane = followed(steep)
    assert abs(plane.tilt[1]) > 0.05
    for _ in range(100):
        plane.step(steep, DT, walking=False)
    np.testing.assert_allclose(plane.tilt, 0.0, atol=1e-3)


def test_feet_in_a_line_show_no_slope():
    line = np.column_stack((np.linspace(-0.1, 0.1, 4), np.zeros(4), np.linspace(0.0, 0.05, 4)))
    np.testing.assert_array_equal(followed(line).tilt, 0.0)


def test_slopes_that_blocks_make_leave_it_level_and_of_more_only_what_is_beyond_counts():
    def tilted(degrees):
        feet = FEET + np.outer(FEET[:, 1], (0.0, 0.0, math.tan(math.radians(degrees))))
        return math.degrees(followed(feet, SupportConfig(even_deg=3.0, tilt_share=0.5)).tilt[0])

    assert tilted(2.9) == tilted(-2.9) == 0.0
    assert tilted(9.0) == pytest.approx(3.0, abs=0.01)
    assert tilted(-9.0) == pytest.approx(-3.0, abs=0.01)
