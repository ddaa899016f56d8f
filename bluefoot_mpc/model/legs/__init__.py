"""Kinematics of the legs: positions, Jacobians, inverse and ankle direction."""

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

__all__ = [
    "ALL_LEGS",
    "IkResult",
    "LegGeometry",
    "LimitViolation",
    "feet_in_base",
    "foot_jacobians_in_base",
    "inverse",
    "inverse_in_leg",
    "joint_positions_in_base",
    "leg_jacobian",
    "limit_violations",
    "link_midpoints",
    "to_leg_frame",
]
