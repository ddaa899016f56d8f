"""The preview on the schedule of the real gait, in closed loop with its own plan, without physics."""

import numpy as np
import pytest

from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController, PreviewInputs
from bluefoot_mpc.zmp.support import support_margins
from tests.zmp.preview.scenes import FEET

CONFIG = PreviewConfig()
DT = 0.02


def stroll(gait_name, speed, *, yaw_rate=0.0, seconds=3.0, config=CONFIG):
    """Plans of a walk after its first second, and (k, 3) margins of the ZMP while each plan holds."""
    gait = Gait(GaitConfig(), np.hstack([FEET, np.zeros((4, 1))]))
    controller = PreviewController(config)
    time = config.interval * np.arange(1, config.samples + 1)
    wish = GaitInputs(velocity=np.array([speed, 0.0]), yaw_rate=yaw_rate, gait=gait_name)
    plans, margins = [], []
    for tick in range(int((seconds + 1.0) / DT)):
        now = gait.step(wish, DT)
        if tick * DT < 0.5:
            continue
        turn = now.yaw_rate * time
        speeds = np.hypot(*now.velocity) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        plan = controller.step(
            PreviewInputs(
                schedule=gait.schedule(config.samples * config.interval, config.interval),
                nominal=np.cumsum(speeds, axis=0) * config.interval,
                velocity=speeds,
                heading=turn,
                pose=now.virtual_pose,
            ),
            DT,
        )
        if tick * DT < 1.0:
            continue
        held = np.array([plan.at(t) for t in (0.0, 0.5 * DT, 0.999 * DT)])
        zmp = held[:, 0] - controller.maps.lever * held[:, 2]
        feet, stance = np.tile(now.foot_position[:, :2], (3, 1, 1)), np.tile(~now.phase.swing, (3, 1))
        plans.append(plan)
        margins.append(support_margins(zmp, feet, stance))
    return plans, np.array(margins)


@pytest.mark.parametrize(("speed", "yaw_rate"), [(0.03, 0.0), (0.06, 0.0), (0.03, 0.2)])
def test_the_walk_keeps_its_margin_within_reach(speed, yaw_rate):
    plans, margins = stroll("walk", speed, yaw_rate=yaw_rate)
    assert {plan.status for plan in plans} == {Fallback.SOLVED}
    assert min(plan.least_margin for plan in plans) >= 0.005
    assert max(plan.slack[1] for plan in plans) < 1e-3
    # Between samples as well, with the feet that the gait lifts.
    assert (margins > 0.0).mean() > 0.98
    sway = np.array([plan.start[0] for plan in plans])
    assert 0.004 < np.ptp(sway[:, 1]) < 0.04


def test_the_rows_earn_the_margin():
    bare = PreviewConfig(law="unconstrained", depth=0.0)
    planned, free = (stroll("walk", 0.03, seconds=1.3, config=config)[0] for config in (CONFIG, bare))
    assert min(plan.least_margin for plan in free) < min(plan.least_margin for plan in planned) - 0.002


def test_the_trot_is_planned_over_its_lines():
    plans, _ = stroll("trot", 0.1, seconds=1.0)
    assert {plan.status for plan in plans} == {Fallback.SOLVED}
    assert min(plan.least_margin for plan in plans) >= -CONFIG.support.half_width - 1e-3
    assert max(np.abs(plan.position - plan.position[0]).max() for plan in plans) < 0.25
