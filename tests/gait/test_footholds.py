from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.footholds import FootholdConfig
from tests.gait.walker import DT, FOOTHOLD, STANCE, TROT_TIMING, command, drive, make

EARLY = replace(FOOTHOLD, early_contact=True, early_progress=0.5, offset_time=0.5)
DOWN = np.ones(4, dtype=bool)
UP = np.array([False, True, True, True])


def to_progress(walker, target, **more):
    """Steps until FL has passed `target` of its first swing, its switch open on the way."""
    for _ in range(50):
        output = walker.step(command(0.08, contact=UP, **more), DT)
        if output.swing_progress[0] >= target:
            return output
    raise AssertionError("never got there")


def test_early_contact_freezes_the_foot_where_it_is() -> None:
    walker = make(foothold=EARLY)
    to_progress(walker, 0.6)
    hit = walker.step(command(0.08, contact=DOWN), DT)
    assert not hit.phase.swing[0]
    assert hit.phase.y2[0] > 0.0
    assert hit.foot_height[0] > 0.001
    run = drive(walker, command(0.08, contact=DOWN), 0.2)
    np.testing.assert_allclose(run.in_world[:, 0], run.in_world[0, 0], atol=1e-12)
    assert np.all(run.foot_height[:, 0] == hit.foot_height[0])


def test_contact_that_was_never_lost_does_not_count() -> None:
    walker = make(foothold=EARLY)
    run = drive(walker, command(0.08, contact=DOWN), 0.16)
    assert run.swing[:, 0].all()


def test_contact_too_soon_or_switched_off_does_not_count() -> None:
    walker = make(foothold=EARLY)
    to_progress(walker, 0.2)
    assert walker.step(command(0.08, contact=DOWN), DT).phase.swing[0]
    walker = make(foothold=replace(EARLY, early_contact=False))
    to_progress(walker, 0.6)
    assert walker.step(command(0.08, contact=DOWN), DT).phase.swing[0]


def test_early_contact_moves_the_virtual_foothold_and_it_returns() -> None:
    walker = make(foothold=EARLY)
    to_progress(walker, 0.6)
    feet = STANCE.copy()
    feet[0] += (0.02, -0.01, 0.008)
    walker.step(command(0.08, contact=DOWN, foot_position=feet), DT)
    foot = walker.state.feet[0]
    assert foot.offset.imag == pytest.approx(-0.01, abs=1e-3)
    assert foot.offset_z == pytest.approx(0.008, abs=1e-3)
    assert foot.velocity == 0.0
    before = abs(foot.offset)
    drive(walker, command(0.08), 0.5)
    assert abs(foot.offset) == pytest.approx(before * np.exp(-1.0), rel=0.03)
    drive(walker, command(0.08), 3.0)
    assert abs(foot.offset) < 1e-4


def test_a_foot_that_touches_level_ground_lands_as_planned() -> None:
    for height, lands in ((EARLY.early_height - 1e-3, False), (EARLY.early_height + 1e-3, True)):
        walker = make(foothold=EARLY)
        to_progress(walker, 0.6)
        feet = STANCE + np.array([0.0, 0.0, height])
        assert walker.step(command(0.08, contact=DOWN, foot_position=feet), DT).phase.swing[0] != lands


def test_the_shift_is_bounded() -> None:
    walker = make(foothold=EARLY)
    to_progress(walker, 0.6)
    walker.step(command(0.08, contact=DOWN, foot_position=STANCE + 0.5), DT)
    assert abs(walker.state.feet[0].offset) <= EARLY.offset_limit + 1e-12
    assert abs(walker.state.feet[0].offset_z) <= EARLY.offset_limit + 1e-12


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
def test_replaced_footholds_are_met_once(law: str) -> None:
    walker = make(foothold=replace(FOOTHOLD, law=law))
    drive(walker, command(0.06), 3.0)
    while walker.state.feet[1].swinging or walker.state.feet[1].turning:
        walker.step(command(0.06), DT)
    goal = STANCE.copy()
    goal[1] += (0.03, -0.015, 0.01)
    walker.set_footholds(goal, [False, True, False, False])
    world = walker.state.pose.to_world(complex(goal[1, 0], goal[1, 1]))
    run = drive(walker, command(0.06), 2.5)
    down = np.flatnonzero(run.swing[:-1, 1] & ~run.swing[1:, 1]) + 1
    assert abs(run.in_world[down[0], 1] - world) < 0.0015
    assert run.foot_height[down[0], 1] == pytest.approx(0.01)
    assert run.foot_height[down[1], 1] == 0.0
    assert abs(run.foot_position[down[1], 1, 1] - STANCE[1, 1]) < 0.002


def test_a_foothold_given_in_flight_waits_on_the_smooth_path() -> None:
    walker = make(foothold=replace(FOOTHOLD, law="minimum_jerk"))
    output = to_progress(walker, 0.5)
    walker.set_footholds(STANCE + 0.02, DOWN)
    after = walker.step(command(0.08), DT)
    assert np.abs(after.foot_position[0, :2] - output.foot_position[0, :2]).max() < 0.01
    assert walker.state.feet[0].goal is None
    assert walker.state.feet[1].goal is not None
    drive(walker, command(0.08), 1.0)
    assert walker.state.feet[0].later is None


def test_rows_that_are_not_finite_are_ignored() -> None:
    walker = make()
    goal = STANCE.copy()
    goal[0, 0] = np.nan
    walker.set_footholds(goal, DOWN)
    assert walker.state.feet[0].goal is None
    assert walker.state.feet[1].goal is not None


def test_printed_damping_lags_behind_its_foothold_by_a_known_amount() -> None:
    timing = replace(TROT_TIMING, cycle_min=0.5, cycle_max=0.5)
    config = replace(FOOTHOLD, ground_damping=True)
    ahead = {}
    for name, foothold in (("printed", config), ("ours", replace(config, ground_damping=False))):
        walker = make(timing, foothold, max_acceleration=1.0)
        run = drive(walker, command(0.1), 3.0, 0.002)
        down = run.swing[:-1, 0] & ~run.swing[1:, 0]
        ahead[name] = run.foot_position[1:, 0, 0][down][-1]
    rate = config.swing_rate / (0.36 * 0.5)
    lag = 2.0 * config.damping_ratio / rate * 0.1  # b_c v / k_c
    assert ahead["ours"] - ahead["printed"] == pytest.approx(lag, rel=0.1)


@pytest.mark.parametrize("values", [{"damping_ratio": 0.9}, {"apex": 0.0}, {"offset_time": 0.0}])
def test_impossible_values_are_refused(values: dict[str, float]) -> None:
    from bluefoot_mpc.exceptions import ConfigurationError

    with pytest.raises(ConfigurationError):
        FootholdConfig(**values)
