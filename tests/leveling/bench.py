"""States of the robot and sources of disturbances made by hand, for tests of the compensator."""

import math
from dataclasses import replace

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.leveling import compensator as module
from bluefoot_mpc.leveling.compensator import Compensator, Leveled
from bluefoot_mpc.leveling.config import LevelingConfig, LevelingLimits, ScheduleConfig
from bluefoot_mpc.leveling.signals import LevelingInputs
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.types import BodyState, FloatArray

DT = 0.02
ROBOT: RobotModel = load_robot()
STANCE: FloatArray = ROBOT.stance_joints
SERVO = ROBOT.parameters.servo
RIGHT, LEFT = [1, 3], [0, 2]
FRONT, REAR = [0, 1], [2, 3]

NOW = ScheduleConfig(fade=1e-3, learn_time=0.0)
"""Acts fully from the first tick on."""
WIDE = LevelingLimits(disturbance=1e9, shift=1e9)
"""Limits that nothing meets."""
UNKNOWN: FloatArray = np.full(16, np.nan)
"""(16,) load of servos that report none."""
SWINGING: FloatArray = STANCE + np.random.default_rng(5).uniform(-0.2, 0.2, (25, 16))
"""(25, 16) rad, joints that stand for a recorded gait."""


class Told:
    """A source that says what it is told to.

    Attributes:
        psi: (22,) what it predicts; None where it cannot.
        seen: the situations that it was shown.
    """

    trust = 1.0
    mse = rate = math.nan
    ready = True
    fault = doubt = ""
    weights = None

    def __init__(self, psi: FloatArray | None = None) -> None:
        self.psi, self.seen = psi, []

    def reset(self) -> None:
        self.seen.clear()

    def step(self, situation, dt):
        self.seen.append(situation)
        return self.psi


def told(monkeypatch, psi: FloatArray | None, **config) -> tuple[Compensator, Told]:
    """A compensator that believes `psi` is coming."""
    source = Told(psi)
    monkeypatch.setattr(module, "make_source", lambda *_: source)
    return compensator(**config), source


class Ticking(Compensator):
    """Gives inputs without a time the time of their tick: made-up states come without a clock."""

    ticks = 0

    def reset(self) -> None:
        super().reset()
        self.ticks = 0

    def step(self, inputs: LevelingInputs, dt: float) -> Leveled:
        if inputs.estimate.time == 0.0:
            inputs = at(dt * self.ticks, inputs)
        self.ticks += 1
        return super().step(inputs, dt)


def compensator(joints: FloatArray = SWINGING, **config) -> Compensator:
    """One that acts at once, unless told otherwise."""
    return Ticking(ROBOT, LevelingConfig(enabled=True, **{"schedule": NOW, **config}), joints)


def state(
    rpy=(0.0, 0.0, 0.0), rate=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), joints=STANCE, speed=0.0, **changes
) -> BodyState:
    """The robot as it was estimated to be."""
    joints = np.array(joints, dtype=float)
    quaternion = quaternion_from_rpy(np.array(rpy, dtype=float))
    q = np.concatenate([[0.0, 0.0, 0.115], [0.0, 0.0, 0.0, 1.0], joints])
    feet = Dynamics(ROBOT).foot_positions(q) - q[:3]
    made = BodyState(
        time=0.0, position=np.array([0.0, 0.0, 0.115]), quaternion=quaternion, rpy=np.array(rpy, dtype=float),
        linear_velocity=np.array(velocity, dtype=float), angular_velocity=np.array(rate, dtype=float),
        joint_position=joints, joint_velocity=np.zeros(16) + speed, contact=np.ones(4, dtype=bool),
        foot_position_in_base=feet, height=0.115,
    )  # fmt: skip
    return replace(made, **changes)


def seen(estimate: BodyState | None = None, **changes) -> LevelingInputs:
    """What the compensator is given on one tick."""
    estimate = estimate or state()
    inputs = LevelingInputs(
        estimate=estimate, turn_rate=estimate.angular_velocity, tilt_reference=np.zeros(2),
        heading_error=0.0, goals=STANCE + 0.02, joint_load=UNKNOWN,
        specific_force=np.array([0.0, 0.0, 9.81]), voltage=SERVO.nominal_voltage, walking=True,
    )  # fmt: skip
    return replace(inputs, **changes)


def at(time: float, inputs: LevelingInputs) -> LevelingInputs:
    """The same at another time (s)."""
    return replace(inputs, estimate=replace(inputs.estimate, time=time))


def last(law: Compensator, inputs: LevelingInputs, ticks: int = 3) -> Leveled:
    """What it says after some ticks of the same."""
    for _ in range(ticks):
        leveled = law.step(inputs, DT)
    return leveled


PSI: FloatArray = np.random.default_rng(3).normal(0.0, 1.0, 22) * np.repeat([5.0, 0.5, 0.2], [3, 3, 16])
MOVED = state(
    rpy=(0.03, -0.05, 0.4), rate=(0.2, -0.3, 0.1), velocity=(0.1, 0.02, -0.03),
    joints=STANCE + np.linspace(-0.1, 0.12, 16), speed=np.linspace(-1.0, 2.0, 16),
)  # fmt: skip
INPUTS = seen(MOVED, heading_error=-0.08, tilt_reference=np.array([0.01, 0.02]))
"""A robot in motion, tilted and off its course."""
