"""Centring the load over the feet of a trot, by the tilt that it shows in step with the gait.

A centre of mass off the middle of the feet lies off both diagonals of a trot,
on the same side of one and on opposite sides of the other. So the trunk falls
a little one way while it stands on one diagonal and another way on the other:
a mass too far forward makes it roll, one too far left makes it pitch, both once
a cycle. A symmetric trot pitches twice a cycle only. Roll and pitch multiplied
by the gait's own cosine and integrated therefore find the unknown load, in
millimetres, and moving the trunk against it takes the cause of the tilt away.
Raising one side, as the slow trim does, only hides its mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

_LOCKED = 0.06
"""Share of a cycle: in a trot the legs of a diagonal are closer, the diagonals as close to half a cycle."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CentringConfig:
    """How the trunk is moved until the load is centred."""

    enabled: bool = False  # off, the trunk stays where the paper's laws put it
    gain: float = 0.5  # m per rad and s; 0.8 rad of tilt per metre make that 2.5 s
    lead_deg: float = 55.0  # degrees of the cycle by which the tilt comes before FL's lift-off
    slow: float = 0.12  # m/s, up to which the gain holds
    fast: float = (
        0.18  # m/s, from which on nothing is learnt: the swing's own rocking would be taken for a load
    )
    bound: float = 0.015  # m, largest shift of the trunk, each axis
    max_tilt: float = 0.05  # rad, beyond it the robot was pushed, and what it does tells nothing

    def __post_init__(self) -> None:
        require_nonnegative(gain=self.gain, bound=self.bound)
        require_positive(max_tilt=self.max_tilt)
        require_finite(lead_deg=self.lead_deg)
        if not 0.0 <= self.slow < self.fast:
            raise ConfigurationError(f"slow = {self.slow!r} must be below fast = {self.fast!r} (m/s)")


class Centring:
    """Finds where over the feet the trunk has to be, whatever it carries.

    What was found is kept while the robot stands, walks otherwise or goes fast.

    Attributes:
        offset: (2,) m, shift of the trunk in b'.

    Args:
        config: gain and bounds.
    """

    def __init__(self, config: CentringConfig) -> None:
        self._config = config
        self._lead = math.radians(config.lead_deg)
        self.reset()

    def reset(self) -> None:
        """Forget the load."""
        self.offset = np.zeros(2)

    def step(self, tilt: FloatArray, gait: GaitOutput, dt: float) -> None:
        """Take one tick's tilt.

        Args:
            tilt: (2,) rad, estimated roll and pitch less those commanded.
            gait: the gait's phase.
            dt: s.
        """
        config = self._config
        roll, pitch = tilt.tolist()
        # Written so that a tilt that is not a number counts as a push.
        if not (config.enabled and gait.phase.walking and math.hypot(roll, pitch) <= config.max_tilt):
            return
        phase: list[float] = gait.phase.phase.tolist()
        if not is_trot(phase):
            return
        speed = math.hypot(*gait.velocity.tolist())
        gain = config.gain * min(1.0, max(0.0, (config.fast - speed) / (config.fast - config.slow)))
        share = 2.0 * gain * dt * math.cos(2.0 * math.pi * phase[0] + self._lead)
        x, y = self.offset.tolist()
        most = config.bound
        self.offset = np.array(
            [min(max(x - share * roll, -most), most), min(max(y + share * pitch, -most), most)]
        )


def is_trot(phase: list[float]) -> bool:
    """Whether the legs, FL FR RL RR, swing by diagonals.

    Args:
        phase: (4,) share of the cycle since each leg's lift-off.
    """
    fl, fr, rl, rr = phase
    return max(_apart(fl, rr), _apart(fr, rl), _apart(fl, fr + 0.5)) <= _LOCKED


def _apart(one: float, other: float) -> float:
    """Distance of two phases on the circle, 0..0.5."""
    return abs((one - other + 0.5) % 1.0 - 0.5)
