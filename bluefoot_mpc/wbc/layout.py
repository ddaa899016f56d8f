"""The problem's parameters: one flat vector, cut into named pieces."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import casadi as ca

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wbc.model import WholeBodyModel


class Layout:
    """Names and places of pieces of a flat vector.

    Attributes:
        slices: place of each piece.
        size: length of the vector.
    """

    def __init__(self, sizes: Mapping[str, int]) -> None:
        self.slices: dict[str, slice] = {}
        self.size = 0
        for name, count in sizes.items():
            self.slices[name] = slice(self.size, self.size + count)
            self.size += count

    def cut(self, vector: Any) -> SimpleNamespace:
        """The pieces of a vector of expressions, by name."""
        return SimpleNamespace(**{name: vector[place] for name, place in self.slices.items()})

    def views(self, vector: FloatArray) -> SimpleNamespace:
        """Views of the pieces of a numpy vector, by name."""
        return self.cut(vector)

    def symbols(self) -> tuple[Any, SimpleNamespace]:
        """A vector of symbols, and its pieces."""
        vector = ca.SX.sym("p", self.size)
        return vector, self.cut(vector)


def parameter_layout(model: WholeBodyModel) -> Layout:
    """Everything that changes from tick to tick, then weights, gains and limits.

    Units as in `inputs.WholeBodyInputs` and `config`.
    """
    joints, feet = model.joints, len(model.feet)
    return Layout(
        {
            # What the caller gives.
            "q": model.pin_model.nq, "v": model.pin_model.nv, "contact": feet, "force_cap": feet,
            "com": 3, "com_velocity": 3, "com_acceleration": 3,
            "trunk": 4, "trunk_velocity": 3, "trunk_acceleration": 3,
            "foot": 3 * feet, "foot_velocity": 3 * feet, "foot_acceleration": 3 * feet,
            "posture": joints, "posture_velocity": joints, "posture_acceleration": joints,
            "ground": 3, "strength": 1, "horizon": 1,
            # What the configuration gives.
            "com_weight": 3, "trunk_weight": 3, "momentum_weight": 3, "contact_weight": 1,
            "swing_weight": 1, "posture_weight": joints, "force_weight": 1,
            "com_gain": 2, "trunk_gain": 2, "momentum_gain": 1, "contact_gain": 1, "swing_gain": 2,
            "posture_gain": 2,
            "torque": joints, "speed": joints, "lower": joints, "upper": joints, "braking": 1,
        }
    )  # fmt: skip
