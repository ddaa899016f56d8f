"""What the operator's keys and sticks mean: a pure state machine from key presses to motion commands."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand, TrunkPose

GAITS = ("trot", "walk")
HELP = (
    "up/down or W/S  faster, slower, backwards      left/right or Q/E  turn\n"
    "A/D             to the left, to the right      space              stop\n"
    "G               trot or walk                   T                  sit down, stand up\n"
    "I/K J/L U/O     trunk: nose, side, heading     R/F                trunk: higher, lower\n"
    "C               trunk back to level            H                  these lines\n"
    "V               wander on its own, or stop     B                  follow the marker, or stop\n"
    "X               sit down and end"
)

Vector3 = tuple[float, float, float]
_VELOCITY: dict[str, Vector3] = {
    "w": (1, 0, 0), "up": (1, 0, 0), "s": (-1, 0, 0), "down": (-1, 0, 0),
    "a": (0, 1, 0), "d": (0, -1, 0),
    "q": (0, 0, 1), "left": (0, 0, 1), "e": (0, 0, -1), "right": (0, 0, -1),
}  # fmt: skip
"""Steps of (forward, left, turn) by key."""
_TILT: dict[str, Vector3] = {
    "i": (0, 1, 0), "k": (0, -1, 0), "j": (-1, 0, 0), "l": (1, 0, 0), "u": (0, 0, 1), "o": (0, 0, -1),
}  # fmt: skip
"""Steps of (roll, pitch, yaw) by key."""
_HEIGHT = {"r": 1.0, "f": -1.0}
_TASKS = {"v": GuideTask.WANDER, "b": GuideTask.FOLLOW}
"""What the robot does on its own, by key; the same key again ends it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TeleopConfig:
    """Steps and bounds of what an operator can ask for."""

    speed_step: float = 0.01  # m/s a key press
    speed_max: float = 0.10  # m/s forward and backward
    lateral_max: float = 0.04  # m/s
    yaw_rate_step: float = 0.05  # rad/s a key press
    yaw_rate_max: float = 0.30  # rad/s
    tilt_step: float = math.radians(2.0)  # rad a key press
    tilt_max: float = math.radians(10.0)  # rad
    height_step: float = 0.005  # m a key press
    height_max: float = 0.02  # m
    timeout: float = 5.0  # s without a key until the velocity becomes zero
    stand_after: float = 3.0  # s more until the robot only stands
    rest_time: float = 3.0  # s given to sit down at the end
    dead_zone: float = 0.15  # share of a stick's travel without effect

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            require_positive(**{name: getattr(self, name)})


@dataclass(frozen=True, kw_only=True, slots=True)
class TeleopState:
    """What the operator wants now.

    Attributes:
        mode: STAND, WALK or SIT.
        velocity: m/s forward, m/s left, rad/s to the left; set by keys.
        stick: the same from a gamepad's sticks, as shares -1..1 of the bounds.
        gait: name of the gait.
        rpy: rad, offset of the trunk's attitude.
        height: m, offset of the trunk's height.
        guide: what the robot finds its own way for; None while keys and sticks drive.
        last_input: s, when the operator last did something.
        ending: s, when the end was asked for; None while driving.
    """

    mode: Mode = Mode.STAND
    velocity: Vector3 = (0.0, 0.0, 0.0)
    stick: Vector3 = (0.0, 0.0, 0.0)
    gait: str = GAITS[0]
    rpy: Vector3 = (0.0, 0.0, 0.0)
    height: float = 0.0
    guide: Guide | None = None
    last_input: float = 0.0
    ending: float | None = None


