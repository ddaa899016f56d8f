"""Wheels to motion and motion to wheels, for any set of wheels, by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.linear import general_solution
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.constraints import rolling_matrix, scaled, sliding_matrix
from bluefoot_mpc.wheels.robot import WheeledRobot, checked
from bluefoot_mpc.wheels.steering import steering_for
from bluefoot_mpc.wheels.wheel import castor_rate, roller_speed

CONSISTENT = 1e-9
"""Share of the speeds that a residual may have before wheels and motion count as contradictory."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What the wheels say the robot does.

    Attributes:
        twist: (3,) m/s forward, m/s left, rad/s, robot's frame; nearest to what all wheels say.
        residual: m/s, root of the summed squares of what slips and slides at all contacts.
        consistent: whether nothing slips or slides.
        rank: of the equations; below 3 the wheels leave something open.
        free: (3, 3 - rank) twists that could be added without any wheel noticing.
    """

    twist: FloatArray
    residual: float
    consistent: bool
    rank: int
    free: FloatArray

    @property
    def determined(self) -> bool:
        """Whether no other motion fits as well."""
        return self.rank == 3


@dataclass(frozen=True, slots=True, eq=False)
class WheelCommand:
    """What the wheels do when the robot moves.

    Attributes:
        speeds: (n,) rad/s.
        steering: (n,) rad, turns of wheels that turn; 0 for others.
        residual: m/s, root of the summed squares of what the contacts would have to slide.
        consistent: whether no wheel would have to slide: the robot can move like this.
        castor_rates: (n,) rad/s at which castors swing; 0 for others.
        roller_speeds: (n,) rad/s of the rollers on the floor of Swedish wheels; 0 for others.
    """

    speeds: FloatArray
    steering: FloatArray
    residual: float
    consistent: bool
    castor_rates: FloatArray
    roller_speeds: FloatArray


def forward(
    robot: WheeledRobot,
    wheel_speeds: FloatArray,
    steering: FloatArray | None = None,
    *,
    known: Sequence[int] | None = None,
) -> Motion:
    """The motion that fits wheel speeds best: least squares over [J1; C1] twist = [J2 speeds; 0].

    Args:
        robot: n wheels.
        wheel_speeds: (n,) rad/s.
        steering: (n,) rad, turn of each wheel that turns; None: all straight.
        known: indices of the wheels whose speed counts, where others have no encoder; None: all.

    Raises:
        ConfigurationError: a number is not finite, their count is wrong, or `known` names no wheel.
    """
    speeds = checked(wheel_speeds, len(robot.wheels), f"wheel speeds of robot '{robot.name}'", "rad/s each")
    chosen = list(range(len(speeds)) if known is None else known)
    if not all(0 <= index < len(speeds) for index in chosen):
        raise ConfigurationError(f"robot '{robot.name}': known = {chosen} must lie in 0..{len(speeds) - 1}")
    radii = np.array([wheel.drive_radius for wheel in robot.wheels])
    sliding = sliding_matrix(robot, steering)
    rows = np.vstack([rolling_matrix(robot, steering)[chosen], sliding])
    right = np.concatenate([(radii * speeds)[chosen], np.zeros(len(sliding))])
    solution = general_solution(scaled(rows, robot.size), right)
    residual = float(np.linalg.norm(solution.residual))
    scale = np.array([1.0, 1.0, 1.0 / robot.size])
    return Motion(
        twist=scale * solution.particular,
        residual=residual,
        consistent=residual <= CONSISTENT * float(np.linalg.norm(right)),
        rank=solution.rank,
        free=scale[:, None] * solution.homogeneous,
    )


def inverse(robot: WheeledRobot, twist: FloatArray, steering: FloatArray | None = None) -> WheelCommand:
    """Wheel speeds for a motion, and the steering where none is given.

    Args:
        robot: n wheels.
        twist: (3,) m/s forward, m/s left, rad/s, robot's frame.
        steering: (n,) rad, turn of each wheel that turns; None: steered wheels take the direction of
            their contact (turned as little as possible), castors trail.

    Raises:
        ConfigurationError: a number is not finite, or their count is wrong.
    """
    wanted = checked(twist, 3, f"twist of robot '{robot.name}'", "m/s, m/s, rad/s")
    angles = steering_for(robot, wanted) if steering is None else robot.checked_steering(steering)
    radii = np.array([wheel.drive_radius for wheel in robot.wheels])
    residual = float(np.linalg.norm(sliding_matrix(robot, angles) @ wanted))
    size = float(np.linalg.norm(wanted * [1.0, 1.0, robot.size]))
    wheels = list(zip(robot.wheels, angles.tolist(), strict=True))
    return WheelCommand(
        speeds=rolling_matrix(robot, angles) @ wanted / radii,
        steering=angles,
        residual=residual,
        consistent=residual <= CONSISTENT * size,
        castor_rates=np.array([castor_rate(w, wanted, a) if w.kind == "castor" else 0.0 for w, a in wheels]),
        roller_speeds=np.array([roller_speed(w, wanted) if w.kind == "swedish" else 0.0 for w, _ in wheels]),
    )
