"""Other robots stand, squat and sway under the whole-body controller, outside the BlueFoot stack.

What is shown is that model and whole-body controller know nothing of BlueFoot: the same
code gets another Pinocchio model and the names of its feet. State is the simulator's
truth, torques act directly: no estimator, servo, bus or delay takes part.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.model.library import LibraryRobot
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.sim.torque_robot import TorqueRobot, TorqueWorldConfig
from bluefoot_mpc.types import BoolArray, Fallback, FloatArray
from bluefoot_mpc.wbc import WholeBodyConfig, WholeBodyController, WholeBodyInputs, WholeBodyModel

_PUSH_TIME = 0.1
"""s that a push lasts; it begins when a quarter of the standing is over."""

_FALLEN_TILT = math.radians(45.0)
_FALLEN_HEIGHT = 0.5
"""Share of the standing height: below it a robot has fallen."""

PHASES = ("stand", "squat", "sway")


@dataclass(frozen=True, kw_only=True, slots=True)
class BalanceConfig:
    """The motion asked for, and how it is controlled."""

    duration: float = 10.0  # s: a fifth standing, two squatting, two swaying
    squat: float = 0.12  # of the standing height of the centre of mass, up and down
    sway: float = 0.10  # of that height, radius of the circle, fore-aft and sideways
    period: float = 2.0  # s of a squat, and of a circle
    push: float = 0.0  # N·s per kg of the robot, on the trunk to the left, while it stands
    control_period: float = 0.002  # s
    friction: float = 0.8  # Coulomb, feet on the ground
    body: WholeBodyConfig = field(default_factory=WholeBodyConfig)

    def __post_init__(self) -> None:
        require_positive(duration=self.duration, period=self.period, control_period=self.control_period)
        require_nonnegative(squat=self.squat, sway=self.sway, push=self.push, friction=self.friction)

    @property
    def bounds(self) -> tuple[float, ...]:
        """End of each phase, s."""
        return (0.2 * self.duration, 0.6 * self.duration, self.duration)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class BalanceRun:
    """What happened, n ticks of a robot with k feet and nj joints.

    Attributes:
        robot: its name.
        config: what was asked.
        mass: kg.
        fell: it tilted beyond 45 degrees or sank below half its height; the run ends there.
        time: (n,) s.
        com: (n, 3) m, centre of mass, world.
        wanted: (n, 3) m, the reference.
        tilt: (n,) rad, angle of the trunk's z axis to the vertical.
        force: (n, k, 3) N, ground on foot, world axes.
        travel: (n,) m, largest distance of a foot's frame from its start: rolling of its ball, and slip.
        torque: (n, nj) N·m.
        tick: (n,) s, processor time of the controller's step.
        solved: (n,) True where the plan was the optimum of its problem.
        iterations: (n,) of the solver; 0 where the optimum without limits kept them all.
    """

    robot: str
    config: BalanceConfig
    mass: float
    fell: bool
    time: FloatArray
    com: FloatArray
    wanted: FloatArray
    tilt: FloatArray
    force: FloatArray
    travel: FloatArray
    torque: FloatArray
    tick: FloatArray
    solved: BoolArray
    iterations: FloatArray

    def error(self, phase: str | None = None) -> FloatArray:
        """(m,) m, distance of the centre of mass from its reference, in one phase or in all."""
        error: FloatArray = np.linalg.norm(self.com - self.wanted, axis=1)
        if phase is None:
            return error
        index = PHASES.index(phase)
        begin, end = (0.0, *self.config.bounds)[index : index + 2]
        return error[(self.time >= begin) & (self.time < end)]


Motion = tuple[FloatArray, FloatArray, FloatArray]
Reference = Callable[[float], Motion]


def balance_reference(start: FloatArray, config: BalanceConfig) -> Reference:
    """The centre of mass over time: stand, squat, then sway in a circle; twice differentiable.

    Args:
        start: (3,) m, the centre of mass standing, world, over ground at z = 0.
        config: how far and how fast.

    Returns:
        Time (s) to position (m), velocity (m/s), acceleration (m/s²), each (3,).
    """
    stood, squatted, end = config.bounds
    rate = 2.0 * math.pi / config.period
    ramp = min(0.5 * config.period, 0.25 * (end - squatted))
    squat, sway = config.squat * start[2], config.sway * start[2]

    def reference(now: float) -> Motion:
        down, around = now - stood, now - squatted
        swell = _window(down, squatted - stood, ramp)
        turn = _window(around, end - squatted, ramp)
        axes = np.array(
            [
                _scaled(turn, _sine(rate, around), sway),
                _scaled(turn, _sine(rate, around, 0.5 * math.pi), sway),
                _scaled(swell, _sine(rate, down), squat),
            ]
        )
        return start + axes[:, 0], axes[:, 1], axes[:, 2]

    return reference


def run_balance(robot: LibraryRobot, config: BalanceConfig | None = None) -> BalanceRun:
    """Let a robot stand, squat and sway, until the end or until it falls."""
    config = config or BalanceConfig()
    world = TorqueRobot(
        robot.pin_model, robot.urdf, robot.feet, robot.posture,
        TorqueWorldConfig(friction=config.friction, foot_radius=robot.foot_radius),
    )  # fmt: skip
    model = WholeBodyModel.from_pinocchio(robot.pin_model, robot.feet, posture=robot.posture)
    loop = _Loop(world, WholeBodyController(model, config.body))
    reference = balance_reference(loop.com, config)
    height, fell, rows = float(loop.com[2]), False, []
    force, begin = np.array([0.0, config.push * model.mass / _PUSH_TIME, 0.0]), 0.25 * config.bounds[0]
    for tick in range(round(config.duration / config.control_period)):
        now = tick * config.control_period
        push = force if begin <= now < begin + _PUSH_TIME else None
        rows.append(loop.step(reference(now), config.control_period, push))
        fell = bool(loop.tilt > _FALLEN_TILT or loop.com[2] < _FALLEN_HEIGHT * height)
        if fell:
            break
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return BalanceRun(robot=robot.name, config=config, mass=model.mass, fell=fell, **columns)


class _Loop:
    """Simulator and controller, closed over the true state.

    Attributes:
        com: (3,) m, centre of mass now, world.
        tilt: rad.
    """

    def __init__(self, world: TorqueRobot, controller: WholeBodyController) -> None:
        self._world, self._controller = world, controller
        self._model = controller.model
        self._data = self._model.pin_model.createData()
        self._feet = self._feet_start = np.zeros((len(self._model.feet), 3))
        self._look()
        self._feet_start = self._feet
        self._contact = np.ones(len(self._model.feet), dtype=np.bool_)

    def step(self, wanted: Motion, dt: float, push: FloatArray | None) -> dict[str, Any]:
        """One tick; what was there at its beginning, and what was done."""
        world, model = self._world, self._model
        inputs = WholeBodyInputs(
            q=self._q, v=world.v, contact=self._contact, com=wanted[0], com_velocity=wanted[1],
            com_acceleration=wanted[2], trunk=model.posture[3:7], foot=self._feet, posture=model.posture[7:],
        )  # fmt: skip
        begin = time.thread_time()
        plan = self._controller.step(inputs, dt)
        spent = time.thread_time() - begin
        row = {
            "time": np.array(world.time), "com": self.com, "wanted": wanted[0], "tilt": np.array(self.tilt),
            "travel": np.array(np.linalg.norm(self._feet - self._feet_start, axis=1).max()),
            "torque": plan.torque, "tick": np.array(spent),
            "solved": np.array(plan.status is Fallback.SOLVED), "iterations": np.array(plan.iterations),
        }  # fmt: skip
        world.step(plan.torque, dt, push)
        row["force"] = world.foot_force
        self._look()
        return row

    def _look(self) -> None:
        self._q = self._world.q
        pin_model = self._model.pin_model
        pin.framesForwardKinematics(pin_model, self._data, self._q)
        self.com = np.array(pin.centerOfMass(pin_model, self._data, self._q))
        self._feet = np.array([self._data.oMf[frame].translation for frame in self._model.frames])
        self.tilt = math.acos(min(1.0, float(rotation_from_quaternion(self._q[3:7])[2, 2])))


Jet = tuple[float, float, float]
"""A value with its first and second derivative in time."""


def _sine(rate: float, now: float, phase: float = 0.0) -> Jet:
    sine, cosine = math.sin(rate * now + phase), math.cos(rate * now + phase)
    return sine, rate * cosine, -rate * rate * sine


def _window(now: float, length: float, ramp: float) -> Jet:
    """0 before 0 and after `length`, 1 between, over smooth ramps of `ramp` (all s)."""
    if now <= 0.0 or now >= length:
        return 0.0, 0.0, 0.0
    rising = now < 0.5 * length
    s = min((now if rising else length - now) / ramp, 1.0)
    sign = 1.0 if rising else -1.0
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        sign * 30.0 * s * s * (1.0 - s) ** 2 / ramp,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / ramp**2,
    )


def _scaled(a: Jet, b: Jet, size: float) -> Jet:
    """`size` times the product of two."""
    return (
        size * a[0] * b[0],
        size * (a[1] * b[0] + a[0] * b[1]),
        size * (a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]),
    )
