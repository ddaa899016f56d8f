"""The simulated body behind emulated devices: shafts of servos, samples of a sensor board.

Where `SimRobot` takes commands and gives frames, a plant has sixteen shafts that
emulated servos turn, and sensors that an emulated board reads; time passes when
somebody looks.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import mujoco
import numpy as np

from bluefoot_mpc.io.emulation.shafts import ShaftDrive, ShaftState
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.body import Posture, SimBody
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.sight import Sight
from bluefoot_mpc.sim.sight_config import LidarConfig
from bluefoot_mpc.types import BoolArray, CameraImage, ImuBatch, SensorFrame, TruthSample

_KEPT = 400
"""Samples of the inertial sensor that wait for a board: two seconds."""
_EPSILON = 1e-9


class SimPlant(SimBody):
    """BlueFoot in MuJoCo, limp in a posture until its shafts are driven.

    Compliance margin and punch are the parameter file's; slope, goal, speed and
    torque limit are the registers'. A LIDAR that somebody puts on the trunk asks for
    its scans itself; the camera's pictures are taken when they are due.

    Args:
        robot: the robot's model.
        config: the simulation; its latency has no effect, the bus has its own.
        posture: how the robot is put on the ground.
        seed: of everything random.
    """

    def __init__(self, robot: RobotModel, config: SimConfig, posture: Posture, seed: int = 0) -> None:
        super().__init__(robot, config, seed, config.sensors.imu_period)
        self._posture = posture
        self._drives: list[ShaftDrive] = []
        self._sampled: deque[SensorFrame] = deque(maxlen=_KEPT)
        self._powers: list[float] = []
        self._zero = 0.0
        camera_alone = replace(config, lidar=LidarConfig())
        self._sight = Sight(self._world, robot.parameters.sensors, camera_alone, seed)
        self._frame = self.reset()

    def reset(self) -> SensorFrame:
        """Lie limp in the first posture at time zero; returns what the sensors say."""
        self._place(self._posture)
        self._drives = [ShaftDrive()] * 16
        settle = max(1, math.ceil(self.config.settle_time / self.config.sensors.imu_period)) * self._steps
        self._step = -settle
        self._inertial.begin(self._pose, self._twist)
        self._sampled.clear()
        self._sight.reset()
        while self._step < 0:
            self._bank.cool()
            self._frame = self._run_frame()
        self._start_clock()
        self._next_event = min(self._next_event, self._sight.due)
        self._powers.clear()
        self._truth.start_frame()
        return self._frame

    @property
    def nominal_supply(self) -> float:
        """V of the pack without load, as this run drew it."""
        return self._bank.config.open_voltage

    @property
    def trunk(self) -> int:
        """MuJoCo's number of the trunk."""
        return self._world.trunk

    def begin(self, time: float) -> None:
        """Let the simulation's zero be at `time` (s) of whoever asks."""
        self._zero = time

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s).

        Raises:
            SimulationError: the physics became unstable.
        """
        target = math.floor((time - self._zero) / self.config.physics_period + _EPSILON)
        while self._step < target:
            into = self._step % self._steps
            count = min(self._steps - into, target - self._step)
            self._advance(count)
            if into + count == self._steps:
                self._finish_window()

    def drive(self, index: int, drive: ShaftDrive) -> None:
        """Let a servo's registers act from now on."""
        if drive != self._drives[index]:
            self._drives[index] = drive
            self._bank.write_servo(index, drive)

    def state(self, index: int) -> ShaftState:
        """The joint as it is now."""
        bank = self._bank
        return ShaftState(
            angle=float(bank.plant.position[index]),
            speed=float(bank.plant.speed[index]),
            load=float(bank.duty[index]),
            temperature=float(bank.temperature[index]),
            voltage=float(bank.voltage[0]),
        )

    def set_supply(self, voltage: float) -> None:
        """Change the voltage (V) of the pack without load."""
        self._bank.set_open_voltage(voltage)

    def samples(self, since: float) -> ImuBatch:
        """Inertial samples after `since` (s), oldest first."""
        batches = [frame.imu for frame in self._sampled if frame.time + self._zero > since + _EPSILON]
        if not batches:
            batches = [_emptied(self._frame.imu)]
        return ImuBatch(
            time=np.concatenate([batch.time for batch in batches]) + self._zero,
            gyro=np.concatenate([batch.gyro for batch in batches]),
            accel=np.concatenate([batch.accel for batch in batches]),
            magnetometer=np.concatenate([batch.magnetometer for batch in batches]),
            valid=np.concatenate([batch.valid for batch in batches]),
        )

    def switches(self) -> tuple[BoolArray, float]:
        """(4,) foot switches, and when they were sampled (s)."""
        return self._frame.contact, float(self._frame.contact_time[0]) + self._zero

    def voltage(self) -> float:
        """V of the servos' supply, mean over the last window of the inertial sensor."""
        return self._frame.voltage

    def current(self) -> float:
        """A out of the pack, the same mean."""
        return self._powers[-1] / self._frame.voltage if self._powers else 0.0

    def face(self, time: float) -> None:
        """Let the physics pass until `time` (s), and have every position of that instant worked out."""
        self.advance(time)
        mujoco.mj_kinematics(self._world.model, self._world.data)

    def picture(self) -> CameraImage | None:
        """The newest picture of the camera that has arrived, once; None without one."""
        image = self._sight.take(self._step)[1]
        return replace(image, time=image.time + self._zero) if image is not None and self._zero else image

    def close(self) -> None:
        """Give the camera's graphics memory back. Idempotent."""
        self._sight.close()

    def truth(self) -> TruthSample:
        """The true state now, with the mean power and all touches since it was last asked for."""
        if self._powers:
            self._truth.power = sum(self._powers) / len(self._powers)
            self._powers.clear()
        sample = super().truth()
        self._truth.start_frame()
        return replace(sample, time=sample.time + self._zero) if self._zero else sample

    def _handle_events(self, step: int) -> None:
        super()._handle_events(step)
        if step >= self._sight.due:
            self._sight.look(step)
        self._next_event = min(self._next_event, self._sight.due)

    def _finish_window(self) -> None:
        self._require_stable()
        power, voltage = self._bank.finish_frame(self._steps)
        self._powers.append(power)
        self._inertial.means(1)
        self._frame = self._sensors.measure(self._step, self._step, 1, voltage)
        self._sampled.append(self._frame)


def _emptied(batch: ImuBatch) -> ImuBatch:
    """A batch like `batch` without its samples."""
    return replace(
        batch, time=batch.time[:0], gyro=batch.gyro[:0], accel=batch.accel[:0],
        magnetometer=batch.magnetometer[:0], valid=batch.valid[:0],
    )  # fmt: skip
