"""Footholds after a hard push: where the capture point has left its plan, feet land further that way."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview.capture import CaptureConfig, capture_point, foothold_shift

_HERE = np.zeros(2)


@dataclass(frozen=True, kw_only=True, slots=True)
class PushRecoveryConfig:
    """Whether footholds follow the capture point, and when."""

    enabled: bool = False
    law: CaptureConfig = field(default_factory=CaptureConfig)


class PushRecovery:
    """Shifts footholds by the error of the capture point.

    Args:
        config: thresholds and bounds.
    """

    def __init__(self, config: PushRecoveryConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """No correction under way."""
        self._active = False

    def step(self, velocity: FloatArray, planned: FloatArray, height: float) -> FloatArray | None:
        """(2,) m in b', shift of the footholds ahead; None where the law is off.

        Feet are where they were planned to be, so the capture point errs by the
        velocity alone.

        Args:
            velocity: (2,) m/s, estimated, in b'.
            planned: (2,) m/s.
            height: m, of the centre of mass above the ground.
        """
        if not self._config.enabled:
            return None
        measured, wanted = (capture_point(_HERE, v, max(height, 0.0)) for v in (velocity, planned))
        shift, self._active = foothold_shift(measured, wanted, self._active, self._config.law)
        return shift
