"""A complete scenario of one's own, a figure of eight: python scripts/figure_eight.py --view."""

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc import Scenario, ScenarioConfig
from bluefoot_mpc.cli.script import main_for
from bluefoot_mpc.types import Mode, MotionCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class FigureEightConfig(ScenarioConfig):
    """Two circles, one left and one right."""

    duration: float = 50.0  # s
    speed: float = 0.06  # m/s
    yaw_rate: float = 0.3  # rad/s


class FigureEight(Scenario):
    """Walk a figure of eight."""

    name = "figure_eight"
    Config = FigureEightConfig

    def command(self, time: float) -> MotionCommand:
        circle_time = 2.0 * math.pi / self.config.yaw_rate
        turn = self.config.yaw_rate if time % (2.0 * circle_time) < circle_time else -self.config.yaw_rate
        return MotionCommand(mode=Mode.WALK, velocity=np.array([self.config.speed, 0.0]), yaw_rate=turn)


if __name__ == "__main__":
    main_for(__file__)
