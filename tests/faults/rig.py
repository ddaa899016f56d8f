"""A whole robot out of emulated devices in this process, with faults, and what it did.

Everything is the real thing but the servos, the board, the LIDAR and the world:
drivers, supervisor, controller and loop are those of ``bluefoot run --robot
emulator``. Time is virtual, so every figure is exact and the same on any machine.
Times are seconds on that clock; the robot is armed at about 1.4 s and trots from
`WALKING` on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.control.pipeline import ControlOutput, Pipeline
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.findings import NotArmedError
from bluefoot_mpc.io.safety import SafetySupervisor
from bluefoot_mpc.io.safety.states import SafetyState
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.loop import LoopHooks, run_loop
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.emulated import EmulatedRobot, make_emulated
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import sitting, supervise
from bluefoot_mpc.types import Mode, MotionCommand, SensorFrame

WALKING = 3.4
"""s from which on a robot that was told to walk at once trots at its speed."""
SPEED = 0.06
"""m/s."""
PERIOD = 0.020
"""s, of commands."""
SLOWEST = 1.0 / 45.0
"""s that a period may take: 45 Hz at least."""
_SYNC_WRITE, _REG_WRITE, _WRITE = 0x83, 4, 3
_GOAL, _ENABLE = 30, 24
_BYTE = 1e-5
"""s of a byte on the servos' line."""
_AFTER = 0.3
"""s for which the devices live on after the run, so that what was sent last takes effect."""

Action = Callable[["Rig"], None]


class LineWatch:
    """What a servo line is told that could move a servo, read from the bytes themselves.

    Attributes:
        goals: s, beginning of each packet that writes goals.
        enables: s, beginning of each packet that enables torque.
        counts: goals of each sync write: s, and counts by servo ID.
    """

    def __init__(self, parts: EmulatedRobot) -> None:
        self.goals: list[float] = []
        self.enables: list[float] = []
        self.counts: list[tuple[float, dict[int, int]]] = []
        line = parts.lines[0]
        receive = line.receive

        def watched(data: bytes, time: float) -> None:
            self._look(data, time)
            receive(data, time)

        line.receive = watched  # type: ignore[method-assign]

    def _look(self, data: bytes, time: float) -> None:
        if len(data) < 8 or data[:2] != b"\xff\xff":
            return
        instruction, address = data[4], data[5]
        time -= len(data) * _BYTE
        if instruction in (_WRITE, _REG_WRITE):
            end, values = address + len(data) - 7, data[6:-1]
        elif instruction == _SYNC_WRITE:
            end, values = address + data[6], data[8:]
        else:
            return
        if address <= _GOAL + 1 and end > _GOAL:
            self.goals.append(time)
            if instruction == _SYNC_WRITE:
                width = data[6] + 1
                each = (data[at : at + width] for at in range(7, len(data) - 1, width))
                at = 1 + _GOAL - address
                self.counts.append((time, {part[0]: part[at] | part[at + 1] << 8 for part in each}))
        if address <= _ENABLE < end and values[_ENABLE - address]:
            self.enables.append(time)


class ShaftWatch:
    """When which joint got torque and lost it, from what the motors are really told."""

    def __init__(self, parts: EmulatedRobot) -> None:
        self.on = [False] * 16
        self.changes: list[tuple[float, int, bool]] = []
        plant = parts.plant
        drive = plant.drive

        def watched(index: int, wanted: Any) -> None:
            has_torque = wanted.enabled and wanted.torque_limit > 0
            if has_torque is not self.on[index]:
                self.on[index] = has_torque
                self.changes.append((plant.data.time, index, has_torque))
            drive(index, wanted)

        plant.drive = watched  # type: ignore[method-assign]

    def limp_at(self, after: float = 0.0) -> float:
        """s at which the last joint lost its torque; infinity while one has it."""
        if any(self.on):
            return math.inf
        return max((time for time, _, on in self.changes if not on), default=after)

    def back_on(self, joint: int, after: float) -> list[float]:
        """s at which a joint got its torque back."""
        return [time for time, index, on in self.changes if index == joint and on and time > after]


