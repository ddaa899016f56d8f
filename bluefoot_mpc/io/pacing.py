"""Real time for robots that could run faster: one step per command period of the wall clock."""

from __future__ import annotations

import time

from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.types import JointCommand, SensorFrame


class PacedRobot:
    """A robot slowed down to the wall clock; a late step is not made up for.

    Args:
        robot: the robot to pace.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.period = robot.period
        self._due = time.monotonic()

    def reset(self) -> SensorFrame:
        """Reset the robot and start the clock."""
        frame = self.robot.reset()
        self._due = time.monotonic()
        return frame

    def step(self, command: JointCommand) -> SensorFrame:
        """Step the robot, then wait until the period is over."""
        frame = self.robot.step(command)
        self._due = max(self._due + self.period, time.monotonic())
        time.sleep(max(0.0, self._due - time.monotonic()))
        return frame

    def stop(self) -> None:
        """Make the robot limp."""
        self.robot.stop()

    def close(self) -> None:
        """Give back the robot's resources."""
        self.robot.close()
