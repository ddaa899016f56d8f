import copy
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.couplings import COUPLINGS
from bluefoot_mpc.gait.gait import Gait, GaitConfig
from bluefoot_mpc.types import ContactSchedule
from tests.gait.test_table import TABLE
from tests.gait.walker import DT, FOOTHOLD, REFERENCE, STANCE, command, drive, make

HORIZON, STEP = 1.28, 0.04
SMOOTH = replace(FOOTHOLD, law="minimum_jerk", vertical="quintic")
TABLED = replace(REFERENCE, trot_table=TABLE, max_acceleration=0.1)


def farthest_edge(walker: Gait, fast: ContactSchedule, true: ContactSchedule) -> float:
    """s from the farthest sample whose contacts differ to the true change that explains it."""
    wrong = np.argwhere(fast.stance != true.stance)
    if not len(wrong):
        return 0.0
    fine = walker.schedule(HORIZON + STEP, 0.01, exact=True).stance
    farthest = 0.0
    for sample, leg in wrong:
        edges = np.flatnonzero(np.diff(fine[:, leg]))
        farthest = max(farthest, float(np.abs((edges + 1.5) * 0.01 - fast.time[sample]).min()))
    return farthest


def compare(walker: Gait, inputs, ticks: int, every: int = 4) -> tuple[float, float]:
    """Worst edge (s) and worst foothold (m) of the closed form over some ticks, one in `every`."""
    edge = error = 0.0
    for tick in range(ticks):
        walker.step(inputs, DT)
        if tick % every:
            walker.schedule(HORIZON, STEP)  # as on every tick: it may remember
            continue
        kept = copy.deepcopy(walker.state)
        fast = walker.schedule(HORIZON, STEP)
        assert walker.state == kept
        true = walker.schedule(HORIZON, STEP, exact=True)
        np.testing.assert_allclose(fast.time, true.time)
        edge = max(edge, farthest_edge(walker, fast, true))
        same = fast.stance == true.stance
        error = max(error, float(np.abs(fast.footholds - true.footholds)[same].max()))
    return edge, error


@pytest.mark.parametrize("config", [REFERENCE, GaitConfig(), TABLED, replace(REFERENCE, foothold=SMOOTH)])
@pytest.mark.parametrize("gait", COUPLINGS)
@pytest.mark.parametrize("twist", [(0.06, 0.0, 0.0), (0.03, 0.5, 0.0), (0.04, -0.2, 0.04)])
def test_steady_contacts_are_right_to_a_substep_and_footholds_to_a_millimetre(
    config: GaitConfig, gait: str, twist: tuple[float, float, float]
) -> None:
    walker = Gait(config, STANCE)
    inputs = command(twist[0], twist[1], gait, twist[2])
    drive(walker, inputs, 6.0)
    edge, error = compare(walker, inputs, 30, 3)
    assert edge <= config.substep + 0.006
    assert error < (1e-3 if gait == "trot" else 2.5e-3)  # a walk's legs do not pace quite evenly


@pytest.mark.parametrize("speed", [0.2, 0.3, 0.4])
def test_fast_trots_are_foreseen_too(speed: float) -> None:
    walker = Gait(replace(TABLED, max_acceleration=1.0), STANCE)
    drive(walker, command(speed), 4.0)
    edge, error = compare(walker, command(speed), 30)
    assert edge <= 0.016
    assert error < 1e-3


@pytest.mark.parametrize("config", [GaitConfig(), TABLED])
@pytest.mark.parametrize("gait", COUPLINGS)
def test_while_the_command_ramps_it_is_nearly_right(config: GaitConfig, gait: str) -> None:
    walker = Gait(config, STANCE)
    edge, error = compare(walker, command(0.3 if gait == "trot" else 0.06, 0.3, gait), 150)
    assert edge <= 0.035
    assert error < 0.009


def test_between_gaits_and_on_the_way_to_rest_the_network_is_rolled() -> None:
    walker = make(foothold=SMOOTH)
    drive(walker, command(0.06), 2.0)
    for inputs, ticks in ((command(0.06, gait="walk"), 250), (command(gait="walk"), 120)):
        edge, error = compare(walker, inputs, ticks, 7)
        assert edge <= 0.026
        assert error < 0.006
    plan = walker.schedule(HORIZON, STEP)
    assert plan.stance.all()
    np.testing.assert_allclose(
        plan.footholds, np.broadcast_to(walker.step(command(), DT).foot_position, (32, 4, 3))
    )


def test_a_rolled_schedule_serves_for_some_ticks_and_moves_with_the_robot() -> None:
    walker = make()
    drive(walker, command(0.06), 2.0)
    walker.step(command(0.06, gait="walk"), DT)
    calls = []
    engine = walker._engine
    advance = engine.advance
    engine.advance = lambda state, dt: calls.append(state is walker.state) or advance(state, dt)
    for _ in range(10):
        walker.schedule(HORIZON, STEP)
        walker.step(command(0.06, gait="walk"), DT)
    assert 2 * (HORIZON / DT) <= calls.count(False) <= 3 * (HORIZON / DT + 6)


def test_given_footholds_and_shifts_are_foreseen() -> None:
    walker = make(foothold=SMOOTH)
    inputs = command(0.06, foothold_shift=np.array([0.01, -0.02]))
    drive(walker, inputs, 3.0)
    goal = STANCE + np.array([0.02, 0.01, 0.008])
    for _ in range(20):
        walker.step(inputs, DT)
        walker.set_footholds(goal, np.ones(4, dtype=bool))
        fast = walker.schedule(HORIZON, STEP)
        true = walker.schedule(HORIZON, STEP, exact=True)
        same = fast.stance == true.stance
        assert same.mean() > 0.97
        np.testing.assert_allclose(fast.footholds[same], true.footholds[same], atol=1e-3)


def test_an_early_landing_is_seen_as_one() -> None:
    walker = make(foothold=replace(SMOOTH, early_contact=True))
    up = np.array([False, True, True, True])
    output = walker.step(command(0.08, contact=up), DT)
    while output.swing_progress[0] < 0.6:
        output = walker.step(command(0.08, contact=up), DT)
    feet = STANCE + np.array([0.0, 0.0, 0.012])
    hit = walker.step(command(0.08, contact=np.ones(4, dtype=bool), foot_position=feet), DT)
    assert not hit.phase.swing[0]
    fast, true = walker.schedule(HORIZON, STEP), walker.schedule(HORIZON, STEP, exact=True)
    assert fast.stance[0, 0]
    same = fast.stance == true.stance
    assert same.mean() > 0.95
    np.testing.assert_allclose(fast.footholds[same], true.footholds[same], atol=4e-3)


def test_the_same_history_gives_the_same_schedule() -> None:
    one, two = make(), make()
    for walker in (one, two):
        drive(walker, command(0.06), 1.0)
        drive(walker, command(0.06, gait="walk"), 0.5)
    two.schedule(HORIZON, STEP)
    two.reset()
    drive(two, command(0.06), 1.0)
    drive(two, command(0.06, gait="walk"), 0.5)
    first, second = one.schedule(HORIZON, STEP), two.schedule(HORIZON, STEP)
    np.testing.assert_array_equal(first.footholds, second.footholds)
    np.testing.assert_array_equal(first.stance, second.stance)
