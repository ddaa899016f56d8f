import copy
import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.couplings import COUPLINGS
from bluefoot_mpc.gait.footholds import FootholdConfig
from bluefoot_mpc.gait.gait import Gait, GaitConfig
from bluefoot_mpc.gait.reflex import reflex
from bluefoot_mpc.settings import build, merge, to_table
from tests.gait.walker import DT, FOOTHOLD, REFERENCE, STANCE, TROT_TIMING, command, drive, make

UP = np.array([False, True, True, True])
SMOOTH = replace(FOOTHOLD, law="minimum_jerk", vertical="quintic")


@pytest.mark.parametrize("gait", COUPLINGS)
@pytest.mark.parametrize("forward", [0.03, 0.06, 0.1])
@pytest.mark.parametrize("config", [REFERENCE, GaitConfig()])
def test_lift_offs_come_in_order_and_in_time(gait: str, forward: float, config: GaitConfig) -> None:
    walker = Gait(replace(config, substep=0.005), STANCE)
    run = drive(walker, command(forward, gait=gait), 12.0, 0.005)
    swing = run.swing
    lifts = [np.flatnonzero(~swing[:-1, leg] & swing[1:, leg]) * 0.005 for leg in range(4)]
    leader = COUPLINGS[gait].leader
    period = np.diff(lifts[leader])[-5:].mean()
    assert period == pytest.approx(run.cycle_time[-1], rel=0.02)
    base = lifts[leader][-3]
    lag = np.array([lift[lift > base - 0.3 * period][0] - base for lift in lifts]) / period
    expected = np.array(COUPLINGS[gait].lag)
    assert np.abs((lag - expected + 0.5) % 1.0 - 0.5).max() < 0.035
    duty = 1.0 - swing[-1600:].mean(axis=0)
    np.testing.assert_allclose(duty, 1.0 - walker.config.timing(gait).swing_share, atol=0.03)
    assert swing.sum(axis=1).max() == 4 - COUPLINGS[gait].least_stance


@pytest.mark.parametrize(("gait", "first"), [("trot", {0, 3}), ("walk", {1})])
def test_first_lift_off_is_immediate(gait: str, first: set[int]) -> None:
    output = make().step(command(0.05, gait=gait), DT)
    assert output.phase.walking
    assert set(np.flatnonzero(output.phase.swing)) == first


@pytest.mark.parametrize("gait", COUPLINGS)
@pytest.mark.parametrize("seconds", [2.0, 2.1, 2.2, 2.35])
def test_comes_to_rest_on_four_feet_and_starts_again(gait: str, seconds: float) -> None:
    walker = make()
    drive(walker, command(0.08, 0.2, gait), seconds)
    run = drive(walker, command(gait=gait), 5.0)
    walking = run.walking
    end = int(np.flatnonzero(~walking)[0])
    assert end * DT < 3.5
    assert not walking[end:].any()
    assert not run.swing[end:].any()
    assert np.all(run.y2[end:] <= 0.0)
    np.testing.assert_array_equal(run.foot_position[end:], run.foot_position[-1:].repeat(250 - end, 0))
    np.testing.assert_allclose(run.foot_position[-1], STANCE, atol=0.002)
    again = walker.step(command(0.05, gait=gait), DT)
    assert again.phase.swing[COUPLINGS[gait].leader]


def test_halt_lands_within_one_swing() -> None:
    walker = make()
    drive(walker, command(0.1), 2.06)
    run = drive(walker, command(0.1, halt=True), 0.4)
    assert np.all(run.velocity == 0.0)
    assert not run.walking[-1]
    assert np.ptp(run.virtual_pose, axis=0).max() == 0.0
    assert not drive(walker, command(0.1, halt=True), 0.2).walking.any()


