"""Where the centre of mass lies from the trunk, by the robot's lumped masses."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.codegen import compiled, made_once
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.binding import Bound
from bluefoot_mpc.zmp.mass_points import MassPoints, lump
from bluefoot_mpc.zmp.placement import PlacementConfig
from bluefoot_mpc.zmp.placement_symbols import com_function, placement_function


class LegMasses:
    """The lumped robot under a trunk that may be tilted on purpose.

    Attributes:
        masses: trunk, joints, links and feet.
        rotation: (3, 3) rotation of the trunk as it is told, base to b'.

    Args:
        parameters: the robot.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        self.masses: MassPoints = lump(parameters)
        self.rotation = np.eye(3)
        geometry = self._geometry = LegGeometry.from_parameters(parameters)
        self._content = (
            geometry.links, geometry.hips, self.masses.trunk, self.masses.trunk_com.tobytes(),
            self.masses.leg_weights.tobytes(),
        )  # fmt: skip
        function = made_once(lambda: compiled(com_function(geometry, self.masses)), "com", *self._content)
        self._joints, self._com = np.zeros(16), np.zeros(3)
        inputs, outputs = (self._joints, self.rotation), (self._com, np.zeros((4, 3)))
        self._measure = Bound(function, inputs, outputs)

    def turn(self, rpy: FloatArray) -> None:
        """Take note of the trunk's commanded (3,) roll, pitch and yaw, rad."""
        self.rotation[:] = rotation_from_rpy(rpy)

    def com(self, joints: FloatArray) -> FloatArray:
        """(3,) m, centre of mass from the trunk in axes of b'.

        Args:
            joints: (16,) rad.
        """
        self._joints[:] = joints
        self._measure.call()
        return self._com.copy()

    def placement(self, config: PlacementConfig) -> Any:
        """The placement law on these masses as a function: see `placement_function`."""
        geometry, masses = self._geometry, self.masses
        return made_once(
            lambda: compiled(placement_function(geometry, masses, config)),
            "placement", *self._content, config,
        )  # fmt: skip
