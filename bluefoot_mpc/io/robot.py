"""The one interface behind which every robot stands: simulated, emulated, real or replayed."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from bluefoot_mpc.types import JointCommand, SensorFrame


@runtime_checkable
class Robot(Protocol):
    """Four methods; pacing is behind them, one step per command period.

    Attributes:
        period: s, command period.
    """

    period: float

    def reset(self) -> SensorFrame:
        """Bring the robot to its start and return the first frame."""
        ...

    def step(self, command: JointCommand) -> SensorFrame:
        """Send a command, let one command period pass, return the next frame."""
        ...

    def stop(self) -> None:
        """Make the robot limp and safe. Idempotent, never raises."""
        ...

    def close(self) -> None:
        """Give back every resource. Idempotent."""
        ...
