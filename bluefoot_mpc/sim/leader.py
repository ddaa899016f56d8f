"""The leader: a wheeled robot that drives ahead through MuJoCo's world and carries the marker."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np

from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.leader_body import (
    FRAME,
    JOINTS,
    LEADER,
    MASS,
    YAW_INERTIA,
    add_leader,
    wheel_body,
    wheel_quaternion,
)
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.leader_path import Way, circle, figure_of_eight, line
from bluefoot_mpc.sim.leader_tracking import Manner, Tracker
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.types import FloatArray, TruthSample
from bluefoot_mpc.wheels.balance import BalancingDrive
from bluefoot_mpc.wheels.drive import DriveState, WheelDrive
from bluefoot_mpc.wheels.mobility import delta_M, delta_m
from bluefoot_mpc.wheels.ready import READY
from bluefoot_mpc.wheels.robot import WheeledRobot

__all__ = ["Leader", "LeaderConfig", "add_leader"]

_PERIOD = 0.040
"""s between two decisions of the leader; its motors push in between too."""
_RESPONSE = 0.010
"""s, least time constant with which the chassis takes on the motion that the wheels give it."""
_TRACTION = 6.0
"""N, greatest force of all wheels together on the chassis."""
_TORQUE = 0.6
"""N·m, greatest torque likewise."""
_ACCELERATION = 0.20
"""m/s², of starts and stops."""
_SLIP_TIME = 0.5
"""s, correlation time of the wheels' slip."""
_REACH = 0.47
"""m, from the leader's centre to its rim and from the robot's to a corner of its outline, together."""
_COURSE_HALF_WIDTH = 0.40
"""m to each side of its course that a leader keeps clear of the robot's centre."""


