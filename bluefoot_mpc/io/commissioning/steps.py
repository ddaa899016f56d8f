"""What was measured when a servo stepped: goals, and where the shaft was when."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class StepPlan:
    """Which steps to make.

    Every amplitude is stepped up and back again, then down and back, from one
    middle. Large ones saturate the motor and show its inertia and back-EMF,
    small ones its stiffness, friction and punch.
    """

    amplitudes_deg: tuple[float, ...] = (2.0, 4.0, 8.0, 16.0, 32.0)  # degrees
    repeats: int = 1  # times the whole pattern
    duration: float = 0.45  # s of recording after each step
    torque_limit: float = 1.0  # share of full duty
    middle: int = 512  # counts, where the pattern starts and ends
    slope: int = 32  # register 28 and 29 while recording
    margin: int = 1  # register 26 and 27
    punch: int = 32  # register 48

    def __post_init__(self) -> None:
        if not self.amplitudes_deg:
            raise ConfigurationError("amplitudes_deg must name at least one amplitude")
        for amplitude in self.amplitudes_deg:
            require_range(1.0, 60.0, amplitudes_deg=amplitude)
        require_range(1, 100, repeats=self.repeats)
        require_range(0.2, 5.0, duration=self.duration)
        require_range(0.1, 1.0, torque_limit=self.torque_limit)
        require_positive(slope=self.slope)
        room = max(self.amplitudes_deg) * 1023.0 / 300.0 + 20.0
        require_range(room, 1023.0 - room, middle=self.middle)

    def goals(self) -> tuple[int, ...]:
        """Goals in counts, one after the other, from `middle` back to `middle`."""
        goals: list[int] = []
        for amplitude in self.amplitudes_deg * self.repeats:
            step = round(amplitude * 1023.0 / 300.0)
            goals += [self.middle + step, self.middle, self.middle - step, self.middle]
        return tuple(goals)


@dataclass(frozen=True, kw_only=True, slots=True)
class StepRecord:
    """One step of one servo.

    Attributes:
        servo: its ID.
        start: counts, where it rested; mean of the readings before the step.
        goal: counts.
        time: (n,) s since the goal was sent, at which the servo read its shaft.
        position: (n,) counts.
        voltage: V, mean while it moved.
        torque_limit: share of full duty.
        slope: counts at full duty (compliance slope) that the servo was set to.
        margin: counts without reaction.
        punch: 0..1023.
    """

    servo: int
    start: float
    goal: int
    time: FloatArray
    position: FloatArray
    voltage: float
    torque_limit: float = 1.0
    slope: float = 32.0
    margin: float = 1.0
    punch: float = 32.0
