"""Steps, bearings and ranges of the URG-04LX (its PP reply; SCIP 2.0 specification C-42-03320B)."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.types import FloatArray

FIRST_STEP, LAST_STEP, FRONT_STEP = 44, 725, 384
"""Steps of the measurement area and the one that looks forward; they rise to the left."""
STEPS_PER_TURN = 1024
POINTS = LAST_STEP - FIRST_STEP + 1
"""682 points over 239.8 degrees."""
SCAN_PERIOD = 0.100
"""s a turn (600 rpm)."""
LEAST_RANGE, GREATEST_RANGE = 20, 5600
"""mm; values below the least are error codes."""
SWEEP_END = LAST_STEP / STEPS_PER_TURN * SCAN_PERIOD
"""s from the time stamp (taken at step 0) to the end of the measurement area."""


def bearings() -> FloatArray:
    """(682,) rad from forward, left positive, of the steps in the order in which they are sent."""
    steps = np.arange(FIRST_STEP, LAST_STEP + 1, dtype=np.float64)
    return (steps - FRONT_STEP) * (2.0 * math.pi / STEPS_PER_TURN)
