"""The short version of what finding the way must reach."""

import math

import pytest

from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate
from tests.graphics import needs_graphics

pytestmark = [pytest.mark.slow, pytest.mark.timeout(500)]

ROOM = """
bounds = [-1.2, -1.8, 3.6, 1.8]

[marker]
x = 2.7
y = 0.5

[[solids]]
name = "screen"
shape = "box"
x = 1.5
y = 0.35
size = [0.1, 1.1, 0.5]

[[solids]]
name = "wall"
shape = "box"
x = 3.55
y = 0.0
size = [0.1, 3.6, 0.5]
"""
"""A marker behind a screen that stands free."""


def figures(result):
    found = result.summary["figures"]
    assert not result.summary["fell"]
    assert found["collisions"] == []
    assert found["closest_approach_m"] >= 0.10
    assert found["stuck_longest_s"] <= 10.0
    return found


@pytest.mark.parametrize(("world", "seed"), [("maze", 3), ("chairs", 11)])
def test_wandering_keeps_off_things_and_sees(world, seed):
    found = figures(simulate("wander", RunOptions(duration=25.0, world=world, seed=seed)))
    assert found["path_m"] > 2.5
    assert found["seen_percent"] >= 40.0


@needs_graphics
@pytest.mark.parametrize("leader", ["ackermann", "omni"])
def test_a_leader_is_kept_in_view_and_at_its_distance(leader):
    options = RunOptions(duration=25.0, seed=3, leader=leader, overrides=("scenario.leader_speed=0.12",))
    found = figures(simulate("follow", options))
    assert found["in_view_percent"] >= 90.0
    assert found["distance_error_m"] == pytest.approx(0.0, abs=0.05)


@needs_graphics
def test_a_marker_behind_a_screen_is_found_and_stopped_at(tmp_path):
    world = tmp_path / "room.toml"
    world.write_text(ROOM)
    found = figures(simulate("approach", RunOptions(duration=60.0, seed=3, world=str(world))))
    assert found["first_seen_s"] > 3.0
    assert math.isfinite(found["arrived_s"])
    assert found["distance_error_m"] == pytest.approx(0.0, abs=0.05)
