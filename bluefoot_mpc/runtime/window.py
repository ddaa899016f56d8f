"""The stretch of a run that its figures are measured on."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import CommandRecord, RunData
from bluefoot_mpc.types import BoolArray, FloatArray, Guide, Mode, MotionCommand, Telemetry, TruthSample

SETTLING = 2.0
"""s after the last change of command before measuring starts."""
_MIN_TICKS = 3
_TIME_TOLERANCE = 1e-6


def measurement_window(run: RunData) -> tuple[float, float]:
    """Start and end (s, time of the frames): from 2 s after the last change of command to the end.

    Start lies behind the end where the command changes until too late. The
    coming to rest at the end of a run does not count.
    """
    commands = wanted_commands(run)
    if not commands:
        return 0.0, 0.0
    changed = commands[0].time
    for before, now in itertools.pairwise(commands):
        if not same_motion(before.motion, now.motion):
            changed = now.time
    return changed + SETTLING, commands[-1].time


def wanted_commands(run: RunData) -> Sequence[CommandRecord]:
    """What was commanded, without the order to rest at the end."""
    end = len(run.commands)
    while end and run.commands[end - 1].motion.mode is Mode.OFF:
        end -= 1
    return run.commands[:end] or run.commands


def same_motion(a: MotionCommand, b: MotionCommand) -> bool:
    """True when two commands ask for the same."""
    if a is b:
        return True
    return (
        (a.mode, a.yaw_rate, a.gait) == (b.mode, b.yaw_rate, b.gait)
        and np.array_equal(a.velocity, b.velocity)
        and np.array_equal(a.trunk.position, b.trunk.position)
        and np.array_equal(a.trunk.rpy, b.trunk.rpy)
        and _same_task(a.guide, b.guide)
    )


def _same_task(a: Guide | None, b: Guide | None) -> bool:
    if a is None or b is None:
        return a is b
    same = (a.task, a.speed, a.distance) == (b.task, b.speed, b.distance)
    return same and np.array_equal(a.waypoints, b.waypoints)


@dataclass(frozen=True, kw_only=True, slots=True)
class Window:
    """Arrays of the ticks inside a window, n of them, with truth.

    Attributes:
        samples: n truth samples.
        time: (n,) s.
        position: (n, 3) m, trunk origin in world.
        quaternion: (n, 4) x, y, z, w.
        estimated_quaternion: (n, 4) x, y, z, w.
        wanted_roll_pitch: (n, 2) rad, as commanded.
        heading: (n,) rad, commanded heading in world: the true one at the
            start of the run plus the yaw rate in force since then.
        direction: rad, of the commanded velocity from the heading, left positive.
        yaw_rate_wanted: rad/s, at the window's end.
        foot_position: (n, 4, 3) m, in world.
        foot_height: (n, 4) m, above the ground under the foot.
        swing: (n, 4) scheduled swing.
        y2: (n, 4) second oscillator states, positive in swing.
        planned_zmp: (n, 2) m, in b'; NaN without one.
        reference_foot: (n, 4, 3) m, wanted feet in b'.
        reference_swing: (n, 4) True where those swing.
    """

    samples: Sequence[TruthSample]
    time: FloatArray
    position: FloatArray
    quaternion: FloatArray
    estimated_quaternion: FloatArray
    wanted_roll_pitch: FloatArray
    heading: FloatArray
    direction: float
    yaw_rate_wanted: float
    foot_position: FloatArray
    foot_height: FloatArray
    swing: BoolArray
    y2: FloatArray
    planned_zmp: FloatArray
    reference_foot: FloatArray
    reference_swing: BoolArray

    @property
    def length(self) -> float:
        """s, from the first tick to the last."""
        return float(self.time[-1] - self.time[0])

    def truth(self, name: str) -> FloatArray:
        """A field of the truth samples, the n ticks along axis 0."""
        return np.array([getattr(sample, name) for sample in self.samples], dtype=np.float64)


def cut_window(run: RunData, start: float, end: float) -> Window | None:
    """The ticks of a run between two times (s), None where there are too few or no truth."""
    ticks = min(len(run.truth), len(run.telemetry), len(run.commands))
    time = np.array([sample.time for sample in run.truth[:ticks]])
    # The truth of an emulator in a process of its own may come late, and then stand beside two ticks.
    is_new = np.diff(time, prepend=-np.inf) > 0.0
    span = np.flatnonzero(is_new & (time >= start - _TIME_TOLERANCE) & (time <= end + _TIME_TOLERANCE))
    if len(span) < _MIN_TICKS:
        return None
    telemetry, commands = [run.telemetry[k] for k in span], [run.commands[k] for k in span]
    samples = [run.truth[k] for k in span]
    q = _stack(samples, lambda s: s.q)
    return Window(
        samples=samples,
        time=time[span],
        position=q[:, :3],
        quaternion=q[:, 3:7],
        estimated_quaternion=_stack(telemetry, lambda t: t.estimate.quaternion),
        wanted_roll_pitch=np.array(list(map(_wanted_roll_pitch, commands, telemetry))),
        heading=_commanded_heading(run.telemetry[:ticks], run.truth[0], time)[span],
        direction=_direction(commands[-1]),
        yaw_rate_wanted=float(commands[-1].motion.yaw_rate),
        foot_position=_stack(samples, lambda s: s.foot_position),
        foot_height=_stack(samples, lambda s: s.foot_height),
        swing=np.array([t.phase.swing for t in telemetry], dtype=np.bool_),
        y2=np.array([t.phase.y2 for t in telemetry]),
        planned_zmp=_stack(telemetry, lambda t: t.zmp),
        reference_foot=_stack(telemetry, lambda t: t.reference.foot_position),
        reference_swing=np.array([t.reference.swing for t in telemetry], dtype=np.bool_),
    )


def _wanted_roll_pitch(command: CommandRecord, telemetry: Telemetry) -> FloatArray:
    """(2,) rad, as commanded, by navigation where it leads."""
    motion = command.motion if command.motion.guide is None else telemetry.motion
    return motion.trunk.rpy[:2]


def _stack(records: Sequence[Any], get: Any) -> FloatArray:
    return np.array([get(record) for record in records], dtype=np.float64)


def _commanded_heading(telemetry: Sequence[Telemetry], first: TruthSample, time: FloatArray) -> FloatArray:
    rate = np.array([record.motion.yaw_rate for record in telemetry])
    return metrics.integrate(rate, time, float(metrics.yaw(first.q[None, 3:7])[0]))


def _direction(command: CommandRecord) -> float:
    forward, left = command.motion.velocity
    return math.atan2(left, forward) if forward or left else 0.0
