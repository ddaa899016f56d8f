"""Wheeled robots and legs on paper: constraints, mobility, ready robots, balance, gait diagrams.

Wheel speeds are in rad/s and twists (forward m/s, left m/s, yaw rad/s) in the
robot's frame unless a name says otherwise. `docs/wheels.md` leads from the second
source document's pages to the functions.
"""

from bluefoot_mpc.wheels.constraints import radius_matrix, rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.drive import DriveLimits, DriveState, WheelDrive
from bluefoot_mpc.wheels.kinematics import Motion, WheelCommand, forward, inverse
from bluefoot_mpc.wheels.mobility import (
    Icr,
    delta_M,
    delta_m,
    delta_s,
    holonomic,
    icr,
    icr_of,
    omnidirectional,
    workspace_dof,
    zero_motion_lines,
)
from bluefoot_mpc.wheels.ready import READY
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

__all__ = [
    "READY",
    "DriveLimits",
    "DriveState",
    "Icr",
    "Motion",
    "Wheel",
    "WheelCommand",
    "WheelDrive",
    "WheeledRobot",
    "delta_M",
    "delta_m",
    "delta_s",
    "forward",
    "holonomic",
    "icr",
    "icr_of",
    "inverse",
    "omnidirectional",
    "radius_matrix",
    "rolling_matrix",
    "sliding_matrix",
    "workspace_dof",
    "zero_motion_lines",
]
