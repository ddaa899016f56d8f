"""What a study may vary: settings by name, each with a range."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

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
    """

    name: str
    keys: tuple[str, ...]
    low: float
    high: float
    step: float | None = None

    def __post_init__(self) -> None:
        """Check the range."""
        if not self.keys:
            raise ConfigurationError(f"parameter '{self.name}' sets nothing: give it at least one key")
        if not self.low < self.high:
            raise ConfigurationError(
                f"parameter '{self.name}': low = {self.low!r} must be below high = {self.high!r}"
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
        varied = (f"{key}={point[p.name]!r}" for p in self.parameters for key in p.keys)
        return (*self.fixed, *varied)


TICK = 0.02
"""s between commands.

A cycle in which every leg's turn takes whole ticks looks the same each time.
Others beat with the ticks: the trunk then tilts at a fraction of the gait's
frequency, up to twice as much.
"""


def _cycle(gait: str, low: float, high: float, turns: int) -> Parameter:
    keys = tuple(f"control.gait.{gait}.cycle_{bound}" for bound in ("min", "max"))
    return Parameter(name="cycle_time", keys=keys, low=low, high=high, step=turns * TICK)


def _gait(gait: str, name: str, low: float, high: float, key: str) -> Parameter:
    return Parameter(name=name, keys=(f"control.gait.{gait}.{key}",), low=low, high=high)


def _control(name: str, low: float, high: float, key: str) -> Parameter:
    return Parameter(name=name, keys=(f"control.{key}",), low=low, high=high)


_POSTURE = (
    _control("trunk_height", 0.085, 0.14, "posture.trunk_height"),
    _control("stance_x", 0.11, 0.18, "posture.stance_x"),
    _control("stance_y", 0.13, 0.20, "posture.stance_y"),
    _control("trunk_forward", -0.012, 0.012, "posture.trunk_forward"),
)
_FEED_FORWARD = (
    _control("level_gain", 0.1, 0.8, "posture.level_gain"),
    _control("mixing", 0.0, 0.8, "servo.mixing"),
    _control("back_emf", 0.0, 1.0, "servo.back_emf"),
)
_SWING = {
    "minimum_jerk": (
        _control("ground_matching", -1.0, 1.0, "gait.foothold.ground_matching"),
        _control("apex", 0.35, 0.75, "gait.foothold.apex"),
    ),
    "virtual_force": (_control("swing_rate", 4.0, 14.0, "gait.foothold.swing_rate"),),
}
_VERTICAL = {"minimum_jerk": "quintic", "virtual_force": "sine"}


def trot_space(law: str = "virtual_force", *, feed_forward: bool = True) -> Space:
    """Timing, lift, stance and swing shape of a trot at one speed.

    Parameters that the gait's table knows have the name of its column.

    Args:
        law: how feet swing, ``minimum_jerk`` (lifted by quintics) or ``virtual_force`` (by the oscillator).
        feed_forward: whether levelling and the servos' feed-forward vary too; the paper's laws have none.

    Raises:
        UnknownNameError: there is no such law.
    """
    timing = (
        _cycle("trot", 0.2, 0.52, 2),
        _gait("trot", "swing_share", 0.2, 0.5, "swing_share"),
        _gait("trot", "step_height", 0.010, 0.035, "height_min"),
    )
    return _space("trot", law, timing, feed_forward)


def walk_space(law: str = "virtual_force", *, feed_forward: bool = True) -> Space:
    """Timing, lift, stance and sway of a walk at one speed.

    Args:
        law: as for `trot_space`.
        feed_forward: as for `trot_space`.

    Raises:
        UnknownNameError: there is no such law.
    """
    timing = (
        _cycle("walk", 0.72, 2.0, 4),
        _gait("walk", "swing_share", 0.12, 0.25, "swing_share"),
        _gait("walk", "step_height", 0.012, 0.03, "height_min"),
        _control("zmp_lead", 0.05, 0.4, "zmp.lead"),
        _control("zmp_gain", 1.0, 8.0, "zmp.gain"),
        _control("zmp_offset", 0.01, 0.04, "zmp.max_offset"),
    )
    return _space("walk", law, timing, feed_forward)


def _space(gait: str, law: str, timing: tuple[Parameter, ...], feed_forward: bool) -> Space:
    if law not in _SWING:
        raise UnknownNameError("swing law", law, _SWING)
    fixed = (
        f"control.gait.foothold.law={law}",
        f"control.gait.foothold.vertical={_VERTICAL[law]}",
        f"control.gait.{gait}.height_v=0.0",
    )
    more = _FEED_FORWARD if feed_forward else ()
    return Space(parameters=(*timing, *_POSTURE, *_SWING[law], *more), fixed=fixed)


SPACES = {"trot": trot_space, "walk": walk_space}
"""Spaces by gait."""
