"""What a study may vary: settings by name, each with a range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.table import BOUNDS

Values = dict[str, float]
"""Values of a point in the space, by name of the parameter."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Parameter:
    """One number that a study may choose.

    Attributes:
        name: what it is called in tables.
        keys: settings that take its value, e.g. ``control.posture.trunk_height``.
        low: smallest value, in the settings' unit.
        high: largest value.
        step: distance of neighbouring values, counted from `low`; None varies freely.
        listed: True where the settings are lists, which get the value as their one entry.
        log: True where a search looks at ratios: `low` is positive and there is no step.
    """

    name: str
    keys: tuple[str, ...]
    low: float
    high: float
    step: float | None = None
    listed: bool = False
    log: bool = False

    def __post_init__(self) -> None:
        """Check the range."""
        if not self.keys:
            raise ConfigurationError(f"parameter '{self.name}' sets nothing: give it at least one key")
        if not self.low < self.high:
            raise ConfigurationError(
                f"parameter '{self.name}': low = {self.low!r} must be below high = {self.high!r}"
            )
        if self.log and (self.low <= 0.0 or self.step is not None):
            raise ConfigurationError(
                f"parameter '{self.name}': a search by ratios needs low > 0 (it is {self.low!r}) and no step"
            )

    def clipped(self, value: float) -> float:
        """The nearest value inside the range, and on a step."""
        if self.step is not None:
            value = self.low + self.step * round((value - self.low) / self.step)
        return min(self.high, max(self.low, value))


@dataclass(frozen=True, kw_only=True, slots=True)
class Space:
    """Parameters that vary, and settings that every point of the space shares.

    Attributes:
        parameters: what varies.
        fixed: overrides ``section.key=value`` in force for every point.
    """

    parameters: tuple[Parameter, ...]
    fixed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that names are unique."""
        names = self.names
        if not names:
            raise ConfigurationError("a space needs at least one parameter")
        if len(set(names)) < len(names):
            raise ConfigurationError(f"parameters of a space need different names, not {', '.join(names)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return tuple(parameter.name for parameter in self.parameters)

    def checked(self, values: Mapping[str, float]) -> Values:
        """The values inside their ranges, in the order of the parameters.

        Raises:
            UnknownNameError: a name is not one of the parameters.
            ConfigurationError: a parameter has no value.
        """
        for name in values:
            if name not in self.names:
                raise UnknownNameError("parameter", name, self.names)
        missing = [name for name in self.names if name not in values]
        if missing:
            raise ConfigurationError(f"no value for {', '.join(missing)}")
        return {p.name: p.clipped(float(values[p.name])) for p in self.parameters}

    def overrides(self, values: Mapping[str, float]) -> tuple[str, ...]:
        """Settings of a point as overrides for a run, the fixed ones first."""
        point = self.checked(values)
        texts = {p.name: f"[{point[p.name]!r}]" if p.listed else repr(point[p.name]) for p in self.parameters}
        varied = (f"{key}={texts[p.name]}" for p in self.parameters for key in p.keys)
        return (*self.fixed, *varied)


TICK = 0.02
"""s between commands.

A cycle in which every leg's turn takes whole ticks looks the same each time.
Others beat with the ticks: the trunk then tilts at a fraction of the gait's
frequency, up to twice as much.
"""


class _Range(NamedTuple):
    """Range of a column of the gait's table; `turns` (in one cycle) keeps it to whole ticks for each."""

    name: str
    low: float
    high: float
    turns: int = 0


_POSTURE = (
    _Range("stance_x", 0.11, 0.18),
    _Range("stance_y", 0.13, 0.20),
    _Range("trunk_height", 0.085, 0.14),
    _Range("trunk_forward", -0.012, 0.012),
)
_FEED_FORWARD = (
    _Range("level_gain", 0.1, 0.8),
    _Range("mixing", 0.0, 0.9),
    _Range("back_emf", 0.0, 1.0),
)
_SWING = {
    "minimum_jerk": (_Range("ground_matching", -1.0, 1.0), _Range("apex", 0.35, 0.75)),
    "virtual_force": (_Range("swing_rate", 4.0, 14.0),),
}
_VERTICAL = {"minimum_jerk": "quintic", "virtual_force": "sine"}
_TIMING = {
    "trot": (
        _Range("cycle_time", 0.2, 0.52, 2),
        _Range("swing_share", 0.2, 0.5),
        _Range("step_height", 0.010, 0.035),
    ),
    "walk": (
        _Range("cycle_time", 0.72, 2.0, 4),
        _Range("swing_share", 0.12, 0.25),
        _Range("step_height", 0.010, 0.03),
    ),
}


def trot_space(law: str = "virtual_force", *, feed_forward: bool = True) -> Space:
    """Timing, lift, stance and swing shape of a trot at one speed.

    Everything is a column of the gait's table, which gets one knot: what the
    table held before has no effect.

    Args:
        law: how feet swing, ``minimum_jerk`` (lifted by quintics) or ``virtual_force`` (by the oscillator).
        feed_forward: whether levelling and the servos' feed-forward vary too; the paper's laws have none.

    Raises:
        UnknownNameError: there is no such law.
    """
    return _space("trot", law, feed_forward)


def walk_space(law: str = "virtual_force", *, feed_forward: bool = True) -> Space:
    """The same for a walk.

    Args:
        law: as for `trot_space`.
        feed_forward: as for `trot_space`.

    Raises:
        UnknownNameError: there is no such law.
    """
    return _space("walk", law, feed_forward)


def _space(gait: str, law: str, feed_forward: bool) -> Space:
    if law not in _SWING:
        raise UnknownNameError("swing law", law, _SWING)
    table = f"control.gait.{gait}_table"
    ranges = (*_TIMING[gait], *_POSTURE, *_SWING[law], *(_FEED_FORWARD if feed_forward else ()))
    names = {column.name for column in ranges}
    fixed = (
        f"{table}.speed=[0.0]",
        f'{table}.law=["{law}"]',
        f'{table}.vertical=["{_VERTICAL[law]}"]',
        *(f"{table}.{name}=[]" for name in BOUNDS if name not in names),
    )
    parameters = tuple(
        Parameter(
            name=name, keys=(f"{table}.{name}",), low=low, high=high,
            step=turns * TICK if turns else None, listed=True,
        )
        for name, low, high, turns in ranges
    )  # fmt: skip
    return Space(parameters=parameters, fixed=fixed)


SPACES = {"trot": trot_space, "walk": walk_space}
"""Spaces by gait."""
