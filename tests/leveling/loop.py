"""Levelled walks of the simulated robot whose sensors, network or source can be made to fail."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.leveling import LevelStage
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.scenarios.leveling import UNCOMPENSATED_TROT
from bluefoot_mpc.settings import build, merge, to_table
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.types import FloatArray, LevelReport
from tests.control import closed_loop
from tests.control.closed_loop import Fault, Trace, play, walk
from tests.leveling.bench import ROBOT

SPEED = 0.06


@dataclass(kw_only=True)
class Leveling:
    """What the levelling stage of one run was given and gave, tick by tick.

    Attributes:
        asked: (n, 16) rad, goals of the stages before.
        given: (n, 16) rad, goals with the levelling in them.
        stage: the stage itself.
        trace: everything else of the run.
    """

    asked: FloatArray
    given: FloatArray
    stage: LevelStage
    trace: Trace

    @property
    def shift(self) -> FloatArray:
        return np.abs(self.given - self.asked).max(axis=1)

    @property
    def reports(self) -> list[LevelReport]:
        return [output.telemetry.level for output in self.trace.outputs]

    @property
    def share(self) -> FloatArray:
        return np.array([report.share for report in self.reports])

    @property
    def events(self) -> list[str]:
        return [event for event in self.trace.events if "levelling" in event]

    def tilt_rms(self, start: float, end: float) -> FloatArray:
        """(2,) degrees, RMS of true roll and pitch."""
        inside = self.trace.rpy[self.trace.between(start, end), :2]
        return np.degrees(np.sqrt((inside**2).mean(axis=0)))


def leveling_config(controller: str, **leveling) -> ControlConfig:
    """A controller with levelling; under the paper's laws with the trot that needs it."""
    table = to_table(preset(controller))
    if controller == "cpg":
        table = merge(
            table,
            {
                "zmp": {"enabled": False}, "posture": {"level_gain": 0.0},
                "gait": {"reflex": {"enabled": False}, "trot": UNCOMPENSATED_TROT},
            },
        )  # fmt: skip
    return build(ControlConfig, merge(table, {"leveling": {"enabled": True, **leveling}}))


def leveled_walk(
    monkeypatch,
    controller: str = "cpg",
    seconds: float = 7.0,
    *,
    source=lambda time: walk(SPEED),
    fault: Fault | None = None,
    each: Callable[[LevelStage, float], None] = lambda stage, time: None,
    seed: int = 0,
    sim: SimConfig | None = None,
    **leveling,
) -> Leveling:
    """Walk with levelling.

    Args:
        monkeypatch: pytest's.
        controller: ``"cpg"`` or ``"mpc"``.
        seconds: s.
        source: commands.
        fault: what becomes of every frame.
        each: called before every tick of the levelling stage, with its time (s).
        seed: of the simulation.
        sim: world and pushes; the default ones where it is None.
        leveling: of the levelling's configuration.
    """
    asked, given, stages = [], [], []
    step = LevelStage.step

    def watched(stage, goals, frame, *rest):
        each(stage, frame.time)
        asked.append(goals.copy())
        answer = step(stage, goals, frame, *rest)
        given.append(answer[0].goals.copy())
        stages.append(stage)
        return answer

    lies = None if fault is None else (fault, -1.0, np.inf)
    with monkeypatch.context() as patch:
        patch.setattr(LevelStage, "step", watched)
        patch.setattr(closed_loop, "SimConfig", lambda: sim or SimConfig())
        trace = play(
            ROBOT, source, seconds, fault=lies, control=leveling_config(controller, **leveling), seed=seed
        )
    return Leveling(asked=np.array(asked), given=np.array(given), stage=stages[-1], trace=trace)
