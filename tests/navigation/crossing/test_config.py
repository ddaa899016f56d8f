"""Configurations that would take all memory or all time are refused before a robot stands there."""

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.settings import build


@pytest.mark.parametrize(
    "table",
    [
        {"map": {"cell": 1e-5}},
        {"map": {"cell": 0.005}, "ahead": 5.0},
        {"map": {"dilation": 1000}},
        {"start_radius": 1e6},
        {"free_space": {"step": 1e-9}},
        {"align": {"step": 1e-6}},
        {"align": {"shift": 1e6}},
        {"plan": {"cell": 1e-5}},
        {"plan": {"horizon": 1e6}},
        {"plan": {"treads": {"reach": 10.0}}},
        {"pace": {"spacing": 1e-6}},
        {"cloud": {"smooth": 1000000}},
        {"sweep": {"count": 0}},
        {"think_ticks": 0},
        {"ahead": float("nan")},
    ],
)
def test_what_no_robot_can_think_about_is_refused(table):
    with pytest.raises(ConfigurationError):
        build(CrossingConfig, table)


def test_what_is_asked_for_may_be_fine():
    assert build(CrossingConfig, {"map": {"cell": 0.005}, "start_radius": 1.0}).map.cell == 0.005
