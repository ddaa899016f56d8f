"""The static placement law as one expression, for generated code: the twin of `placement`."""

from __future__ import annotations

from typing import Any

import casadi as ca

from bluefoot_mpc.model.legs import ALL_LEGS, LegGeometry
from bluefoot_mpc.model.legs.symbols import leg_points
from bluefoot_mpc.zmp.mass_points import MassPoints
from bluefoot_mpc.zmp.placement import FURTHEST, PlacementConfig


def com_function(geometry: LegGeometry, masses: MassPoints) -> ca.Function:
    """Centre of mass (3, m) and first moments of the legs (3 x 4, kg·m), from the trunk.

    Inputs: joints (16, rad) and the trunk's rotation, transposed: 3 x 3 by columns is by
    rows what numpy holds.
    """
    joints, turned = ca.SX.sym("joints", 16), ca.SX.sym("rotation", 3, 3)
    com, moments = _moments(geometry, masses, joints, turned.T)
    return ca.Function("lumped_com", [joints, turned], [com, moments])


def placement_function(geometry: LegGeometry, masses: MassPoints, config: PlacementConfig) -> ca.Function:
    """One tick of the placement law, from joints to the trunk's offset.

    Inputs: joints (16, rad), the trunk's rotation as in `com_function`, feet (3 x 4, m) and
    trunk (3, m) in b', share by which each leg swings (4), and offset (2, m), commanded shift of
    the centre of mass (2, m), time step (s). Outputs: offset anew (2, m), ZMP from the trunk (2, m).
    """
    joints, turned = ca.SX.sym("joints", 16), ca.SX.sym("rotation", 3, 3)
    feet, trunk, swing = ca.SX.sym("feet", 3, 4), ca.SX.sym("trunk", 3), ca.SX.sym("swing", 4)
    offset, commanded, dt = ca.SX.sym("offset", 2), ca.SX.sym("commanded", 2), ca.SX.sym("dt")
    com, moments = _moments(geometry, masses, joints, turned.T)
    zmp = com[:2]
    for leg in ALL_LEGS:
        zmp = zmp - swing[leg] * (moments[:2, leg] - masses.leg * com[:2]) / masses.trunk
    force = _boundary_force(trunk, feet, config)
    rate = config.gain * (zmp + offset - commanded - offset) + config.boundary_gain / masses.trunk * force
    placed = _shortened(offset + dt * _shortened(rate, config.max_rate), config.max_offset)
    inputs = [joints, turned, feet, trunk, swing, offset, commanded, dt]
    return ca.Function("placement", inputs, [placed, zmp])


def _moments(geometry: LegGeometry, masses: MassPoints, joints: Any, rotation: Any) -> tuple[Any, Any]:
    weights = ca.DM(masses.leg_weights)
    legs = [
        rotation @ (leg_points(geometry, leg, joints[4 * leg : 4 * leg + 4]) @ weights) for leg in ALL_LEGS
    ]
    trunk = masses.trunk * (rotation @ ca.DM(masses.trunk_com))
    return (trunk + sum(legs[1:], legs[0])) / masses.total, ca.horzcat(*legs)


def _boundary_force(trunk: Any, feet: Any, config: PlacementConfig) -> Any:
    force: Any = ca.SX(2, 1)
    for leg in ALL_LEGS:
        lever = feet[:, leg] - trunk
        distance = ca.sqrt(ca.sumsqr(lever))
        pull = ca.exp(ca.fmin(config.boundary_sharpness * (distance - config.reach_max), FURTHEST))
        push = ca.exp(ca.fmin(config.boundary_sharpness * (config.reach_min - distance), FURTHEST))
        force = force + (pull - push) / distance * lever[:2]
    return force


def _shortened(vector: Any, most: float) -> Any:
    """The vector, no longer than `most`."""
    size = ca.sqrt(ca.sumsqr(vector))
    return ca.if_else(size > most, most / ca.fmax(size, most), 1.0) * vector
