"""The simulated robot behind the robot interface."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.body import Posture, SimBody
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.sight import Sight
from bluefoot_mpc.types import N_JOINTS, JointCommand, SensorFrame


class SimRobot(SimBody):
    """BlueFoot in MuJoCo: servos, sensors and battery as the hardware has them.

    It starts standing in its default stance, at rest. The same seed and commands
    give the same frames, bit for bit.

    Attributes:
        period: s, command period.
        discarded_commands: how many commands were not finite and therefore ignored.
    """

    def __init__(self, robot: RobotModel, config: SimConfig, seed: int = 0) -> None:
        super().__init__(robot, config, seed, config.command_period)
        self.period = config.command_period
        self._start = Posture(joints=robot.stance_joints, height=float(robot.default_stance()[2]))
        self._commands: deque[tuple[int, JointCommand]] = deque()
        self._sight = Sight(self._world, robot.parameters.sensors, config, seed)
        self._frame = self.reset()

    def reset(self) -> SensorFrame:
        """Stand in the default stance at time zero: the state after construction, bit for bit."""
        self._commands.clear()
        self.discarded_commands = 0
        self._place(self._start)
        self._bank.hold(self._start.joints)
        self._sight.reset()
        # Standing still is simulated before time zero, the last command period with sensors.
        settle = max(1, math.ceil(self.config.settle_time / self.config.command_period)) * self._steps
        self._step = -settle
        self._inertial.begin(self._pose, self._twist)
        while self._step < 0:
            self._bank.cool()
            self._frame = self._run_frame()
        self._start_clock()
        self._frame = self._with_sight(self._frame)
        return self._frame

    def step(self, command: JointCommand) -> SensorFrame:
        """Send a command, let one command period pass, return the next frame.

        A command that is not finite is discarded, as the bus driver does.

        Raises:
            SimulationError: the physics became unstable.
        """
        q, speed, limit = command.position, command.speed, command.torque_limit
        if math.isfinite(q @ q + speed @ speed + limit @ limit):
            self._commands.append((self._step + self._latency, command))
            self._next_event = min(self._next_event, self._step + self._latency)
        else:
            self.discarded_commands += 1
        self._frame = self._with_sight(self._run_frame())
        return self._frame

    def stop(self) -> None:
        """Switch every servo's torque off at once. Idempotent."""
        self._commands.clear()
        limp = JointCommand(
            position=self._frame.joint_position, speed=np.zeros(N_JOINTS), torque_limit=np.zeros(N_JOINTS)
        )
        self._bank.write(limp)

    def close(self) -> None:
        """Give the graphics memory back, where there is a camera. Idempotent."""
        self._sight.close()

    def _handle_events(self, step: int) -> None:
        """Deliver the commands that have arrived, switch pushes on and off, and look around."""
        commands = self._commands
        while commands and commands[0][0] <= step:
            self._bank.write(commands.popleft()[1])
        if step >= self._sight.due:
            self._sight.look(step)
        self._next_event = min(commands[0][0], self._sight.due) if commands else self._sight.due
        if self._pushes:
            self._next_event = min(self._next_event, self._push(step))

    def _with_sight(self, frame: SensorFrame) -> SensorFrame:
        """The frame with what LIDAR and camera have seen up to its instant."""
        sight = self._sight
        if self._step >= sight.due:
            sight.look(self._step)
        self._next_event = min(self._next_event, sight.due)
        if not sight.has_news:
            return frame
        scan, image = sight.take(self._step)
        return frame if scan is None and image is None else replace(frame, lidar=scan, camera=image)
