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
        """The pieces of a vector of expressions, or views of those of an array, by name."""
        return SimpleNamespace(**{name: vector[place] for name, place in self.slices.items()})

    def symbols(self) -> tuple[Any, SimpleNamespace]:
        """A vector of symbols, and its pieces."""
        vector = ca.SX.sym("p", self.size)
        return vector, self.cut(vector)

    def part(self, vector: FloatArray, names: tuple[str, ...]) -> FloatArray:
        """View of pieces that follow each other."""
        return vector[self.slices[names[0]].start : self.slices[names[-1]].stop]


def input_sizes(model: WholeBodyModel) -> dict[str, int]:
    """Lengths of the arrays that the caller gives on each tick; names and units of `WholeBodyInputs`."""
    joints, feet = model.joints, len(model.feet)
    return {
        "q": model.pin_model.nq, "v": model.pin_model.nv, "contact": feet,
        "com": 3, "com_velocity": 3, "com_acceleration": 3,
        "trunk": 4, "trunk_velocity": 3, "trunk_acceleration": 3,
        "foot": 3 * feet, "foot_velocity": 3 * feet, "foot_acceleration": 3 * feet,
        "posture": joints, "posture_velocity": joints, "posture_acceleration": joints,
        "remaining": feet, "ground": 3,
    }  # fmt: skip


def parameter_layout(model: WholeBodyModel) -> Layout:
    """The caller's arrays, what else changes from tick to tick, then weights, gains and limits.

    ``strength`` is the share of the nominal torque that voltage and heat leave, ``horizon``
    (s) the time over which joint limits must hold, ``loaded`` the share of its load
    that each foot carries.
    """
    joints = model.joints
    configured = {
        "com_weight": 3, "trunk_weight": 3, "momentum_weight": 3, "contact_weight": 1,
        "swing_weight": 1, "posture_weight": joints, "force_weight": 1,
        "com_gain": 2, "trunk_gain": 2, "momentum_gain": 1, "contact_gain": 1, "swing_gain": 2,
        "posture_gain": 2, "force_limit": 1, "ramp": 1,
        "torque": joints, "back_emf": joints, "speed": joints, "lower": joints, "upper": joints,
        "braking": 1, "friction": 1,
    }  # fmt: skip
    changing = {"loaded": len(model.feet), "strength": 1, "horizon": 1, "dt": 1}
    return Layout({**input_sizes(model), **changing, **configured})