@dataclass(kw_only=True)
class Plan:
    """What a run is to be.

    Attributes:
        faults: entries of a fault plan.
        seed: of what is drawn in it.
        end: s, when the run ends.
        actions: what is done to the robot, and when (s), between two ticks of the loop.
        cuts_in: what is done at the very instant (s), in the middle of whatever is going on.
        command: wanted motion at a time (s).
        spoil: what becomes of the controller's output.
        rests: the run ends sitting and switched off.
        lidar: the robot has one.
        after: what is done after the loop's end, before the ports are given back.
    """

    faults: Iterable[Mapping[str, Any]] = ()
    seed: int = 0
    end: float = 5.0
    actions: dict[float, Action] = field(default_factory=dict)
    cuts_in: dict[float, Action] = field(default_factory=dict)
    command: Callable[[float], MotionCommand] | None = None
    spoil: Callable[[float, ControlOutput], ControlOutput] | None = None
    rests: bool = False
    lidar: bool = False
    after: Action | None = None


class Rig:
    """A robot with faults, before its run and after it.

    Attributes:
        parts: the emulated devices.
        supervisor: the safety supervisor.
        data: the run; empty where the robot was not armed.
        refusal: why it was not armed.
        states: when the supervisor took which state.
        reasons: what it said.
        ended: s, when the loop ended.
    """

    def __init__(self, plan: Plan, folder: Path) -> None:
        self.plan = plan
        resolved = _resolved(plan, folder)
        self.model = RobotModel(resolved.parameters)
        self.pipeline = Pipeline(self.model, resolved.stages.control, PERIOD)
        self.on = make_emulated(resolved, self.model, sitting(self.pipeline, self.model), paced=False)
        self.parts: EmulatedRobot = self.on.parts
        self.line, self.shafts = LineWatch(self.parts), ShaftWatch(self.parts)
        self.supervisor: SafetySupervisor = supervise(self.on.robot, self.model, resolved)
        self.supervisor.watch_over(self.pipeline.sitting_joints)
        self.data = RunData(period=PERIOD, config={})
        self.refusal: NotArmedError | None = None
        self.states: list[tuple[float, SafetyState]] = []
        self.reasons: list[str] = []
        self.ended = math.inf
        self._ahead = sorted(plan.actions.items(), key=lambda item: item[0])
        self._cut_in(sorted(plan.cuts_in.items(), key=lambda item: item[0]))

    # -- the run ----------------------------------------------------------------

    def run(self) -> Rig:
        """Arm, walk and end; the devices live on for a while."""
        hooks = LoopHooks(truth=self.on.truth, observers=(self._observe,), rests=self.plan.rests)
        try:
            self.data = run_loop(self.supervisor, self, self._source, hooks, {})
        except NotArmedError as error:
            self.refusal = error
        finally:
            self.ended = self.now
            self.note_state()
            if self.plan.after is not None:
                self.plan.after(self)
            self.on.robot.close()
        self.parts.board.advance(self.now + _AFTER)
        return self

    @property
    def now(self) -> float:
        """s on the run's clock."""
        clock: VirtualClock = self.on.robot._clock  # type: ignore[attr-defined]
        return clock.now()

    def reset(self) -> None:
        """Of the controller."""
        self.pipeline.reset()

    def step(self, frame: SensorFrame, motion: MotionCommand, safety: Any) -> ControlOutput:
        """Of the controller, with what is to go wrong in it."""
        if self.plan.command is not None and motion.mode is not Mode.OFF:
            motion = self.plan.command(frame.time)
        output = self.pipeline.step(frame, motion, safety)
        return output if self.plan.spoil is None else self.plan.spoil(frame.time, output)

    def _cut_in(self, ahead: list[tuple[float, Action]]) -> None:
        clock: VirtualClock = self.on.robot._clock  # type: ignore[attr-defined]
        sleep_until = clock.sleep_until

        def watched(when: float) -> None:
            while ahead and ahead[0][0] <= when:
                sleep_until(ahead[0][0])
                ahead.pop(0)[1](self)
            sleep_until(when)

        if ahead:
            clock.sleep_until = watched  # type: ignore[method-assign]

    def _source(self, _: float) -> MotionCommand | None:
        if self.now >= self.plan.end:
            return None
        return MotionCommand(mode=Mode.WALK, velocity=np.array([SPEED, 0.0]))

    def _observe(self, frame: SensorFrame, *_: Any) -> None:
        self.note_state()
        while self._ahead and self._ahead[0][0] <= frame.time:
            self._ahead.pop(0)[1](self)

    def note_state(self) -> None:
        """Keep what the supervisor thinks and says."""
        state = self.supervisor.state
        if not self.states or self.states[-1][1] is not state:
            self.states.append((self.now, state))
        for reason in (*self.supervisor.request.reasons, *self.supervisor.warnings):
            if reason not in self.reasons:
                self.reasons.append(reason)

    # -- what came of it ----------------------------------------------------------

    @property
    def times(self) -> np.ndarray:
        """(n,) s, of the frames."""
        return np.array([frame.time for frame in self.data.frames])

    def modes(self, start: float = 0.0, end: float = math.inf) -> list[Mode]:
        """The controller's modes from `start` to `end` (s)."""
        return [t.mode for t in self.data.telemetry if start <= t.time < end]

    def first(self, mode: Mode, after: float = 0.0) -> float:
        """s at which the controller took a mode; infinity where it never did."""
        taken = (t.time for t in self.data.telemetry if t.mode is mode and t.time >= after)
        return min(taken, default=math.inf)

    def state_at(self, state: SafetyState, after: float = 0.0) -> float:
        """s at which the supervisor took a state; infinity where it never did."""
        taken = (time for time, name in self.states if name is state and time >= after)
        return min(taken, default=math.inf)

    @property
    def fell(self) -> bool:
        """Whether it fell as a summary defines it: a link above the feet touched the ground, or 45°."""
        stood = self.first(Mode.WALK)
        touched = any(sample.touching for sample in self.data.truth if stood < sample.time < self.plan.end)
        return touched or self.tilt_deg() > 45.0

    def tilt_deg(self, start: float = 0.0, end: float = math.inf) -> float:
        """The largest true tilt from `start` to `end` (s)."""
        upright = (1.0 - 2.0 * (s.q[3] ** 2 + s.q[4] ** 2) for s in self.data.truth if start <= s.time < end)
        return max(math.degrees(math.acos(min(1.0, cosine))) for cosine in upright)

    def height(self, time: float) -> float:
        """m, the trunk's true height at a time (s)."""
        return float([s.q[2] for s in self.data.truth if s.time <= time][-1])

    def sinking_speed(self, start: float) -> float:
        """m/s, the fastest that the trunk went down from `start` (s) on."""
        inside = [(s.time, s.q[2]) for s in self.data.truth if s.time >= start]
        times, heights = np.array(inside).T
        return float(-np.min(np.diff(heights) / np.diff(times)))

    def way(self, start: float, end: float) -> float:
        """m forward from `start` to `end` (s), in truth."""
        inside = [s.q[0] for s in self.data.truth if start <= s.time < end]
        return float(inside[-1] - inside[0])


def _resolved(plan: Plan, folder: Path) -> Resolved:
    overrides = ["scenario.stand_time=0.0"]
    entries = list(plan.faults)
    if entries:
        path = folder / "faults.toml"
        path.write_text(
            f"seed = {plan.seed}\n" + "".join(f"[[fault]]\n{_toml(entry)}\n" for entry in entries)
        )
        overrides.append(f"devices.faults={path}")
    if plan.lidar:
        overrides.append("devices.emulate_lidar=true")
    options = RunOptions(robot="emulator", overrides=tuple(overrides))
    return resolve(find_scenario("walk"), options)


def _toml(entry: Mapping[str, Any]) -> str:
    return "\n".join(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value}"
                     for key, value in entry.items())  # fmt: skip
