"""Configuration of the trunk-levelling compensator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx import NarxConfig
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range

Source = Literal["zero", "network", "persistence", "model"]
"""Where the disturbance ψ comes from: nowhere, the NARX network, the last measured one, or Pinocchio."""

TUNED = ((0.125, 16000.0, 80.0), (0.25, 11000.0, 160.0), (0.35, 8000.0, 60.0))
"""Share α of the levelling goals, K_b (1/s²), K_d (1/s): as high as they go before legs of a slow trot ring.

Searched on randomised robots with ``benchmarks/tune_leveling.py`` and by hand, for goals that are mixed.
"""


@dataclass(frozen=True, kw_only=True, slots=True)
class AttitudeGains:
    """Angular acceleration that the compensator wants against tilt: K_b θ + K_d dθ/dt.

    Gains left at ``None`` are those of `TUNED` at the share α in force.
    """

    tilt: float | None = None  # K_b of roll and pitch, 1/s²
    tilt_rate: float | None = None  # K_d of roll and pitch, 1/s
    heading: float = 0.0  # K_b of the error to the commanded heading, 1/s²
    heading_rate: float = 0.0  # K_d of it, 1/s

    def __post_init__(self) -> None:
        """Check signs."""
        require_nonnegative(heading=self.heading, heading_rate=self.heading_rate)
        for name in ("tilt", "tilt_rate"):
            value = getattr(self, name)
            if value is not None:
                require_nonnegative(**{name: value})

    def in_force(self, mix: float) -> tuple[float, float]:
        """K_b (1/s²) and K_d (1/s) of roll and pitch for the share α = `mix`."""
        shares, *columns = zip(*TUNED, strict=True)
        tilt, tilt_rate = (float(np.interp(mix, shares, column)) for column in columns)
        return (
            tilt if self.tilt is None else self.tilt,
            tilt_rate if self.tilt_rate is None else self.tilt_rate,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ScheduleConfig:
    """When the compensator acts and when the network learns.

    Windows are counted from the start of the run: off, on, off, on ... With ``on = 0``
    it acts from the start for good.
    """

    start: float = 0.0  # s, when the first off window begins
    off: float = 0.0  # s, length of the off windows
    on: float = 0.0  # s, length of the on windows; 0: for good
    fade: float = 0.2  # s from not acting at all to acting fully, and back
    learn: Literal["off", "always", "never"] = "off"  # in the off windows, in all, or not at all
    learn_time: float = 10.0  # s of walking that a network without loaded weights learns before it acts

    def __post_init__(self) -> None:
        """Check lengths."""
        require_nonnegative(start=self.start, off=self.off, on=self.on, learn_time=self.learn_time)
        require_positive(fade=self.fade)


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelingLimits:
    """What keeps a wrong prediction from throwing the robot."""

    disturbance: float = 150.0  # rad/s², largest angular acceleration that is believed of ψ, each axis
    shift: float = 0.3  # rad, furthest that a goal is moved from the gait's own
    tilt_deg: float = 20.0  # degrees, tilt beyond which it lets go: the robot was pushed or falls
    clamped: float = 0.5  # s in a row with half of the goals at the limit, after which it disengages

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(disturbance=self.disturbance, shift=self.shift, clamped=self.clamped)
        require_range(0.0, 45.0, tilt_deg=self.tilt_deg)


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelingConfig:
    """The compensator's parts, each of which can be chosen on its own.

    With ``attitude = false`` and ``psi = "zero"`` the levelling torque is zero,
    and what is left is the mixing itself: softer servos.
    """

    enabled: bool = False
    mix: float = 0.25  # α, share of the levelling goal in the goal, between 0 and 1
    psi: Source = "network"  # where the disturbance comes from
    attitude: bool = True  # the part with K_b and K_d
    form: Literal["mixed", "residual"] = "mixed"  # as the paper mixes, or added to the goals of a controller
    mass_matrix: Literal["nominal", "model"] = "nominal"  # averaged over a gait, or Pinocchio's M(q)
    gains: AttitudeGains = field(default_factory=AttitudeGains)
    delay_ticks: int = 1  # command periods from command to servo, for servos that do not report their load
    weights: str = ""  # file with the network's weights; empty: it begins untrained
    schedule: ScheduleConfig = field(default_factory=ScheduleConfig)
    limits: LevelingLimits = field(default_factory=LevelingLimits)
    narx: NarxConfig = field(default_factory=NarxConfig)

    @property
    def loads_weights(self) -> bool:
        """Whether a network begins with the weights of a file."""
        return self.enabled and self.psi == "network" and bool(self.weights)

    def __post_init__(self) -> None:
        """Check ranges."""
        if not 0.0 < self.mix < 1.0:
            raise ConfigurationError(
                f"mix = {self.mix!r} must lie between 0 and 1, both excluded: "
                "0 would switch levelling off (--level none), 1 the gait"
            )
        if not 0 <= self.delay_ticks <= 10:
            raise ConfigurationError(f"delay_ticks = {self.delay_ticks!r} must lie in 0..10")
