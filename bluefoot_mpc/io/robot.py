"""The one interface behind which every robot stands: simulated, emulated, real or replayed."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from bluefoot_mpc.io.findings import Finding
from bluefoot_mpc.types import FloatArray, JointCommand, SensorFrame


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


@runtime_checkable
class PoweredRobot(Robot, Protocol):
    """A robot whose servos must be armed: emulated or real. It starts limp, and so it ends.

    `reset` connects and returns a frame, torque off. `stop` is the emergency
    stop: torque off and power cut at once, from any thread, at any time; after
    it a latch below the bus refuses every write that could move a servo until
    `arm`.
    """

    def preflight(self) -> tuple[Finding, ...]:
        """Check everything that must hold before torque; writes nothing."""
        ...

    def arm(self, torque_limit: float) -> SensorFrame:
        """Hold the present position with a low torque limit.

        Args:
            torque_limit: fraction of stall torque, the same for all servos.

        Raises:
            NotArmedError: a servo refused; every torque is off again.
        """
        ...

    def watch_over(self, sit: FloatArray) -> None:
        """Tell where to sink to by itself when no commands come: (16,) rad, joints of the sitting posture."""
        ...

    def disarm(self) -> None:
        """End of a controlled stop: torque off three times, verified, power cut, latch set. Never raises."""
        ...
