from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.footholds import FootholdConfig
from bluefoot_mpc.gait.gait import Gait, GaitConfig
from bluefoot_mpc.settings import build, merge, to_table
from tests.gait.walker import DT, FOOTHOLD, REFERENCE, STANCE, TROT_TIMING, command, drive, make

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


def test_a_foot_leaves_the_ground_at_rest() -> None:
    for law in ("virtual_force", "minimum_jerk"):
        walker = make(foothold=replace(FOOTHOLD, law=law), max_acceleration=10.0)
        drive(walker, command(0.1), 2.0, 0.001)
        while not walker.state.feet[0].swinging:
            before = drive(walker, command(0.1), 0.001, 0.001)
        after = drive(walker, command(0.1), 0.003, 0.001)
        moved = after.in_world[-1, 0] - before.in_world[-1, 0]
        assert moved.real > 0.0  # towards its foothold, and never back first
        assert abs(moved) < 0.1 * 0.1 * 0.004 * 10.0


def test_feet_land_in_the_same_place_whatever_the_tick() -> None:
    """Lift-off and landing happen inside a tick, and count from the moment at which they do."""
    smooth = replace(FOOTHOLD, law="minimum_jerk", vertical="quintic")
    timing = replace(TROT_TIMING, cycle_min=0.317, cycle_max=0.317)  # no whole number of ticks
    places, paths = [], []
    for substep, dt in ((0.02, 0.02), (0.0005, 0.02)):
        walker = make(timing, smooth, substep=substep, max_acceleration=10.0)
        run = drive(walker, command(0.2), 4.0, dt)
        down = np.flatnonzero(run.swing[:-1, 0] & ~run.swing[1:, 0])[3:] + 1
        # In b' at the tick's end: carried back to the landing by nothing but the commanded speed.
        steps = np.diff(run.in_world[down, 0].real)
        places.append(steps)
        paths.append(run.foot_position[50:, :, :2])
    # Of the way itself, which a whole tick of 4 mm would show.
    assert np.abs(paths[0] - paths[1]).max() < 1e-3
    np.testing.assert_allclose(places[0][:8], places[1][:8], atol=4e-4)
    np.testing.assert_allclose(places[1].mean(), 0.2 * 0.317, atol=1e-3)


def test_a_foothold_that_waited_keeps_its_height() -> None:
    walker = make(foothold=replace(FOOTHOLD, law="minimum_jerk"))
    to_progress(walker, 0.5)
    walker.set_footholds(STANCE + np.array([0.01, 0.0, 0.012]), DOWN)
    heights = drive(walker, command(0.08), 1.2).foot_height[:, 0]
    swing = walker.state.feet[0]
    assert 0.012 in np.round(heights, 12)
    assert swing.later is None


def test_a_second_early_landing_counts_from_the_foothold_as_it_was_shifted() -> None:
    walker = make(foothold=replace(EARLY, offset_time=1e6, offset_limit=0.2), max_acceleration=100.0)
    shift = STANCE + np.array([0.01, 0.0, 0.02])
    to_progress(walker, 0.6)
    walker.step(command(0.08, contact=DOWN, foot_position=shift), DT)
    first = walker.state.feet[0].offset
    while walker.state.feet[0].turning:
        walker.step(command(0.08, contact=DOWN), DT)
    to_progress(walker, 0.6)
    walker.step(command(0.08, contact=DOWN, foot_position=shift), DT)
    assert walker.state.feet[0].offset == pytest.approx(first, abs=2e-3)


def test_swinging_feet_are_displaced_towards_the_fall() -> None:
    table = {"reflex": {"enabled": True, "threshold": 50.0, "shift": 0.02, "shift_limit": 0.03}}
    config = build(GaitConfig, merge(to_table(REFERENCE), table))
    landed = {}
    for rate in (0.0, 1.0):
        walker = Gait(config, STANCE)
        falling = command(0.05, contact=UP, tilt_rate_error=np.array([-rate, rate]))
        run = drive(walker, falling, 0.6)
        down = np.flatnonzero(run.swing[:-1, 0] & ~run.swing[1:, 0])[0] + 1
        landed[rate] = run.in_world[down, 0]
    # Nose down is forward, left side down is left.
    assert landed[1.0] - landed[0.0] == pytest.approx(0.02 + 0.02j, abs=2e-3)


def landings(run, leg: int) -> np.ndarray:
    """How far from its nominal place in b' a leg lands, m."""
    down = np.flatnonzero(run.swing[:-1, leg] & ~run.swing[1:, leg]) + 1
    return run.foot_position[down, leg, :2] - STANCE[leg, :2]


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
def test_landing_places_shift_on_demand_and_come_back(law: str) -> None:
    foothold = replace(FOOTHOLD, law=law, shift_limit=0.05, shift_rate=0.5)
    shift = np.array([0.012, -0.03])
    walker, other = make(foothold=foothold), make(foothold=foothold)
    run = drive(walker, command(0.08, foothold_shift=shift), 3.0, 0.005)
    plain = drive(other, command(0.08), 3.0, 0.005)
    for leg in range(4):
        ahead = landings(run, leg)
        expected = landings(plain, leg)[-1] + shift
        np.testing.assert_allclose(ahead[-1], expected, atol=1.5e-3)
        moved = np.abs(np.diff(run.in_world[:, leg]))
        assert moved.max() < 0.005 * 1.6  # no jump, though the demand was one
    back = drive(walker, command(0.08), 2.0, 0.005)
    np.testing.assert_allclose(landings(back, 0)[-1], landings(plain, 0)[-1], atol=1.5e-3)
    # Feet that stand are never moved.
    world, still = run.in_world, ~run.swing[1:] & ~run.swing[:-1]
    assert np.abs(np.diff(world, axis=0))[still].max() < 1e-12


def test_a_shift_is_bounded_and_without_one_nothing_changes() -> None:
    foothold = replace(FOOTHOLD, law="minimum_jerk", shift_limit=0.02, shift_rate=10.0)
    walker = make(foothold=foothold)
    drive(walker, command(0.05, foothold_shift=np.array([3.0, 4.0])), 1.0)
    assert walker.state.landing_shift == pytest.approx(0.012 + 0.016j)
    drive(walker, command(0.05, foothold_shift=np.array([np.nan, 0.0])), 0.1)
    assert walker.state.landing_shift == 0.0
    one, two = make(foothold=foothold), make(foothold=foothold)
    nothing = drive(one, command(0.05, 0.2, foothold_shift=np.zeros(2)), 2.0)
    np.testing.assert_array_equal(nothing.foot_position, drive(two, command(0.05, 0.2), 2.0).foot_position)


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
def test_footholds_out_of_reach_are_drawn_in_and_named(law: str) -> None:
    walker = make(foothold=replace(FOOTHOLD, law=law, reach=0.05))
    drive(walker, command(0.03, 0.1), 3.0)
    goal = STANCE + np.array([[0.3, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.3, 0.0], [0.05, 0.0, 0.0]])
    taken = walker.set_footholds(goal, [True, True, True, False])
    assert taken.tolist() == [False, True, False, False]
    flies = [foot.swinging for foot in walker.state.feet]
    run = drive(walker, command(0.03, 0.1), 1.6, 0.005)
    for leg in (0, 1, 2):
        away = np.hypot(*landings(run, leg)[1 if flies[leg] and law == "minimum_jerk" else 0])
        assert away < 0.053
        if law == "minimum_jerk" or not flies[leg]:  # the damped point mass may be too late for it
            assert (away > 0.045) == (leg != 1)