class Leader:
    """Drives the leader's body: keeps to its way, turns its wheels, and pushes the chassis as they say.

    It is scenery: it knows where it and the robot are.

    Attributes:
        config: of the leader.
        robot: its wheels.

    Args:
        model: MuJoCo model with `add_leader`'s body.
        data: its state.
        config: of the simulation, with a kind of leader. `step` is to be called in the inertial period.
        seed: of the run; the slip of the wheels is drawn from a stream of its own.
        other: (3,) m, centre of the robot in world, for which the leader waits; None: it is alone.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        config: SimConfig,
        seed: int,
        other: FloatArray | None = None,
    ) -> None:
        self.config, self.robot = config.leader, READY[config.leader.kind]()
        self._model, self._data, self._seed, self._other = model, data, seed, other
        period = self._period = config.sensors.imu_period
        self._body, self._frame = int(model.body(LEADER).id), int(model.body(FRAME).id)
        self._wheels = [int(model.body(wheel_body(i)).id) for i in range(len(self.robot.wheels))]
        joint = model.joint(JOINTS[0])
        q, v = int(joint.qposadr[0]), int(joint.dofadr[0])
        self._place, self._speed = data.qpos[q : q + 3], data.qvel[v : v + 3]
        self._force = data.qfrc_applied[v : v + 3]
        self._every = max(1, round(_PERIOD / period))
        # Forces hold for a period: a response as short as that would overshoot.
        self._response = max(_RESPONSE, 2.0 * period)
        self._tracker = Tracker(_way(config.leader), _manner(self.robot))
        self.reset()

    @property
    def state(self) -> DriveState:
        """What the wheels do."""
        return self._drive.state

    def reset(self) -> None:
        """Be as after construction: at rest, waiting for `start`. MuJoCo's state is the caller's to reset."""
        self._random = stream(self._seed, "leader")
        self._drive = _drive(self.robot, self._seed)
        self._tracker.reset()
        self._slip = np.zeros(3)
        self._twist = (0.0, 0.0, 0.0)
        self._wanted_speed = 0.0
        self._tick, self._started = 0, False
        self._show()

    def start(self) -> None:
        """Let its time begin now."""
        self._started = True

    def step(self) -> None:
        """Push the chassis for the next period."""
        if not self._started:
            return
        if self._tick % self._every == 0:
            self._decide()
        self._tick += 1
        self._push()

    def fill(self, sample: TruthSample) -> TruthSample:
        """The sample with the leader's part of the truth; kinematics must be up to date.

        The leader's position is its point on the floor, which wheels are measured from.
        """
        data = self._data
        w, x, y, z = data.xquat[self._frame].tolist()
        return replace(
            sample,
            leader=np.array([*data.xpos[self._body].tolist(), x, y, z, w]),
            leader_wheels=self._drive.state.wheel_speed.copy(),
        )

    def _decide(self) -> None:
        """The motion of the next few periods, as the wheels give it."""
        dt = self._every * self._period
        x, y, yaw = self._place.tolist()
        speed = self._next_speed(self._tick * self._period, dt, self._is_blocked(x, y))
        wanted = self._tracker.twist(x, y, yaw, speed)
        state = self._drive.step(np.array(wanted), dt)
        keep = math.exp(-dt / _SLIP_TIME)
        draw = self._random.standard_normal(3)
        self._slip = keep * self._slip + math.sqrt(1.0 - keep * keep) * self.config.slip * draw
        ahead, left, turn = state.twist.tolist()
        along, aside, around = self._slip.tolist()
        # Slip shortens or stretches a motion, and carries it a little to the side.
        self._twist = (
            (1.0 + along) * ahead - aside * left,
            (1.0 + along) * left + aside * ahead,
            (1.0 + around) * turn,
        )
        self._show()

    def _next_speed(self, now: float, dt: float, blocked: bool) -> float:
        """m/s along the way, changing no faster than it can."""
        config = self.config
        wanted = config.speed if now >= config.delay and not blocked else 0.0
        if config.path == "stop_and_go" and (now - config.delay) % (config.go + config.pause) >= config.go:
            wanted = 0.0
        left = max(self._tracker.left_to_go, 0.0)
        if math.isfinite(left):
            wanted = min(wanted, math.sqrt(_ACCELERATION * left))
        most = _ACCELERATION * dt
        self._wanted_speed += max(-most, min(most, wanted - self._wanted_speed))
        return self._wanted_speed

    def _is_blocked(self, x: float, y: float) -> bool:
        """Whether the robot is near on the course from (x, y), m in the way's frame."""
        if self._other is None:
            return False
        course = self._tracker.course
        dx, dy = float(self._other[0]) - self.config.distance - x, float(self._other[1]) - y
        ahead = dx * math.cos(course) + dy * math.sin(course)
        aside = dy * math.cos(course) - dx * math.sin(course)
        return 0.0 < ahead < _REACH + self.config.gap and abs(aside) < _COURSE_HALF_WIDTH

    def _push(self) -> None:
        """Force and torque that bring the chassis to its motion, within what the wheels can hold."""
        yaw = float(self._place[2])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        vx, vy, rate = self._speed.tolist()
        ahead, left, turn = self._twist
        fx = MASS / self._response * (cosine * ahead - sine * left - vx)
        fy = MASS / self._response * (sine * ahead + cosine * left - vy)
        share = min(1.0, _TRACTION / max(math.hypot(fx, fy), 1e-9))
        torque = YAW_INERTIA / self._response * (turn - rate)
        self._force[:] = fx * share, fy * share, max(-_TORQUE, min(_TORQUE, torque))

    def _show(self) -> None:
        """Turn wheels and upper part, which are welded on, to where the drive has them."""
        state, poses = self._drive.state, self._model.body_quat
        half = 0.5 * state.tilt
        poses[self._frame] = math.cos(half), 0.0, math.sin(half), 0.0
        steering, angles = state.steering.tolist(), state.wheel_angle.tolist()
        for index, (body, wheel) in enumerate(zip(self._wheels, self.robot.wheels, strict=True)):
            poses[body] = wheel_quaternion(wheel, steering[index], angles[index])


def _drive(robot: WheeledRobot, seed: int) -> WheelDrive | BalancingDrive:
    """What turns the wheels: motors alone, or motors that balance too."""
    if robot.name != "balancing":
        return WheelDrive(robot)
    return BalancingDrive(robot, seed=int(stream(seed, "leader.balance").integers(1 << 31)))


def _way(config: LeaderConfig) -> Way:
    """The way of a configuration; `stop_and_go` is a figure of eight with pauses."""
    if config.path == "line":
        return line(config.length)
    return circle(config.radius) if config.path == "circle" else figure_of_eight(config.radius)


def _manner(robot: WheeledRobot) -> Manner:
    """What the wheels permit: any motion at once, any motion after steering, or only along the way."""
    if delta_m(robot) == 3:
        return "turning"
    return "swinging" if delta_M(robot) == 3 else "steering"
