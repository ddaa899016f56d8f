"""The short version of what crossing rough ground must reach."""

import pytest

from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate

pytestmark = [pytest.mark.slow, pytest.mark.timeout(500)]


def test_a_kerb_is_mapped_met_and_climbed():
    options = RunOptions(duration=72.0, world="kerb", seed=0, overrides=("scenario.goal=0.7",))
    result = simulate("rough", options)
    found = result.summary["figures"]
    assert result.summary["success"], result.summary["criteria"]
    assert found["sweeps"] == 2
    assert found["map_error_median_mm"] < 3.0
    assert found["footholds"] > 30
    assert found["foothold_error_median_mm"] < 8.0


def test_blind_the_same_robot_uses_no_map():
    options = RunOptions(duration=8.0, world="rubble", seed=0, blind=True)
    found = simulate("rough", options).summary["figures"]
    assert found["sweeps"] == 0
    assert found["map_cells"] == 0
    assert found["progress_m"] > 0.03
