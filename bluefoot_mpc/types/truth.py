"""What the simulator alone knows: for reports, never for a controller."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.types.common import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class TruthSample:
    """The simulator's truth at a frame: for reports only, never for a controller.

    Attributes:
        time: s.
        q: (23,) trunk position in world, quaternion xyzw, joints.
        v: (22,) trunk twist in the base frame (linear, angular), joints.
        com: (3,) m, centre of mass in world.
        momentum: (6,) linear kg·m/s and angular (about the centre of mass) kg·m²/s, world axes.
        foot_position: (4, 3) m, centres of the feet in world.
        foot_height: (4,) m, lowest point of each foot above the ground under it.
        foot_force: (4, 3) N, ground on foot, world axes.
        motor_torque: (16,) N·m at the output shaft (after back-EMF and friction).
        duty: (16,) fraction of supply voltage on the motor, -1..1.
        motor_temperature: (16,) °C.
        electrical_power: W drawn by the servos.
        voltage: V at the servos.
        touching: names of bodies other than feet that touch the world.
        external_force: (3,) N, push on the trunk's origin, world axes.
        clearance: m, from any part of the robot to the nearest thing but the floor; infinite where there
            is none within two metres, NaN where nothing stands in the world.
        collisions: names of things but the floor that any part of the robot, feet too, touches.
        marker: (3,) m, centre of the marker in world; NaN without one.
        leader: (7,) pose of the leader in world: position, quaternion xyzw; NaN without one.
        leader_wheels: (n,) rad/s, wheel speeds of the leader; empty without one.
    """

    time: float
    q: FloatArray
    v: FloatArray
    com: FloatArray
    momentum: FloatArray
    foot_position: FloatArray
    foot_height: FloatArray
    foot_force: FloatArray
    motor_torque: FloatArray
    duty: FloatArray
    motor_temperature: FloatArray
    electrical_power: float
    voltage: float
    touching: tuple[str, ...]
    external_force: FloatArray
    clearance: float = float("nan")
    collisions: tuple[str, ...] = ()
    marker: FloatArray = field(default_factory=lambda: np.full(3, np.nan))
    leader: FloatArray = field(default_factory=lambda: np.full(7, np.nan))
    leader_wheels: FloatArray = field(default_factory=lambda: np.zeros(0))
