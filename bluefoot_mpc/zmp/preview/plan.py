"""What the preview plans."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.types import BoolArray, Fallback, FloatArray
from bluefoot_mpc.zmp.preview.model import advance


@dataclass(frozen=True, kw_only=True, slots=True)
class ComPlan:
    """Motion of the centre of mass over the horizon, horizontal, in the b' of now.

    b' of now is kept as an inertial frame: velocities are those over the ground.
    A plan that is what is left of an earlier one has fewer samples, and the
    first may be nearer.

    Attributes:
        time: (n,) s from now, of the samples.
        start: (3, 2) position (m), velocity (m/s) and acceleration (m/s²) now.
        position: (n, 2) m.
        velocity: (n, 2) m/s.
        acceleration: (n, 2) m/s².
        jerk: (n, 2) m/s³, constant up to each sample.
        zmp: (n, 2) m.
        margin: (n,) m, of the ZMP to the edge of the support, + inside; never
            positive where feet stand on one line, NaN where no support is known.
        supported: (n,) False where no foot was scheduled to stand and the region
            of a sample beside was used.
        slack: (3,) m, largest violation of support region, reach and terminal capture
            point; NaN where no support is known.
        status: where the plan comes from.
        iterations: of the solver; 0 when no constraint was met.
    """

    time: FloatArray
    start: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray
    zmp: FloatArray
    margin: FloatArray
    supported: BoolArray
    slack: FloatArray
    status: Fallback
    iterations: int = 0

    def at(self, time: float) -> FloatArray:
        """(3, 2) position, velocity and acceleration at `time` (s from now).

        Before now the start comes back, after the end the last position at rest.
        """
        if time <= 0.0:
            return self.start.copy()
        if time > self.time[-1] + 1e-9:
            return np.stack([self.position[-1], np.zeros(2), np.zeros(2)])
        k = min(int(np.searchsorted(self.time, time)), len(self.time) - 1)
        if k == 0:
            return np.array(advance(self.start, self.jerk[0], time))
        before = (self.position[k - 1], self.velocity[k - 1], self.acceleration[k - 1])
        return np.array(advance(before, self.jerk[k], time - float(self.time[k - 1])))

    @property
    def least_margin(self) -> float:
        """M, least margin over the horizon; NaN when none is known."""
        known = self.margin[np.isfinite(self.margin)]
        return float(known.min()) if len(known) else float("nan")


def carried(points: FloatArray, pose: FloatArray, now: FloatArray) -> FloatArray:
    """(3, 2) position, velocity and acceleration in another frame.

    Args:
        points: (3, 2) in the frame at `pose`.
        pose: (3,) x (m), y (m), yaw (rad) of that frame.
        now: (3,) of the wanted frame.
    """
    turn, offset = _change(pose, now)
    state = points @ turn.T
    state[0] += offset
    return state


def shifted(plan: ComPlan, age: float, pose: FloatArray, now: FloatArray) -> ComPlan:
    """What is left of a plan `age` s after it was made, from the frame of now.

    Args:
        plan: in the frame at `pose`.
        age: s, less than the plan lasts.
        pose: (3,) x (m), y (m), yaw (rad) of that frame.
        now: (3,) of the wanted frame.
    """
    turn, offset = _change(pose, now)
    left = slice(int(np.searchsorted(plan.time, age, side="right")), None)
    return ComPlan(
        time=plan.time[left] - age,
        start=carried(plan.at(age), pose, now),
        position=plan.position[left] @ turn.T + offset,
        velocity=plan.velocity[left] @ turn.T,
        acceleration=plan.acceleration[left] @ turn.T,
        jerk=plan.jerk[left] @ turn.T,
        zmp=plan.zmp[left] @ turn.T + offset,
        margin=plan.margin[left],
        supported=plan.supported[left],
        slack=plan.slack,
        status=Fallback.SHIFTED,
    )


def _change(pose: FloatArray, now: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(2, 2) turn and (2,) offset (m) that take points of the frame at `pose` to that at `now`."""
    (x, y, yaw), (x_now, y_now, yaw_now) = pose.tolist(), now.tolist()
    c, s = math.cos(yaw - yaw_now), math.sin(yaw - yaw_now)
    c_now, s_now = math.cos(yaw_now), math.sin(yaw_now)
    dx, dy = x - x_now, y - y_now
    return np.array([[c, -s], [s, c]]), np.array([c_now * dx + s_now * dy, c_now * dy - s_now * dx])
