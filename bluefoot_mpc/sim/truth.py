"""The simulator's truth, for reports only."""

from __future__ import annotations

import mujoco
import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.sim.servo import ServoBank
from bluefoot_mpc.sim.terrain import Ground
from bluefoot_mpc.sim.world import World
from bluefoot_mpc.types import N_LEGS, FloatArray, TruthSample


class TruthReader:
    """Reads the state of the simulation without changing how it goes on.

    Attributes:
        power: W, mean electrical power of the last frame.
    """

    def __init__(self, world: World, ground: Ground, foot_radius: float) -> None:
        self.power = 0.0
        self._world, self._ground, self._radius = world, ground, foot_radius
        self._feet = list(world.foot_geoms)
        self._touched: set[str] = set()
        self._harmless = {geom for geom, name in enumerate(world.body_of_part) if not name}

    def start_frame(self) -> None:
        """Forget what was touched in the last frame."""
        self._touched.clear()

    def look_for_contacts(self) -> None:
        """Note which bodies other than feet touch the world in this physics step."""
        data = self._world.data
        if data.ncon > 0:
            others = set(data.contact.geom.ravel().tolist()) - self._harmless
            if others:
                self._touched.update(self._world.body_of_part[geom] for geom in others)

    def read(self, time: float, bank: ServoBank, force: FloatArray) -> TruthSample:
        """The truth at the end of the last physics step; contact forces are that step's.

        Args:
            time: s.
            bank: the servos.
            force: (3,) N, push on the trunk, world axes.
        """
        world = self._world
        model, data = world.model, world.data
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        pose = data.qpos[world.q : world.q + 23]
        q = np.concatenate([pose[0:3], pose[4:7], pose[3:4], pose[7:]])
        v = data.qvel[world.v : world.v + 22].copy()
        v[0:3] = rotation_from_quaternion(q[3:7]).T @ v[0:3]
        mass = model.body_subtreemass[world.trunk]
        feet = data.geom_xpos[self._feet]
        return TruthSample(
            time=time,
            q=q,
            v=v,
            com=data.subtree_com[world.trunk].copy(),
            momentum=np.concatenate(
                [mass * data.subtree_linvel[world.trunk], data.subtree_angmom[world.trunk]]
            ),
            foot_position=feet,
            foot_height=self._ground.clearance(feet, self._radius),
            foot_force=-data.sensordata[world.sensor + 3 : world.sensor + 15].reshape(N_LEGS, 3),
            motor_torque=bank.torque.copy(),
            duty=bank.duty.copy(),
            motor_temperature=bank.temperature.copy(),
            electrical_power=self.power,
            voltage=float(bank.voltage[0]),
            touching=tuple(sorted(self._touched)),
            external_force=force.copy(),
        )
