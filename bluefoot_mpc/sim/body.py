"""The simulated body: MuJoCo's world, servos on one battery, and sensors, in steps of the physics."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from bluefoot_mpc.exceptions import SimulationError
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.inertial import InertialWindows
from bluefoot_mpc.sim.leader import Leader
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.sensors import SAMPLE, Probe, Sensors
from bluefoot_mpc.sim.servo import BankConfig, Plant, ServoBank
from bluefoot_mpc.sim.terrain import Ground
from bluefoot_mpc.sim.truth import TruthReader
from bluefoot_mpc.sim.world import World, build_world
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import N_JOINTS, FloatArray, SensorFrame, TruthSample

_SENSORS_OFF = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
NEVER = 1 << 62
"""Number of a physics step that does not come."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Posture:
    """How the robot is put on the ground.

    Attributes:
        joints: (16,) rad.
        height: m, trunk origin above the ground.
    """

    joints: FloatArray
    height: float


class SimBody:
    """What is the same however the robot is commanded: physics, servo bank, sensors, pushes, truth.

    Attributes:
        config: the simulation.
        drawn: what randomisation made of this run, for a log.

    Args:
        robot: the robot's model.
        config: the simulation.
        seed: of everything random.
        period: s, between two frames of the sensors.
    """

    def __init__(self, robot: RobotModel, config: SimConfig, seed: int, period: float) -> None:
        self.config = config
        drawn = draw(config, seed)
        self.drawn = drawn.as_dict()
        self._latency = round(drawn.latency / config.physics_period)
        self._plan = world_plan(config.world, seed)
        self._world = build_world(robot, config, drawn, self._plan)
        self._steps = round(period / config.physics_period)
        self._imu_steps = round(config.sensors.imu_period / config.physics_period)
        self._bank = ServoBank(
            BankConfig(
                servo=robot.parameters.servo,
                battery=robot.parameters.battery,
                gain=drawn.servo_gain,
                friction_scale=drawn.servo_friction,
                open_voltage=drawn.voltage,
                standby_current=config.standby_current,
                backlash=_backlash(robot, config),
                load_friction_speed=config.load_friction_speed,
                period=config.physics_period,
            ),
            _plant(self._world),
        )
        self._ground = Ground(config.world, self._world.model, self._world.data, self._plan)
        self._truth = TruthReader(self._world, self._ground, self._bank, robot.parameters.legs.foot_radius)
        windows = -(-self._steps // self._imu_steps)
        self._inertial = InertialWindows(robot.parameters.sensors.imu, config.sensors.imu_period, windows)
        self._samples = np.zeros((windows, SAMPLE))
        probe = Probe(
            means=self._inertial.values,
            samples=self._samples,
            position=self._bank.plant.position,
            duty=self._bank.duty,
            temperature=self._bank.temperature,
            physics_period=config.physics_period,
            frame_steps=self._steps,
            window_steps=self._imu_steps,
        )
        self._sensors = Sensors(config.sensors, robot.parameters.servo, probe, seed)
        world, data = self._world, self._world.data
        self._sample = data.sensordata[world.sensor : world.sensor + SAMPLE]
        self._pose, self._twist = data.qpos[world.q : world.q + 7], data.qvel[world.v : world.v + 6]
        self._pushes: list[tuple[int, int, FloatArray]] = []
        self._force = np.zeros(3)
        self._step, self._next_event = 0, NEVER
        self._leader = None
        if config.leader.kind:
            place = data.xpos[world.trunk]
            self._leader = Leader(world.model, data, config, seed, place)

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model, for viewers."""
        return self._world.model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's state, for viewers. Do not write to it."""
        return self._world.data

    @property
    def plan(self) -> WorldPlan | None:
        """What stands where in the world; None on open ground and in MuJoCo's own files."""
        return self._plan

    @property
    def ground(self) -> Ground:
        """Height of the ground anywhere."""
        return self._ground

    @property
    def overheated(self) -> tuple[str, ...]:
        """Names of the servos that switched off by heat."""
        return self._bank.overheated

    def truth(self) -> TruthSample:
        """The true state now: for reports, never for a controller."""
        sample = self._truth.read(self._step * self.config.physics_period, self._force)
        return sample if self._leader is None else self._leader.fill(sample)

    def apply_push(self, force: FloatArray, duration: float) -> None:
        """Push the trunk's origin from now on.

        Args:
            force: (3,) N, world axes.
            duration: s.
        """
        self._add_push(self._step * self.config.physics_period, np.asarray(force, dtype=np.float64), duration)

    def _place(self, posture: Posture) -> None:
        """Put the robot on the ground at the origin, aligned with the slope, limp, nothing ahead."""
        world, model, data = self._world, self._world.model, self._world.data
        self._pushes, self._force, self._next_event = [], np.zeros(3), NEVER
        mujoco.mj_resetData(model, data)
        slope, height = self.config.world.slope, posture.height
        pose = data.qpos[world.q : world.q + 23]
        pose[0:3] = (-math.sin(slope) * height, 0.0, math.cos(slope) * height)
        pose[3:7] = (math.cos(0.5 * slope), 0.0, -math.sin(0.5 * slope), 0.0)
        pose[7:] = posture.joints
        self._bank.reset()
        self._sensors.reset()
        if self._leader is not None:
            self._leader.reset()

    def _start_clock(self) -> None:
        """Make this instant time zero: rested pack, cold servos, the configured pushes ahead."""
        self._world.data.time = 0.0
        self._bank.cool()
        for push in self.config.pushes:
            self._add_push(push.time, np.array(push.force), push.duration)
        if self._leader is not None:
            self._leader.start()

    def _add_push(self, time: float, force: FloatArray, duration: float) -> None:
        start = max(self._step, round(time / self.config.physics_period))
        stop = start + max(1, round(duration / self.config.physics_period))
        self._pushes.append((start, stop, force))
        self._next_event = min(self._next_event, start)

    def _run_frame(self) -> SensorFrame:
        """Physics of one frame, then what the sensors say of it."""
        self._truth.start_frame()
        first, count = self._advance(self._steps)
        self._require_stable()
        self._truth.power, voltage = self._bank.finish_frame(self._steps)
        self._inertial.means(count)
        return self._sensors.measure(self._step, first, count, voltage)

    def _require_stable(self) -> None:
        if not math.isfinite(self._pose[2]):
            now = self._step * self.config.physics_period
            raise SimulationError(f"the simulation became unstable before t = {now:.3f} s")

    def _advance(self, steps: int) -> tuple[int, int]:
        """Some physics steps, at most a frame's.

        Gyro and accelerometer give means over the IMU's period. The other
        sensors are evaluated in the steps that end on it, so their samples are
        one physics step old.

        Returns:
            Number of the step that ends with the first sample, and of samples.
        """
        model, data = self._world.model, self._world.data
        option, advance, mj_step = model.opt, self._bank.advance, mujoco.mj_step
        flags = option.disableflags & ~_SENSORS_OFF
        quiet = flags | _SENSORS_OFF
        option.disableflags = quiet
        period, count, leader, is_close = self._imu_steps, 0, self._leader, self._truth.is_close
        for step in range(self._step + 1, self._step + steps + 1):
            if step > self._next_event:
                self._handle_events(step - 1)
            advance()
            if step % period:
                mj_step(model, data)
                if is_close:
                    self._truth.look_for_collisions()
                continue
            option.disableflags = flags
            mj_step(model, data)
            option.disableflags = quiet
            self._inertial.mark(count, self._pose, self._twist)
            self._samples[count] = self._sample
            self._truth.look_for_contacts()
            if leader is not None:
                leader.step()
            count += 1
        first = self._step // period * period + period
        self._step += steps
        return first, count

    def _handle_events(self, step: int) -> None:
        """Bring what is due into force, and find out what comes next."""
        self._next_event = self._push(step) if self._pushes else NEVER

    def _push(self, step: int) -> int:
        """Bring the pushes of a step into force; returns the step at which they change next."""
        self._pushes = [push for push in self._pushes if step < push[1]]
        self._force = np.zeros(3)
        for start, _, force in self._pushes:
            if start <= step:
                self._force += force
        # The free joint's first three forces act on the trunk's origin, in world axes.
        v = self._world.v
        self._world.data.qfrc_applied[v : v + 3] = self._force
        return min((edge for push in self._pushes for edge in push[:2] if edge > step), default=NEVER)


def _backlash(robot: RobotModel, config: SimConfig) -> float:
    degrees = robot.parameters.servo.backlash_deg if config.backlash_deg is None else config.backlash_deg
    return math.radians(degrees)


def _plant(world: World) -> Plant:
    data, model = world.data, world.model
    q, v = world.q + 7, world.v + 6
    return Plant(
        position=data.qpos[q : q + N_JOINTS],
        speed=data.qvel[v : v + N_JOINTS],
        drive=data.ctrl[world.ctrl : world.ctrl + N_JOINTS],
        friction=model.dof_frictionloss[v : v + N_JOINTS],
        damping=model.dof_damping[v : v + N_JOINTS],
    )
