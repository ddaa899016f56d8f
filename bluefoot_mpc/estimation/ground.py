"""The plane under the standing feet."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from bluefoot_mpc.estimation import symbols
from bluefoot_mpc.estimation.config import GroundConfig
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.types import N_LEGS, BodyState, BoolArray, FloatArray

_MEMORY = 5


class GroundEstimate(NamedTuple):
    """Slope of the ground about the robot.

    Attributes:
        slope: (2,) rise per metre forward and to the left, in the heading frame
            (x along the trunk's heading, z along gravity); level ground is zero.
        known: False until feet have stood apart in both directions: then the
            slope is drawn towards zero.
    """

    slope: FloatArray
    known: bool


class GroundPlane:
    """Slope of the plane through the feet that stand, by least squares that forget.

    Each frame gives the heights of its standing feet over their mean, so nothing
    but the attitude is needed of where the robot is; two feet give the slope
    along their line, and the diagonals of a trot in turn give both. Frames with
    fewer feet change nothing. The sums live in axes that do not turn with the
    robot, so the slope stays where it is while the robot turns.

    Args:
        config: how long frames count.
    """

    def __init__(self, config: GroundConfig) -> None:
        self._work = Workspace(_fit(config))
        self._unknown = np.zeros(_MEMORY)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._memory = self._unknown
        self._latest = GroundEstimate(np.zeros(2), known=False)

    @property
    def latest(self) -> GroundEstimate:
        """What the last step gave; level and not known before the first."""
        return self._latest

    def step(self, estimate: BodyState, stance: BoolArray | Sequence[bool], dt: float) -> GroundEstimate:
        """Take the feet of one frame.

        Args:
            estimate: state of the body.
            stance: (4,) feet that carry the robot and stand still, for example
                those that are scheduled to stand and touch.
            dt: s since the previous frame.
        """
        memory, quaternion, feet, stands, step = self._work.inputs
        memory[:] = self._memory
        quaternion[:] = estimate.quaternion
        feet[:] = estimate.foot_position_in_base
        stands[:] = stance
        step[0] = dt
        self._work.call()
        after, slope, known = self._work.outputs
        if after[0] == after[0]:  # a state that is not finite leaves the plane as it was
            self._memory = after.copy()
            self._latest = GroundEstimate(slope.copy(), bool(known[0]))
        return self._latest


@functools.lru_cache(maxsize=8)
def _fit(config: GroundConfig) -> Any:
    """One step of the fit (immutable, so it may be shared).

    The memory holds the sums, in m² s, of xx, xy, yy, xz and yz of the standing
    feet about their mean.
    """
    memory, quaternion = ca.SX.sym("memory", _MEMORY), ca.SX.sym("quaternion", 4)
    feet, stance, dt = ca.SX.sym("feet", 3, N_LEGS), ca.SX.sym("stance", N_LEGS), ca.SX.sym("dt")
    rotation = symbols.rotation_matrix(quaternion)
    n = ca.sum1(stance)
    world = rotation @ feet
    centred = world - ca.repmat(world @ stance / ca.fmax(n, 1.0), 1, N_LEGS)
    x, y, z = ca.vertsplit(centred)
    moments = ca.vertcat(*(ca.dot(stance, (a * b).T) for a, b in ((x, x), (x, y), (y, y), (x, z), (y, z))))
    fresh = n > 1.0
    kept = ca.if_else(fresh, ca.exp(-dt / config.memory), 1.0)
    after = kept * memory + ca.if_else(fresh, dt, 0.0) * moments
    xx, xy, yy, xz, yz = ca.vertsplit(after)
    # A little of level ground keeps the fit regular while the feet's line has one direction only.
    floor = config.memory * config.min_spread**2
    xx_full, yy_full = xx + 0.1 * floor, yy + 0.1 * floor
    det = xx_full * yy_full - xy * xy
    slope = ca.vertcat(yy_full * xz - xy * yz, xx_full * yz - xy * xz) / det
    least = 0.5 * (xx + yy) - ca.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    # Turned from fixed axes into those of the heading: x along the trunk's.
    forward = rotation[:2, 0] / ca.sqrt(ca.sumsqr(rotation[:2, 0]))
    ahead = ca.vertcat(ca.dot(forward, slope), forward[0] * slope[1] - forward[1] * slope[0])
    return compile_function(
        "ground_plane",
        {"memory": memory, "quaternion": quaternion, "feet": feet, "stance": stance, "dt": dt},
        {"after": after, "slope": ahead, "known": least > floor},
    )
