"""The simulator's truth, for reports only."""

from __future__ import annotations

import itertools
from typing import Any

import casadi as ca
import mujoco
import numpy as np

from bluefoot_mpc.sim.clearance import Surroundings
from bluefoot_mpc.sim.servo import ServoBank
from bluefoot_mpc.sim.terrain import Ground
from bluefoot_mpc.sim.world import World
from bluefoot_mpc.sim.worlds.build import MARKER_GEOM
from bluefoot_mpc.types import N_JOINTS, N_LEGS, FloatArray, TruthSample

_ENDS = np.cumsum([0, 23, 22, 3, 6, 3 * N_LEGS, N_LEGS, 3 * N_LEGS, N_JOINTS, N_JOINTS, N_JOINTS]).tolist()
_PARTS = [slice(start, end) for start, end in itertools.pairwise(_ENDS)]
"""Where the parts of a sample lie in the result of `truth_function`."""


_CLOSE = 0.15
"""m; the fastest foot needs several frames for it."""


class TruthReader:
    """Reads the state of the simulation without changing how it goes on.

    Attributes:
        power: W, mean electrical power of the last frame.
        is_close: False where nothing but the floor was near in the last sample.
    """

    def __init__(self, world: World, ground: Ground, bank: ServoBank, foot_radius: float) -> None:
        self.power = 0.0
        self._world, self._ground, self._bank, self._radius = world, ground, bank, foot_radius
        self._touched: set[str] = set()
        self._surroundings = Surroundings(world.model, world.data, world.trunk)
        self.is_close = self._surroundings.exist
        self._hit: set[str] = set()
        self._marker = mujoco.mj_name2id(world.model, mujoco.mjtObj.mjOBJ_GEOM, MARKER_GEOM)
        self._harmless = {geom for geom, name in enumerate(world.body_of_part) if not name}
        # Contacts of each foot in the last step with sensors.
        self._found = world.data.sensordata[world.sensor + 3 : world.sensor + 3 + 4 * N_LEGS : 4]
        self._out = np.zeros(_ENDS[-1])
        self._buffer, self._run = self._connect()

    def start_frame(self) -> None:
        """Forget what was touched in the last frame."""
        self._touched.clear()
        self._hit.clear()

    def look_for_contacts(self) -> None:
        """Note which bodies other than feet touch the world in this physics step, and what is no floor.

        The step must be one with sensors.
        """
        data = self._world.data
        # The feet count their own: most of the time there are no others.
        if data.ncon != sum(self._found.tolist()):
            others = set(data.contact.geom.ravel().tolist()) - self._harmless
            self._touched.update(self._world.body_of_part[geom] for geom in others)
        if self._surroundings.exist:
            self.look_for_collisions()

    def look_for_collisions(self) -> None:
        """Note what is no floor and touches the robot in this physics step."""
        self._hit.update(self._surroundings.touched())

    def read(self, time: float, force: FloatArray) -> TruthSample:
        """The truth at the end of the last physics step; contact forces are that step's.

        Args:
            time: s.
            force: (3,) N, push on the trunk, world axes.
        """
        model, data, bank = self._world.model, self._world.data, self._bank
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        self._run()
        out = self._out.copy()
        q, v, com, momentum, feet, heights, forces, torque, duty, temperature = [out[part] for part in _PARTS]
        feet = feet.reshape(N_LEGS, 3)
        if not self._ground.is_plane:
            heights = self._ground.clearance(feet, self._radius)
        clearance = self._surroundings.clearance()
        self.is_close = clearance < _CLOSE
        return TruthSample(
            time=time,
            q=q,
            v=v,
            com=com,
            momentum=momentum,
            foot_position=feet,
            foot_height=heights,
            foot_force=forces.reshape(N_LEGS, 3),
            motor_torque=torque,
            duty=duty,
            motor_temperature=temperature,
            electrical_power=self.power,
            voltage=float(bank.voltage[0]),
            touching=tuple(sorted(self._touched)) if self._touched else (),
            external_force=force.copy(),
            clearance=clearance,
            collisions=tuple(sorted(self._hit)) if self._hit else (),
            marker=data.geom_xpos[self._marker].copy() if self._marker >= 0 else np.full(3, np.nan),
        )

    def _connect(self) -> tuple[Any, Any]:
        world, data, bank = self._world, self._world.data, self._bank
        buffer: Any
        buffer, run = truth_function(world, self._ground, self._radius).buffer()
        trunk, sensor = world.trunk, world.sensor
        inputs = (
            data.qpos[world.q : world.q + 23],
            data.qvel[world.v : world.v + 22],
            data.subtree_com[trunk],
            data.subtree_linvel[trunk],
            data.subtree_angmom[trunk],
            data.geom_xpos,
            data.sensordata[sensor + 3 : sensor + 3 + 4 * N_LEGS],
            bank.torque,
            bank.duty,
            bank.temperature,
        )
        for index, array in enumerate(inputs):
            buffer.set_arg(index, array.data)
        buffer.set_res(0, self._out.data)
        return buffer, run


def truth_function(world: World, ground: Ground, foot_radius: float) -> ca.Function:
    """What a sample holds of MuJoCo's memory and the servos', in the house's conventions, in a row.

    Feet are above the ground by what they are above its plane.
    """
    qpos, qvel = ca.SX.sym("qpos", 23), ca.SX.sym("qvel", 22)
    com, velocity, spin = (ca.SX.sym(name, 3) for name in ("com", "velocity", "spin"))
    geoms, feet = ca.SX.sym("geoms", 3, world.model.ngeom), ca.SX.sym("feet", 4, N_LEGS)
    servos = [ca.SX.sym(name, N_JOINTS) for name in ("torque", "duty", "temperature")]
    mass = float(world.model.body_subtreemass[world.trunk])
    q = ca.vertcat(qpos[0:3], qpos[4:7], qpos[3], qpos[7:])
    v = ca.vertcat(_rotation(q[3:7]).T @ qvel[0:3], qvel[3:])
    centres = [geoms[:, geom] for geom in world.foot_geoms]
    heights = [ground.plane_clearance(centre[0], centre[2], foot_radius) for centre in centres]
    forces = -ca.vec(feet[1:, :])
    result = ca.vertcat(q, v, com, mass * velocity, spin, *centres, *heights, forces, *servos)
    return ca.Function("truth", [qpos, qvel, com, velocity, spin, geoms, feet, *servos], [result])


def _rotation(quaternion: ca.SX) -> ca.SX:
    """Symbolic twin of `bluefoot_mpc.geometry.rotation_from_quaternion`."""
    x, y, z, w = ca.vertsplit(quaternion)
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        ca.horzcat(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        ca.horzcat(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
