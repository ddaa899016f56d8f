"""Inverse kinematics of the legs in closed form, with limits as explicit results (paper ch. 4).

Four joints place three coordinates, so the direction of the last link in the
leg's vertical plane is given too; `ankle` holds the ways to choose it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, isfinite, sin, sqrt

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import wrap_angle, wrap_angles
from bluefoot_mpc.model.legs.geometry import ALL_LEGS, HipConstants, LegGeometry
from bluefoot_mpc.types import JOINTS, LEG_JOINTS, LEGS, BoolArray, FloatArray

REACH_TOLERANCE = 1e-9  # m, a stretched leg must count as reaching despite rounding
LIMIT_TOLERANCE = 1e-9  # rad, an angle put at its limit must not break it


@dataclass(frozen=True, kw_only=True, slots=True)
class LimitViolation:
    """One joint beyond one of its imposed limits.

    Attributes:
        leg: name of the leg, ``"FL"``.
        joint: name of the joint, ``"knee"``.
        angle: rad, where the inverse puts it.
        limit: rad, the limit that it passes.
        excess: rad, by how much (positive).
    """

    leg: str
    joint: str
    angle: float
    limit: float
    excess: float

    @property
    def index(self) -> int:
        """Place of the joint in the house order of 16."""
        return JOINTS.index(f"{self.leg}_{self.joint}")

    def describe(self) -> str:
        """One sentence for a person, angles in degrees."""
        return (
            f"{self.leg} {self.joint} at {degrees(self.angle):.1f}° passes its limit of "
            f"{degrees(self.limit):.1f}° by {degrees(self.excess):.1f}°"
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class IkResult:
    """Angles for wanted foot points, and what stands against them.

    Attributes:
        joints: (4 n,) rad, leg-major; always finite. An unreachable leg points
            at the nearest point that it reaches with this ankle direction.
        reachable: (n,) True where the foot gets to its target (limits aside).
        missing: (n,) m, from the nearest reachable point to the target.
        violations: limits that the angles pass, legs in order.
        legs: indices of the n legs.
    """

    joints: FloatArray
    reachable: BoolArray
    missing: FloatArray
    violations: tuple[LimitViolation, ...]
    legs: tuple[int, ...] = ALL_LEGS

    @property
    def feasible(self) -> bool:
        """Whether every foot reaches its target inside the limits."""
        return not self.violations and bool(self.reachable.all())

    @property
    def clamped(self) -> FloatArray:
        """(4 n,) rad, the angles with those beyond a limit put at that limit."""
        joints = self.joints.copy()
        for violation in self.violations:
            leg = self.legs.index(LEGS.index(violation.leg))
            joints[4 * leg + LEG_JOINTS.index(violation.joint)] = violation.limit
        return joints

    def describe(self) -> tuple[str, ...]:
        """One sentence for each foot out of reach and each limit passed."""
        lost = [
            f"{LEGS[leg]} foot target is {1e3 * missing:.1f} mm out of reach"
            for leg, missing, reached in zip(self.legs, self.missing, self.reachable, strict=True)
            if not reached
        ]
        return (*lost, *(violation.describe() for violation in self.violations))


def inverse(
    geometry: LegGeometry,
    feet_in_base: FloatArray,
    ankle: FloatArray | float,
    knee_up: bool = True,
    legs: Sequence[int] = ALL_LEGS,
) -> IkResult:
    """Joint angles that put the feet at given points with given ankle directions.

    Args:
        geometry: lengths, hips and imposed limits.
        feet_in_base: (n, 3) m, wanted foot points in the base frame.
        ankle: (n,) rad, or one angle for all: direction of the last link in
            the leg's vertical plane, 0 outward, -pi/2 straight down.
        knee_up: the walking branch (knee angle below zero); else the other one.
        legs: indices of the n legs, all four by default.

    Raises:
        ConfigurationError: a target is not finite.
    """
    targets: list[list[float]] = feet_in_base.tolist()
    directions = ankle.tolist() if isinstance(ankle, np.ndarray) else [float(ankle)] * len(legs)
    joints: list[float] = []
    missing: list[float] = []
    violations: list[LimitViolation] = []
    for leg, target, direction in zip(legs, targets, directions, strict=True):
        if not isfinite(target[0] + target[1] + target[2] + direction):
            raise ConfigurationError(
                f"foot target of {LEGS[leg]} is not finite: {target} m, ankle {direction} rad"
            )
        angles, lacking = _leg_angles(geometry.links, geometry.hips[leg], target, direction, knee_up)
        joints += angles
        missing.append(lacking)
        for angle, (low, high) in zip(angles, geometry.bounds[4 * leg : 4 * leg + 4], strict=True):
            if angle < low - LIMIT_TOLERANCE or angle > high + LIMIT_TOLERANCE:
                violations += _limit_violations(geometry, leg, angles)
                break
    lack = np.array(missing)
    return IkResult(
        joints=np.array(joints), reachable=lack <= REACH_TOLERANCE, missing=lack,
        violations=tuple(violations), legs=tuple(legs),
    )  # fmt: skip


def limit_violations(geometry: LegGeometry, joints: FloatArray) -> tuple[LimitViolation, ...]:
    """Imposed limits that (16,) joint angles (rad) pass, in house order."""
    found: list[LimitViolation] = []
    for leg in ALL_LEGS:
        found += _limit_violations(geometry, leg, joints[4 * leg : 4 * leg + 4].tolist())
    return tuple(found)


def inverse_in_leg(
    geometry: LegGeometry, feet_in_leg: FloatArray, ankle: FloatArray, knee_up: bool = True
) -> tuple[FloatArray, FloatArray]:
    """The same inverse for a stack of points in the leg frame, without limits.

    Args:
        geometry: lengths.
        feet_in_leg: (..., 3) m, foot points in the leg frame.
        ankle: (...) rad, direction of the last link; broadcast against the points.
        knee_up: branch of the knee.

    Returns:
        (..., 4) rad, angles of the leg, and (...) m, distance missing to the target.
    """
    a1, a2, a3, a4 = geometry.links
    x, y, z = feet_in_leg[..., 0], feet_in_leg[..., 1], feet_in_leg[..., 2]
    reach = np.hypot(x, y) - a1 - a4 * np.cos(ankle)
    height = z - a4 * np.sin(ankle)
    distance = np.hypot(reach, height)
    near = np.clip(distance, abs(a2 - a3), a2 + a3)
    c3 = np.clip((near * near - a2 * a2 - a3 * a3) / (2.0 * a2 * a3), -1.0, 1.0)
    s3 = np.sqrt(1.0 - c3 * c3) * (-1.0 if knee_up else 1.0)
    q3 = np.arctan2(s3, c3)
    q2 = wrap_angles(np.arctan2(height, reach) - np.arctan2(a3 * s3, a2 + a3 * c3))
    q1 = np.broadcast_to(np.arctan2(y, x), q2.shape)
    return np.stack([q1, q2, q3, wrap_angles(ankle - q2 - q3)], axis=-1), np.abs(distance - near)


def _leg_angles(
    links: tuple[float, float, float, float], hip: HipConstants, target: list[float],
    direction: float, knee_up: bool,
) -> tuple[tuple[float, float, float, float], float]:  # fmt: skip
    """Angles of one leg and the distance missing (m); plain floats for speed."""
    a1, a2, a3, a4 = links
    dx, dy = target[0] - hip.x, target[1] - hip.y
    x, y = hip.cos * dx + hip.sin * dy, hip.cos * dy - hip.sin * dx
    reach = hypot(x, y) - a1 - a4 * cos(direction)
    height = target[2] - hip.z - a4 * sin(direction)
    distance = hypot(reach, height)
    # Out of reach, the nearest point lies on the same ray from the hip_pitch axis.
    near = min(max(distance, abs(a2 - a3)), a2 + a3)
    c3 = min(1.0, max(-1.0, (near * near - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)))
    s3 = -sqrt(1.0 - c3 * c3) if knee_up else sqrt(1.0 - c3 * c3)
    q3 = atan2(s3, c3)
    q2 = wrap_angle(atan2(height, reach) - atan2(a3 * s3, a2 + a3 * c3))
    return (atan2(y, x), q2, q3, wrap_angle(direction - q2 - q3)), abs(distance - near)


def _limit_violations(geometry: LegGeometry, leg: int, angles: Sequence[float]) -> list[LimitViolation]:
    found: list[LimitViolation] = []
    bounds = geometry.bounds[4 * leg : 4 * leg + 4]
    for joint, angle, (low, high) in zip(LEG_JOINTS, angles, bounds, strict=True):
        limit = low if angle < low else high
        excess = max(low - angle, angle - high)
        if excess > LIMIT_TOLERANCE:
            found.append(LimitViolation(leg=LEGS[leg], joint=joint, angle=angle, limit=limit, excess=excess))
    return found
