"""The trunk's sway over the feet: the ZMP placement law, around the place where the trunk is told to be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.zmp import placement
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
        config = self._config
        if not config.enabled:
            return np.full(2, np.nan)
        # The law is quasi-static, and tilts that nobody commanded are small.
        points, com = self._masses.points_and_com(joints)
        zmp = placement.static_zmp(self._masses.masses, com, points, self._swing_ahead(gait))
        force = placement.boundary_force(trunk, gait.foot_position, config)
        target = zmp + self.offset - self._commanded
        self.offset = placement.advance(self.offset, target, force, self._masses.masses, dt, config)
        return trunk[:2] + zmp

    def _swing_ahead(self, gait: GaitOutput) -> BoolArray:
        """(4,) True where a leg will swing after the law's lead time, at the present rhythm."""
        if not gait.phase.walking:
            return np.zeros(4, dtype=np.bool_)
        ahead = (gait.phase.phase + self._config.lead / gait.cycle_time) % 1.0
        return np.asarray(ahead < gait.swing_share)
