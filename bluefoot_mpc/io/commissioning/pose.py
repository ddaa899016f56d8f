"""The pose in which a robot is calibrated: angles, a drawing of it, and which way each joint turns.

All of it follows from the model's kinematics. In the pose that is suggested
every angle is zero, all links of a leg in one straight line, level: it can be
laid on a ruler, and offsets found in it do not depend on signs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.legs.forward import joint_positions_in_base
from bluefoot_mpc.model.legs.geometry import LegGeometry
from bluefoot_mpc.types import JOINTS, LEG_JOINTS, LEGS, N_LEGS, FloatArray

_CELL = (0.022, 0.011)
"""m of one character of the drawing, down and across: characters are twice as high as wide."""
_LOOK = math.radians(10.0)
"""rad by which a joint is turned to see where its foot goes."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Pose:
    """Angles of one leg, equal for all four.

    Attributes:
        angles_deg: hip_yaw, hip_pitch, knee, ankle.
    """

    angles_deg: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def joints(self) -> FloatArray:
        """(16,) rad."""
        return np.tile(np.radians(self.angles_deg), N_LEGS)


def parse_pose(text: str, geometry: LegGeometry) -> Pose:
    """A pose from ``HIP_YAW,HIP_PITCH,KNEE,ANKLE`` in degrees.

    Raises:
        ConfigurationError: another form, or outside the joints' limits.
    """
    try:
        yaw, pitch, knee, ankle = (float(part) for part in text.split(","))
    except ValueError:
        form = ",".join(LEG_JOINTS)
        raise ConfigurationError(
            f"--pose = '{text}' is not of the form {form} in degrees, say 0,0,0,0"
        ) from None
    pose = Pose(angles_deg=(yaw, pitch, knee, ankle))
    if not np.all((pose.joints >= geometry.lower) & (pose.joints <= geometry.upper)):
        limits = np.degrees(np.column_stack([geometry.lower, geometry.upper])[: len(LEG_JOINTS)])
        known = ", ".join(f"{n} {a:g}..{b:g}" for n, (a, b) in zip(LEG_JOINTS, limits, strict=True))
        raise ConfigurationError(f"--pose = '{text}' lies outside the joints' limits: {known} degrees")
    return pose


def drawing(geometry: LegGeometry, pose: Pose) -> str:
    """The pose in characters: from above (forward is up), and one leg from its side."""
    points = joint_positions_in_base(geometry, pose.joints)
    top = _canvas([-points[leg][:, [0]].ravel() for leg in range(N_LEGS)],
                  [-points[leg][:, [1]].ravel() for leg in range(N_LEGS)],
                  [LEGS[leg] for leg in range(N_LEGS)])  # fmt: skip
    yaw = geometry.hip_azimuth[0] + pose.joints[0]
    reach = (points[0][:, :2] - geometry.hip_position[0][:2]) @ np.array([math.cos(yaw), math.sin(yaw)])
    side = _canvas([-points[0][:, 2]], [reach], ["foot"])
    angles = ", ".join(f"{name} {a:g}°" for name, a in zip(LEG_JOINTS, pose.angles_deg, strict=True))
    return (
        f"Calibration pose, every leg: {angles}\n\n"
        f"from above, forward is up (o: joints, *: feet)\n\n{top}\n\n"
        f"one leg from its side, trunk at the left\n\n{side}\n"
    )


def positive_direction(geometry: LegGeometry, pose: Pose, joint: int) -> str:
    """In words, what the foot does when a joint turns to greater angles."""
    leg, kind = divmod(joint, len(LEG_JOINTS))
    turned = pose.joints
    turned[joint] += _LOOK
    before = joint_positions_in_base(geometry, pose.joints)[leg][-1]
    moved = joint_positions_in_base(geometry, turned)[leg][-1] - before
    if kind == 0:
        outward = before[:2] - geometry.hip_position[leg][:2]
        turn = outward[0] * moved[1] - outward[1] * moved[0]
        sense = "counter-clockwise" if turn > 0.0 else "clockwise"
        return f"swing the whole {LEGS[leg]} leg {sense}, seen from above"
    above = "hip" if kind == 1 else LEG_JOINTS[kind]
    way = "up" if moved[2] > 0.0 else "down"
    return f"turn the {LEGS[leg]} {above} so that the foot goes {way}"


def joint_table(geometry: LegGeometry, pose: Pose) -> list[tuple[str, str]]:
    """Every joint and the way it turns to greater angles."""
    return [(name, positive_direction(geometry, pose, index)) for index, name in enumerate(JOINTS)]


def _canvas(down: list[FloatArray], across: list[FloatArray], labels: list[str]) -> str:
    """Chains of points (m) as lines of characters, joints as ``o``, ends as ``*`` with a label."""
    top, left = min(float(v.min()) for v in down), min(float(v.min()) for v in across)
    height = round((max(float(v.max()) for v in down) - top) / _CELL[0]) + 1
    width = round((max(float(v.max()) for v in across) - left) / _CELL[1]) + 1
    margin = max(len(label) for label in labels) + 1
    grid = [[" "] * (width + 2 * margin) for _ in range(height)]

    def cell(y: float, x: float) -> tuple[int, int]:
        return round((y - top) / _CELL[0]), round((x - left) / _CELL[1]) + margin

    for ys, xs in zip(down, across, strict=True):
        for share in np.linspace(0.0, len(ys) - 1.0, 60):
            at = np.arange(len(ys))
            row, column = cell(float(np.interp(share, at, ys)), float(np.interp(share, at, xs)))
            grid[row][column] = "."
    for ys, xs, label in zip(down, across, labels, strict=True):
        for y, x in zip(ys[:-1], xs[:-1], strict=True):
            row, column = cell(float(y), float(x))
            grid[row][column] = "o"
        row, column = cell(float(ys[-1]), float(xs[-1]))
        grid[row][column] = "*"
        start = column + 1 if xs[-1] >= xs[0] else column - len(label)
        grid[row][start : start + len(label)] = list(label)
    return "\n".join("   " + "".join(row).rstrip() for row in grid)