def test_a_command_while_landing_waits_for_rest() -> None:
    walker = make()
    drive(walker, command(0.1), 2.06)
    walker.step(command(halt=True), DT)
    run = drive(walker, command(0.1), 1.0)
    assert not run.swing[:, :].all(axis=1).any()
    assert run.walking[-1]
    assert run.velocity[-1, 0] > 0.05


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
def test_stance_feet_never_move_in_the_world(law: str) -> None:
    walker = make(foothold=replace(FOOTHOLD, law=law))
    run = drive(walker, command(0.08, 0.4, left=0.03), 5.0)
    world = run.in_world
    still = ~run.swing[1:] & ~run.swing[:-1]
    assert np.abs(np.diff(world, axis=0))[still].max() < 1e-12
    assert np.all(run.foot_height[~run.swing] == 0.0)


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
@pytest.mark.parametrize(
    ("speed", "cycle", "share"),
    [(0.03, 0.7, 0.36), (0.06, 0.6, 0.36), (0.1, 0.5, 0.38), (0.2, 0.3, 0.45), (0.4, 0.24, 0.5)],
)
def test_feet_arrive_at_their_footholds(law: str, speed: float, cycle: float, share: float) -> None:
    timing = replace(TROT_TIMING, cycle_min=cycle, cycle_max=cycle, swing_share=share)
    for lead in (0.0, 0.5):
        walker = make(timing, replace(FOOTHOLD, law=law, stance_lead=lead), max_acceleration=2.0)
        run = drive(walker, command(speed), 2.0, 0.002)
        landings = run.swing[:-1] & ~run.swing[1:]
        landings[:500] = False
        ahead = (run.foot_position[1:, :, 0] - STANCE[:, 0])[landings]
        expected = lead * speed * cycle * (1.0 - share)
        np.testing.assert_allclose(ahead, expected, atol=0.0015)
        lifts = ~run.swing[:-1] & run.swing[1:]
        lifts[:500] = False
        behind = (run.foot_position[:-1, :, 0] - STANCE[:, 0])[lifts]
        np.testing.assert_allclose(behind, expected - speed * cycle * (1.0 - share), atol=0.0025)


def test_turning_on_the_spot_is_symmetric() -> None:
    walker = make(foothold=SMOOTH)
    run = drive(walker, command(yaw_rate=0.5), 6.0, 0.005)
    angle = np.angle((run.foot_position[..., 0] + 1j * run.foot_position[..., 1])[400:])
    nominal = np.angle(STANCE[:, 0] + 1j * STANCE[:, 1])
    radius = np.hypot(run.foot_position[..., 0], run.foot_position[..., 1])[400:]
    offset = (angle - nominal)[~run.swing[400:]]
    assert offset.max() == pytest.approx(-offset.min(), abs=0.003)
    stance_time = run.cycle_time[-1] * 0.64
    assert offset.max() == pytest.approx(0.5 * 0.5 * stance_time, abs=0.005)
    np.testing.assert_allclose(radius[~run.swing[400:]], 0.165 * math.sqrt(2.0), atol=1e-3)


def test_virtual_robot_follows_the_ramped_command() -> None:
    walker = make(max_acceleration=0.1, max_yaw_acceleration=1.0)
    run = drive(walker, command(0.05, 0.2), 3.0)
    speeds = run.velocity[:, 0]
    assert np.diff(speeds).max() <= 0.1 * DT + 1e-12
    assert speeds[-1] == pytest.approx(0.05)
    assert run.yaw_rate[-1] == pytest.approx(0.2)
    assert run.virtual_pose[-1, 2] == pytest.approx(0.2 * 3.0 - 0.5 * 0.2 * 0.2, abs=0.003)


def test_step_height_is_reached_and_latched() -> None:
    timing = replace(TROT_TIMING, height_v=0.2, height_min=0.0, height_max=0.05)
    for foothold in (FOOTHOLD, SMOOTH):
        walker = make(timing, foothold)
        run = drive(walker, command(0.1), 4.0, 0.005)
        assert run.foot_height[-400:].max() == pytest.approx(0.02, rel=0.02)
    middle = next(k for k, p in enumerate(run.swing_progress[-100:, 0]) if 0.1 < p < 0.4)
    assert middle >= 0
    walker = make(timing, SMOOTH, max_acceleration=100.0)
    drive(walker, command(0.1), 0.06)  # lifted at 0.1 m/s
    run = drive(walker, command(0.02), 0.2)
    assert run.foot_height[:, 0].max() == pytest.approx(0.02, rel=0.05)


def test_reset_gives_the_first_state_back() -> None:
    walker = make()
    first = copy.deepcopy(walker.state)
    one = drive(walker, command(0.06, 0.1, "walk"), 3.0)
    walker.reset()
    assert walker.state == first
    two = drive(walker, command(0.06, 0.1, "walk"), 3.0)
    np.testing.assert_array_equal(one.foot_position, two.foot_position)


def test_unknown_gait_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="trot, walk"):
        make().step(command(0.05, gait="gallop"), DT)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_commands_that_are_not_finite_are_held(bad: float) -> None:
    walker, other = make(), make()
    drive(walker, command(0.05, 0.1), 1.0)
    drive(other, command(0.05, 0.1), 1.0)
    feet = STANCE.copy()
    feet[2, 1] = bad
    broken = command(bad, bad, foot_position=feet, tilt_rate_error=np.array([bad, 0.0]))
    held = drive(walker, broken, 1.0)
    good = drive(other, command(0.05, 0.1), 1.0)
    np.testing.assert_array_equal(held.foot_position, good.foot_position)


