"""A run in memory: what the loop collects and what a log gives back.

A report or a summary takes a `RunData` and need not know whether it comes from
the loop that just ended or from a file (`bluefoot_mpc.runtime.log.RunLog`).
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.runtime.pictures import PictureBook
from bluefoot_mpc.runtime.versions import installed_versions
from bluefoot_mpc.types import (
    FloatArray,
    JointCommand,
    Mode,
    MotionCommand,
    SafetyRequest,
    SensorFrame,
    Telemetry,
    TruthSample,
)

TOPICS: tuple[str, ...] = ("frame", "command", "telemetry", "truth")
COMPLETED = "completed"
"""Stop reason of a run that reached its planned end."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CommandRecord:
    """What went into and came out of the controller on one tick, beside the frame.

    Attributes:
        time: s, time of the frame that the tick used.
        motion: what the operator or the scenario wanted.
        safety: what the supervisor asked for.
        joints: what the controller answered.
    """

    time: float
    motion: MotionCommand
    safety: SafetyRequest
    joints: JointCommand


def happenings(telemetry: Sequence[Telemetry]) -> list[tuple[float, str]]:
    """Time (s) and text of everything that the controller reported, and of its changes of gait."""
    found: list[tuple[float, str]] = []
    gait = ""
    for record in telemetry:
        found += [(record.time, event) for event in record.events]
        walks = record.mode is Mode.WALK
        if walks and gait and record.motion.gait != gait:
            found.append((record.time, f"gait {gait} -> {record.motion.gait}"))
        gait = record.motion.gait if walks else ""
    return found


@dataclass(kw_only=True, slots=True)
class RunData:
    """Everything that one run produced, tick by tick, oldest first.

    ``frames``, ``commands`` and ``telemetry`` have one entry per tick;
    ``truth`` has the simulator's sample at the same instants and is empty where
    there is no simulator. The last tick may lack entries after a stop.

    Attributes:
        frames: sensor frames, as the controller got them.
        commands: commands, inputs and outputs of the controller.
        telemetry: the controller's own account of its ticks; ``tick_us`` in it
            is the wall time of the tick.
        truth: the simulator's truth.
        period: s, command period.
        config: everything resolved, as a nested table. Its table ``run`` says
            what was run: ``scenario, seed, robot, controller``.
        stop_reason: one sentence; ``"completed"`` when the run reached its end.
        real_time_factor: simulated time over wall time; None where unknown.
        versions: of this package and what it ran on.
        pictures: the few of the camera's that are kept; ``frames`` need not hold any.
    """

    frames: list[SensorFrame] = field(default_factory=list)
    commands: list[CommandRecord] = field(default_factory=list)
    telemetry: list[Telemetry] = field(default_factory=list)
    truth: list[TruthSample] = field(default_factory=list)
    period: float = 0.02
    config: dict[str, Any] = field(default_factory=dict)
    stop_reason: str = COMPLETED
    real_time_factor: float | None = None
    versions: dict[str, str] = field(default_factory=installed_versions)
    pictures: PictureBook = field(default_factory=PictureBook, repr=False, compare=False)

    def keep_picture(self, frame: SensorFrame, telemetry: Telemetry) -> None:
        """Keep a tick's picture where it is worth it; to be called on every tick, with a picture or without.

        Args:
            frame: the tick's frame, its picture included.
            telemetry: what the controller made of it.
        """
        self.pictures.keep(frame, telemetry)

    def records(self, topic: str) -> list[Any]:
        """The list of records of a topic, with or without its leading slash.

        Raises:
            UnknownNameError: there is no such topic.
        """
        lists: dict[str, list[Any]] = {
            "frame": self.frames,
            "command": self.commands,
            "telemetry": self.telemetry,
            "truth": self.truth,
        }
        name = topic.removeprefix("/")
        if name not in lists:
            raise UnknownNameError("topic", topic, TOPICS)
        return lists[name]

    def stack(self, topic: str, path: str) -> NDArray[Any]:
        """One field of all records of a topic, as an array with the records along axis 0.

        Args:
            topic: ``"frame"``, ``"command"``, ``"telemetry"`` or ``"truth"``.
            path: a field, or several joined by dots, e.g. ``"estimate.rpy"``.

        Raises:
            UnknownNameError: there is no such topic or field.
            ConfigurationError: the records' values differ in shape (the inertial samples do).
        """
        records = self.records(topic)
        if not records:
            return np.empty(0)
        try:
            values = [operator.attrgetter(path)(record) for record in records]
        except AttributeError as error:
            known = type(records[0]).__dataclass_fields__
            raise UnknownNameError(f"field of /{topic.removeprefix('/')}", path, known) from error
        try:
            return np.array(values)
        except ValueError as error:
            raise ConfigurationError(f"'{path}' differs in shape from record to record") from error

    @property
    def tick_us(self) -> FloatArray:
        """(n,) µs, wall time of each tick."""
        return np.array([record.tick_us for record in self.telemetry], dtype=np.float64)
