"""Feet that meet rough ground earlier or later than planned, and the heights that they show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.gait.gait import Gait
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class TouchConfig:
    """When a foot counts as landed, and how it looks for ground that is not there."""

    armed: float = 0.60  # share of the swing from which contact counts as the ground, 1
    above: float = 0.020  # m over the expected height: contact higher up is a flank, not ground
    search_speed: float = 0.060  # m/s, at which a foot without contact goes on down
    search_depth: float = 0.015  # m, farthest that it does
    search_time: float = 0.5  # s after the swing, for which it does
    gain: float = 3.0  # 1/s, with which heights of standing feet follow the measured ones

    def __post_init__(self) -> None:
        """Check ranges."""
        require_range(0.0, 1.0, armed=self.armed)
        require_nonnegative(
            above=self.above, search_depth=self.search_depth, gain=self.gain, search_time=self.search_time
        )
        require_positive(search_speed=self.search_speed)


class FootContacts:
    """Ends swings at the ground, and keeps the heights of standing feet right.

    Heights are measured by forward kinematics and the estimated tilt against the other standing feet, so
    that neither drift nor the droop of the servos enters.

    Attributes:
        missing: (4,) True where a foot found no ground within its search.

    Args:
        config: bounds.
    """

    def __init__(self, config: TouchConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget every foot."""
        self.missing: BoolArray = np.zeros(4, dtype=np.bool_)
        self._free = [False] * 4  # contact was lost after lift-off
        self._since = [float("inf")] * 4  # s since the swing ended
        self._sunk = [0.0] * 4  # m that a foot went down in search of ground

    def step(self, gait: Gait, contact: BoolArray, height: FloatArray, dt: float) -> None:
        """Take one tick's contacts, before the gait advances.

        Args:
            gait: whose feet they are (changed).
            contact: (4,) True where the switch is closed.
            height: (4,) m, measured heights of the feet, over anything common.
            dt: s.
        """
        feet, state = gait.state.feet, gait.state
        for leg, (foot, touches) in enumerate(zip(feet, contact.tolist(), strict=True)):
            if foot.swinging:
                self._since[leg], self._sunk[leg] = 0.0, 0.0
                self.missing[leg] = False
                self._free[leg] = self._free[leg] or not touches
                progress = state.rhythm.progress(state.cpg.y1[leg], state.cpg.y2[leg])[1]
                near = foot.z <= foot.goal_z + self._config.above
                if touches and self._free[leg] and near and progress >= self._config.armed:
                    gait.touch_down(leg)
                    self._free[leg] = False
                    self._measure(gait, leg, contact, height)
                continue
            self._since[leg] += dt
            if touches:
                self._free[leg], self.missing[leg] = False, False
                self._since[leg] = float("inf")
            elif self._since[leg] < self._config.search_time:
                self._search(gait, leg, dt)
        self._correct(gait, contact, height, dt)

    def _measure(self, gait: Gait, leg: int, contact: BoolArray, height: FloatArray) -> None:
        """Take a landed foot's height as it is measured against those that stand."""
        feet = gait.state.feet
        others = [k for k in range(4) if k != leg and contact[k] and not feet[k].swinging]
        known = [*others, leg]
        if not others or not np.isfinite(height[known]).all():
            return
        over = height[leg] - float(height[others].mean())
        gait.set_height(leg, float(over) + sum(feet[k].z for k in others) / len(others))

    def _search(self, gait: Gait, leg: int, dt: float) -> None:
        """Go on down."""
        step = min(self._config.search_speed * dt, self._config.search_depth - self._sunk[leg])
        if step <= 0.0:
            self.missing[leg] = True
            return
        self._sunk[leg] += step
        gait.set_height(leg, gait.state.feet[leg].z - step)

    def _correct(self, gait: Gait, contact: BoolArray, height: FloatArray, dt: float) -> None:
        """Let the heights of standing feet follow the measured ones, without moving their mean."""
        feet = gait.state.feet
        standing = [leg for leg in range(4) if contact[leg] and not feet[leg].swinging]
        if len(standing) < 3 or not np.isfinite(height[standing]).all():
            return
        believed = np.array([feet[leg].z for leg in standing])
        error = height[standing] - believed
        error -= error.mean()
        share = min(1.0, self._config.gain * dt)
        for leg, z, wrong in zip(standing, believed.tolist(), error.tolist(), strict=True):
            gait.set_height(leg, z + share * wrong)
