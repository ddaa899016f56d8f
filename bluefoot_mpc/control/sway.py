"""The trunk's sway over the feet: the ZMP placement law, around the place where the trunk is told to be."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, joint_positions_in_base
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.zmp import placement
from bluefoot_mpc.zmp.mass_points import lump
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
        parameters: the robot.
        config: the law.
        joints_in_stance: (16,) rad, joints for a (6,) commanded pose over the nominal stance.
    """

    def __init__(
        self,
        parameters: RobotParameters,
        config: PlacementConfig,
        joints_in_stance: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._geometry = LegGeometry.from_parameters(parameters)
        self._masses = lump(parameters)
        self._config = config
        self._joints_in_stance = joints_in_stance
        self._neutral_com = self._points_and_com(joints_in_stance(np.zeros(6)), None)[1]
        self.reset()

    def reset(self) -> None:
        """Back to the neutral place, without a commanded pose."""
        self.offset = np.zeros(2)
        self._commanded = np.zeros(2)
        self._rotation: FloatArray | None = None

    def follow(self, pose: FloatArray) -> None:
        """Take note of a change of the commanded pose, (6,) m and rad."""
        self._rotation = rotation_from_rpy(pose[3:]) if pose[3:].any() else None
        com = self._points_and_com(self._joints_in_stance(pose), self._rotation)[1]
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
        points, com = self._points_and_com(joints, self._rotation)
        zmp = placement.static_zmp(self._masses, com, points, self._swing_ahead(gait))
        force = placement.boundary_force(trunk, gait.foot_position, config)
        target = zmp + self.offset - self._commanded
        self.offset = placement.advance(self.offset, target, force, self._masses, dt, config)
        return trunk[:2] + zmp

    def _points_and_com(
        self, joints: FloatArray, rotation: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """(4, 5, 3) m, points of the legs, and (3,) m, centre of mass, from the trunk in axes of b'."""
        points = joint_positions_in_base(self._geometry, joints)
        trunk_com = self._masses.trunk_com
        if rotation is not None:
            points, trunk_com = points @ rotation.T, rotation @ trunk_com
        return points, placement.centre_of_mass(self._masses, trunk_com, points)

    def _swing_ahead(self, gait: GaitOutput) -> BoolArray:
        """(4,) True where a leg will swing after the law's lead time, at the present rhythm."""
        if not gait.phase.walking:
            return np.zeros(4, dtype=np.bool_)
        ahead = (gait.phase.phase + self._config.lead / gait.cycle_time) % 1.0
        return np.asarray(ahead < gait.swing_share)
