"""What the stages of the pipeline are given while the simulated robot walks: the instances of every race."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.io.safety import SafetyConfig, SafetySupervisor
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.wbc import WholeBodyController, WholeBodyInputs
from bluefoot_mpc.zmp.preview import PreviewController, PreviewInputs

STANDING = 2.5
"""s until the robot walks steadily."""
WALKS = (("trot", 0.06), ("walk", 0.03))
OVERRIDES = ("control.sway.trot=preview", "control.sway.walk=preview", "control.whole_body.enabled=true")
"""Both model-based stages, whether or not the default uses them."""


@dataclass(slots=True)
class Recording:
    """Instances, oldest first.

    Attributes:
        robot: the robot that walked.
        whole_body: inputs of the whole-body problem.
        preview: inputs of the preview.
        feet: (n, 4, 3) m, wanted feet in the base frame.
        frames: sensor frames and commands, to run a pipeline on.
    """

    robot: RobotModel
    whole_body: list[WholeBodyInputs] = field(default_factory=list)
    preview: list[PreviewInputs] = field(default_factory=list)
    feet: list[np.ndarray] = field(default_factory=list)
    frames: list[tuple] = field(default_factory=list)

    def standing_on(self, feet: int) -> list[WholeBodyInputs]:
        """Inputs with as many feet on the ground."""
        return [inputs for inputs in self.whole_body if int(np.sum(inputs.contact)) == feet]


def record(seconds: float = 10.0) -> Recording:
    """Walk as often as `WALKS` says, this long each (s)."""
    found: Recording | None = None
    for gait, speed in WALKS:
        options = RunOptions(
            controller="mpc", gait=gait, speed=speed, duration=seconds + STANDING, overrides=OVERRIDES
        )
        resolved = resolve(find_scenario("walk"), options)
        model = RobotModel(resolved.parameters)
        found = found or Recording(robot=model)
        simulator = SimRobot(model, resolved.stages.sim, 0)
        robot = SafetySupervisor(simulator, model.lower, model.upper, SafetyConfig())
        pipeline = Pipeline(model, resolved.stages.control, simulator.period)
        _walk(robot, pipeline, resolved.scenario, found)
    if found is None or not (found.whole_body and found.preview):
        raise SystemExit("the walk did not use both model-based stages: nothing to race with")
    return found


def _walk(robot, pipeline, scenario, found: Recording) -> None:
    """Walk to the end and keep what the stages were given."""
    frame = robot.reset()
    with _listening(found) as listen:
        while (motion := scenario.source(frame.time)) is not None:
            listen["on"] = frame.time >= STANDING
            request = robot.request
            output = pipeline.step(frame, motion, request)
            if listen["on"]:
                reference = output.telemetry.reference
                found.feet.append(reference.foot_position - reference.trunk_position)
                found.frames.append((frame, motion, request))
            frame = robot.step(output.command)


@contextmanager
def _listening(found: Recording) -> Iterator[dict[str, bool]]:
    listen = {"on": False}

    def spy(owner, kept):
        step = owner.step

        def spied(self, inputs, dt):
            if listen["on"]:
                kept.append(_copy(inputs))
            return step(self, inputs, dt)

        owner.step = spied
        return step

    steps = {
        owner: spy(owner, kept)
        for owner, kept in ((WholeBodyController, found.whole_body), (PreviewController, found.preview))
    }
    try:
        yield listen
    finally:
        for owner, step in steps.items():
            owner.step = step


def _copy(inputs):
    """The inputs with arrays of their own: the pipeline writes on in its own."""
    names = type(inputs).__dataclass_fields__
    arrays = {name: np.array(v) for name in names if isinstance(v := getattr(inputs, name), np.ndarray)}
    return replace(inputs, **arrays)
