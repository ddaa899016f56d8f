"""Kinematics of the legs: positions, Jacobians, inverse, ankle direction and velocities."""

from bluefoot_mpc.model.legs.ankle import AnkleConfig, AnklePolicy, ankle_directions, ground_directions
from bluefoot_mpc.model.legs.ankle_table import AnkleTable
from bluefoot_mpc.model.legs.forward import (
    feet_in_base,
    foot_jacobians_in_base,
    joint_positions_in_base,
    leg_jacobian,
    link_midpoints,
    to_leg_frame,
)
from bluefoot_mpc.model.legs.geometry import ALL_LEGS, LegGeometry
from bluefoot_mpc.model.legs.inverse import (
    IkResult,
    LimitViolation,
    inverse,
    inverse_in_leg,
    limit_violations,
)
from bluefoot_mpc.model.legs.velocity import damped_inverse, foot_velocities_in_world, joint_velocities
from bluefoot_mpc.model.legs.widest import limit_margin, widest_directions, widest_margin

__all__ = [
    "ALL_LEGS",
    "AnkleConfig",
    "AnklePolicy",
    "AnkleTable",
    "IkResult",
    "LegGeometry",
    "LimitViolation",
    "ankle_directions",
    "damped_inverse",
    "feet_in_base",
    "foot_jacobians_in_base",
    "foot_velocities_in_world",
    "ground_directions",
    "inverse",
    "inverse_in_leg",
    "joint_positions_in_base",
    "joint_velocities",
    "leg_jacobian",
    "limit_margin",
    "limit_violations",
    "link_midpoints",
    "to_leg_frame",
    "widest_directions",
    "widest_margin",
]
