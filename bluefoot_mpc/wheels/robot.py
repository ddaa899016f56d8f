"""A robot on wheels: any set of them, and which steer together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.wheel import Wheel


@dataclass(frozen=True, kw_only=True, slots=True)
class WheeledRobot:
    """Wheels under one rigid chassis.

    Attributes:
        name: for messages and pictures.
        wheels: at least one; every (n,) array of the package is in their order.
        linked: groups of steered wheels, by index, that one mechanism turns so that all
            axes meet in a point (Ackermann steering); a group counts as one steered wheel.
        steering_limit: rad, largest turn of a steered wheel to either side; of linked
            ones, that of the one wheel in their middle for which they stand.
    """

    name: str
    wheels: tuple[Wheel, ...]
    linked: tuple[tuple[int, ...], ...] = ()
    steering_limit: float = math.pi / 2.0

    def __post_init__(self) -> None:
        if not self.wheels:
            raise ConfigurationError(f"robot '{self.name}' has no wheels: give at least one")
        require_positive(steering_limit=self.steering_limit)
        if any(len(group) < 2 for group in self.linked):
            raise ConfigurationError(f"robot '{self.name}': a linked group needs two wheels or more")
        members = list(chain.from_iterable(self.linked))
        if len(set(members)) != len(members):
            raise ConfigurationError(f"robot '{self.name}': a wheel stands in more than one linked group")
        for index in members:
            if not 0 <= index < len(self.wheels) or self.wheels[index].kind != "steered":
                raise ConfigurationError(
                    f"robot '{self.name}': linked wheel {index} is not one of its steered wheels "
                    f"{list(self.indices('steered'))}"
                )

    def indices(self, *kinds: str) -> tuple[int, ...]:
        """Indices of the wheels of these kinds, in order."""
        return tuple(i for i, wheel in enumerate(self.wheels) if wheel.kind in kinds)

    @property
    def size(self) -> float:
        """Characteristic length: the largest distance of a wheel from P (m), 1 where all are 0.

        Forward speeds and this length times yaw rates can be compared.
        """
        return max(wheel.length for wheel in self.wheels) or 1.0

    def checked_steering(self, steering: FloatArray | None) -> FloatArray:
        """(n,) rad, the steering angles given, or zeros for None.

        Raises:
            ConfigurationError: another number of angles than wheels, one is not finite,
                or one is not zero for a wheel that does not turn.
        """
        if steering is None:
            return np.zeros(len(self.wheels))
        angles = checked(steering, len(self.wheels), f"steering of robot '{self.name}'", "rad for each wheel")
        for wheel, angle in zip(self.wheels, angles, strict=True):
            if angle != 0.0 and not wheel.turns:
                raise ConfigurationError(
                    f"robot '{self.name}': a {wheel.kind} wheel cannot be steered: give 0 for it"
                )
        return angles


def checked(values: FloatArray, count: int, what: str, unit: str) -> FloatArray:
    """(count,) the numbers as an array.

    Raises:
        ConfigurationError: another number of them, or one is not finite.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count,):
        raise ConfigurationError(f"{what}: {count} numbers wanted ({unit}), not shape {array.shape}")
    if not np.isfinite(array).all():
        raise ConfigurationError(f"{what}: {array.tolist()} has a number that is not finite ({unit})")
    return array
