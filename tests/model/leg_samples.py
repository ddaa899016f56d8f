"""Random legs and postures that the kinematics tests share."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import FloatArray


def uneven_geometry() -> LegGeometry:
    """Links of four different lengths and hips off the trunk's plane: nothing cancels by symmetry."""
    return LegGeometry(
        link_lengths=np.array([0.05, 0.08, 0.07, 0.045]),
        hip_position=np.array(
            [[0.10, 0.06, 0.01], [0.09, -0.07, -0.02], [-0.11, 0.05, 0.0], [-0.08, -0.06, 0.015]]
        ),
        hip_azimuth=np.radians([40.0, -55.0, 150.0, -120.0]),
        lower=np.radians(np.tile([-45.0, -80.0, -100.0, -90.0], 4)),
        upper=np.radians(np.tile([50.0, 90.0, 70.0, 85.0], 4)),
        physical_lower=np.radians(np.full(16, -110.0)),
        physical_upper=np.radians(np.full(16, 110.0)),
        foot_radius=0.01,
    )


def random_joints(geometry: LegGeometry, rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 16) rad, uniform inside the imposed limits."""
    return rng.uniform(geometry.lower, geometry.upper, size=(count, 16))


def outward(geometry: LegGeometry, joints: FloatArray) -> bool:
    """Whether every foot stands on the outer side of its hip_yaw axis, as the inverse assumes."""
    a1, a2, a3, a4 = geometry.links
    pitch = np.cumsum(joints.reshape(4, 4)[:, 1:], axis=1)
    reach = a1 + np.cos(pitch) @ np.array([a2, a3, a4])
    return bool((reach > 1e-3).all())
