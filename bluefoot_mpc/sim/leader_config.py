"""Configuration of the leader: which wheeled robot goes ahead, where and how fast."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.wheels.ready import READY

PATHS = ("circle", "figure_of_eight", "line", "stop_and_go")
"""Names of the ways that a leader can go."""

GREATEST_SPEED = 0.30
"""m/s; every kind of leader holds its way up to here."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LeaderConfig:
    """A wheeled robot that carries the marker ahead of the robot, on level floor.

    It begins `distance` in front of the robot, facing away from it. A figure of
    eight goes around to the left, then to the right; `stop_and_go` is one with pauses.
    """

    kind: str = ""  # a ready robot of bluefoot_mpc.wheels; empty: there is no leader
    speed: float = 0.10  # m/s along the way; 0 stays where it is
    path: str = "figure_of_eight"  # figure_of_eight, circle, line or stop_and_go
    distance: float = 0.9  # m from the robot's centre to the leader's at the start
    delay: float = 1.0  # s after the start of the run until it moves
    radius: float = 0.85  # m of the loops; a figure of eight takes 2 by 4 of them
    length: float = 2.0  # m of the line, at whose end it stops
    go: float = 15.0  # s between two pauses of stop_and_go
    pause: float = 8.0  # s of such a pause
    slip: float = 0.01  # standard deviation of the wheels' slip, share of the motion
    gap: float = 0.35  # m; with the robot nearer than this in its course, it waits

    def __post_init__(self) -> None:
        if self.kind and self.kind not in READY:
            raise UnknownNameError("leader", self.kind, READY)
        if self.path not in PATHS:
            raise UnknownNameError("path of the leader", self.path, PATHS)
        if not 0.0 <= self.speed <= GREATEST_SPEED:
            raise ConfigurationError(
                f"the leader's speed = {self.speed!r} m/s must lie in 0..{GREATEST_SPEED:g}:"
                " its wheels turn no faster"
            )
        require_range(0.5, 5.0, distance=self.distance)
        require_range(0.5, 20.0, radius=self.radius)
        require_range(0.0, 600.0, delay=self.delay, pause=self.pause)
        require_range(0.0, 0.1, slip=self.slip)
        require_range(0.0, 2.0, gap=self.gap)
        require_positive(length=self.length, go=self.go)
