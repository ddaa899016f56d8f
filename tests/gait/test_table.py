import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.gait import Gait, Style
from bluefoot_mpc.gait.table import GaitTable, interpolator
from bluefoot_mpc.gait.transition import RhythmFamily
from bluefoot_mpc.settings import build, dump_toml, to_table
from tests.gait.walker import DT, REFERENCE, STANCE, command, drive

STYLE = Style(trunk_height=0.115, trunk_forward=0.0, ankle_shift=0.0, level_gain=0.15)
TABLE = GaitTable(
    speed=(0.0, 0.2, 0.4),
    cycle_time=(0.45, 0.2, 0.24),
    swing_share=(0.36, 0.44, 0.5),
    step_height=(0.013, 0.019, 0.028),
    apex=(0.6,),
    ground_matching=(1.0, -1.0, -0.25),
    law=("minimum_jerk",),
    vertical=("quintic",),
    stance_x=(0.15, 0.118, 0.117),
    stance_y=(0.146, 0.187, 0.179),
    trunk_height=(0.134, 0.113, 0.117),
    level_gain=(0.5, 0.2, 0.1),
)
FAST = replace(REFERENCE, trot_table=TABLE, max_acceleration=1.0)


def test_values_are_read_between_the_knots_and_held_beyond() -> None:
    read = interpolator((1.0, 2.0, 4.0), [(0.0, 1.0), (2.0, 3.0), (3.0, -1.0)])
    assert read(0.0) == (0.0, 1.0)
    assert read(1.5) == (1.0, 2.0)
    assert read(3.0) == (2.5, 1.0)
    assert read(9.0) == (3.0, -1.0)


def test_the_effective_speed_counts_sideways_and_turning() -> None:
    table = replace(TABLE, turn_lever=0.2, lateral_weight=2.0)
    assert table.effective_speed(0.3 + 0.2j, -0.5) == pytest.approx(0.5 + 0.1)


@pytest.mark.parametrize(
    ("speed", "cycle", "share", "height"),
    [
        (0.05, 0.3875, 0.38, 0.0145),
        (0.2, 0.2, 0.44, 0.019),
        (0.3, 0.22, 0.47, 0.0235),
        (0.5, 0.24, 0.5, 0.028),
    ],
)
def test_the_gait_walks_as_its_table_says(speed: float, cycle: float, share: float, height: float) -> None:
    run = drive(Gait(FAST, STANCE, STYLE), command(speed), 6.0, 0.002)
    tail = slice(-1500, None)
    lifts = np.flatnonzero(~run.swing[:-1, 0] & run.swing[1:, 0])
    assert np.diff(lifts)[-4:].mean() * 0.002 == pytest.approx(cycle, rel=0.015)
    np.testing.assert_allclose(run.swing[tail].mean(axis=0), share, atol=0.02)
    np.testing.assert_allclose(run.foot_height[tail].max(axis=0), height, rtol=0.01)
    # Half the stance's travel before the nominal place, half behind it.
    standing = run.foot_position[tail][..., 0] - np.sign(STANCE[:, 0]) * np.interp(
        speed, TABLE.speed, TABLE.stance_x
    )
    travel = np.abs(standing[~run.swing[tail]]).max()
    assert travel == pytest.approx(0.5 * speed * cycle * (1.0 - share), rel=0.05, abs=1e-3)


@pytest.mark.parametrize(("cycle", "share"), [(0.197, 0.457), (0.241, 0.5), (0.2, 0.4), (0.22, 0.5)])
def test_short_cycles_lock_and_land_right_between_ticks(cycle: float, share: float) -> None:
    """Ten to twelve ticks a cycle, at 400 mm/s: a whole tick would show as 8 mm."""
    table = GaitTable(
        speed=(0.0,), cycle_time=(cycle,), swing_share=(share,), law=("minimum_jerk",), vertical=("quintic",)
    )
    run = drive(Gait(replace(FAST, trot_table=table), STANCE), command(0.4), 8.0)
    tail = slice(-200, None)
    phase = np.array([output.phase.phase for output in run.outputs])[tail]
    turns = np.unwrap(2.0 * math.pi * phase, axis=0) / (2.0 * math.pi)
    np.testing.assert_allclose((turns[-1] - turns[0]) / (199 * DT), 1.0 / cycle, rtol=0.01)
    lag = (phase[:, :1] - phase) % 1.0
    np.testing.assert_allclose(lag[:, 1:3], 0.5, atol=0.02)
    np.testing.assert_allclose((lag[:, 3] + 0.5) % 1.0, 0.5, atol=0.02)
    x = run.foot_position[tail][..., 0] - STANCE[:, 0]
    assert np.abs(x[~run.swing[tail]]).max() < 0.5 * 0.4 * cycle * (1.0 - share) + 5e-4


def test_standing_feet_keep_their_places_while_the_nominal_ones_move() -> None:
    walker = Gait(FAST, STANCE, STYLE)
    np.testing.assert_allclose(np.abs(walker.step(command(), DT).foot_position[:, 0]), TABLE.stance_x[0])
    run = drive(walker, command(0.4), 1.0)
    world = run.in_world
    still = ~run.swing[1:] & ~run.swing[:-1]
    assert np.abs(np.diff(world, axis=0))[still].max() < 1e-12
    np.testing.assert_allclose([abs(foot.nominal.real) for foot in walker.state.feet], 0.117)
    np.testing.assert_allclose([abs(foot.nominal.imag) for foot in walker.state.feet], 0.179)