@dataclass(frozen=True, slots=True)
class Teleop:
    """The rules: `press` and `tilt_sticks` change the state, `command` reads it. All are pure."""

    config: TeleopConfig = field(default_factory=TeleopConfig)

    def press(self, state: TeleopState, key: str, time: float) -> TeleopState:
        """State after a key press; a key without a meaning still shows that the operator is there.

        Args:
            state: before the press.
            key: a lower-case letter, ``"up"``, ``"down"``, ``"left"``, ``"right"`` or ``"space"``.
            time: s, now.
        """
        if self._is_stopped(state, time):
            # Whoever comes back must not find the robot walking off with the first key.
            state = _stopped(state)
        state = replace(state, last_input=time)
        if state.ending is not None:
            return state
        if key == "x":
            return replace(_stopped(state), mode=Mode.SIT, ending=time)
        if key in _VELOCITY:
            velocity = self._faster(state.velocity, _VELOCITY[key])
            return replace(state, mode=Mode.WALK, velocity=velocity, guide=None)
        if key in _TASKS:
            task = _TASKS[key]
            again = state.guide is not None and state.guide.task is task
            return _stopped(state) if again else self.lead(state, Guide(task=task), time)
        if key in _TILT or key in _HEIGHT:
            return self._pose(state, key)
        return _SWITCHES[key](state) if key in _SWITCHES else state

    def tilt_sticks(self, state: TeleopState, stick: Vector3, time: float) -> TeleopState:
        """State after reading the sticks, each -1..1: forward, left, turn to the left.

        A stick out of its dead zone counts as a living operator; back in it, it stops the robot.
        """
        if state.ending is not None:
            return state
        effect = tuple(self._outside_dead_zone(value) for value in stick)
        x, y, turn = effect
        if any(effect):
            still = (0.0, 0.0, 0.0)
            return replace(
                state, mode=Mode.WALK, velocity=still, stick=(x, y, turn), guide=None, last_input=time
            )
        return replace(_stopped(state), last_input=time) if any(state.stick) else state

    def lead(self, state: TeleopState, guide: Guide | None, time: float) -> TeleopState:
        """State after giving the robot a task, or taking it away; the next key or stick ends it."""
        state = replace(_stopped(state), last_input=time)
        return (
            state
            if guide is None or state.ending is not None
            else replace(state, mode=Mode.WALK, guide=guide)
        )

    def command(self, state: TeleopState, time: float) -> MotionCommand | None:
        """The command at a time: the operator's, what the dead man's handle leaves of it, or None to end."""
        if state.ending is not None and time - state.ending >= self.config.rest_time:
            return None
        idle = time - state.last_input
        mode, (forward, left, turn) = state.mode, self.wanted(state)
        if self._is_stopped(state, time):
            forward = left = turn = 0.0
            if mode is Mode.WALK and idle >= self.config.timeout + self.config.stand_after:
                mode = Mode.STAND
        pose = TrunkPose(position=np.array([0.0, 0.0, state.height]), rpy=np.array(state.rpy))
        velocity = np.array([forward, left])
        return MotionCommand(
            mode=mode, velocity=velocity, yaw_rate=turn, gait=state.gait, trunk=pose, guide=state.guide
        )

    def wanted(self, state: TeleopState) -> Vector3:
        """Wanted m/s forward, m/s left and rad/s, sticks and keys together, within the bounds."""
        bounds = self._bounds()
        x, y, turn = (
            _clipped(v + s * bound, bound)
            for v, s, bound in zip(state.velocity, state.stick, bounds, strict=True)
        )
        return x, y, turn

    def status(self, state: TeleopState, time: float) -> str:
        """One line on what is commanded now."""
        forward, left, turn = self.wanted(state)
        remark = ""
        if state.ending is not None:
            remark = "  sitting down"
        elif state.guide is not None:
            remark = f"  {state.guide.task.value.upper()}: on its own"
        elif state.mode is Mode.WALK and self._is_stopped(state, time):
            forward = left = turn = 0.0
            remark = "  NO KEY: stopped"
        roll, pitch, yaw = (math.degrees(angle) for angle in state.rpy)
        return (
            f"{time:6.1f} s  {state.mode.value:<5} {state.gait:<4}  "
            f"{forward * 1e3:+4.0f} {left * 1e3:+4.0f} mm/s  "
            f"{math.degrees(turn):+5.1f} °/s  trunk {roll:+.0f} {pitch:+.0f} {yaw:+.0f}° "
            f"{state.height * 1e3:+.0f} mm{remark}"
        )

    def _is_stopped(self, state: TeleopState, time: float) -> bool:
        """True when the dead man's handle has acted: nobody gave a sign for too long.

        A robot that finds its own way needs no hand at the handle.
        """
        return state.guide is None and time - state.last_input >= self.config.timeout

    def _faster(self, velocity: Vector3, step: Vector3) -> Vector3:
        sizes = (self.config.speed_step, self.config.speed_step, self.config.yaw_rate_step)
        # Rounded, so that as many presses back lead to exactly zero.
        x, y, turn = (
            round(_clipped(v + s * size, bound), 9)
            for v, s, size, bound in zip(velocity, step, sizes, self._bounds(), strict=True)
        )
        return x, y, turn

    def _pose(self, state: TeleopState, key: str) -> TeleopState:
        if key in _HEIGHT:
            height = state.height + _HEIGHT[key] * self.config.height_step
            return replace(state, height=round(_clipped(height, self.config.height_max), 9))
        roll, pitch, yaw = (
            round(_clipped(angle + s * self.config.tilt_step, self.config.tilt_max), 9)
            for angle, s in zip(state.rpy, _TILT[key], strict=True)
        )
        return replace(state, rpy=(roll, pitch, yaw))

    def _bounds(self) -> Vector3:
        return self.config.speed_max, self.config.lateral_max, self.config.yaw_rate_max

    def _outside_dead_zone(self, value: float) -> float:
        zone = self.config.dead_zone
        size = min(max(abs(value) - zone, 0.0) / (1.0 - zone), 1.0)
        return math.copysign(size, value) if size else 0.0


def _stopped(state: TeleopState) -> TeleopState:
    mode = Mode.STAND if state.mode is Mode.WALK else state.mode
    return replace(state, mode=mode, velocity=(0.0, 0.0, 0.0), stick=(0.0, 0.0, 0.0), guide=None)


def _other_gait(state: TeleopState) -> TeleopState:
    return replace(state, gait=GAITS[(GAITS.index(state.gait) + 1) % len(GAITS)])


def _sit_or_stand(state: TeleopState) -> TeleopState:
    return replace(_stopped(state), mode=Mode.STAND if state.mode is Mode.SIT else Mode.SIT)


def _level(state: TeleopState) -> TeleopState:
    return replace(state, rpy=(0.0, 0.0, 0.0), height=0.0)


_SWITCHES = {"space": _stopped, "g": _other_gait, "t": _sit_or_stand, "c": _level}
"""Keys that set something, whatever it was."""


def _clipped(value: float, bound: float) -> float:
    return max(-bound, min(bound, value))
