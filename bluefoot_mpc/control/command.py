"""What of a command may be used: numbers that are not finite must not reach the laws."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bluefoot_mpc.types import Guide, MotionCommand


def usable(motion: MotionCommand, previous: MotionCommand) -> tuple[MotionCommand, tuple[str, ...]]:
    """The command with what is not finite replaced, and what a person should know of that.

    A speed that is not a number is no speed: the robot comes to rest. A trunk
    offset that is none leaves the trunk where it was told to be before. A guided
    task with such a number, or one that makes no sense, is none, and the robot comes to rest.

    Args:
        motion: the command as it came.
        previous: the usable command of the tick before.
    """
    events: tuple[str, ...] = ()
    moving, posed = _has_finite_twist(motion), _has_finite_pose(motion)
    if not moving:
        motion = replace(motion, velocity=np.zeros(2), yaw_rate=0.0)
        events = ("velocity command is not finite: taken as zero",)
    if not posed:
        motion = replace(motion, trunk=previous.trunk)
        events = (*events, "trunk command is not finite: the last one is kept")
    if motion.guide is not None and not _is_usable_guide(motion.guide):
        motion = replace(motion, velocity=np.zeros(2), yaw_rate=0.0, guide=None)
        events = (*events, "the guided task's numbers are of no use: the robot stands")
    return motion, events


def _has_finite_twist(motion: MotionCommand) -> bool:
    return math.isfinite(sum(motion.velocity.tolist()) + motion.yaw_rate)


def _has_finite_pose(motion: MotionCommand) -> bool:
    return math.isfinite(sum(motion.trunk.position.tolist()) + sum(motion.trunk.rpy.tolist()))


def _is_usable_guide(guide: Guide) -> bool:
    """Speed and distance above zero, waypoints (n, 2), all of it finite."""
    points = guide.waypoints
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        return False
    return 0.0 < guide.speed < math.inf and 0.0 < guide.distance < math.inf
