"""Where over its feet the trunk can pitch furthest: after a walk the feet stand anywhere."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, to_leg_frame, widest_margin
from bluefoot_mpc.types import BodyState, FloatArray

ENOUGH = 0.010
"""m of reach that should be left: feet and trunk are not quite where they were told to be."""
_GRID = np.stack(
    np.meshgrid(
        np.arange(-0.032, 0.033, 0.008), (-0.012, 0.0, 0.012), (-0.012, -0.006, 0.0, 0.006), indexing="ij",
    ),
    axis=-1,
).reshape(-1, 3)  # fmt: skip
"""m, shifts that are tried; little downwards: there may be blocks under the trunk."""
_LEVER = 0.15
"""m, turns room of a joint into room of a foot."""


def best_shift(estimate: BodyState, legs: LegGeometry, pitch: float, preferred: FloatArray) -> FloatArray:
    """(3,) m, shift of the trunk in the heading frame with which the legs hold a pitch.

    The least change of the preferred shift that leaves `ENOUGH` reach; where none does, the one that leaves
    the most.

    Args:
        estimate: of the robot, its trunk about level.
        legs: lengths, hips and limits.
        pitch: rad, greatest of the sweep.
        preferred: (3,) m, the shift that is taken where it does.
    """
    roll, tilt, _ = estimate.rpy.tolist()
    feet = estimate.foot_position_in_base @ rotation_from_rpy(np.array((roll, tilt, 0.0))).T
    if not np.isfinite(feet).all():
        return preferred
    shifts = np.vstack((preferred, _GRID + preferred * (0.0, 0.0, 1.0)))
    room = reach_left(feet, legs, pitch, shifts)
    change = np.linalg.norm(shifts - preferred, axis=1)
    good = room >= ENOUGH
    best = int(np.argmin(np.where(good, change, np.inf)) if good.any() else np.argmax(room))
    return np.array(shifts[best])


def reach_left(feet: FloatArray, legs: LegGeometry, pitch: float, shifts: FloatArray) -> FloatArray:
    """(n,) m, how much further the worst leg could reach with the trunk shifted and pitched.

    What is left until a leg is stretched, or the room to a joint's limit times a lever.

    Args:
        feet: (4, 3) m, from the trunk's origin, level axes.
        legs: lengths, hips and limits.
        pitch: rad, nose down.
        shifts: (n, 3) m, of the trunk.
    """
    rotation_base_to_level = rotation_from_rpy(np.array((0.0, pitch, 0.0)))
    places = to_leg_frame(legs, (feet - shifts[:, None, :]) @ rotation_base_to_level)
    first, *others = legs.links
    from_hip_pitch = np.hypot(np.hypot(places[..., 0], places[..., 1]) - first, places[..., 2])
    stretched = sum(others) - from_hip_pitch
    # Out of reach the margin is infinite; how far says the stretch alone.
    margin = np.maximum(widest_margin(legs, places, zooms=1), -1.0)
    return np.asarray(np.minimum(stretched, _LEVER * margin).min(axis=-1))