def test_the_trunks_part_follows_without_a_jump() -> None:
    run = drive(Gait(FAST, STANCE, STYLE), command(0.4), 4.0)
    heights = np.array([output.style.trunk_height for output in run.outputs])
    assert heights[0] == pytest.approx(0.134, abs=3e-4)
    assert heights[-1] == pytest.approx(0.117, abs=1e-4)
    assert np.abs(np.diff(heights)).max() < 0.002
    assert run.outputs[-1].style.level_gain == pytest.approx(0.1, abs=1e-3)
    assert run.outputs[-1].style.trunk_forward == STYLE.trunk_forward


def test_an_empty_table_changes_nothing() -> None:
    plain, told = Gait(REFERENCE, STANCE), Gait(REFERENCE, STANCE, STYLE)
    for gait in ("trot", "walk", "trot"):
        one, two = (drive(walker, command(0.07, 0.2, gait), 2.5) for walker in (plain, told))
        np.testing.assert_array_equal(one.foot_position, two.foot_position)
        assert two.outputs[-1].style is STYLE
    assert GaitTable().empty


def test_a_column_alone_leaves_the_laws_in_charge_of_the_rest() -> None:
    table = GaitTable(speed=(0.0, 0.4), step_height=(0.02, 0.04))
    walker = Gait(replace(REFERENCE, trot_table=table), STANCE)
    plain = Gait(REFERENCE, STANCE)
    one, two = (drive(gait, command(0.08), 4.0) for gait in (walker, plain))
    np.testing.assert_allclose(one.cycle_time, two.cycle_time, rtol=5e-3)  # a table is read in small steps
    assert (one.swing == two.swing).mean() > 0.99
    assert one.foot_height[-100:].max() == pytest.approx(0.024, rel=0.02)


def test_the_corrections_of_tracking_leave_the_parameters_alone() -> None:
    walker = Gait(FAST, STANCE, STYLE)
    drive(walker, command(0.1), 2.0)
    before = walker.state.now
    for k in range(20):
        walker.step(command(0.1 + 1e-5 * (-1) ** k), DT)
        assert walker.state.now is before
    drive(walker, command(0.101), 0.2)
    assert walker.state.now.cycle_time < before.cycle_time


@pytest.mark.parametrize("phase", range(0, 12, 3))
def test_gait_changes_between_tables(phase: int) -> None:
    walk = GaitTable(
        speed=(0.0, 0.06),
        cycle_time=(1.4, 1.0),
        swing_share=(0.18, 0.22),
        stance_x=(0.16,),
        trunk_height=(0.12,),
    )
    walker = Gait(replace(FAST, walk_table=walk), STANCE, STYLE)
    drive(walker, command(0.06), 1.0 + 0.04 * phase)
    run = drive(walker, command(0.06, gait="walk"), 8.0)
    flying = run.swing.sum(axis=1)
    assert flying.max() <= 2
    assert flying[-100:].max() == 1
    assert run.cycle_time[-1] == pytest.approx(1.0)
    assert run.outputs[-1].style.trunk_height == pytest.approx(0.12, abs=1e-4)
    back = drive(walker, command(0.06), 8.0)
    assert np.all(back.swing[-50:, 0] == back.swing[-50:, 3])


def test_mixed_rhythms_are_near_calibrated_ones() -> None:
    family = RhythmFamily("trot", replace(REFERENCE, trot_table=TABLE), (0.36, 0.5))
    for share in (0.38, 0.41, 0.47):
        exact = RhythmFamily("trot", REFERENCE, (share,)).at(share)
        found = family.at(share)
        assert found.alpha == pytest.approx(exact.alpha, abs=2e-3)
        assert found.turn == pytest.approx(exact.turn, rel=5e-3)
        assert family.at(share) is found


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"speed": (0.1, 0.1), "cycle_time": (0.3, 0.3)}, "must rise"),
        ({"speed": (-0.1, 0.1)}, "0 or more"),
        ({"speed": (0.1, 0.2, 0.3), "cycle_time": (0.3, 0.3)}, "cycle_time must hold one value for each"),
        ({"cycle_time": (0.3,)}, "cycle_time"),
        ({"speed": (0.1,), "swing_share": (0.6,)}, r"swing_share\[0\] = 0\.6 must lie in"),
        ({"speed": (0.1,), "trunk_height": (math.nan,)}, r"trunk_height\[0\]"),
    ],
)
def test_impossible_tables_are_refused(values: dict[str, tuple[float, ...]], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        GaitTable(**values)


def test_tables_survive_toml_and_refuse_overlapping_swings() -> None:
    table = to_table(FAST)
    assert build(GaitConfig, table) == FAST
    assert "ground_matching = [1.0, -1.0, -0.25]" in dump_toml(table)
    with pytest.raises(UnknownNameError, match="virtual_force"):
        build(GaitConfig, {"trot_table": {"speed": [0.1], "law": ["spring"]}})
    with pytest.raises(ConfigurationError, match=r"walk\.swing_share = 0\.3 must not exceed 0\.25"):
        replace(REFERENCE, walk_table=GaitTable(speed=(0.0, 0.1), swing_share=(0.2, 0.3)))
