"""A slow trot of the simulated robot without levelling, for tests that look at it from outside."""

from functools import cache

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import ControlOutput, Pipeline
from bluefoot_mpc.scenarios.leveling import UNCOMPENSATED_TROT
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import MotionCommand, SensorFrame, TruthSample
from tests.control.closed_loop import walk
from tests.leveling.bench import ROBOT

START = 1.5
"""s, when it begins to walk."""


@cache
def trot(seconds: float = 4.0) -> list[tuple[SensorFrame, ControlOutput, TruthSample]]:
    """What was seen, done and true on every tick of a trot at 60 mm/s."""
    robot = SimRobot(ROBOT, SimConfig(), 0)
    pipeline = Pipeline(ROBOT, build(ControlConfig, {"gait": {"trot": UNCOMPENSATED_TROT}}), robot.period)
    frame, rows = robot.reset(), []
    for _ in range(round(seconds / robot.period)):
        output = pipeline.step(frame, walk(0.06) if frame.time >= START else MotionCommand())
        rows.append((frame, output, robot.truth()))
        frame = robot.step(output.command)
    return rows