@pytest.mark.parametrize("feet", [np.zeros((3, 3)), np.full((4, 3), np.nan)])
def test_impossible_stance_is_refused(feet: np.ndarray) -> None:
    with pytest.raises(ConfigurationError, match="stance feet"):
        Gait(GaitConfig(), feet)


def test_configuration_survives_a_table_and_refuses_overlapping_swings() -> None:
    config = GaitConfig()
    assert build(GaitConfig, to_table(config)) == config
    with pytest.raises(ConfigurationError, match=r"walk\.swing_share = 0\.3 must not exceed 0\.25"):
        replace(config, walk=replace(config.walk, swing_share=0.3))
    with pytest.raises(ConfigurationError, match="virtual_force"):
        build(FootholdConfig, {"law": "spring"})


def test_reflex_hurries_the_legs_towards_the_fall() -> None:
    table = {"reflex": {"enabled": True, "threshold": 0.5}}
    config = build(GaitConfig, merge(to_table(REFERENCE), table))
    calm, falling = Gait(config, STANCE), Gait(config, STANCE)
    contact = np.array([False, True, True, False])
    drive(calm, command(0.05, contact=contact), 0.1)
    drive(falling, command(0.05, contact=contact, tilt_rate_error=np.array([0.0, 0.6])), 0.1)
    ahead = [f.state.rhythm.progress(f.state.cpg.y1[0], f.state.cpg.y2[0])[1] for f in (calm, falling)]
    assert ahead[1] > ahead[0] + 0.05
    assert falling.state.feet[0].z < calm.state.feet[0].z


def test_the_reflex_lowers_the_step_of_either_profile() -> None:
    for vertical in ("sine", "quintic"):
        table = {
            "reflex": {"enabled": True, "threshold": 0.5, "speed_gain": 0.0},
            "foothold": {"vertical": vertical},
        }
        config = build(GaitConfig, merge(to_table(REFERENCE), table))
        tops = []
        for rate in (0.0, 0.6):
            walker = Gait(config, STANCE)
            falling = command(0.05, contact=UP, tilt_rate_error=np.array([0.0, rate]))
            tops.append(drive(walker, falling, 0.4).foot_height[:, 0].max())
        assert 0.7 < tops[1] / tops[0] < 0.9  # 1 / sqrt(1.5), once the oscillator has followed


def test_the_schedule_is_that_of_an_undisturbed_robot() -> None:
    config = build(GaitConfig, merge(to_table(REFERENCE), {"reflex": {"enabled": True, "threshold": 0.2}}))
    calm, falling = Gait(config, STANCE), Gait(config, STANCE)
    for walker in (calm, falling):
        drive(walker, command(0.05, contact=UP), 2.0)
    falling.state.reflex = reflex((0.0, 2.0), [1.0 + 0.0j] * 4, UP.tolist(), config.reflex)
    assert max(falling.state.reflex.psi_omega) > 1.4
    np.testing.assert_array_equal(
        falling.schedule(1.0, DT, exact=True).stance, calm.schedule(1.0, DT, exact=True).stance
    )


def test_a_command_too_small_to_be_one_starts_nothing() -> None:
    walker = make()
    still = REFERENCE.still_speed
    assert not drive(walker, command(0.9 * still, 0.9 * still), 0.2).walking.any()
    assert drive(walker, command(1.1 * still), 0.02).walking.all()


def test_only_an_unbroken_rest_counts_on_the_way_to_standing() -> None:
    walker = make()
    drive(walker, command(0.05), 2.0)
    drive(walker, command(), 0.6)  # slowed down, and not yet a cycle on the spot
    for _ in range(12):
        assert drive(walker, command(), 0.2).walking.all()
        assert drive(walker, command(0.0, 0.02), 0.1).walking.all()
    assert not walker.state.landing


def test_the_reflex_sees_feet_from_the_trunk_and_not_from_the_virtual_robot() -> None:
    config = build(GaitConfig, merge(to_table(REFERENCE), {"reflex": {"enabled": True, "threshold": 0.5}}))
    speeds = []
    for trunk in (0.0, 0.4):  # ahead of every foot: then all legs lie behind a forward fall
        walker = Gait(config, STANCE)
        falling = command(
            0.05, contact=np.zeros(4, dtype=bool), foot_position=STANCE,
            tilt_rate_error=np.array([0.0, 0.4]), trunk_position=np.array([trunk, 0.0, 0.1]),
        )  # fmt: skip
        walker.step(falling, DT)
        speeds.append(walker.state.reflex.psi_omega)
    assert speeds[0][0] > 1.4
    assert max(speeds[1]) < 1.01
