"""From the wanted trunk and feet to joint goals: inverse kinematics, limits, a soft start."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import AnkleConfig, AnkleTable, LegGeometry, ankle_directions, inverse
from bluefoot_mpc.types import FloatArray, PostureReference

START_TIME = 1.0
"""s over which the joints go from where they were found to where they are wanted."""


class JointTargets:
    """Turns posture references into joint goals that the legs can reach.

    Args:
        geometry: the legs.
        ankle: how the fourth joint is resolved.
    """

    def __init__(self, geometry: LegGeometry, ankle: AnkleConfig) -> None:
        self._geometry = geometry
        self._ankle = ankle
        self._table = AnkleTable(geometry) if ankle.policy == "margin" else None
        self.reset()

    def reset(self) -> None:
        """Forget where the joints were found."""
        self._found: FloatArray | None = None
        self._elapsed = 0.0

    def step(
        self, reference: PostureReference, joints: FloatArray, dt: float
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """(16,) rad, joint goals, and what had to be cut to reach them.

        Args:
            reference: wanted trunk and feet.
            joints: (16,) rad, measured joints; only the first tick's are used.
            dt: s.
        """
        rotation = rotation_from_rpy(reference.trunk_rpy)
        feet = (reference.foot_position - reference.trunk_position) @ rotation
        gamma = ankle_directions(self._geometry, self._ankle, feet, rotation[2], table=self._table)
        result = inverse(self._geometry, feet, gamma)
        # Two ufuncs: np.clip takes three times as long on a few numbers.
        goal = np.minimum(np.maximum(result.joints, self._geometry.lower), self._geometry.upper)
        events = tuple(violation.describe() for violation in result.violations)
        return self._soften(goal, joints, dt), events

    def _soften(self, goal: FloatArray, joints: FloatArray, dt: float) -> FloatArray:
        if self._found is None:
            self._found = joints.copy()
        self._elapsed += dt
        if self._elapsed >= START_TIME:
            return goal
        share = 0.5 - 0.5 * math.cos(math.pi * self._elapsed / START_TIME)
        return self._found + share * (goal - self._found)
