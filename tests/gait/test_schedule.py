import copy
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.couplings import COUPLINGS
from tests.gait.walker import DT, FOOTHOLD, STANCE, command, drive, make


@pytest.mark.parametrize("law", ["virtual_force", "minimum_jerk"])
@pytest.mark.parametrize("gait", COUPLINGS)
@pytest.mark.parametrize("before", [0.0, 0.3, 2.0, 2.13])
def test_schedule_is_what_happens_later(gait: str, law: str, before: float) -> None:
    walker = make(foothold=replace(FOOTHOLD, law=law))
    inputs = command(0.06, 0.15, gait)
    drive(walker, inputs, before)
    walker.step(inputs, DT)
    kept = copy.deepcopy(walker.state)
    plan = walker.schedule(2.0, DT, exact=True)
    assert walker.state == kept
    pose = walker.state.pose
    run = drive(walker, inputs, 2.0)
    np.testing.assert_array_equal(plan.stance, ~run.swing)
    np.testing.assert_allclose(plan.time, DT * np.arange(1, 101))
    world = np.vectorize(pose.to_world)(plan.footholds[..., 0] + 1j * plan.footholds[..., 1])
    standing = ~run.swing
    np.testing.assert_allclose(world[standing], run.in_world[standing], atol=1e-12)


def test_schedule_names_the_next_foothold_of_a_swinging_foot() -> None:
    walker = make()
    inputs = command(0.08)
    drive(walker, inputs, 3.0)
    plan = walker.schedule(3.0, DT, exact=True)
    for leg in range(4):
        stance = plan.stance[:, leg]
        changes = np.flatnonzero(np.abs(np.diff(plan.footholds[:, leg, 0])) > 1e-9)
        assert np.all(stance[changes])  # a foothold changes at lift-off ...
        assert not stance[changes + 1].any()  # ... to the next one
        last = np.flatnonzero(~stance)[-1]
        tail = plan.footholds[-1, leg, 0] - plan.footholds[0, leg, 0]
        assert tail > 0.05 or last < 10


def test_a_swing_that_does_not_end_within_the_horizon_is_predicted() -> None:
    walker = make(foothold=replace(FOOTHOLD, law="minimum_jerk"))
    inputs = command(0.08)
    drive(walker, inputs, 3.0)
    while not walker.step(inputs, DT).phase.swing[0]:
        pass
    short = walker.schedule(2 * DT, DT, exact=True)
    long = walker.schedule(1.0, DT, exact=True)
    assert not short.stance[-1, 0]
    np.testing.assert_allclose(short.footholds[-1, 0], long.footholds[0, 0], atol=0.002)


def test_schedule_at_rest_and_while_stopping() -> None:
    walker = make()
    plan = walker.schedule(1.0, DT, exact=True)
    assert plan.stance.all()
    np.testing.assert_array_equal(plan.footholds, np.broadcast_to(STANCE, (50, 4, 3)))
    drive(walker, command(0.05), 2.0)
    walker.step(command(), DT)
    plan = walker.schedule(3.0, DT, exact=True)
    assert plan.stance[-1].all()
    run = drive(walker, command(), 3.0)
    np.testing.assert_array_equal(plan.stance, ~run.swing)
