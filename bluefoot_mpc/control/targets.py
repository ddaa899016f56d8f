"""From the wanted trunk and feet to joint goals: inverse kinematics, limits, a soft start."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.control.quick_inverse import QuickInverse
from bluefoot_mpc.control.upright import UprightAnkles
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import (
    AnkleConfig,
    AnkleTable,
    IkResult,
    LegGeometry,
    ankle_directions,
    inverse,
)
from bluefoot_mpc.types import FloatArray, PostureReference, SensorFrame

START_TIME = 1.0
"""s over which the joints go from where they were found to where they are wanted."""
UPRIGHT = math.radians(-110.0)
"""rad, farthest that last links lean outward among stones, where that leaves the joints `ROOM`."""
ROOM = math.radians(5.0)
"""rad."""
TURN_TIME = 1.0
"""s over which the last links turn upright and back."""
_RECENT = 0.1
"""s for which a joint that did not answer is taken to be where it was."""


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
        self._quick = QuickInverse(geometry, self._table) if self._table is not None else None
        self._upright_table = UprightAnkles(geometry, UPRIGHT, ROOM)
        self._upright_grid = self._upright_table.grid
        self.reset()

    def reset(self) -> None:
        """Forget where the joints were found."""
        self._found: FloatArray | None = None
        self._elapsed = 0.0
        self._beyond: frozenset[int] = frozenset()
        self._upright = 0.0
        if self._quick is not None and self._table is not None:
            self._quick.look_up(self._table.grid)

    @property
    def started(self) -> bool:
        """Whether the joints have left the posture in which they were found."""
        return self._elapsed >= START_TIME

    def reach(self, reference: PostureReference, ankle_shift: float = 0.0) -> IkResult:
        """Joints for a wanted trunk and feet, and what stands against them.

        Args:
            reference: wanted trunk and feet.
            ankle_shift: rad, added to the ankle direction that the policy gives.
        """
        rotation = rotation_from_rpy(reference.trunk_rpy)
        feet = _feet_in_base(reference, rotation)
        table = self._upright_table if self._upright >= 0.5 else self._table
        gamma = ankle_directions(self._geometry, self._ankle, feet, rotation[2], table=table)
        return inverse(self._geometry, feet, gamma + ankle_shift if ankle_shift else gamma)

    def stand_up(self, upright: bool, dt: float) -> None:
        """Turn the last links upright, as far as joints allow, or back to their widest directions.

        Args:
            upright: which of the two.
            dt: s.
        """
        goal = 1.0 if upright else 0.0
        if self._upright == goal or self._quick is None or self._table is None:
            return
        most = dt / TURN_TIME
        self._upright += min(most, max(-most, goal - self._upright))
        share = self._upright
        grid = self._upright_grid if share == 1.0 else self._table.grid
        if 0.0 < share < 1.0:
            widest = self._table.grid
            # Where the widest one bends it is not tabulated: there the turn is made at once.
            grid = np.where(
                np.isnan(widest), self._upright_grid, widest + share * (self._upright_grid - widest)
            )
        self._quick.look_up(grid)

    def step(
        self, reference: PostureReference, frame: SensorFrame, dt: float, ankle_shift: float = 0.0
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """(16,) rad, joint goals, and which limits began to cut them on this tick.

        Args:
            reference: wanted trunk and feet.
            frame: where the joints are; only the first frame is used.
            dt: s.
            ankle_shift: rad, added to the ankle direction that the policy gives.
        """
        goal = self._quickly(reference, ankle_shift)
        events: tuple[str, ...] = ()
        if goal is None:
            goal, events = self._thoroughly(reference, ankle_shift)
        else:
            self._beyond = frozenset()
        if self._found is None:
            # A servo that did not answer in this period is where it was a moment ago; one that is not known
            # is taken to be where it is wanted.
            recent = frame.joint_valid | (frame.time - frame.joint_time <= _RECENT)
            known = recent & np.isfinite(frame.joint_position)
            self._found = np.where(known, frame.joint_position, goal)
        return self._soften(goal, self._found, dt), events

    def _quickly(self, reference: PostureReference, ankle_shift: float) -> FloatArray | None:
        """(16,) rad by generated code; None where a foot or limit needs a closer look."""
        if self._quick is None:
            return None
        return self._quick.joints(
            _feet_in_base(reference, rotation_from_rpy(reference.trunk_rpy)), ankle_shift
        )

    def _thoroughly(
        self, reference: PostureReference, ankle_shift: float
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """(16,) rad inside the limits, and which of them began to cut on this tick."""
        result = self.reach(reference, ankle_shift)
        # Two ufuncs: np.clip takes three times as long on a few numbers.
        goal = np.minimum(np.maximum(result.joints, self._geometry.lower), self._geometry.upper)
        beyond = frozenset(violation.index for violation in result.violations)
        new, self._beyond = beyond - self._beyond, beyond
        return goal, tuple(v.describe() for v in result.violations if v.index in new)

    def _soften(self, goal: FloatArray, found: FloatArray, dt: float) -> FloatArray:
        self._elapsed += dt
        if self._elapsed >= START_TIME:
            return goal
        share = 0.5 - 0.5 * math.cos(math.pi * self._elapsed / START_TIME)
        return found + share * (goal - found)


def _feet_in_base(reference: PostureReference, rotation: FloatArray) -> FloatArray:
    """(4, 3) m, wanted feet in the frame of the wanted trunk."""
    return (reference.foot_position - reference.trunk_position) @ rotation
