"""A supervised pipeline on the simulated robot, with sensors that can be made to lie."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import ControlOutput, Pipeline
from bluefoot_mpc.geometry import rpy_from_quaternion
from bluefoot_mpc.io.safety import SafetyConfig, SafetySupervisor
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import Mode, MotionCommand, SensorFrame, TrunkPose, TruthSample

Fault = Callable[[SensorFrame], SensorFrame]


class FaultyRobot:
    """The simulated robot whose frames pass through a fault between two times (s)."""

    def __init__(self, robot: SimRobot, fault: Fault, start: float, end: float) -> None:
        self.robot, self.period = robot, robot.period
        self._fault, self._start, self._end = fault, start, end

    def reset(self) -> SensorFrame:
        return self._seen(self.robot.reset())

    def step(self, command) -> SensorFrame:
        return self._seen(self.robot.step(command))

    def stop(self) -> None:
        self.robot.stop()

    def close(self) -> None:
        self.robot.close()

    def _seen(self, frame: SensorFrame) -> SensorFrame:
        return self._fault(frame) if self._start <= frame.time < self._end else frame


@dataclass
class Trace:
    """What a run was like; `truth` is for the tests alone."""

    frames: list[SensorFrame] = field(default_factory=list)
    outputs: list[ControlOutput] = field(default_factory=list)
    truth: list[TruthSample] = field(default_factory=list)
    safety: SafetySupervisor | None = None

    def add(self, frame: SensorFrame, output: ControlOutput, truth: TruthSample) -> None:
        self.frames.append(frame)
        self.outputs.append(output)
        self.truth.append(truth)

    @property
    def time(self) -> np.ndarray:
        return np.array([truth.time for truth in self.truth])

    @property
    def modes(self) -> list[Mode]:
        """Modes in the order in which they were entered."""
        seen = [output.telemetry.mode for output in self.outputs]
        return [mode for before, mode in zip([None, *seen], seen, strict=False) if mode is not before]

    @property
    def walking(self) -> np.ndarray:
        return np.array([output.telemetry.phase.walking for output in self.outputs])

    @property
    def swing(self) -> np.ndarray:
        return np.array([output.telemetry.phase.swing for output in self.outputs])

    @property
    def height(self) -> np.ndarray:
        return np.array([truth.q[2] for truth in self.truth])

    @property
    def rpy(self) -> np.ndarray:
        """(n, 3) rad, with a yaw that does not wrap."""
        angles = np.array([rpy_from_quaternion(truth.q[3:7]) for truth in self.truth])
        angles[:, 2] = np.unwrap(angles[:, 2])
        return angles

    @property
    def yaw(self) -> np.ndarray:
        return self.rpy[:, 2]

    @property
    def trunk_over_feet(self) -> np.ndarray:
        """(n, 2) m, trunk from the middle of the feet, world axes."""
        feet = np.array([truth.foot_position for truth in self.truth])
        return self.position[:, :2] - feet[..., :2].mean(axis=1)

    @property
    def tilt_deg(self) -> np.ndarray:
        x, y = np.array([truth.q[3:5] for truth in self.truth]).T
        return np.degrees(np.arccos(1.0 - 2.0 * (x * x + y * y)))

    @property
    def position(self) -> np.ndarray:
        return np.array([truth.q[:3] for truth in self.truth])

    @property
    def fell(self) -> bool:
        return any(truth.touching for truth in self.truth) or bool(self.tilt_deg.max() > 45.0)

    @property
    def events(self) -> list[str]:
        return [event for output in self.outputs for event in output.telemetry.events]

    def between(self, start: float, end: float) -> np.ndarray:
        return (self.time >= start) & (self.time < end)


def play(
    model: RobotModel,
    source: Callable[[float], MotionCommand],
    seconds: float,
    *,
    fault: tuple[Fault, float, float] | None = None,
    control: ControlConfig | None = None,
    seed: int = 0,
) -> Trace:
    """Run `source` (time to command) for some seconds, with a fault (what, from, to) if given."""
    robot = SimRobot(model, SimConfig(), seed)
    seen = robot if fault is None else FaultyRobot(robot, *fault)
    safety = SafetySupervisor(seen, model.lower, model.upper, SafetyConfig())
    pipeline = Pipeline(model, control or ControlConfig(), robot.period)
    trace = Trace(safety=safety)
    frame = safety.reset()
    for k in range(round(seconds / robot.period)):
        output = pipeline.step(frame, source(k * robot.period), safety.request)
        trace.add(frame, output, robot.truth())
        frame = safety.step(output.command)
    return trace


def after(*stages: tuple[float, MotionCommand]) -> Callable[[float], MotionCommand]:
    """Commands that follow one another, each from its time (s) on."""

    def source(time: float) -> MotionCommand:
        return [command for start, command in stages if time >= start - 1e-9][-1]

    return source


def walk(forward=0.0, left=0.0, yaw_rate=0.0, gait="trot", **trunk) -> MotionCommand:
    pose = TrunkPose(**{name: np.array(value) for name, value in trunk.items()})
    return MotionCommand(
        mode=Mode.WALK, velocity=np.array([forward, left]), yaw_rate=yaw_rate, gait=gait, trunk=pose
    )


def mode(wanted: Mode) -> MotionCommand:
    return MotionCommand(mode=wanted)
