"""Lowering the body without a controller: goals to the sitting posture at limited speed, then torque away.

Pure, for the supervisor and for the guard below it alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import N_JOINTS, FloatArray, JointCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class SinkConfig:
    """How fast the body is lowered when nobody controls it."""

    speed: float = 0.8  # rad/s of the joint with the longest way
    limp_time: float = 0.5  # s, torque from all to none, seated
    blind_time: float = 1.0  # s, the same where the sitting posture is not known

    def __post_init__(self) -> None:
        require_positive(speed=self.speed, limp_time=self.limp_time, blind_time=self.blind_time)


@dataclass(frozen=True, kw_only=True, slots=True)
class Sink:
    """Where a robot that is being lowered stands.

    Attributes:
        goal: (16,) rad, goals of the servos.
        torque: (16,) torque limits, 0..1, as they were when sinking began.
        share: of these limits that is left, 0..1.
    """

    goal: FloatArray
    torque: FloatArray
    share: float = 1.0

    @property
    def limp(self) -> bool:
        """True at the end: no torque is left."""
        return self.share <= 0.0

    def command(self) -> JointCommand:
        """What the servos are told now."""
        return JointCommand(
            position=self.goal, speed=np.zeros(N_JOINTS), torque_limit=self.share * self.torque
        )


def advance(sink: Sink, sit: FloatArray | None, dt: float, config: SinkConfig) -> Sink:
    """The next goals and limits: all joints arrive together, then torque fades.

    Args:
        sink: where it stands.
        sit: (16,) rad, the sitting posture; None where it is not known, then torque fades at once.
        dt: s.
        config: speeds.
    """
    if sink.limp:
        return sink
    if sit is None:
        return Sink(goal=sink.goal, torque=sink.torque, share=max(0.0, sink.share - dt / config.blind_time))
    way = sit - sink.goal
    longest = float(np.abs(way).max())
    if longest > 1e-9:
        goal = sink.goal + way * min(1.0, config.speed * dt / longest)
        return Sink(goal=goal, torque=sink.torque, share=sink.share)
    return Sink(goal=sit, torque=sink.torque, share=max(0.0, sink.share - dt / config.limp_time))
