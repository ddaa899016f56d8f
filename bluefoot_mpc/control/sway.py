"""The trunk's sway over the feet: the ZMP placement law, around the place where the trunk is told to be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.zmp.binding import Bound
from bluefoot_mpc.zmp.placement import PlacementConfig


class Sway:
    """Moves the trunk so that the moment of swinging legs is balanced.

    The law alone would undo a commanded offset: the legs trail behind a trunk
    that is moved or tilted over its feet, the centre of mass leaves the trunk's
    origin, and the law leads the trunk back. What the command itself does to
    the centre of mass is therefore taken out of it.

    Attributes:
        offset: (2,) m, the law's share of the trunk's place in b'.

    Args:
        masses: the robot's centre of mass by its joints.
        config: the law.
        joints_in_stance: (16,) rad, joints for a (6,) commanded pose over the nominal stance.
    """

    def __init__(
        self,
        masses: LegMasses,
        config: PlacementConfig,
        joints_in_stance: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._masses = masses
        self._config = config
        self._joints_in_stance = joints_in_stance
        self._masses.turn(np.zeros(3))
        self._neutral_com = self._masses.com(joints_in_stance(np.zeros(6)))
        self._joints, self._feet, self._trunk = np.zeros(16), np.zeros((4, 3)), np.zeros(3)
        self._swing, self._before, self._taken = np.zeros(4), np.zeros(2), np.zeros(2)
        self._dt, self._placed, self._zmp = np.zeros(1), np.zeros(2), np.zeros(2)
        inputs = (
            self._joints, masses.rotation, self._feet, self._trunk, self._swing, self._before, self._taken,
            self._dt,
        )  # fmt: skip
        self._law = Bound(masses.placement(config), inputs, (self._placed, self._zmp))
        self.reset()

    def reset(self) -> None:
        """Back to the neutral place, without a commanded pose."""
        self.offset = np.zeros(2)
        self._commanded = np.zeros(2)
        self._masses.turn(np.zeros(3))

    def follow(self, pose: FloatArray) -> None:
        """Take note of a change of the commanded pose, (6,) m and rad."""
        self._masses.turn(pose[3:])
        com = self._masses.com(self._joints_in_stance(pose))
        self._commanded = (com - self._neutral_com)[:2] if pose.any() else np.zeros(2)

    def step(self, gait: GaitOutput, joints: FloatArray, trunk: FloatArray, dt: float) -> FloatArray:
        """Advance the offset; gives the (2,) ZMP that the law assumes, m in b', NaN when it is off.

        Args:
            gait: feet in b' and the gait's phase.
            joints: (16,) rad.
            trunk: (3,) m, wanted trunk origin in b'.
            dt: s.
        """
        if not self._config.enabled:
            return np.full(2, np.nan)
        # The law is quasi-static, and tilts that nobody commanded are small.
        self._joints[:], self._feet[:], self._trunk[:] = joints, gait.foot_position, trunk
        self._swing[:] = self._swing_ahead(gait)
        self._before[:], self._taken[:], self._dt[0] = self.offset, self._commanded, dt
        self._law.call()
        self.offset = self._placed.copy()
        return trunk[:2] + self._zmp

    def _swing_ahead(self, gait: GaitOutput) -> BoolArray:
        """(4,) True where a leg will swing after the law's lead time, at the present rhythm."""
        if not gait.phase.walking:
            return np.zeros(4, dtype=np.bool_)
        ahead = (gait.phase.phase + self._config.lead / gait.cycle_time) % 1.0
        return np.asarray(ahead < gait.swing_share)
