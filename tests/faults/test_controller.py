"""What reaches the servos when a controller goes wrong, read from the bytes on their line."""

import math

import numpy as np
import pytest

from bluefoot_mpc.io.calibration import Calibration
from tests.faults.rig import PERIOD, Plan, Rig
from tests.faults.table import AT, TICK, spoil_goals

pytestmark = pytest.mark.slow

FASTEST = 12.0
"""rad/s, of goals."""


@pytest.mark.parametrize(
    "change",
    [
        lambda goals: goals + 500 * TICK,
        lambda goals: goals - 500 * TICK,
        lambda goals: np.full(16, 3.0),
        lambda goals: np.full(16, -50.0),
        lambda goals: np.where(np.arange(16) % 3, goals, np.inf),
    ],
    ids=["500 ticks up", "500 ticks down", "out of limits", "far out of limits", "infinite"],
)
def test_goals_stay_within_limits_and_do_not_jump(change, tmp_path):
    rig = Rig(Plan(spoil=spoil_goals(change, AT, AT + 0.3), end=AT + 0.5), tmp_path).run()
    written = [goals for _, goals in rig.line.counts]
    assert len(written) > 100
    counts = np.array([[goals[servo] for servo in range(1, 17)] for goals in written])
    steps = np.abs(np.diff(counts, axis=0)).max()
    assert steps <= FASTEST * PERIOD / TICK + 1
    angles = Calibration.nominal(rig.model.parameters).angles(counts.astype(float))
    assert (angles >= rig.model.lower - 0.5 * TICK - 1e-9).all()
    assert (angles <= rig.model.upper + 0.5 * TICK + 1e-9).all()
    assert rig.parts.report()["torque_on"] == []


def test_a_controller_that_breaks_lets_the_robot_sink(tmp_path):
    def breaks(time, output):
        if time >= AT:
            raise RuntimeError("no solution")
        return output

    rig = Rig(Plan(spoil=breaks, rests=True, end=6.0), tmp_path).run()
    assert "no solution" in rig.data.stop_reason
    assert AT + 0.5 < rig.shafts.limp_at() < math.inf
    assert rig.parts.report()["torque_on"] == []
    assert not rig.parts.report()["power_on"]
