"""Motion as a list of steps: what a person would say, one after the other.

    steps = Steps().stand(1.0).walk(5.0, forward=0.06).turn(3.0, left=20.0).pose(2.0, pitch=5.0).sit(2.0)

Steps can also name what the robot is to find its own way for:
``Steps().goto(60.0, points=[(1.0, 0.5), (2.0, 0.0)]).wander(30.0).follow(60.0, distance=0.6)``.

A scenario asks ``steps.at(time)``; `bluefoot_mpc.io.station.client` sends the
same steps over the link; ``bluefoot run remote --set scenario.script=...`` reads
them from text, one step a line or parted by semicolons:
``walk 5 forward=0.06; goto 40 points=1,0.5/2,0; sit 2``.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import require_finite, require_positive
from bluefoot_mpc.types import FloatArray, Guide, GuideTask, Mode, MotionCommand, TrunkPose

STEPS = ("stand", "walk", "turn", "pose", "goto", "wander", "follow", "approach", "sit")
_FORMS = {"gait": "NAME", "points": "FORWARD,LEFT/FORWARD,LEFT"}
"""How a value is written in text; numbers where it is not in here."""

REACH = 1000.0
"""m; farther from the start there is no waypoint."""

NEAREST = 0.4
"""m; nearer to the marker the robot keeps off it as off any other thing."""


class Steps:
    """A sequence of commands, each held for a while. Every step returns the sequence again.

    Attributes:
        commands: the commands, in order.
        ends: s, when each of them is over.
    """

    def __init__(self) -> None:
        self.commands: list[MotionCommand] = []
        self.ends: list[float] = []

    @property
    def duration(self) -> float:
        """s, of the whole sequence."""
        return self.ends[-1] if self.ends else 0.0

    def at(self, time: float) -> MotionCommand:
        """The command at `time` (s since the start); the last one holds for ever."""
        for command, end in zip(self.commands, self.ends, strict=True):
            if time < end:
                return command
        return self.commands[-1] if self.commands else MotionCommand()

    def add(self, seconds: float, command: MotionCommand) -> Steps:
        """Any command for some seconds."""
        require_positive(seconds=seconds)
        self.commands.append(command)
        self.ends.append(self.duration + seconds)
        return self

    def stand(self, seconds: float) -> Steps:
        """Stand level."""
        return self.add(seconds, MotionCommand())

    def walk(
        self,
        seconds: float,
        *,
        forward: float = 0.06,
        left: float = 0.0,
        turn: float = 0.0,
        gait: str = "trot",
    ) -> Steps:
        """Walk: m/s forward and to the left, degrees/s to the left, ``"trot"`` or ``"walk"``."""
        require_finite(forward=forward, left=left, turn=turn)
        if gait not in ("trot", "walk"):
            raise UnknownNameError("gait", gait, ("trot", "walk"))
        velocity, rate = np.array([forward, left]), math.radians(turn)
        return self.add(seconds, MotionCommand(mode=Mode.WALK, velocity=velocity, yaw_rate=rate, gait=gait))

    def turn(self, seconds: float, *, left: float = 15.0, gait: str = "trot") -> Steps:
        """Turn on the spot, degrees/s to the left."""
        return self.walk(seconds, forward=0.0, turn=left, gait=gait)

    def pose(
        self, seconds: float, *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0, height: float = 0.0
    ) -> Steps:
        """Stand with the trunk tilted, degrees (right side down, nose down, left), and raised, m."""
        require_finite(roll=roll, pitch=pitch, yaw=yaw, height=height)
        trunk = TrunkPose(position=np.array([0.0, 0.0, height]), rpy=np.radians(np.array([roll, pitch, yaw])))
        return self.add(seconds, MotionCommand(trunk=trunk))

    def goto(
        self, seconds: float, *, points: Sequence[Sequence[float]] | FloatArray, speed: float = 0.1
    ) -> Steps:
        """Go to one point after the other, around what stands in the way; at the last one stand.

        Args:
            seconds: s that it may take; a shorter way does not end the step sooner.
            points: m forward and m to the left of where the run started (odometry frame).
            speed: m/s, at most.
        """
        return self._guided(seconds, Guide(task=GuideTask.GOTO, speed=speed, waypoints=waypoints(points)))

    def wander(self, seconds: float, *, speed: float = 0.15) -> Steps:
        """Walk through what is free, at most so fast (m/s)."""
        return self._guided(seconds, Guide(task=GuideTask.WANDER, speed=speed))

    def follow(self, seconds: float, *, distance: float = 0.6, speed: float = 0.15) -> Steps:
        """Follow the marker at a distance (m), at most so fast (m/s)."""
        return self._guided(seconds, Guide(task=GuideTask.FOLLOW, speed=speed, distance=distance))

    def approach(self, seconds: float, *, distance: float = 0.6, speed: float = 0.15) -> Steps:
        """Look for the marker and stop at a distance (m) from it; at most so fast (m/s)."""
        return self._guided(seconds, Guide(task=GuideTask.APPROACH, speed=speed, distance=distance))

    def sit(self, seconds: float) -> Steps:
        """Sit down, and stay so."""
        return self.add(seconds, MotionCommand(mode=Mode.SIT))

    def _guided(self, seconds: float, guide: Guide) -> Steps:
        require_positive(speed=guide.speed, distance=guide.distance)
        if guide.distance < NEAREST:
            raise ConfigurationError(
                f"distance = {guide.distance:g} must be at least {NEAREST:g} m: nearer to the marker the "
                "robot keeps off it as off any other thing"
            )
        return self.add(seconds, MotionCommand(mode=Mode.WALK, guide=guide))


def waypoints(points: Sequence[Sequence[float]] | FloatArray) -> FloatArray:
    """(n, 2) m of a list of points, forward and left.

    Raises:
        ConfigurationError: there is none, or one is not a pair of numbers within `REACH`.
    """
    try:
        pairs = [(float(forward), float(left)) for forward, left in points]
    except (TypeError, ValueError):
        raise ConfigurationError(
            f"points = {points!r} must be pairs of numbers, m forward and m to the left: "
            "[(1.0, 0.5), (2.0, 0.0)]"
        ) from None
    if not pairs:
        raise ConfigurationError("points is empty: name at least one, m forward and m to the left")
    for number, pair in enumerate(pairs, start=1):
        if not all(abs(value) <= REACH for value in pair):
            raise ConfigurationError(
                f"point {number} is {pair}: both numbers must lie in -{REACH:g}..{REACH:g} m"
            )
    return np.array(pairs)


def read_steps(text: str) -> Steps:
    """The steps of a text, or of the file that it names.

    Raises:
        ConfigurationError: a step cannot be understood, and the message names it; or the file cannot be read.
        UnknownNameError: there is no such step.
    """
    if "\n" not in text and _names_file(text):
        try:
            text = Path(text).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigurationError(f"cannot read the script {text}: {error}") from error
    lines = (line.partition("#")[0].strip() for line in text.replace(";", "\n").splitlines())
    steps = Steps()
    for line in filter(None, lines):
        _step(steps, line)
    if not steps.commands:
        raise ConfigurationError("the script has no steps, for example: walk 5 forward=0.06; sit 2")
    return steps


def _names_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except OSError:  # longer than a name can be
        return False


def _step(steps: Steps, line: str) -> None:
    name, *words = line.split()
    if name not in STEPS:
        raise UnknownNameError("step", name, STEPS)
    method = getattr(steps, name)
    valid = [key for key in inspect.signature(method).parameters if key != "seconds"]
    values: dict[str, float | str | list[list[float]]] = {}
    try:
        seconds = float(words[0])
        for word in words[1:]:
            key, _, value = word.partition("=")
            if key not in valid:
                raise UnknownNameError(f"value of '{name}'", key, valid)
            values[key] = _read_value(key, value)
        if "points" in valid and "points" not in values:
            raise ValueError(line)
    except (ValueError, IndexError):
        form = " ".join((name, "SECONDS", *(f"{key}={_FORMS.get(key, 'NUMBER')}" for key in valid)))
        raise ConfigurationError(f"cannot read the step '{line}'; it has the form: {form}") from None
    try:
        method(seconds, **values)
    except ConfigurationError as error:
        raise ConfigurationError(f"step '{line}': {error}") from error


def _read_value(key: str, text: str) -> float | str | list[list[float]]:
    if key == "gait":
        return text
    if key == "points":
        points = [[float(number) for number in point.split(",")] for point in text.split("/")]
        if any(len(point) != 2 for point in points):
            raise ValueError(text)
        return points
    return float(text)
