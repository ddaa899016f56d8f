"""A leader on a floor of its own, without the robot, for tests."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.leader import Leader, LeaderConfig, add_leader
from bluefoot_mpc.types import FloatArray

PERIOD = 0.005


class Stage:
    """Floor, leader and, if wanted, a wall across its way; physics in steps of the leader's period."""

    def __init__(
        self, *, wall_at: float | None = None, seed: int = 0, other: FloatArray | None = None, **leader: Any
    ) -> None:
        self.config = LeaderConfig(**{"delay": 0.0, **leader})
        spec = mujoco.MjSpec()
        spec.option.timestep = PERIOD
        spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.05])
        if wall_at is not None:
            spec.worldbody.add_geom(
                name="wall",
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[0.05, 3.0, 0.3],
                pos=[wall_at + 0.05, 0.0, 0.3],
            )
        add_leader(spec, self.config)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.leader = Leader(self.model, self.data, SimConfig(leader=self.config), seed, other)
        self.leader.start()

    def reset(self) -> None:
        mujoco.mj_resetData(self.model, self.data)
        self.leader.reset()
        self.leader.start()

    @property
    def pose(self) -> FloatArray:
        """(3,) x and y in the way's frame, heading."""
        return self.data.qpos[:3].copy()

    def run(self, seconds: float) -> Log:
        """Drive on."""
        steps = round(seconds / PERIOD)
        log = Log(
            pose=np.zeros((steps, 3)),
            twist=np.zeros((steps, 3)),
            wheels=np.zeros((steps, len(self.leader.robot.wheels))),
            steering=np.zeros((steps, len(self.leader.robot.wheels))),
            tilt=np.zeros(steps),
            force=np.zeros((steps, 3)),
        )
        for step in range(steps):
            self.leader.step()
            mujoco.mj_step(self.model, self.data)
            state, (vx, vy, rate) = self.leader.state, self.data.qvel[:3].tolist()
            cosine, sine = math.cos(self.data.qpos[2]), math.sin(self.data.qpos[2])
            log.pose[step] = self.data.qpos[:3]
            log.twist[step] = cosine * vx + sine * vy, cosine * vy - sine * vx, rate
            log.wheels[step], log.steering[step] = state.wheel_speed, state.steering
            log.tilt[step], log.force[step] = state.tilt, self.data.qfrc_applied[:3]
        return log


@dataclass
class Log:
    """What a leader did; one row per period. The twist is in the leader's frame."""

    pose: FloatArray
    twist: FloatArray
    wheels: FloatArray
    steering: FloatArray
    tilt: FloatArray
    force: FloatArray

    @property
    def speed(self) -> FloatArray:
        return np.hypot(self.twist[:, 0], self.twist[:, 1])
