"""Where the centre of mass lies from the trunk, by the robot's lumped masses."""

from __future__ import annotations

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, joint_positions_in_base
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp import placement
from bluefoot_mpc.zmp.mass_points import MassPoints, lump


class LegMasses:
    """The lumped robot under a trunk that may be tilted on purpose.

    Attributes:
        masses: trunk, joints, links and feet.

    Args:
        parameters: the robot.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        self.masses: MassPoints = lump(parameters)
        self._geometry = LegGeometry.from_parameters(parameters)
        self._rotation: FloatArray | None = None

    def turn(self, rpy: FloatArray) -> None:
        """Take note of the trunk's commanded (3,) roll, pitch and yaw, rad."""
        self._rotation = rotation_from_rpy(rpy) if rpy.any() else None

    def points_and_com(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(4, 5, 3) m, points of the legs, and (3,) m, centre of mass, from the trunk in axes of b'.

        Args:
            joints: (16,) rad.
        """
        points = joint_positions_in_base(self._geometry, joints)
        trunk_com = self.masses.trunk_com
        if self._rotation is not None:
            points, trunk_com = points @ self._rotation.T, self._rotation @ trunk_com
        return points, placement.centre_of_mass(self.masses, trunk_com, points)

    def com(self, joints: FloatArray) -> FloatArray:
        """(3,) m, centre of mass from the trunk in axes of b'."""
        return self.points_and_com(joints)[1]
