"""Position in the odometry frame, and what else a body state says beside the filter."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import casadi as ca

from bluefoot_mpc.estimation import symbols
from bluefoot_mpc.estimation.filter import VALUES
from bluefoot_mpc.estimation.inertial import Vector
from bluefoot_mpc.estimation.prediction import Prediction
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.types import N_LEGS, FloatArray


class Odometry:
    """Workspace that moves the position and makes a body state's numbers; holds no memory of them.

    The position follows what the standing feet moved backwards; without any, the
    filter's own way. Within a stance the sum telescopes, so rounding of the
    joints does not add up.

    Args:
        mount: m, IMU in the base.
    """

    def __init__(self, mount: Vector) -> None:
        self._work = Workspace(_report(mount))

    def advance(
        self, position: FloatArray, before: FloatArray, after: FloatArray, ahead: Prediction, *,
        used: Sequence[int], contact: Sequence[bool], rate: FloatArray, sums: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """Move by one frame.

        Args:
            position: (3,) m, IMU in the odometry frame.
            before: (27,) estimate at the last frame.
            after: (27,) estimate now.
            ahead: the prediction between them.
            used: feet that the filter kept in place.
            contact: (4,) feet that touch.
            rate: (3,) rad/s, base frame, bias removed, at the last frame.
            sums: (10,) of this frame's samples, see `inertial.Motion`.

        Returns:
            (32,) m, rad, s: position of the IMU, of the trunk, quaternion, roll
            pitch yaw, velocity of the trunk in the base, rate, height, feet in the base.
        """
        place, feet, now, points, roll, way, stays, touches, turning, tally = self._work.inputs
        place[:] = position
        feet[:] = before[7:19]
        now[:] = after
        points[:] = ahead.points
        roll[:] = ahead.roll
        way[:] = ahead.way
        stays[:] = 0.0
        for leg in used:
            stays[leg] = 1.0
        touches[:] = contact
        turning[:] = rate
        tally[:] = sums
        self._work.call()
        return self._work.outputs[0].copy()


def trunk_height(feet_from_trunk: Any, contact: Any) -> Any:
    """Trunk origin above the mean of the standing feet, or above the lowest foot without any.

    Args:
        feet_from_trunk: 3 x 4 m, world axes.
        contact: 4, feet that touch.

    Returns:
        m, above foot points (one ball radius less than above the floor).
    """
    heights = feet_from_trunk[2, :].T
    n = ca.sum1(contact)
    mean = ca.dot(heights, contact) / ca.fmax(n, 1.0)
    return -ca.if_else(n > 0.0, mean, ca.mmin(heights))


@functools.lru_cache(maxsize=8)
def _report(mount: Vector) -> Any:
    position, last, way = (ca.SX.sym(name, 3) for name in ("position", "rate", "way"))
    sums = ca.SX.sym("sums", 10)
    before, roll = (ca.SX.sym(name, 3 * N_LEGS) for name in ("before", "roll"))
    points, after = ca.SX.sym("points", 3, N_LEGS), ca.SX.sym("after", VALUES)
    used, contact = ca.SX.sym("used", N_LEGS), ca.SX.sym("contact", N_LEGS)
    moved = ca.reshape(before + roll - after[7:19], 3, N_LEGS) @ used
    n = ca.sum1(used)
    imu = position + ca.if_else(n > 0.0, moved / ca.fmax(n, 1.0), way)
    rate = ca.if_else(sums[0] > 0.0, sums[1:4] / ca.fmax(sums[0], 1.0) - after[19:22], last)
    rotation, lever = symbols.rotation_matrix(after[:4]), ca.DM(list(mount))
    report = ca.vertcat(
        imu, imu - rotation @ lever, after[:4], symbols.rpy(after[:4]),
        rotation.T @ after[4:7] - ca.cross(rate, lever), rate, trunk_height(rotation @ points, contact),
        ca.vec(points),
    )  # fmt: skip
    inputs = {
        "position": position, "before": before, "now": after, "points": points, "roll": roll,
        "way": way, "used": used, "contact": contact, "rate": last, "sums": sums,
    }  # fmt: skip
    return compile_function("report", inputs, {"report": report})
