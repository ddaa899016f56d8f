"""Names and array types that every record uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LEGS: tuple[str, ...] = ("FL", "FR", "RL", "RR")
LEG_JOINTS: tuple[str, ...] = ("hip_yaw", "hip_pitch", "knee", "ankle")
JOINTS: tuple[str, ...] = tuple(f"{leg}_{joint}" for leg in LEGS for joint in LEG_JOINTS)
N_LEGS = 4
N_JOINTS = 16
