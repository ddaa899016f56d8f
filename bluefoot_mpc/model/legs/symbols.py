"""Kinematics of the legs as expressions, for generated code.

They are those of `forward`, `inverse` and `ankle_table`, operation by
operation, so that the numbers are the same to the last bit or nearly so; which
limits are passed, and by how much, is left to `inverse`.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from bluefoot_mpc.model.legs.ankle_table import SHAPE, coordinates
from bluefoot_mpc.model.legs.geometry import ALL_LEGS, LegGeometry


def leg_points(geometry: LegGeometry, leg: int, angles: Any) -> Any:
    """3 x 5 (m, base frame): the four joints and the foot of a leg; `joint_positions_in_base` of symbols."""
    a1, a2, a3, a4 = geometry.links
    hip = geometry.hips[leg]
    q2, q23 = angles[1], angles[1] + angles[2]
    q234 = q23 + angles[3]
    c, s = ca.cos(hip.azimuth + angles[0]), ca.sin(hip.azimuth + angles[0])
    reaches, heights = [0.0, a1], [hip.z, hip.z]
    for length, pitch in ((a2, q2), (a3, q23), (a4, q234)):
        reaches.append(reaches[-1] + length * ca.cos(pitch))
        heights.append(heights[-1] + length * ca.sin(pitch))
    columns = [ca.vertcat(hip.x + r * c, hip.y + r * s, z) for r, z in zip(reaches, heights, strict=True)]
    return ca.horzcat(*columns)


def cell_function(geometry: LegGeometry) -> ca.Function:
    """Where feet lie in the ankle table.

    Input: feet (12 values, m, base frame). Outputs: rows of `AnkleTable.grid` (4), and
    places in these cells (8 values, 0..1: outward and upward, leg by leg).
    """
    feet = ca.SX.sym("feet", 12)
    numbers, places = [], []
    for leg in ALL_LEGS:
        hip = geometry.hips[leg]
        x, y, z = feet[3 * leg], feet[3 * leg + 1], feet[3 * leg + 2]
        row, column = coordinates(geometry, ca.hypot(x - hip.x, y - hip.y), z - hip.z)
        rows, columns = SHAPE
        inside = ca.logic_and(
            ca.logic_and(row >= 0.0, row < rows), ca.logic_and(column >= 0.0, column < columns)
        )
        i, j = ca.floor(row), ca.floor(column)
        numbers.append(ca.if_else(inside, (leg * rows + i) * columns + j, len(ALL_LEGS) * rows * columns))
        places += [row - i, column - j]
    return ca.Function("ankle_cell", [feet], [ca.vertcat(*numbers), ca.vertcat(*places)])


def inverse_function(geometry: LegGeometry) -> ca.Function:
    """Angles for feet whose cells of the ankle table are known, knee up.

    Inputs: feet (12 values, m, base frame), cells (4 x 4, columns are legs), places in
    the cells (8), and an angle added to the direction (rad). Outputs: angles (16, rad),
    the same inside the imposed limits (16), and a check (2): by how much one lies beyond a
    limit (rad) or a foot out of reach (m) at most, and the sum of the angles: NaN where a
    cell or a foot is.
    """
    feet, cells, places = ca.SX.sym("feet", 12), ca.SX.sym("cells", 4, 4), ca.SX.sym("places", 8)
    shift = ca.SX.sym("shift")
    angles, lacking = [], []
    for leg in ALL_LEGS:
        corner, outward, upward, twist = ca.vertsplit(cells[:, leg])
        row, column = places[2 * leg], places[2 * leg + 1]
        direction = corner + row * (outward + twist * column) + upward * column + shift
        joints, missing = _leg(geometry, leg, feet[3 * leg : 3 * leg + 3], direction)
        angles.append(joints)
        lacking.append(missing)
    joints = ca.vertcat(*angles)
    lower, upper = ca.DM(geometry.lower), ca.DM(geometry.upper)
    cut = ca.fmin(ca.fmax(joints, lower), upper)
    beyond = ca.mmax(ca.vertcat(lower - joints, joints - upper, *lacking))
    # The largest of numbers may hide one that is none; their sum does not.
    check = ca.vertcat(beyond, ca.sum1(joints))
    return ca.Function("leg_inverse", [feet, cells, places, shift], [joints, cut, check])


def _leg(geometry: LegGeometry, leg: int, foot: Any, direction: Any) -> tuple[Any, Any]:
    """Four angles of one leg, and the distance missing (m)."""
    a1, a2, a3, a4 = geometry.links
    hip = geometry.hips[leg]
    dx, dy = foot[0] - hip.x, foot[1] - hip.y
    x, y = hip.cos * dx + hip.sin * dy, hip.cos * dy - hip.sin * dx
    reach = ca.hypot(x, y) - a1 - a4 * ca.cos(direction)
    height = foot[2] - hip.z - a4 * ca.sin(direction)
    distance = ca.hypot(reach, height)
    near = ca.fmin(ca.fmax(distance, abs(a2 - a3)), a2 + a3)
    c3 = ca.fmin(1.0, ca.fmax(-1.0, (near * near - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)))
    s3 = -ca.sqrt(1.0 - c3 * c3)
    q3 = ca.atan2(s3, c3)
    q2 = _wrapped(ca.atan2(height, reach) - ca.atan2(a3 * s3, a2 + a3 * c3))
    q4 = _wrapped(direction - q2 - q3)
    return ca.vertcat(ca.atan2(y, x), q2, q3, q4), ca.fabs(distance - near)


def _wrapped(angle: Any) -> Any:
    """Symbolic twin of `bluefoot_mpc.geometry.wrap_angle`."""
    turns = ca.floor((math.pi - angle) / (2.0 * math.pi))
    inside = ca.logic_and(angle > -math.pi, angle <= math.pi)
    return ca.if_else(inside, angle, angle + 2.0 * math.pi * turns)
