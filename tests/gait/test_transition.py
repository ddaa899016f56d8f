from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.cpg import CpgConfig, CpgInputs, CpgIntegrator, CpgState
from bluefoot_mpc.gait.gait import Gait
from bluefoot_mpc.gait.network import coming_to_rest, gated
from bluefoot_mpc.gait.transition import Transition
from tests.gait.walker import DT, REFERENCE, STANCE, command, drive, make


@pytest.mark.parametrize(
    "config", [replace(REFERENCE, blend_time=0.1), replace(REFERENCE, blend_time=4.0), GaitConfig()]
)
@pytest.mark.parametrize(("first", "second"), [("trot", "walk"), ("walk", "trot")])
def test_transition_from_any_phase(first: str, second: str, config: GaitConfig) -> None:
    for phase in range(0, 24, 2):
        walker = Gait(config, STANCE)
        drive(walker, command(0.06, gait=first), 1.0 + 0.04 * phase)
        run = drive(walker, command(0.06, gait=second), 9.0)
        flying = run.swing.sum(axis=1)
        assert flying.max() <= 2
        if second == "walk":
            assert flying[-100:].max() == 1
        for swing in run.swing[flying == 2]:
            assert swing[0] == swing[3]  # two in the air are always a diagonal pair
        # Nobody is left behind: stance never lasts much longer than a cycle.
        assert longest(~run.swing) * DT < 1.15 * run.cycle_time.max()
        assert np.abs(run.foot_position - STANCE)[..., :2].max() < 0.75 * 0.06 * run.cycle_time.max() + 0.003
        lifts = [np.flatnonzero(~run.swing[:-1, leg] & run.swing[1:, leg])[-1] for leg in range(4)]
        period = run.cycle_time[-1] / DT
        lag = ((np.array(lifts) - lifts[0]) / period) % 1.0
        expected = np.array([0.0, 0.5, 0.5, 0.0] if second == "trot" else [0.0, 0.5, 0.75, 0.25])
        assert np.abs((lag - expected + 0.5) % 1.0 - 0.5).max() < 0.06


def longest(mask: np.ndarray) -> int:
    best = 0
    for column in mask.T:
        edges = np.flatnonzero(np.diff(np.r_[False, column, False].astype(int)))
        best = max(best, int((edges[1::2] - edges[::2]).max()))
    return best


def test_changing_ones_mind_on_the_way() -> None:
    walker = make()
    drive(walker, command(0.06), 2.0)
    for gait in ("walk", "trot", "walk", "trot"):
        run = drive(walker, command(0.06, gait=gait), 0.7)
        assert run.swing.sum(axis=1).max() <= 2
    run = drive(walker, command(0.06), 5.0)
    assert np.all(run.swing[-100:, 0] == run.swing[-100:, 3])


def test_there_and_back_while_turning() -> None:
    walker = make()
    for gait in ("trot", "walk", "trot"):
        run = drive(walker, command(0.04, 0.3, gait), 6.0)
        assert run.walking.all()
        assert run.swing.sum(axis=1).max() <= 2


def test_a_change_at_rest_takes_effect_at_the_next_start() -> None:
    walker = make()
    drive(walker, command(gait="walk"), 0.1)
    run = drive(walker, command(0.05, gait="walk"), 5.0)
    assert run.swing.sum(axis=1).max() == 1


def test_gate_holds_a_leg_back() -> None:
    config = CpgConfig()
    integrator = CpgIntegrator(config)
    inputs = CpgInputs(omega=20.0, alpha=0.3, matrix=(0.0,) * 16)
    near = CpgState(y1=(0.0, -1.0, 1.0, -1.0), y2=(1.0, -1e-3, -0.1, -1e-3))
    after = gated(integrator, near, inputs, 0.01, 2)
    assert after.y2[1] == near.y2[1]  # FR is on FL's end of the trunk
    assert after.y2[3] > 0.0  # RR is FL's diagonal
    after = gated(integrator, near, inputs, 0.01, 3)
    assert after.y2[1] == near.y2[1]
    assert after.y2[3] == near.y2[3]


def test_with_three_to_stand_on_a_hind_leg_waits_for_its_diagonal_front_leg() -> None:
    integrator = CpgIntegrator(CpgConfig())
    inputs = CpgInputs(omega=20.0, alpha=0.3, matrix=(0.0,) * 16)
    pair = CpgState(y1=(-0.95, 1.0, 1.0, -1.0), y2=(-0.3, -0.1, -0.1, -1e-3))  # RR a little early
    assert gated(integrator, pair, inputs, 0.01, 3).y2[3] == pair.y2[3]
    landed = CpgState(y1=(0.95, 1.0, 1.0, -1.0), y2=(-0.3, -0.1, -0.1, -1e-3))
    assert gated(integrator, landed, inputs, 0.01, 3).y2[3] > 0.0


def test_the_way_shortens_swings_before_it_changes_the_order() -> None:
    way = Transition(REFERENCE)
    shares = (REFERENCE.trot.swing_share, REFERENCE.walk.swing_share)
    middle, trot, walk = way.rhythm(0.5, shares), way.rhythm(0.0, shares), way.rhythm(1.0, shares)
    assert middle.share == pytest.approx(walk.share, abs=1e-3)
    assert middle.matrix == trot.matrix
    assert trot is way.cycle(0.0, shares).rhythm
    assert walk is way.cycle(1.0, shares).rhythm
    assert way.least_stance(0.4) == 2
    assert way.least_stance(0.6) == 3


def test_on_the_way_to_rest_only_flying_legs_move() -> None:
    integrator = CpgIntegrator(CpgConfig())
    inputs = CpgInputs(omega=20.0, alpha=0.3, matrix=(0.1,) * 16)
    state = CpgState(y1=(0.0, -1.0, 0.3, -0.5), y2=(1.0, -1e-3, -0.9, 0.8))
    for _ in range(100):
        state = coming_to_rest(integrator, state, inputs, 0.01)
    assert state.y2[1] == -1e-3
    assert state.y2[2] == -0.9
    assert max(state.y2) <= 0.0
